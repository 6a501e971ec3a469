# ruff: noqa: E501 messages stand here as they are told
"""What is said where a number cannot be read off a run."""

import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from modelica_like import ModelicaLikeError, build, calibrate, load_spectrum, sensitivities, simulate, sweep
from modelica_like.analyse.sizing import load_of
from modelica_like.errors import MissingValue, NetlistError, UnitError, UnknownName, ValueOutOfRange
from modelica_like.runs.readings import read_output
from modelica_like.runs.recorded import RecordedModel, RecordedSolution, RecordedVariable
from modelica_like.runs.results import settled

DRIVE = Path(__file__).parents[2] / "examples" / "machine_table_direct.toml"


def run(until: float = 0.1) -> Any:
    return simulate(DRIVE, until)


def recorded() -> RecordedSolution:
    model = RecordedModel("drive", (RecordedVariable("clutch.tau", "N.m"),), (), {})
    return RecordedSolution(model, np.arange(3.0), np.zeros((1, 3)), np.zeros((0, 3)), 0.0)


def unsteady(times: int) -> RecordedSolution:
    model = RecordedModel("drive", (RecordedVariable("clutch.tau", "N.m"),), (), {})
    time = np.linspace(0, 1, times + 1)
    return RecordedSolution(model, time, np.full((1, times + 1), np.log2(times)), np.zeros((0, times + 1)), 0.0)


CASES: dict[str, tuple[type[ModelicaLikeError], Callable[[], object], str]] = {
    "a formula of readings": (UnknownName, lambda: run().read("rms(clutch.tau)*max(clutch.tau)"), """\
'rms(clutch.tau)*max(clutch.tau)' calculates with readings of a run, which formulas cannot.
Ask for each reading and calculate with the numbers; a formula may stand inside: max(a.tau + b.tau)."""),
    "a condition with a time": (UnknownName, lambda: run().read("time(table.v > 1 m/s)"), """\
'time(table.v > 1 m/s)': only mode changes have a time(…).
When a condition is true for the first time is first(table.v > 1 m/s)."""),
    "a condition with a plain number": (UnitError, lambda: run().read("first(table.v > 10)"), """\
'table.v - 10.0' mixes m/s and 1.
Give the number its unit: 10 m/s."""),
    "half a reading": (UnknownName, lambda: run().read("max(clutch.tau)/2"), """\
'max(clutch.tau)/2' calculates with readings of a run, which formulas cannot.
Ask for each reading and calculate with the numbers; a formula may stand inside: max(a.tau + b.tau)."""),
    "a trajectory in a sweep": (ValueOutOfRange, lambda: sweep(DRIVE, {"clutch.capacity": [90.0]}, ["series(clutch.tau)"]), """\
series(clutch.tau) is a trajectory, not a number.
Take it from the results."""),
    "a run without its polynomials": (MissingValue, lambda: pickle.loads(pickle.dumps(run())).read("max(clutch.tau)"), """\
max(clutch.tau) cannot be read off this run: what happens between its results was not kept.
Ask before the run: simulate(…, readings=["max(clutch.tau)"])."""),
    "results only": (MissingValue, lambda: load_spectrum(recorded(), "clutch.tau"), """\
clutch.tau cannot be read off drive: between its results nothing is known.
Ask before the run: run_fmu(…, readings=[…]), or simulate the netlist."""),
    "a number of an FMU": (MissingValue, lambda: load_of(recorded(), "clutch.tau"), """\
peak(clutch.tau) cannot be read off drive: between its results nothing is known.
Ask before the run: run_fmu(…, readings=[…]), or simulate the netlist."""),
    "a number that never settles": (MissingValue, lambda: settled(recorded(), unsteady, ["max(clutch.tau)"]), """\
max(clutch.tau) of drive is not known: it changes by 1 between 67584 and 135169 results.
Ask for a shorter run, or simulate the netlist."""),
    "no variable of an FMU": (UnknownName, lambda: settled(recorded(), unsteady, ["max(clutch.ta)"]), """\
drive has no variable 'clutch.ta'; did you mean 'clutch.tau'?
Other outputs are peak(…), max(…), min(…), integral(…), mean(…), rms(…), at(…, time), first(… > …), duration(mode: name), series(…), time(mode: before -> after), and of components loss_energy, source_energy, lock_time, unlock_time."""),
    "a trajectory": (ValueOutOfRange, lambda: simulate(DRIVE, 0.1, readings=["series(clutch.tau)"]), """\
series(clutch.tau) is a trajectory, not a number.
Take it from the results."""),
    "no condition": (UnknownName, lambda: read_output(build(DRIVE), "first(clutch.tau)"), """\
'first(clutch.tau)' has no condition.
Compare two values: first(motor.w > 100 rad/s), first(a.tau < b.tau)."""),
    "a condition that never holds": (UnknownName, lambda: sensitivities(run(), "first(clutch.tau > 1e6 N.m)"), """\
'first(clutch.tau > 1e6 N.m)' does not happen in this run."""),
    "no function": (NetlistError, lambda: read_output(build(DRIVE), "max(median(clutch.tau))"), """\
'median(clutch.tau)' is neither a quantity nor a formula; there is no function 'median'; did you mean 'min'.
A quantity is a number with a unit ("8.5 kg.cm2"), a formula is arithmetic of parameters ("2*J")."""),
    "an energy over time": (ValueOutOfRange, lambda: read_output(build(DRIVE), "at(2*clutch.loss_energy, 0.1 s)"), """\
clutch.loss_energy is one number of a whole run: it has no values over time.
Over time there is clutch.loss_power: ask for integral(clutch.loss_power) or max(clutch.loss_power), or for clutch.loss_energy of a shorter run."""),
    "a time of a change over time": (ValueOutOfRange, lambda: read_output(build(DRIVE), "first(time > 2*clutch.lock_time)"), """\
clutch.lock_time is one number of a whole run: it has no values over time.
Ask for clutch.lock_time itself, or for a formula of such numbers, e.g. 2*clutch.lock_time."""),
    "a time of a change that a part does not have": (UnknownName, lambda: read_output(build(DRIVE), "2*table.lock_time"), """\
machine_table_direct has no variable 'table.lock_time'; did you mean 'table.loss_power'?
Other outputs are peak(…), max(…), min(…), integral(…), mean(…), rms(…), at(…, time), first(… > …), duration(mode: name), series(…), time(mode: before -> after), and of components loss_energy, source_energy, lock_time, unlock_time."""),
    "a mode change before the first": (ValueOutOfRange, lambda: read_output(build(DRIVE), "time(clutch.mode -> stuck, 0)"), """\
'time(clutch.mode -> stuck, 0)' asks for mode change 0: they are counted from 1.
The first one is time(clutch.mode -> stuck), the second one time(clutch.mode -> stuck, 2)."""),
    "a negative mode change": (ValueOutOfRange, lambda: read_output(build(DRIVE), "time(clutch.mode: forward -> stuck, -1)"), """\
'time(clutch.mode: forward -> stuck, -1)' asks for mode change -1: they are counted from 1.
The first one is time(clutch.mode: forward -> stuck), the second one time(clutch.mode: forward -> stuck, 2)."""),
    "a mode": (UnknownName, lambda: read_output(build(DRIVE), "duration(clutch.mode: sliding)"), """\
clutch.mode has no mode 'sliding'. It has free, stuck, start_forward, start_backward, forward, backward."""),
    "energies of no time": (ValueOutOfRange, lambda: run().energy(0.05, "50 ms"), """\
The end of a balance, 0.05 s, is not after its beginning, 0.05 s."""),
    "a load": (UnknownName, lambda: load_of(run(), "clutch.tau", "peek"), """\
A load cannot be the 'peek' of a trajectory; did you mean 'peak'? It can be peak, largest, smallest, final, mean, rms, integral, reading."""),
    "a file as data": (ValueOutOfRange, lambda: calibrate(DRIVE, ["meas.csv"], {"table.J": (1.0, 2.0)}), """\
'meas.csv' is no measurement.
Say what it measures: Trajectories("meas.csv"), OperatingPoints(…) or Numbers(…), with the uncertainties."""),
    "an array as data": (ValueOutOfRange, lambda: calibrate(DRIVE, [np.ones((9, 9))], {"table.J": (1.0, 2.0)}), """\
ndarray is no measurement.
Say what it measures: Trajectories("meas.csv"), OperatingPoints(…) or Numbers(…), with the uncertainties."""),
}  # fmt: skip


def test_an_extreme_of_rounding_proposes_the_peak() -> None:
    """The screw accelerates the table, and carries nothing at rest or constant speed."""
    made = sensitivities(DRIVE, ["min(screw.flange_r.tau)", "min(clutch.tau)"], "load_torque")
    assert made.remarks == (
        "min(screw.flange_r.tau) is zero up to rounding, and so are its derivatives: screw.flange_r.tau has the other sign, "
        "up to 8.95247 N.m. Ask for peak(screw.flange_r.tau), the largest amount.",
    )
    assert made.remarks[0] in str(made)


@pytest.mark.parametrize("case", CASES)
def test_messages(case: str) -> None:
    kind, action, told = CASES[case]
    with pytest.raises(kind) as caught:
        action()
    assert str(caught.value) == told
