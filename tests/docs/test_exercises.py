"""Solutions of the exercises of docs/architecture.md; test_architecture_page.py looks at the page itself."""

from __future__ import annotations

from math import exp, log
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.fmi2 import FMU2Model

from components import ConstantTorque, Flange, Inertia
from modelica_like import export_fmu, sensitivities, simulate
from modelica_like.errors import UnitError
from modelica_like.language import (
    Component,
    Equations,
    Events,
    Expr,
    Mode,
    Parameter,
    Variable,
    der,
    maximum,
    minimum,
    param,
    series,
    var,
)
from modelica_like.netlist import loads

# -- 1: a component with a mode ----------------------------------------------------------------------------------------


class Governor(Component):
    """Brake that acts above one speed and lets go below another: d·w while it acts."""

    flange = Flange("shaft end")
    d: Parameter = param("N.m.s/rad", "damping while it acts", min=0)
    w_on: Parameter = param("rad/s", "speed at which it begins")
    w_off: Parameter = param("rad/s", "speed at which it ends")
    w: Variable = var("rad/s", "speed")
    state = Mode("idle", "acting")

    def equations(self) -> Equations:
        yield der(self.flange.phi) == self.w
        yield self.flange.tau == self.state.choose(idle=0, acting=self.d * self.w)

    def events(self) -> Events:
        yield self.state.initially("acting", when=self.w > self.w_on)
        yield self.state.go("idle", "acting", when=self.w > self.w_on)
        yield self.state.go("acting", "idle", when=self.w < self.w_off)

    def loss_power(self) -> Expr:
        return self.flange.tau * self.w


class Governed(Component):
    motor = ConstantTorque(tau_constant="2 N.m")
    wheel = Inertia(J="0.5 kg.m2", phi=0, w=0)
    governor = Governor(d="0.1 N.m.s/rad", w_on="60 rad/s", w_off="30 rad/s")

    def equations(self) -> Equations:
        yield from series(self.motor, self.wheel, self.governor)


def test_a_component_with_a_mode() -> None:
    """Up by 2/0.5 rad/s²; while it acts, towards 2/0.1 rad/s with the time constant 0.5/0.1 s."""
    run = simulate(Governed(), "30 s")
    begins = 60 / 4
    ends = begins + 5 * log((60 - 20) / (30 - 20))
    again = ends + (60 - 30) / 4
    assert [event.after for event in run.events] == ["acting", "idle", "acting"]
    assert [event.time for event in run.events] == pytest.approx([begins, ends, again], rel=1e-6)
    assert run.final["wheel.w"] == pytest.approx(20 + 40 * exp(-(30 - again) / 5), rel=1e-6)
    assert run.energy().closure < 1e-7


# -- 2: a function of the language -------------------------------------------------------------------------------------


def smooth_step(x: Expr) -> Expr:
    """Return 0 below 0, 1 above 1, and x²(3 - 2x) between; its slope has no jump."""
    inside = minimum(maximum(x, 0), 1)
    return inside**2 * (3 - 2 * inside)


class Starter(Component):
    """Angle of a shaft that is brought to a speed without a jerk."""

    phi: Variable = var("rad", "angle", state="always", default=0.0)
    T: Parameter = param("s", "duration of the start", default=2.0)
    w: Parameter = param("rad/s", "speed", default=3.0)

    def equations(self) -> Equations:
        yield der(self.phi) == self.w * smooth_step(self.time / self.T)


class Wrong(Starter):
    def equations(self) -> Equations:
        yield der(self.phi) == self.w * smooth_step(self.T)


def test_a_function_of_the_language() -> None:
    run = simulate(Starter(), "4 s")
    assert [run.at(time)["phi"] for time in (1.0, 2.0, 4.0)] == pytest.approx(
        [3 * 2 * (0.5**3 - 0.5**4 / 2), 3 * 2 / 2, 3 * (4 - 2 / 2)], rel=1e-6
    )
    assert run.events == ()
    found = sensitivities(Starter(), ["phi"], ["T", "w"], until="4 s")
    assert (found["phi", "T"], found["phi", "w"]) == (pytest.approx(-1.5, rel=1e-7), pytest.approx(3, rel=1e-7))
    with pytest.raises(UnitError):
        simulate(Wrong(), "1 s")


# -- 3: an FMI call ----------------------------------------------------------------------------------------------------

NETLIST = """
[parts]
motor = { is = "Torque" }
rotor = { is = "Inertia", J = "2 kg.m2", phi = 0, w = 0 }
gear = { is = "IdealGear", ratio = 5 }
load = { is = "Inertia", J = "50 kg.m2" }
[series]
drive = ["motor", "rotor", "gear", "load"]
"""


def test_an_fmi_call(tmp_path: Path) -> None:
    """fmi2GetDirectionalDerivative of the acceleration by the torque is 1/(J + J_load/ratio²)."""
    file = tmp_path / "drive.fmu"
    export_fmu(loads(NETLIST), file, version="2.0", check=False)
    description = fmpy.read_model_description(str(file))
    references = {one.name: one.valueReference for one in description.modelVariables}
    fmu = FMU2Model(
        guid=description.guid, modelIdentifier=description.modelExchange.modelIdentifier,
        unzipDirectory=str(fmpy.extract(str(file), str(tmp_path / "fmu"))), instanceName="drive",
    )  # fmt: skip
    fmu.instantiate()
    fmu.setupExperiment(startTime=0.0)
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    found = fmu.getDirectionalDerivative([references["der(rotor.w)"]], [references["motor.tau"]], [1.0])
    fmu.terminate()
    fmu.freeInstance()
    assert np.array(found) == pytest.approx(1 / (2 + 50 / 5**2), rel=1e-14)
