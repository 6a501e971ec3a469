"""Units of results: SI everywhere, or those that the netlist or the user asks for, everywhere the same."""

import csv
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from rich.console import Console

from components import Constant, Ramp
from modelica_like import Assembly, Solution, build, load, simulate
from modelica_like.errors import ModelicaLikeError, UnitError, UnknownName
from modelica_like.netlist.write import save
from modelica_like.runs.display import Display
from modelica_like.runs.recorded import RecordedModel, RecordedVariable
from modelica_like.show.report.files import write_solution
from modelica_like.show.report.run import run_report

EXAMPLES = Path(__file__).parents[2] / "examples"
NETLIST = """
name = "spindle"

[parts]
wanted = { is = "Constant", k = "1500 rpm" }
motor = { is = "Speed" }
oil = { is = "Damper", d = "2 N.m.s/rad" }
wall = { is = "Fixed" }
feed = { is = "Ramp", height = "10 mm", duration = "1 s" }

[series]
shaft = ["motor", "oil", "wall"]

[connect]
speed = ["wanted.y", "motor.w_ref"]

[simulate]
until = "2 s"

[display]
speed = "rpm"
"feed.y" = "mm"
"*.phi" = "deg"
energy = "kJ"
torque = "kN.m"
"wall.flange.tau" = "N.m"
"""


@pytest.fixture
def run(tmp_path: Path) -> Solution:
    netlist = tmp_path / "spindle.toml"
    netlist.write_text(NETLIST)
    return simulate(load(netlist))


def test_signals_are_in_the_si_unit_of_their_value() -> None:
    parts = {
        "n": Constant(k="1500 rpm"), "x": Ramp(height="10 mm", duration=1.0), "T": Constant(k="20 degC"),
        "p": Constant(k="2 bar"), "f": Constant(k="3 kN"),
    }  # fmt: skip
    found = simulate(Assembly("signals", parts=parts), 1.0)
    units = {one.path: str(one.unit) for one in found.model.flat_variables}
    wanted = {
        "n.y": (50 * np.pi, "rad/s"),
        "x.y": (0.01, "m"),
        "T.y": (293.15, "K"),
        "p.y": (2e5, "Pa"),
        "f.y": (3e3, "N"),
    }
    for path, (value, unit) in wanted.items():
        assert found.final[path] == pytest.approx(value, rel=1e-12)
        assert units[path] == unit
    assert {str(one.unit) for one in found.model.flat_parameters} >= {"rad/s", "m", "K", "Pa", "N"}


def test_a_picture_is_in_the_units_of_the_netlist(run: Solution) -> None:
    figure = run.plot("motor.w", "feed.y", "oil.phi_rel", "motor.phi", "motor.flange.tau", "wall.flange.tau")
    curves = {
        line.get_label(): (line.get_ydata()[-1], axes.get_ylabel()) for axes in figure.axes for line in axes.lines
    }
    assert curves["motor.w"] == (pytest.approx(1500), "speed in rpm")
    assert curves["feed.y"] == (pytest.approx(10), "position in mm")
    assert curves["motor.phi"] == (pytest.approx(18000, rel=1e-6), "angle in \u00b0")
    assert curves["oil.phi_rel"] == (pytest.approx(-100 * np.pi, rel=1e-6), "relative angle in rad")
    assert curves["motor.flange.tau"] == (pytest.approx(-0.1 * np.pi, rel=1e-6), "torque in kN·m")
    assert curves["wall.flange.tau"] == (pytest.approx(100 * np.pi, rel=1e-6), "torque in N·m")


def test_a_difference_of_temperatures_is_not_counted_from_the_zero_of_a_scale() -> None:
    """The plates are 20 °C warm and no warmer than the air: not -273 °C above it."""
    shown = Display(build(EXAMPLES / "launch.toml"))
    assert (shown.of("clutch.T"), shown.of("clutch.rise")) == ("degC", "K")


def test_an_argument_wins_over_the_netlist(run: Solution) -> None:
    axes, _ = run.plot("motor.w", display={"speed": "rad/s"}).axes
    assert axes.get_ylabel() == "speed in rad/s"
    assert axes.lines[0].get_ydata()[-1] == pytest.approx(50 * np.pi)


def test_a_table_with_units_is_in_them_and_one_without_is_in_si(run: Solution, tmp_path: Path) -> None:
    for units, speed, stroke in ((True, 1500.0, 10.0), (False, 50 * np.pi, 0.01)):
        write_solution(run, tmp_path / "run.csv", units=units)
        rows = list(csv.reader((tmp_path / "run.csv").read_text().splitlines()))
        column = dict(zip(rows[0], zip(*rows[1:], strict=True), strict=True))
        assert float(column["motor.w"][-1]) == pytest.approx(speed)
        assert float(column["feed.y"][-1]) == pytest.approx(stroke)
        assert not units or (column["motor.w"][0], column["feed.y"][0], column["time"][0]) == ("rpm", "mm", "s")


def test_a_report_tells_its_energies_in_them(run: Solution) -> None:
    console = Console(record=True, width=120)
    console.print(run_report(run))
    text = console.export_text()
    lost = 2 * (50 * np.pi) ** 2 * 2 / 1000
    assert "energy balance in kJ" in text
    assert f"{lost:.4f}" in text


def test_they_stay_in_the_netlist(run: Solution, tmp_path: Path) -> None:
    copy = tmp_path / "copy.toml"
    save(load(tmp_path / "spindle.toml"), copy)
    assert simulate(load(copy)).model.settings["display"] == run.model.settings["display"]


@pytest.mark.parametrize(
    ("display", "kind", "told"),
    [
        ({"motor.w": "mm"}, UnitError, "motor.w is in rad/s: it cannot be shown in mm."),
        ({"speed": "N"}, UnitError, "speed is in rad/s: it cannot be shown in N."),
        (
            {"sped": "rpm"},
            UnknownName,
            "spindle has no variable or quantity 'sped' to show in rpm; did you mean 'speed'?",
        ),
        ({"speed": "rmp"}, UnitError, "Unknown unit 'rmp'; did you mean 'rpm'?"),
    ],
)
def test_what_cannot_be_shown_is_told(
    run: Solution, display: dict[str, str], kind: type[ModelicaLikeError], told: str
) -> None:
    with pytest.raises(kind) as caught:
        run.plot(display=display)
    assert caught.value.what == told


def test_a_wrong_unit_in_the_netlist_is_told_with_its_line(tmp_path: Path) -> None:
    netlist = tmp_path / "spindle.toml"
    netlist.write_text(NETLIST.replace('"mm"', '"mmm"'))
    with pytest.raises(UnitError, match="Unknown unit 'mmm'") as caught:
        load(netlist)
    assert caught.value.where[0].line == NETLIST.splitlines().index('"feed.y" = "mm"') + 1


def test_units_of_recorded_columns() -> None:
    """A name in brackets is no pattern, a number has no unit, and other tools have units of their own."""
    units = {"belt[2].w": "rad/s", "oil.T": "K", "n": "1", "odd.w": "Umdr", "w": "rad/s"}
    model = RecordedModel("drive", tuple(map(RecordedVariable, units, units.values())), (), {})
    shown = Display(model, {"belt[2].w": "rpm", "temperature": "degC", "*.w": "deg/s", "n*": "rpm"})
    assert {path: shown.of(path) for path in units} == {
        "belt[2].w": "rpm", "oil.T": "degC", "n": "1", "odd.w": "Umdr", "w": "rad/s"
    }  # fmt: skip
    assert shown.values("oil.T", np.array([300.0])) == pytest.approx(26.85)
    assert shown.values("belt[2].w", np.array([np.pi])) == pytest.approx(30.0)
    assert shown.converted(20.0, "degC", "degF") == pytest.approx(68.0)
    assert shown.converted(68.0, "degF", "degC") == pytest.approx(20.0)
    assert ("n" in shown, "m" in shown, shown.quantity("w"), shown.quantity("n")) == (True, False, "speed", "value")
    for path, unit in (("n", "%"), ("odd.w", "rpm")):
        with pytest.raises(UnitError, match=f"^{path} is in "):
            Display(model, {path: unit})
    with pytest.raises(UnknownName, match=r"^drive has no variable or quantity 'zzzzz' to show in rpm\.$"):
        Display(model, {"zzzzz": "rpm"})


def test_a_difference_of_temperatures_may_have_another_unit() -> None:
    rise = SimpleNamespace(path="rise", unit="K", difference=True)
    model = SimpleNamespace(name="drive", flat_variables=[rise], flat_discretes=[])
    for unit, shown in (("degC", "K"), ("mK", "mK")):
        assert Display(model, {"rise": unit}).of("rise") == shown
