"""Co-Simulation in fixed steps with bounded work: order, events, what does not fit into a step, the export's report."""

import xml.etree.ElementTree as Xml
import zipfile
from pathlib import Path

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

from components import Fixed, Inertia, Spring, StepTable, Torque
from modelica_like import export_fmu, simulate
from modelica_like.errors import ExportError, FmuFailed, ValueOutOfRange
from modelica_like.fmi.run import run_fmu
from modelica_like.language import Component, Equations, connect, series

EXAMPLES = Path(__file__).parents[2] / "examples"
CLUTCHES = "msl/rotational/CoupledClutches.toml"
WINCH = str(Path(__file__).parents[1] / "system/new_drives/winch.toml")
STEP = 1e-3


class Oscillator(Component):
    """phi = cos(2 t)."""

    wall, spring, rotor = Fixed(), Spring(c=2.0), Inertia(J=0.5, phi=1.0, w=0.0)

    def equations(self) -> Equations:
        yield from series(self.wall, self.spring, self.rotor)


class Kicked(Component):
    """A mass of 2 kg.m2 whose torque changes eight times between 0.1 s and 0.2 s."""

    rotor, source = Inertia(J=2.0, phi=0.0, w=0.0), Torque()
    table = StepTable(table=[[0.0, 0.0], *([0.1 + 0.01 * k, float(k)] for k in range(1, 9))])

    def equations(self) -> Equations:
        yield from series(self.source, self.rotor)
        yield connect(self.table.y, self.source.tau)


OSCILLATOR, KICKED = Oscillator(), Kicked()


def go(case, fmu, until, step):
    """States behind every step."""
    rows = []
    for k in range(round(until / step)):
        fmu.doStep(k * step, step)
        rows.append(case.states(fmu))
    return np.array(rows)


def test_fixed_steps_have_order_five(exported):
    errors = []
    for steps in (20, 40):
        case = exported(OSCILLATOR, "2.0", 1.0 / steps)
        fmu = case.started()
        go(case, fmu, 1.0, 1.0 / steps)
        angle, speed = fmu.getReal([case.ref("rotor.phi"), case.ref("rotor.w")])
        errors.append(max(abs(angle - np.cos(2.0)), abs(speed + 2 * np.sin(2.0))))
    assert errors[1] < 1e-8
    assert np.log2(errors[0] / errors[1]) > 4.7


def test_communication_steps_of_several_fixed_ones_are_the_same(exported):
    case = exported(CLUTCHES, "2.0", STEP)
    single, five = (go(case, case.started(), 1.5, step) for step in (STEP, 5 * STEP))
    assert five == pytest.approx(single[4::5], rel=1e-9, abs=1e-9)


@pytest.mark.parametrize(
    ("netlist", "until", "late"),
    [
        ("machine_table_direct.toml", 0.4, 1e-6),
        ("machine_table_geared.toml", 0.4, 1e-6),
        ("machine_tool_startup.toml", 1.0, 2e-5),
        (CLUTCHES, 1.5, 1e-6),
        ("lepelletier.toml", 35.0, 1e-6),
    ],
    ids=["direct", "geared", "003", "CoupledClutches", "Lepelletier"],
)
def test_the_modes_change_as_with_idas(exported, netlist, until, late):
    case = exported(netlist, "3.0", STEP)
    lines = []
    fmu = case.instance(logMessage=lambda _environment, _status, _category, text: lines.append(text.decode()))
    fmu.setDebugLogging(True, ["logEvents"])
    case.initialize(fmu)
    for k in range(round(until / STEP)):
        fmu.doStep(k * STEP, STEP)
    told = [line.removeprefix("t = ").split(" s: ") for line in lines]
    reference = simulate(case.model, until, rtol=1e-10, atol=1e-12).events
    assert [text for _, text in told] == [f"{one.mode}: {one.before} -> {one.after}" for one in reference]
    assert [float(time) for time, _ in told] == pytest.approx([one.time for one in reference], abs=late)


def test_the_winch_goes_on_as_in_steps_of_any_size(exported):
    """Where a brake and a gear lock together, IDAS and the run-time leave the gear in different modes at standstill."""
    case, free = exported(WINCH, "2.0", STEP), exported(WINCH, "2.0")
    found = go(case, case.started(), 5.0, STEP)
    exact = go(free, free.started(until=5.0, tolerance=1e-10), 5.0, STEP)
    assert np.max(np.abs(found - exact) / np.ptp(exact, axis=0)) < 1e-4


def test_what_does_not_fit_into_a_step_comes_with_the_next(exported):
    """Eight changes in one step of 0.1 s: those beyond the budget are late by a step at most, and none is lost."""
    case = exported(KICKED, "2.0", 0.1)
    fmu = case.started()
    speeds = [go(case, fmu, 1.0, 0.1)[:, case.model.states.index("rotor.w")]]
    assert np.diff(speeds[0])[3:] == pytest.approx(8 * 0.1 / 2, rel=1e-12)
    exact = (sum(range(1, 9)) * 0.01 + 8 * 0.81) / 2
    assert exact - 8 * 0.1 / 2 < speeds[0][-1] <= exact + 1e-12


def test_a_state_copied_back_gives_the_same_bits(exported):
    case = exported(CLUTCHES, "2.0", STEP)
    fmu = case.started()
    for k in range(400):
        fmu.doStep(k * STEP, STEP)
    copy = fmu.getFMUstate()
    both = []
    for _ in range(2):
        fmu.setFMUstate(copy)
        both.append([(fmu.doStep((400 + k) * STEP, STEP), case.states(fmu))[1] for k in range(600)])
    assert np.array_equal(*both)


def test_another_communication_step_is_refused(exported):
    case = exported(CLUTCHES, "2.0", STEP)
    fmu = case.started()
    for size in (1.5 * STEP, 0.5 * STEP, 2e-12):
        with pytest.raises(FMICallException):
            fmu.doStep(0.0, size)
    fmu.doStep(0.0, 2 * STEP)


def test_the_export_tells_the_error_by_variable(tmp_path):
    done = export_fmu(EXAMPLES / CLUTCHES, tmp_path / "fixed.fmu", "3.0", fixed_step="1 ms")
    deviations = {one.signal: one.relative for one in done.check.curves.deviations}
    assert not done.check.differs
    assert set(deviations) == {"J1.phi", "J1.w"} | {f"clutch{k}.{what}_rel" for k in (1, 2, 3) for what in ("phi", "w")}
    assert 0 < max(deviations.values()) < 1e-6
    assert f"J1.w {deviations['J1.w']:.2g}" in str(done)
    with zipfile.ZipFile(done.path) as archive:
        tag = Xml.fromstring(archive.read("modelDescription.xml")).find("CoSimulation")
    assert tag is not None
    assert tag.get("fixedInternalStepSize") == "0.001"
    assert tag.get("hasEventMode") == tag.get("canHandleVariableCommunicationStepSize") == "false"
    with pytest.raises(FmuFailed, match=r"0\.0015 s is not a whole number of fixed steps of 0\.001 s"):
        run_fmu(done.path, step=1.5e-3)


def test_what_cannot_be_a_fixed_step_is_refused(tmp_path):
    with pytest.raises(ExportError, match="only Model Exchange"):
        export_fmu(EXAMPLES / CLUTCHES, tmp_path / "me.fmu", kind="me", fixed_step=STEP)
    with pytest.raises(ValueOutOfRange, match="positive"):
        export_fmu(EXAMPLES / CLUTCHES, tmp_path / "none.fmu", fixed_step=0)


# -- handles -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("drive", [CLUTCHES, WINCH])
def test_a_handle_takes_the_same_steps_as_an_fmu(exported, drive):
    case, until = exported(drive, "2.0", STEP), 0.4
    fmu = case.started()
    expected = go(case, fmu, until, STEP)
    names = [name for name in case.model.states if name in case.face.by_name]
    handle = case.model.native(outputs=names, fixed_step="1 ms")
    handle.reset(until=until)
    found = np.array([handle.step(k * STEP + STEP).copy() for k in range(len(expected))])
    assert np.array_equal(found, expected)
    handle.reset(until=until)
    times, results = handle.run(until, round(until / (4 * STEP)))
    assert times[-1] == until
    assert np.allclose(results[-1], expected[-1], rtol=1e-9, atol=1e-9)  # times are rounded otherwise
    assert np.all(np.abs(times / STEP - np.round(times / STEP)) < 1e-9)


def test_a_handle_of_fixed_steps_refuses_what_is_no_whole_number_of_them(exported):
    handle = exported(OSCILLATOR).model.native(outputs=["rotor.phi"], fixed_step=STEP)
    handle.step(STEP)
    with pytest.raises(ValueOutOfRange, match=r"The time 0 s is before the present one, 0\.001 s"):
        handle.step(0.0)
    for wrong in (1.5 * STEP, STEP):
        with pytest.raises(ValueOutOfRange, match=r"is not a whole number of fixed steps of 0\.001 s"):
            handle.step(wrong)
    with pytest.raises(ValueOutOfRange, match=r"The step of 0\.003333333333 s is not a whole number"):
        handle.run(STEP + 0.01, 3)
    assert handle.step(2 * STEP)[0] == pytest.approx(np.cos(4 * STEP), abs=1e-12)
    for wrong in (0.0, -1.0, float("inf")):
        with pytest.raises(ValueOutOfRange, match=r"fixed step must be a positive time|must be a finite"):
            exported(OSCILLATOR).model.native(fixed_step=wrong)
