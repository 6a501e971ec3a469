"""What a signal is at the start of a run counts for initial equations and steady starts: values read off its shape."""

from math import exp
from typing import Any

import pytest

from components import (
    BooleanPulse,
    BooleanTable,
    CoilForce,
    FirstOrder,
    KinematicPTP2,
    Pulse,
    SawTooth,
    ShiftSchedule,
    StepTable,
    Trapezoid,
)
from modelica_like import Assembly, Component, export_fmu, run_fmu, simulate
from modelica_like.language import (
    Discrete,
    Equations,
    Input,
    Parameter,
    Variable,
    der,
    discrete,
    floor,
    param,
    signal_in,
    var,
)
from modelica_like.simulation import Solver

both = pytest.mark.parametrize("solver", ["idas", "native"])
SHAPES: list[tuple[Component, dict[float, float]]] = [
    (Pulse(amplitude=10, period=1.0, start_time=-0.25), {0.0: 10, 0.25: 0, 0.5: 0, 0.8: 10, 1000.0: 10}),
    (Pulse(amplitude=10, period=1.0, periods=3), {-1.0: 0, 0.0: 10, 2.25: 10, 2.75: 0, 3.25: 0, 9.0: 0}),
    (Pulse(amplitude=10, period=0.1, width=1.0), {-0.01: 0, 0.0: 10, 0.3: 10, 0.35: 10}),
    (SawTooth(amplitude=10, period=0.1), {-0.1: 0, 0.0: 0, 0.025: 2.5, 0.3: 0, 100.075: 7.5}),
    (
        Trapezoid(amplitude=10, rising=0.2, width=0.3, falling=0.2, period=1.0),
        {-0.5: 0, 0.1: 5, 0.2: 10, 0.4: 10, 0.6: 5, 0.7: 0, 7.05: 2.5, 1000.4: 10},
    ),
    (BooleanPulse(period=1.0, width=0.25), {0.0: 1, 0.25: 0, 7.125: 1, 7.5: 0}),
    (StepTable(table=[[0, 5], [1, 20], [2, 40]]), {-1.0: 5, 0.5: 5, 1.0: 20, 2.5: 40}),
    (BooleanTable(times=[0.5, 1.5]), {0.0: 0, 0.5: 1, 1.0: 1, 1.5: 0}),
    (
        CoilForce(T=0.1, start_time=0.2, stop_time=0.5, T_off=0.05),
        {0.1: 0, 0.3: (1 - exp(-1)) ** 2, 0.55: ((1 - exp(-3)) * exp(-1)) ** 2, 9.0: 0},
    ),
    (
        KinematicPTP2(q_begin=1.0, q_end=3.0, qd_max=2.0, qdd_max=5.0, start_time=1.0),
        {0.0: 1, 1.25: 1.15625, 1.7: 2, 2.2: 2.9, 4.0: 3},
    ),
    (
        ShiftSchedule(pattern=[["1", "a"], ["2", "b"]], shifts=[[0, "1", 0], [0.2, "2", 0.2], [1, "1", 0.5]]),
        {0.0: 1, 0.25: 0.75, 0.4: 0, 0.9: 0, 1.0: 0, 1.25: 0.5, 7.0: 1},
    ),
]
OUTPUTS: dict[type[Component], str] = {KinematicPTP2: "q", ShiftSchedule: "a"}
CASES = [(signal, t0, value) for signal, values in SHAPES for t0, value in values.items()]


class Keeps(Component):
    """Keeps what its signal was at the start."""

    u: Input = signal_in("1")
    x: Variable = var("1")

    def equations(self) -> Equations:
        yield der(self.x) == 0

    def initial_equations(self) -> Equations:
        yield self.x == self.u


def behind(signal: Component, block: Component) -> Assembly:
    """Return a drive of a signal and a block."""
    output = f"signal.{OUTPUTS.get(type(signal), 'y')}"
    return Assembly("drive", parts={"signal": signal, "block": block}, connect={"u": [output, "block.u"]})


@both
@pytest.mark.parametrize(("signal", "t0", "value"), CASES)
def test_initial_equations(signal: Component, t0: float, value: float, solver: Solver) -> None:
    run = simulate(behind(signal, Keeps()), t0 + 0.01, t0=t0, solver=solver)
    assert run.final["block.x"] == pytest.approx(value, abs=1e-6)


@both
def test_a_steady_start(solver: Solver) -> None:
    """The low pass begins at 10, and falls after half a period."""
    drive = behind(Pulse(amplitude=10, period=1.0), FirstOrder(T=0.1))
    run = simulate(drive, 0.7, start="steady", solver=solver, rtol=1e-9)
    assert run["block.y"][0] == pytest.approx(10)
    assert run.at(0.5)["block.y"] == pytest.approx(10)
    assert run.final["block.y"] == pytest.approx(10 * exp(-2))


def test_an_fmu(tmp_path: Any) -> None:
    fmu = export_fmu(behind(Pulse(amplitude=10, period=1.0), Keeps()), tmp_path / "drive.fmu", outputs=["block.x"])
    for kind in ("cs", "me"):
        assert run_fmu(fmu.path, start=3.25, stop=3.5, kind=kind)["block.x"][-1] == pytest.approx(10)


class Counts(Component):
    """Has a number of whole periods at the start."""

    period: Parameter = param("s", default=0.5)
    n: Discrete = discrete("1")
    x: Variable = var("1", default=0.0)

    def equations(self) -> Equations:
        yield self.period * der(self.x) == self.n

    def initial_equations(self) -> Equations:
        yield self.n == floor(self.time / self.period)


@both
def test_an_initial_equation_of_a_discrete_variable(solver: Solver) -> None:
    assert simulate(Counts(), 2.0, t0=1.75, solver=solver).final["x"] == pytest.approx(3 * 0.25 / 0.5)
    assert simulate(Counts(period=0.25), 2.0, t0=1.75, solver=solver).final["x"] == pytest.approx(7)
    assert simulate(Counts(n=1.0), 2.0, t0=1.75, solver=solver).final["x"] == pytest.approx(0.5)
