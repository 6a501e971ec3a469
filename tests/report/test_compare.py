"""How far two trajectories are apart: tables made by hand, and netlists against each other."""

from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from modelica_like import linearize, sensitivities, simulate, steady
from modelica_like.errors import ModelicaLikeError, NetlistError, UnitError
from modelica_like.runs.measured import read_csv
from modelica_like.runs.recorded import RecordedModel, RecordedSolution, RecordedVariable
from modelica_like.show.report.changes import reasons
from modelica_like.show.report.compare import Comparison, compare
from modelica_like.show.report.files import write_solution
from modelica_like.show.report.sources import trajectories

EXAMPLES = Path(__file__).parents[2] / "examples"
DIRECT = EXAMPLES / "machine_table_direct.toml"


def write(path: Path, header: str, *rows: str) -> Path:
    path.write_text("\n".join([header, *rows, ""]))
    return path


def recorded(name: str, times: list[float], x: list[float], modes: list[float]) -> RecordedSolution:
    mode = RecordedVariable("clutch.mode", kind="discrete", names={0: "free", 1: "stuck"})
    model = RecordedModel(name, (RecordedVariable("x", "m"),), (mode,), {})
    return RecordedSolution(model, *(np.array(part, dtype=float) for part in (times, [x], [modes])), 0.0)


def shown(comparison: Comparison) -> str:
    console = Console(width=100, highlight=False)
    with console.capture() as capture:
        console.print(comparison)
    return "\n".join(line.rstrip() for line in capture.get().splitlines())


def test_largest_deviation_and_its_time(tmp_path: Path) -> None:
    a = write(tmp_path / "a.csv", "time,x,y", "0,0,5", "1,2,5", "2,4,5")
    b = write(tmp_path / "b.csv", "time,y,x", "0,5,0", "1,5,3", "2,5.5,4.5")
    comparison = compare(a, b)
    assert (comparison["x"].largest, comparison["x"].relative, comparison["x"].time) == (1.0, 0.25, 1.0)
    assert (comparison["y"].largest, comparison["y"].time) == (0.5, 2.0)
    assert not comparison.interpolated


def test_other_times_are_interpolated(tmp_path: Path) -> None:
    a = write(tmp_path / "a.csv", "time,x", "0,0", "0.5,1", "1,2")
    b = write(tmp_path / "b.csv", "time,x", "0,0", "0.4,0.8", "0.7,1.4", "1.1,2.4")
    comparison = compare(a, b)
    assert comparison.interpolated
    # At 1 s the second is 1.4 + 3/4·1.0.
    assert comparison["x"].largest == pytest.approx(0.15)
    assert comparison["x"].time == 1.0
    assert "interpolated linearly" in shown(comparison)


def test_what_has_other_units_is_left_out_and_told(tmp_path: Path) -> None:
    """1 kN is 1000 N, 60 rpm are 2 pi rad/s; without a unit, numbers are those of the other."""
    a = write(tmp_path / "a.csv", "time [ms],f [kN],w [rpm],p [bar],n", "0,1,60,1,5", "1000,1,60,1,5")
    b = write(tmp_path / "b.csv", "time;f;w;p;n", "[s];[N];[rad/s];[psia?];1/s", "0;1000;0;1;6", "1;1000;0;1;5")
    comparison = compare(a, b)
    assert [(row.signal, row.unit) for row in comparison.deviations] == [("w", "rad/s"), ("n", "1"), ("f", "N")]
    assert comparison["f"].largest == pytest.approx(0.0, abs=1e-9)
    assert comparison["w"].largest == pytest.approx(2 * np.pi)
    assert comparison["n"].largest == 1.0
    assert shown(comparison).splitlines()[-1] == "Not compared: p in Pa and psia?."


def test_events_are_paired_and_the_time_between_them_is_left_out() -> None:
    """The first jumps at 1.0 s, the second at 1.1 s: in between they are 10 apart, and both right."""
    first = recorded("first", [0, 1, 1, 1.05, 2], [0, 0, 10, 10, 10], [0, 0, 1, 1, 1])
    second = recorded("second", [0, 1.05, 1.1, 1.1, 2], [0, 0, 0, 10, 11], [0, 0, 0, 1, 1])
    comparison = compare(first, second)
    (event,) = comparison.events
    assert (event.mode, event.after) == ("clutch.mode", "stuck")
    assert event.difference == pytest.approx(0.1)
    assert comparison["x"].largest == 1.0
    assert comparison.largest_event_difference == pytest.approx(0.1)


def test_a_mode_that_only_one_has_is_no_difference() -> None:
    first = recorded("first", [0, 1, 1, 2], [0, 0, 1, 1], [0, 0, 1, 1])
    model = RecordedModel("second", (RecordedVariable("x", "m"),), (), {})
    second = RecordedSolution(model, np.array([0.0, 2.0]), np.array([[0.0, 0.0]]), np.zeros((0, 2)), 0.0)
    assert compare(first, second).events == ()
    assert compare(second, first).events == ()


def test_an_event_that_only_one_has() -> None:
    first = recorded("first", [0, 1, 1, 2], [0, 0, 1, 1], [0, 0, 1, 1])
    second = recorded("second", [0, 2], [0, 0], [0, 0])
    comparison = compare(first, second)
    assert comparison.events[0].difference is None
    assert comparison.largest_event_difference == np.inf
    assert "never" in shown(comparison)


def test_not_a_number_is_a_deviation() -> None:
    first = recorded("first", [0, 1, 2], [0, 1, 2], [0, 0, 0])
    second = recorded("second", [0, 1, 2], [0, np.nan, 2], [0, 0, 0])
    assert compare(first, second)["x"].largest == np.inf


def test_a_netlist_and_its_own_table(tmp_path: Path) -> None:
    """What was written reads back the same, events included."""
    run = simulate(DIRECT)
    write_solution(run, tmp_path / "run.csv", units=True)
    table = read_csv(tmp_path / "run.csv")
    np.testing.assert_array_equal(table["table.v"], run["table.v"])
    comparison = compare(DIRECT, tmp_path / "run.csv")
    assert comparison.largest == 0.0
    assert len(comparison.deviations) == len(run.model.position)


def test_signals_are_chosen_by_patterns(tmp_path: Path) -> None:
    run = simulate(DIRECT, points=10)
    comparison = compare(run, run, signals=["table.?", "hub.w"])
    assert {row.signal for row in comparison.deviations} == {"table.s", "table.v", "hub.w"}


def test_report_and_picture() -> None:
    first = recorded("first", [0, 1, 1, 2], [0, 0, 1, 1], [0, 0, 1, 1])
    second = recorded("second", [0, 1.5, 1.5, 2], [0, 0, 2, 2], [0, 0, 1, 1])
    comparison = compare(first, second)
    assert shown(comparison) == (
        "first and second\n"
        "signal  largest deviation  unit  of the range  at time in s\n"
        "x               1.000e+00  m          1.0e+00             2\n"
        "\n"
        "events\n"
        "mode         to     first at s  second at s  difference in s\n"
        "clutch.mode  stuck           1          1.5          5.0e-01"
    )
    above, below = comparison.plot().axes
    assert above.get_ylabel() == "x in m"
    assert [line.get_label() for line in above.get_lines()] == ["first", "second"]
    assert max(below.get_lines()[0].get_ydata()) == 1.0


MESSAGES = {
    "no signal in common": (
        ("time,x", "0,0", "1,1"),
        ("time,y", "0,0", "1,1"),
        (),
        "a.csv and b.csv have no signal in common.\nSignals are compared by their names, such as clutch.tau.",
    ),
    "no time in common": (
        ("time,x", "0,0", "1,1"),
        ("time,x", "2,0", "3,1"),
        (),
        "a.csv and b.csv have no time in common.",
    ),
    "unknown signal": (
        ("time,speed", "0,0", "1,1"),
        ("time,speed", "0,0", "1,1"),
        ("sped",),
        "They have no common signal 'sped'; did you mean 'speed'?",
    ),
    "no header": (
        ("0,0", "1,1"),
        ("time,x", "0,0"),
        (),
        "a.csv is not a table: it needs a line of names, and lines of numbers.",
    ),
    "times that fall": (("time,x", "1,0", "0,1"), ("time,x", "0,0"), (), "a.csv: the times must increase."),
    "times without a number": (
        ("time,x", "0,0", "nan,1", "1,1"),
        ("time,x", "0,0"),
        (),
        "a.csv: the times must increase.",
    ),
    "a unit that is none of time": (
        ("time [turns],x", "0,0", "1,1"),
        ("time,x", "0,0"),
        (),
        "a.csv: 'turns' is no unit of time.\nWrite s, ms, min or h.",
    ),
    "other quantities": (
        ("time,x [m/s]", "0,0", "1,1"),
        ("time,x [rpm]", "0,0", "1,1"),
        (),
        "x is in m/s in a.csv and in rad/s in b.csv: this cannot be compared.",
    ),
    "a unit that nobody knows": (
        ("time,x [U/min]", "0,0", "1,1"),
        ("time,x [rad/s]", "0,0", "1,1"),
        (),
        "x is in U/min in a.csv and in rad/s in b.csv: this cannot be compared.",
    ),
    "times around those of the other": (
        ("time,x", "0,0", "9,9"),
        ("time,x", "2,2", "3,3", "4,4"),
        (),
        "No time of a.csv, but those of events, lies within the times of b.csv.\nCompare them the other way round.",
    ),
    "a word": (("time,x", "0,0", "1,fast"), ("time,x", "0,0"), (), "a.csv:3: 'fast' is not a number."),
    "a value too many": (("time,x", "0,0", "1,1,1"), ("time,x", "0,0"), (), "a.csv:3: 3 values under 2 names."),
}


@pytest.mark.parametrize("case", MESSAGES)
def test_messages(case: str, tmp_path: Path) -> None:
    a, b, signals, sentence = MESSAGES[case]
    with pytest.raises(ModelicaLikeError) as told:
        compare(write(tmp_path / "a.csv", *a), write(tmp_path / "b.csv", *b), signals=signals)
    assert str(told.value) == sentence


def test_picture_of_nothing() -> None:
    run = recorded("first", [0, 1], [0, 1], [0, 0])
    with pytest.raises(ModelicaLikeError) as told:
        compare(run, run).plot("y")
    assert str(told.value) == "Neither has a signal 'y'."


def test_other_files() -> None:
    with pytest.raises(ModelicaLikeError) as told:
        trajectories("drive.txt")
    assert str(told.value) == (
        "'drive.txt' has no trajectories.\n"
        "Netlists and systems of FMUs (.toml), Modelica texts (.mo), FMUs (.fmu), SSPs (.ssp) and tables (.csv) have."
    )


def test_a_text_and_its_classes_are_compared(tmp_path: Path) -> None:
    """exp(-t) and exp(-2·t) are 1/4 apart, at ln 2."""
    law = "  Real x(start = 1, fixed = true);\nequation\n  der(x) = -{}*x;\n"
    text = "".join(f"model {name}\n{law.format(rate)}end {name};\n" for name, rate in (("Fast", 2), ("Slow", 1)))
    (tmp_path / "laws.mo").write_text(text)
    apart = compare(tmp_path / "laws.mo", f"{tmp_path}/laws.mo:Fast", until=1.0, points=1000, tolerance=1e-9)
    assert apart.deviations[0].largest == pytest.approx(0.25, rel=1e-5)
    assert apart.deviations[0].time == pytest.approx(np.log(2), abs=1e-3)


def test_what_needs_equations_says_so_of_recorded_data(tmp_path: Path) -> None:
    table = read_csv(write(tmp_path / "a.csv", "time,x", "0,0", "1,2"))
    needing = (
        lambda: linearize(table),
        lambda: sensitivities(table, "x"),
        lambda: simulate(table),
        lambda: steady(DIRECT, near=table),
        lambda: table.point(0.5),
    )
    for run in needing:
        with pytest.raises(NetlistError, match="a: this needs the drive with its equations, not trajectories"):
            run()


def test_nobody_knows_why_a_mode_of_an_fmu_changes() -> None:
    assert reasons(recorded("clutch", [0.0, 1.0, 1.0], [0.0, 1.0, 1.0], [0, 0, 1])) == [""]


FALLING = """[parts]
mass = { is = "Mass", m = 1, s = 0, v = 0.5 }
push = { is = "ConstantForce", f_constant = 6 }
[connect]
end = ["push.flange", "mass.flange_a"]
"""


def test_values_are_set_in_netlists_and_other_starts_are_told(tmp_path: Path) -> None:
    """v = v0 + F·t/m, with 2 kg in the table and v0 = 0 there."""
    (tmp_path / "push.toml").write_text(FALLING)
    a = tmp_path / "push.toml"
    b = write(tmp_path / "b.csv", "time,mass.v", "0,0", "0.5,1.5", "1,3")
    assert compare(a, b, until=1.0)["mass.v"].largest == pytest.approx(3.5, rel=1e-6)
    comparison = compare(a, b, until=1.0, values={"mass.m": "2000 g"})
    assert comparison["mass.v"].largest == pytest.approx(0.5, rel=1e-6)
    (start,) = comparison.starts
    assert (start.signal, start.first, start.second) == ("mass.v", 0.5, 0.0)
    assert "They start differently: mass.v at 0.5 and 0 m/s." in shown(comparison)
    same = compare(a, b, until=1.0, values={"mass.m": 2, "mass.v": 0})
    assert same.starts == ()
    assert same["mass.v"].largest < 1e-6


def test_values_for_a_system_and_texts_for_an_fmu_are_refused(tmp_path: Path) -> None:
    a = write(tmp_path / "a.csv", "time,x", "0,0", "1,2")
    (tmp_path / "drive.fmu").write_bytes(b"")
    with pytest.raises(UnitError, match="cannot be given x = '3 m'"):
        compare(tmp_path / "drive.fmu", a, values={"x": "3 m"})
    system = tmp_path / "system.toml"
    system.write_text('[fmus]\na = "a.fmu"\n')
    with pytest.raises(NetlistError, match="No values can be set in the system"):
        compare(system, a, values={"x": 3})
