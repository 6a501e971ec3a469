"""Several runs in one picture: what is drawn, in which units, and what is refused."""

from pathlib import Path

import numpy as np
import pytest

from modelica_like import Solution, overlay, simulate
from modelica_like.errors import ModelicaLikeError, NetlistError, UnitError, UnknownName
from modelica_like.runs.measured import read_columns

EXAMPLES = Path(__file__).parents[2] / "examples"
DRIVE = EXAMPLES / "machine_table_direct.toml"


@pytest.fixture(scope="module")
def run() -> Solution:
    return simulate(DRIVE, points=20)


def table(folder: Path, text: str) -> Path:
    (folder / "measured.csv").write_text(text)
    return folder / "measured.csv"


def test_a_measurement_is_drawn_as_dots_in_the_units_of_the_run(run: Solution, tmp_path: Path) -> None:
    file = table(tmp_path, "# bench 3\ntime [ms],spindle.w [rpm],clutch.tau [kN.m]\n0,0,-0.08\n100,3000,-0.09\n")
    figure = overlay({"model": run, "bench": file}, display={"speed": "rpm"})
    speeds, torques, bands = figure.axes
    assert (speeds.get_ylabel(), torques.get_ylabel()) == ("spindle.w in rpm", "\u2212clutch.tau in N\u00b7m")
    line, dots = speeds.lines[:2]
    assert (dots.get_linestyle(), dots.get_marker(), line.get_marker()) == ("None", ".", "None")
    assert np.asarray(dots.get_xdata()) == pytest.approx([0, 0.1])
    assert np.asarray(dots.get_ydata()) == pytest.approx([0, 3000])
    assert np.asarray(torques.lines[1].get_ydata()) == pytest.approx([80, 90])
    assert [text.get_text() for text in speeds.get_legend().get_texts()] == ["model", "bench"]
    assert len(bands.collections) == 2


def test_units_may_stand_in_a_second_line_and_brackets_of_places_stay(tmp_path: Path) -> None:
    columns = read_columns(table(tmp_path, "time,belt[2].w,x [mm]\nms,rpm,\n1,2,3\n"))
    assert {name: (float(values[0]), unit) for name, (values, unit) in columns.items()} == {
        "time": (1.0, "ms"), "belt[2].w": (2.0, "rpm"), "x": (3.0, "mm"),
    }  # fmt: skip


def test_a_family_has_a_panel_per_signal_and_says_what_is_not_drawn(run: Solution) -> None:
    runs = {f"load = {load}": simulate(DRIVE, points=20, parameters={"load_torque": load}) for load in (5, 15, 25)}
    figure = overlay(runs, "spindle.w", "clutch.tau*clutch.w_rel")
    assert [axes.get_ylabel() for axes in figure.axes] == ["spindle.w in rad/s", "clutch.tau*clutch.w_rel\nin W"]
    assert [line.get_label() for line in figure.axes[1].lines] == list(runs)
    assert "Events differ from run to run; they are not drawn." in [text.get_text() for text in figure.texts]
    usual = overlay({"a": run, "b": runs["load = 5"]})
    drawn = {axes.get_ylabel().split()[0].lstrip("\u2212") for axes in usual.axes}
    assert {"hub.w", "clutch.tau", "table.v"} <= drawn


@pytest.mark.parametrize(
    ("text", "kind", "told"),
    [
        ("time,spindel.w\n0,0\n", UnknownName, "has no variable 'spindel.w'; did you mean 'spindle.w'?"),
        ("time,spindle.w [mm]\n0,0\n", UnitError, "spindle.w expects rad/s; '0 m' is m."),
        ("time,spindle.w [1/min]\n0,0\n", UnitError, "does not say whether it counts turns or radians."),
        ("t,spindle.w\n0,0\n", NetlistError, "the first column of a table of trajectories is `time`."),
        ("time,spindle.w\n", NetlistError, "it needs a line of names, and lines of numbers."),
        ("time,spindle.w\ns,rpm\n", NetlistError, "it needs a line of names, and lines of numbers."),
    ],
)
def test_wrong_tables_are_told(
    run: Solution, tmp_path: Path, text: str, kind: type[ModelicaLikeError], told: str
) -> None:
    with pytest.raises(kind) as caught:
        overlay({"model": run, "bench": table(tmp_path, text)})
    assert told in caught.value.what
