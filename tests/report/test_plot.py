"""Pictures: what is drawn, and how it is labelled."""

import subprocess
import sys
from collections.abc import Iterator
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text

from components import Fixed, Inertia, SpringDamper
from modelica_like import Solution, build, simulate
from modelica_like.errors import ModelicaLikeError, NetlistError, UnitError, UnknownName
from modelica_like.language import (
    Assembly,
    Component,
    Discrete,
    Equations,
    Events,
    Parameter,
    Variable,
    der,
    integer,
    param,
    pre,
    var,
    when,
)
from modelica_like.runs.signals import read_signals
from modelica_like.show.plot import for_page, plot, save_plot

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture(scope="module")
def start_up() -> Solution:
    return simulate(EXAMPLES / "machine_table_direct.toml", points=50)


def test_the_usual_curves_are_speeds_torques_and_forces_once_each(start_up: Solution) -> None:
    names = [one.name for one in for_page(start_up)[0]]
    assert {"motor.w", "clutch.w_rel", "clutch.tau", "table.v"} <= set(names)
    # hub and spindle turn together, so one curve shows both
    assert len({"hub.w", "spindle.w"} & set(names)) == 1
    for k, name in enumerate(names):
        assert not any(np.array_equal(start_up[name], start_up[other]) for other in names[:k])


def test_patterns_choose(start_up: Solution) -> None:
    curves, left = for_page(start_up, ["table.v", "clutch.w*", "clutch.mode", "2*table.s", "table.v"])
    assert [one.name for one in curves] == ["table.v", "clutch.w_rel", "2*table.s"], "modes are bands"
    assert left == ""
    with pytest.raises(UnknownName, match=r"has no variable 'tabel\.v'; did you mean 'table\.v'\?"):
        for_page(start_up, ["tabel.v"])


def test_one_panel_per_quantity_with_bands_and_events(start_up: Solution) -> None:
    figure = plot(start_up, ["motor.w", "hub.w", "clutch.tau", "clutch.w_rel", "clutch.mode"], title="Start-up")
    panels = figure.axes
    assert [axes.get_ylabel() for axes in panels] == [
        "speed in rad/s", "torque in N\u00b7m", "slip speed in rad/s", "",
    ]  # fmt: skip
    assert panels[-1].get_xlabel() == "time in s"
    assert [line.get_label() for line in panels[0].lines[:2]] == ["motor.w", "hub.w"]
    assert [line.get_xdata()[0] for line in panels[1].lines[1:]] == [event.time for event in start_up.events]
    assert [text.get_text() for text in panels[0].texts] == ["1"]
    assert "1  0.2 s  clutch: stuck" in [text.get_text() for text in figure.texts]
    bands = {one.get_label(): one.get_paths()[0].get_extents().intervalx for one in panels[-1].collections}
    assert bands["backward"] == pytest.approx([0, 0.2])
    assert bands["stuck"] == pytest.approx([0.2, start_up.time[-1]])


def test_what_drives_is_positive_and_says_its_sign(start_up: Solution) -> None:
    (axes,) = plot(start_up, ["clutch.tau", "-clutch.tau", "clutch.flange_a.tau"]).axes[:-1]
    curves = {line.get_label(): line.get_ydata() for line in axes.lines[:3]}
    assert list(curves) == ["\u2212clutch.tau", "-clutch.tau", "clutch.flange_a.tau"]
    for values in curves.values():
        assert values == pytest.approx(start_up["clutch.flange_a.tau"])


def test_formulas_have_units_of_their_own(start_up: Solution) -> None:
    words = ["clutch.tau*clutch.w_rel", "60*motor.w/(2*pi)", "motor.w*time", "sqrt(table.v**2)", "clutch.loss_power"]
    found = {one.name: (one.unit, one.values(start_up)) for one in read_signals(start_up.model, words)}
    t, w = start_up.time, start_up["motor.w"]
    assert found[words[0]][0] == "W"
    assert found[words[0]][1] == pytest.approx(start_up["clutch.loss_power"], abs=1e-9)
    assert found[words[1]][1] == pytest.approx(30 / np.pi * w)
    assert (found[words[2]][0], found[words[3]][0], found[words[4]][0]) == ("rad", "m/s", "W")
    assert found[words[2]][1] == pytest.approx(w * t)
    labels = [axes.get_ylabel() for axes in plot(start_up, words[:1], display={"power": "kW"}).axes]
    assert labels[0] == "power in kW"


@pytest.mark.parametrize(
    ("word", "kind", "told"),
    [
        ("2*motr.w", UnknownName, "'2.0 * motr.w': machine_table_direct has no variable 'motr.w'; did you mean"),
        ("motor.w + table.s", UnitError, "'motor.w + table.s' mixes rad/s and m."),
        ("1 s/(2*pi)*motor.w", NetlistError, "'1 s/(2*pi)*motor.w' is neither a quantity nor a formula."),
        ("2*3", UnknownName, "machine_table_direct has no variable '2*3'."),
        ("clutch.lost_power", UnknownName, "machine_table_direct has no variable 'clutch.lost_power'"),
    ],
)
def test_wrong_formulas_are_told(start_up: Solution, word: str, kind: type[ModelicaLikeError], told: str) -> None:
    with pytest.raises(kind) as caught:
        plot(start_up, [word])
    assert told in caught.value.what


def _texts(figure: Figure) -> Iterator[Text]:
    """Yield all texts that are drawn."""
    yield from figure.texts
    for axes in figure.axes:
        yield from axes.texts
        yield from axes.get_legend().get_texts() if axes.get_legend() else []
        for axis, reach in ((axes.xaxis, axes.get_xlim()), (axes.yaxis, axes.get_ylim())):
            yield axis.label
            yield from (one.label1 for one in axis.get_major_ticks() if min(reach) <= one.get_loc() <= max(reach))


def clashes(figure: Figure) -> list[tuple[str, str]]:
    """Return texts that overlap, and those beyond the edge."""
    figure.dpi = 100
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    boxes = [(one.get_text(), one.get_window_extent(canvas.get_renderer())) for one in _texts(figure)]
    boxes = [(text, box) for text, box in boxes if text.strip()]
    edge = figure.bbox.padded(1)
    outside = [(text, "edge") for text, box in boxes if not edge.x0 <= box.x0 <= box.x1 <= edge.x1
               or not edge.y0 <= box.y0 <= box.y1 <= edge.y1]  # fmt: skip
    return outside + [
        (one, two) for (one, a), (two, b) in combinations(boxes, 2)
        if min(a.x1, b.x1) - max(a.x0, b.x0) > 1 and min(a.y1, b.y1) - max(a.y0, b.y0) > 1
    ]  # fmt: skip


@pytest.mark.parametrize(
    "drive", ["launch", "winch", "dc_bench_speed_control", "msl/rotational/Backlash", "msl/translational/PreLoad"]
)
def test_no_label_overlaps_another(drive: str) -> None:
    run = simulate(EXAMPLES / f"{drive}.toml", points=50)
    assert clashes(run.plot()) == []


@pytest.mark.slow
def test_no_label_overlaps_another_in_any_example() -> None:
    for netlist in sorted(path for kind in ("*", "components/*", "elements/*", "msl/*/*", "dc_machines/*")
                          for path in EXAMPLES.glob(f"{kind}.toml")):  # fmt: skip
        model = build(netlist)
        run = simulate(model, model.settings.get("until", 1.0), points=40, solver="native")
        assert clashes(run.plot()) == [], netlist.name


def test_a_long_chain_has_a_picture_of_a_page_that_counts_the_rest() -> None:
    parts = {f"mass{k}": Inertia(J=1, w=float(k), phi=0) for k in range(40)}
    run = simulate(Assembly("many", parts=parts, free=[f"mass{k}.flange_{e}" for k in range(40) for e in "ab"]), 1.0)
    figure = run.plot()
    assert figure.get_size_inches()[1] < 8
    said = " ".join(text.get_text() for text in figure.texts)
    assert "Not drawn: 27 more of speed (mass13.w, " in said
    assert "15 others)" in said
    every = {line.get_label() for axes in run.plot("*.w").axes for line in axes.lines}
    assert every == {f"mass{k}.w" for k in range(40)}


def test_nothing_is_left_out_without_a_word() -> None:
    """Every curve, mode and event is drawn, or named or counted below."""
    run = simulate(EXAMPLES / "lepelletier.toml", points=50)
    figure = run.plot()
    said = " ".join(text.get_text() for text in figure.texts)
    assert "12 angles, 6 signals" in said
    listed = sum(len(line.split(": ")) - 1 for line in said.split("Not ")[0].splitlines())
    assert listed >= 24
    speeds = run.plot("*.w", "*.w_rel")
    drawn = {line.get_label().lstrip("\u2212") for axes in speeds.axes for line in axes.lines}
    assert drawn >= {name for name in run.names if name.endswith((".w", ".w_rel"))}


class Counted(Component):
    """Counts when it has turned once, by a relation that only the solver knows."""

    phi: Variable = var("1", "turns", state="always", default=0.0)
    rate: Parameter = param("1/s", "turns a second", default=2.0)
    passed: Discrete = integer("passes", start=0)

    def equations(self) -> Equations:
        yield der(self.phi) == self.rate

    def events(self) -> Events:
        yield when(self.phi > 1.0, {self.passed: pre(self.passed) + 1})


def test_what_no_user_has_declared_is_not_drawn() -> None:
    run = simulate(Assembly("counter", parts={"counted": Counted()}), 1.0)
    hidden = {one.path for one in run.model.flat_discretes if one.hidden}
    assert hidden
    figure = run.plot("counted.*")
    said = [text.get_text() for text in _texts(figure)]
    assert not [text for text in said for path in hidden if path in text]
    drawn = {line.get_label(): line.get_ydata() for axes in figure.axes for line in axes.lines}
    assert drawn["counted.passed"][-1] == 1


def test_a_run_at_rest_is_an_empty_picture(tmp_path: Path) -> None:
    assembly = Assembly(
        "rest", parts={"wall": Fixed(), "spring": SpringDamper(c=1, d=1), "mass": Inertia(J=1, phi=0, w=0)},
        series={"chain": ["wall", "spring", "mass"]},
    )  # fmt: skip
    save_plot(plot(simulate(assembly, 1.0)), tmp_path / "rest.png")
    assert (tmp_path / "rest.png").stat().st_size > 1000


def test_the_format_must_be_known(start_up: Solution, tmp_path: Path) -> None:
    with pytest.raises(NetlistError, match=r"^'x\.doc': a picture can be .*eps, .*png.*\.$"):
        save_plot(plot(start_up, ["table.v"]), tmp_path / "x.doc")


def test_no_window_system_is_touched() -> None:
    """In a process of its own: other packages of the tests do import pyplot."""
    program = "import sys, modelica_like as ml; ml.simulate(sys.argv[1], 0.1).plot('motor.w'); print(*sys.modules)"
    command = [sys.executable, "-c", program, str(EXAMPLES / "fan.toml")]
    run = subprocess.run(command, capture_output=True, text=True, check=True)
    modules = run.stdout.split()
    assert "matplotlib.figure" in modules
    assert "matplotlib.pyplot" not in modules
