"""Delayed values in FMUs, against closed forms: the past belongs to the state of the instance."""

import itertools
from math import factorial
from pathlib import Path

import numpy as np
import pytest
from fmpy import simulate_fmu

from modelica_like import build, export_fmu
from modelica_like.errors import ValueOutOfRange
from modelica_like.language import (
    Component,
    Equations,
    Input,
    Output,
    Parameter,
    Variable,
    delay,
    der,
    if_,
    mod,
    param,
    signal_in,
    signal_out,
    var,
)

KINDS = ["ModelExchange", "CoSimulation"]


class Loop(Component):
    """y' = -y(t - T), beside a square wave that comes 0.3 s later."""

    T: Parameter = param("s", "delay", default=1.0)
    tau: Parameter = param("s", "time constant", default=1.0)
    period: Parameter = param("s", "of the square wave", default=1.0)
    y: Variable = var("1", "value")
    wave: Variable = var("1", "square wave, later")

    def equations(self) -> Equations:
        yield self.tau * der(self.y) == -delay(self.y, self.T)
        high = mod(self.time, self.period, events=True) < 0.5 * self.period
        yield self.wave == delay(if_(high, 1, 0), 0.3 * self.tau)


class Line(Component):
    """A dead time, and the integral of what comes out."""

    T: Parameter = param("s", "delay", default=0.25)
    u: Input = signal_in("1", "given", default=0.0)
    y: Output = signal_out("1", "later")
    total: Variable = var("s", "its integral", default=0.0)

    def equations(self) -> Equations:
        yield self.y == delay(self.u, self.T)
        yield der(self.total) == self.y


@pytest.fixture(scope="module", params=["2.0", "3.0"])
def loop(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("fmu") / "loop.fmu"
    export_fmu(Loop(y=1.0), path, version=request.param, strict=True, outputs=("wave",))
    return path


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("T", "y"), [(1.0, 1.0), (0.7, -2.0)])
def test_polynomials_of_the_method_of_steps(loop: Path, kind: str, T: float, y: float) -> None:
    run = simulate_fmu(
        str(loop), stop_time=5.0, output_interval=0.01, fmi_type=kind, relative_tolerance=1e-8,
        output=["y", "wave"], start_values={"T": T, "y": y},
    )  # fmt: skip
    terms = [(-1) ** k * np.maximum(run["time"] - (k - 1) * T, 0) ** k / factorial(k) for k in range(12)]
    assert run["y"] == pytest.approx(y * np.sum(terms, axis=0), abs=1e-6)
    late = run["time"] - 0.3
    clear = np.abs(np.mod(late + 0.25, 0.5) - 0.25) > 1e-6
    square = np.where(late < 0, 1.0, np.mod(late, 1.0) < 0.5)
    assert run["wave"][clear] == pytest.approx(square[clear], abs=1e-9)


def test_a_state_copied_back_has_its_past(exported) -> None:
    case = exported(Loop(y=1.0), "3.0")
    fmu = case.started(until=4.0)
    fmu.doStep(0.0, 1.3)
    copy = fmu.getFMUState()
    written = fmu.serializeFMUState(copy)
    found = []
    for _ in range(2):
        for k in range(20):
            fmu.doStep(1.3 + 0.1 * k, 0.1)
        found.append(case.states(fmu))
        fmu.freeFMUState(copy)
        copy = fmu.deserializeFMUState(written)
        fmu.setFMUState(copy)
    assert found[0] == found[1]
    fmu.freeFMUState(copy)
    fmu.freeInstance()


@pytest.mark.parametrize("step", [0.1, 0.013])
def test_held_inputs_come_again(exported, step: float) -> None:
    case = exported(Line())
    fmu = case.started(until=3.0)
    given = np.sin(3.0 * step * np.arange(int(3.0 / step)))
    total = []
    for k, value in enumerate(given):
        fmu.setReal([case.ref("u")], [value])
        fmu.doStep(k * step, step)
        total.append(fmu.getReal([case.ref("total")])[0])
    steps = list(itertools.accumulate(given * step, initial=0.0))
    times = step * np.arange(len(steps))
    exact = np.interp(times[1:] - 0.25, times, steps)
    assert total == pytest.approx(exact, abs=1e-9)
    fmu.freeInstance()


def test_times_of_delays_are_fixed_with_the_start(exported) -> None:
    case = exported(Loop(y=1.0))
    kinds = {name: case.face.by_name[name].variability for name in ("T", "tau", "period")}
    assert kinds == {"T": "fixed", "tau": "fixed", "period": "tunable"}  # 0.3·tau delays the wave
    run = build(Loop(y=1.0)).native(outputs=["y"])
    run.reset({"T": 0.5})
    assert run.step(1.0)[0] == pytest.approx(1 - 1.0 + 0.5**2 / 2, abs=1e-7)
    with pytest.raises(ValueOutOfRange, match="T cannot be set: it is a fixed parameter"):
        run.set({"T": 0.7})
