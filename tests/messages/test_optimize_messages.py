# ruff: noqa: E501 messages stand here as they are told
"""What is said where an optimisation is not asked for rightly."""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from modelica_like import build, calibrate, optimize
from modelica_like.analyse.calibration.measurements import Numbers
from modelica_like.analyse.sweeps.ranges import read_bounds
from modelica_like.errors import (
    LanguageError,
    MissingExtra,
    ModelicaLikeError,
    NetlistError,
    UnitError,
    UnknownName,
    ValueOutOfRange,
)
from modelica_like.netlist import loads

D = Path(__file__).parents[2] / "examples" / "machine_table_direct.toml"
F = {"clutch.capacity": ["40 N.m", "300 N.m"]}
M: dict[str, Any] = {"minimize": "clutch.lock_time"}
MOVED = """
[parts]
profile = { is = "Table", table = [[0, 0], [2, 0]] }
drive = { is = "Force" }
mass = { is = "Mass", m = "1 kg", s = 0, v = 0 }
[series]
a = ["drive", "mass"]
[connect]
f = ["profile.y", "drive.f"]
[simulate]
until = "2 s"
"""
TEXT = """
[parts]
wheel = { is = "Inertia", J = "2 kg.m2", phi = 0, w = "50 rad/s" }
brake = { is = "Brake", capacity = "20 N.m" }
[series]
drive = ["wheel", "brake"]
[simulate]
until = "20 s"
[optimize]
"""
FREE = 'minimize = "brake.lock_time"\nfree = { "brake.capacity" = ["5 N.m", "100 N.m"] }\n'


def without(package: str, action: Callable[[], object]) -> object:
    """Act as if a package were not installed."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(sys.modules, package, None)
        return action()


CALLS: dict[str, tuple[type[ModelicaLikeError], Callable[[], object], str]] = {
    "nothing is free": (
        ValueOutOfRange,
        lambda: optimize(D, **M),
        """An optimisation needs something that is free.
Give a parameter and its bounds: free = { "clutch.capacity" = ["20 N.m", "120 N.m"] }.""",
    ),
    "no objective": (
        ValueOutOfRange,
        lambda: optimize(D, free=F),
        """An optimisation needs an objective.
Say what is to be small: minimize = "peak(shaft.tau)".""",
    ),
    "a mode as objective": (
        ValueOutOfRange,
        lambda: optimize(D, free=F, minimize="clutch.mode"),
        """'clutch.mode': clutch.mode is a mode, which is no quantity: its numbers stand for names.
Ask how long it has one of them, duration(clutch.mode: free), or when it changes, time(clutch.mode: free -> stuck).""",
    ),
    "a limit of a mode": (
        ValueOutOfRange,
        lambda: optimize(D, free=F, subject_to="max(2*clutch.mode) <= 1", **M),
        """'max(2*clutch.mode)': clutch.mode is a mode, which is no quantity: its numbers stand for names.
Ask how long it has one of them, duration(clutch.mode: free), or when it changes, time(clutch.mode: free -> stuck).""",
    ),
    "an objective that nothing changes": (
        ValueOutOfRange,
        lambda: optimize(D, free=F, minimize="load_torque"),
        """Nothing changes the objective 'load_torque': it is a parameter that is not free.
Ask for an output of the run, or free it.""",
    ),
    "a limit that nothing changes": (
        ValueOutOfRange,
        lambda: optimize(D, free=F, subject_to="load_torque <= 20 N.m", **M),
        """Nothing changes the limit 'load_torque <= 20 N.m': it is a parameter that is not free.
Ask for an output of the run, or free it.""",
    ),
    "one bound": (
        ValueOutOfRange,
        lambda: optimize(D, free={"clutch.capacity": "40 N.m"}, **M),
        """clutch.capacity: the bounds must be two values, not '40 N.m'.
Write ["20 N.m", "120 N.m"].""",
    ),
    "bounds the wrong way round": (
        ValueOutOfRange,
        lambda: optimize(D, free={"clutch.capacity": [60, 40]}, **M),
        """clutch.capacity: the lower bound 60 is not below the upper bound 40.""",
    ),
    "a start outside the bounds": (
        ValueOutOfRange,
        lambda: optimize(D, free={"clutch.capacity": [40, 60]}, **M),
        """clutch.capacity = 86.7843 N.m is not between its bounds 40 and 60.
An optimisation begins with the drive as it is.
Widen the bounds, or give the drive a value between them.""",
    ),
    "the unit of a bound": (
        UnitError,
        lambda: optimize(D, free={"clutch.capacity": ["40 kg", "60 N.m"]}, **M),
        """clutch.capacity expects N.m; '40 kg' is kg.""",
    ),
    "a name": (
        UnknownName,
        lambda: optimize(D, free={"clutch.capacty": [40, 60]}, **M),
        """machine_table_direct has no parameter 'clutch.capacty'; did you mean 'clutch.capacity'?""",
    ),
    "no relation": (
        ValueOutOfRange,
        lambda: optimize(D, free=F, subject_to="clutch.lock_time", **M),
        """'clutch.lock_time' is no limit: it compares nothing.
Write "clutch.lock_time <= 0.4 s", with <=, >= or ==.""",
    ),
    "a limit without a unit": (
        UnitError,
        lambda: optimize(D, free=F, subject_to="clutch.lock_time <= 0.4", **M),
        """'clutch.lock_time <= 0.4' compares a value in s with a number without a unit.
Write "clutch.lock_time <= 0.4 s".""",
    ),
    "the unit of a limit": (
        UnitError,
        lambda: optimize(D, free=F, subject_to="clutch.lock_time <= 0.4 N", **M),
        """clutch.lock_time expects s; '0.4 N' is N.""",
    ),
    "the name of a limit": (
        UnknownName,
        lambda: optimize(D, free=F, subject_to="clutch.lock_tim <= 0.4 s", **M),
        """machine_table_direct has no variable 'clutch.lock_tim'; did you mean 'clutch.lock_time'?
Other outputs are peak(…), max(…), min(…), integral(…), mean(…), rms(…), at(…, time), first(… > …), duration(mode: name), series(…), time(mode: before -> after), and of components loss_energy, source_energy, lock_time, unlock_time.""",
    ),
    "three objectives": (
        ValueOutOfRange,
        lambda: optimize(D, free=F, minimize=["clutch.lock_time", "clutch.tau", "table.s"]),
        """There may be one objective, or two for a front.
Limit the others by subject_to.""",
    ),
    "an objective twice": (
        ValueOutOfRange,
        lambda: optimize(D, free=F, minimize="clutch.lock_time", maximize="clutch.lock_time"),
        """Both objectives of the front are clutch.lock_time.
Leave one out.""",
    ),
    "the largest of different things": (
        UnitError,
        lambda: optimize(D, free=F, minimize="max(peak(clutch.tau), clutch.lock_time)"),
        """'max(peak(clutch.tau), clutch.lock_time)' compares N.m with s.""",
    ),
    "free and given": (
        ValueOutOfRange,
        lambda: optimize(D, free=F, cases=[{"name": "cold", "clutch.capacity": 20}], **M),
        """clutch.capacity is free, and has a value in the load case 'cold'.
Leave out one of the two.""",
    ),
    "the name in a load case": (
        UnknownName,
        lambda: optimize(D, free=F, cases=[{"name": "cold", "oil.T": 20}], **M),
        """machine_table_direct has no parameter 'oil.T'.""",
    ),
    "a table of a compiled model": (
        LanguageError,
        lambda: optimize(build(D), free={"motor.table": {"points": 3, "from": 0, "to": 1}}, **M),
        """Tables of a compiled model cannot be free.
Give the netlist or the component itself.""",
    ),
    "no table": (
        UnknownName,
        lambda: optimize(D, free={"motor.table": {"points": 3, "from": 0, "to": 1}}, **M),
        """machine_table_direct has no table 'motor.table'.""",
    ),
    "a trajectory": (
        ValueOutOfRange,
        lambda: optimize(D, free=F, minimize="series(clutch.tau)"),
        """series(clutch.tau) is a trajectory, not a number.
Take it from the results.""",
    ),
    "no file": (
        NetlistError,
        lambda: optimize(D, free=F, choose={"hub": "hubs.csv"}, **M),
        """choose: the table 'hubs.csv' for hub does not exist.
Its place is beside the netlist; write a list for values of one parameter.""",
    ),
    "an order of what is calibrated": (
        ValueOutOfRange,
        lambda: calibrate(
            loads(MOVED),
            Numbers({"mass.s": 1.0}),
            {"profile.table": {"rows": [1, 2], "from": 0, "to": 1, "rising": True}},
        ),
        """A calibration knows no order of values.
Leave out `rising` and `falling`: the data tell.""",
    ),
    "many combinations without Optuna": (
        MissingExtra,
        lambda: without("optuna", lambda: optimize(D, free=F, choose={"hub.J": [*range(1, 300)]}, **M)),
        """optuna is not installed.
Install it with: pip install "modelica-like[choose]\"""",
    ),
    "choices of a compiled model": (
        LanguageError,
        lambda: optimize(build(D), free=F, choose={"hub.J": [1]}, **M),
        """A compiled model has nothing to choose.
Give the netlist or the component itself.""",
    ),
    "the name of an entry": (
        UnknownName,
        lambda: optimize(loads(TEXT + 'minimise = "brake.tau"')),
        """[optimize] has no 'minimise'; did you mean 'minimize'? It has minimize, maximize, free, choose, subject_to, for, starts, points.
  in netlist.toml:10 `minimise = "brake.tau"`""",
    ),
    "an objective that is a number": (
        NetlistError,
        lambda: optimize(loads(TEXT + "minimize = 3")),
        """optimize.minimize must be a text or a list of texts, such as "max(shaft.tau)".
  in netlist.toml:10 `minimize = 3`""",
    ),
    "one bound in a netlist": (
        NetlistError,
        lambda: optimize(loads(TEXT + 'minimize = "brake.lock_time"\nfree = { "brake.capacity" = "40 N.m" }')),
        """optimize.free.brake.capacity must be the lower and the upper bound.
  in netlist.toml:11 `free = { "brake.capacity" = "40 N.m" }`
Write ["20 N.m", "120 N.m"], or of a table { points = 12, from = "0 N", to = "9 kN" }.""",
    ),
    "the name of a limit in a netlist": (
        UnknownName,
        lambda: optimize(loads(TEXT + FREE + 'subject_to = ["brake.lock_tim <= 1 s"]')),
        """netlist has no variable 'brake.lock_tim'; did you mean 'brake.lock_time'?
  in netlist.toml:12 `subject_to = ["brake.lock_tim <= 1 s"]`
Other outputs are peak(…), max(…), min(…), integral(…), mean(…), rms(…), at(…, time), first(… > …), duration(mode: name), series(…), time(mode: before -> after), and of components loss_energy, source_energy, lock_time, unlock_time.""",
    ),
    "load cases that are no list": (
        NetlistError,
        lambda: optimize(loads(TEXT + FREE + 'for = { "wheel.J" = 3 }')),
        """optimize.for must be a list of load cases.
  in netlist.toml:12 `for = { "wheel.J" = 3 }`
Write [{ name = "cold", "oil.T" = "-20 degC" }].""",
    ),
    "a choice that is no list": (
        ValueOutOfRange,
        lambda: optimize(D, free=F, choose={"hub.J": 3}, **M),
        """choose: hub.J needs a list of values or the name of a table, not 3.
Write {"clutch.plates": [2, 4, 6]}, or {"motor": "motors.csv"}.""",
    ),
    "choices that are no list": (
        NetlistError,
        lambda: optimize(loads(TEXT + FREE + 'choose = { "wheel.J" = 3 }')),
        """optimize.choose.wheel.J must be a list of values, or the name of a table.
  in netlist.toml:12 `choose = { "wheel.J" = 3 }`
Write [2, 4, 6], or "motors.csv" with a column for each parameter.""",
    ),
    "no start": (
        NetlistError,
        lambda: optimize(loads(TEXT + "starts = 0")),
        """optimize.starts = 0 must be a whole number from 1 to 10000.
  in netlist.toml:10 `starts = 0`""",
    ),
    "an output that does not happen": (
        UnknownName,
        lambda: optimize(D, free={"clutch.capacity": [10, 300]}, until="0.1 s", **M),
        """'clutch.lock_time' does not happen after the start of the run.
clutch.mode does not change in this run.""",
    ),
    "no bounds of a profile": (
        ValueOutOfRange,
        lambda: optimize(loads(MOVED), minimize="mass.s", free={"profile.table": {"points": 3, "from": 0}}),
        """free: profile.table needs `from` and `to`.
Write { points = 12, from = "0 N", to = "9 kN", rising = true }.""",
    ),
    "an unknown entry of a profile": (
        ValueOutOfRange,
        lambda: optimize(
            loads(MOVED), minimize="mass.s", free={"profile.table": {"from": 0, "to": 1, "monotone": True}}
        ),
        """free: profile.table has no 'monotone'.
Write { points = 12, from = "0 N", to = "9 kN", rising = true }.""",
    ),
    "no number of points": (
        ValueOutOfRange,
        lambda: optimize(loads(MOVED), minimize="mass.s", free={"profile.table": {"points": 1, "from": 0, "to": 1}}),
        """free: profile.table: points = 1 must be a whole number from 2 to 100.""",
    ),
    "rows that there are not": (
        ValueOutOfRange,
        lambda: optimize(loads(MOVED), minimize="mass.s", free={"profile.table": {"rows": [3], "from": 0, "to": 1}}),
        """free: profile.table: rows = [3] must be a list of row numbers from 1 to 2.""",
    ),
    "no start of the search": (
        ValueOutOfRange,
        lambda: optimize(D, free=F, starts=0, **M),
        """starts must be at least 1, not 0.""",
    ),
    "bounds that are given do not stand in the netlist": (
        ValueOutOfRange,
        lambda: optimize(loads(TEXT + FREE, "stop.toml"), free={"brake.capacity": [30, 20]}),
        """brake.capacity: the lower bound 30 is not below the upper bound 20.""",
    ),
    "a front of one point": (
        ValueOutOfRange,
        lambda: optimize(loads(MOVED), minimize=["mass.s", "mass.v"], free={"mass.m": [0.5, 2]}, points=1),
        """A front needs at least 2 points, not 1.""",
    ),
    "a front of choices": (
        ValueOutOfRange,
        lambda: optimize(
            loads(MOVED), minimize=["mass.s", "mass.v"], free={"mass.m": [0.5, 2]}, choose={"profile.scale": [1]}
        ),
        """A choice needs one objective.
Limit the other one by subject_to.""",
    ),
    "a probability of 100 %": (
        ValueOutOfRange,
        lambda: optimize(D, free=F, subject_to="P(clutch.lock_time <= 0.3 s) >= 100 %", **M),
        """'P(clutch.lock_time <= 0.3 s) >= 100 %': a probability must be between 50 % and 100 %, and that of a limit with <= or >=.
Write "P(clutch.lock_time <= 0.4 s) >= 99.9 %".""",
    ),
    "a probability where nothing scatters": (
        ValueOutOfRange,
        lambda: optimize(D, free=F, subject_to="P(clutch.lock_time <= 0.3 s) >= 99 %", **M),
        """'P(clutch.lock_time <= 0.3 s) >= 99 %' asks for a probability, but nothing scatters.
Say how parameters scatter: [tolerances] in the netlist, or tolerances={"clutch.mu": "±10 %"}.""",
    ),
    "a mode with a probability": (
        ValueOutOfRange,
        lambda: optimize(D, free=F, subject_to="P(mode(1).damping >= 0.1) >= 99 %", **M),
        """'P(mode(1).damping >= 0.1) >= 99 %': a mode has no probability, as it needs no run.
Ask for a probability of outputs of the run or of lines of design checks.""",
    ),
    "a front with a probability": (
        ValueOutOfRange,
        lambda: optimize(
            D,
            free=F,
            minimize=["clutch.lock_time", "clutch.tau"],
            subject_to="P(clutch.lock_time <= 0.3 s) >= 99 %",
            tolerances={"load_torque": "±1 %"},
        ),
        """A front has no limits with a probability.
Give plain limits.""",
    ),
    "no netlist to save": (
        LanguageError,
        lambda: optimize(build(D), minimize="clutch.lock_time", free={"load_torque": [10, 20]}).save("best.toml"),
        """Only a drive of a netlist can be saved as one.
The values are in `values`, the model in `model`.""",
    ),
    "a gain without frequency": (
        ValueOutOfRange,
        lambda: optimize(D, minimize="gain(load_torque, clutch.tau)", free=F),
        """'gain(load_torque, clutch.tau)' has no frequency.
Write gain(force, mass.s, 5 Hz).""",
    ),
    "a gain at no frequency": (
        UnitError,
        lambda: optimize(D, minimize="gain(load_torque, clutch.tau, 5 s)", free=F),
        """The frequency of 'gain(load_torque, clutch.tau, 5 s)' expects Hz; '5 s' is s.""",
    ),
    "a peak without number": (
        ValueOutOfRange,
        lambda: optimize(D, minimize="resonance(load_torque, clutch.tau, first)", free=F),
        """'resonance(load_torque, clutch.tau, first)': peaks are counted from 1, not by 'first'.
Without a number it is the largest peak.""",
    ),
    "an unknown input": (
        UnknownName,
        lambda: optimize(D, minimize="resonance(load_torqe, clutch.tau)", free=F),
        """'resonance(load_torqe, clutch.tau)': machine_table_direct has no 'load_torqe'; did you mean 'load_torque'?""",
    ),
    "a power as in Modelica": (
        NetlistError,
        lambda: optimize(D, minimize="integral(clutch.tau^2)", free=F),
        """'clutch.tau^2' is neither a quantity nor a formula.
A power is written with two asterisks: "w**2".""",
    ),
    "no pair of numbers": (
        ValueOutOfRange,
        lambda: read_bounds("clutch.capacity=20"),
        """'clutch.capacity=20': '20' is not LOW:HIGH.
Write for example 'clutch.capacity=20:120 N.m'.""",
    ),
}


@pytest.mark.parametrize("name", CALLS)
def test_message(check_message: Callable[..., None], name: str) -> None:
    check_message(*CALLS[name])


TABLES = {
    "nothing": ("", "choose: 'hubs.csv' has no column of a parameter."),
    "no row": ("name,J\n", "choose: 'hubs.csv' has no row."),
    "a line that is too long": ("name,J\nsmall,1,2\n", "choose: a line of 'hubs.csv' has 3 cells, its first line 2."),
}


@pytest.mark.parametrize("name", TABLES)
def test_tables_of_kinds(tmp_path: Path, name: str) -> None:
    text, message = TABLES[name]
    (tmp_path / "hubs.csv").write_text(text)
    path = tmp_path / "drive.toml"
    path.write_text(TEXT + FREE + 'choose = { wheel = "hubs.csv" }\n')
    with pytest.raises(NetlistError) as caught:
        optimize(path)
    assert caught.value.what == message
    assert "hubs.csv" in str(caught.value)


CHECKS = {
    "a run of its own": (
        'torque = { from = "drive.toml", peak = "brake.tau", until = "1 s" }',
        "shaft.safety",
        """A load of 'drive.toml' has a run of its own.
Of a load of this netlist the run of the optimisation counts, so it has neither `until` nor `set`.""",
    ),
    "several values": (
        'torque = ["1 N.m", "2 N.m"]',
        "shaft.safety",
        """'shaft.safety' has 2 values.
Write one of them: shaft.safety[0].""",
    ),
    "no such line": (
        'torque = { from = "drive.toml", peak = "brake.tau" }',
        "shaft.safty",
        """'shaft.safty': the result has no line 'safty'; did you mean 'safety'?""",
    ),
}


@pytest.mark.parametrize("name", CHECKS)
def test_lines_of_design_checks(tmp_path: Path, name: str) -> None:
    torque, line, message = CHECKS[name]
    check = f'[checks.shaft]\nis = "shaft_stress"\nbending = "0 N.m"\n{torque}\ndiameter = "10 mm"\n'
    (tmp_path / "checks.toml").write_text(check + 'yield_strength = "275 N/mm2"\n')
    (tmp_path / "drive.toml").write_text('sizing = "checks.toml"\n' + TEXT + FREE + f'subject_to = ["{line} >= 2.5"]\n')
    with pytest.raises(ModelicaLikeError) as caught:
        optimize(tmp_path / "drive.toml")
    assert "\n".join(filter(None, [caught.value.what, caught.value.advice])) == message
    assert "drive.toml" in str(caught.value)


@pytest.mark.parametrize(
    ("table", "text"),
    [
        (
            "name,capacity\nweak,20 N.m\nwrong,20 kg\n",
            "PressedFriction.capacity expects N.m; '20 kg' is kg.\n  in brakes.csv:3 `wrong,20 kg`",
        ),
        (
            "name,capacity,drag\nweak,20 N.m,3\n",
            "Brake has no parameter or variable 'drag'; did you mean 'tau_drag'? It has phi, w, tau, peak, creep,"
            " creep_time, rest, f_normalized, fn_max, cgeo, w_scale, capacity, tau_drag, mode, command, range, smooth,"
            " extrapolate, mu_pos."
            "\n  in brakes.csv:2 `weak,20 N.m,3`",
        ),
    ],
)
def test_cells_of_a_table_that_do_not_fit(tmp_path: Path, table: str, text: str) -> None:
    (tmp_path / "brakes.csv").write_text(table)
    (tmp_path / "stop.toml").write_text(TEXT + FREE.splitlines()[0] + '\nchoose = { brake = "brakes.csv" }\n')
    with pytest.raises(ModelicaLikeError) as caught:
        optimize(tmp_path / "stop.toml")
    assert str(caught.value) == text
