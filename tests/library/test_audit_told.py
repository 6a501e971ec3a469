"""What the audit of the energy balance tells: negative losses, energies that jump at events, and no rounding."""

from dataclasses import replace
from io import StringIO
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from components import Damper, Fixed, Inertia
from modelica_like import Assembly, Solution, simulate
from modelica_like.language import Component, Equations, Events, Mode, Parameter, Variable, der, param, var
from modelica_like.netlist import loads
from modelica_like.show.report.run import run_report
from modelica_like.solve.initialize import Impact

TWO_SETS = """
name = "two_sets"

[parts]
rotor = { is = "Inertia", J = 1.7549702174772808, w = 1, phi = 0 }
ring_1 = { is = "Inertia", J = 0.0028151629834661145, w = 1, phi = 0 }
carrier_1 = { is = "Inertia", J = 1 }
motor = { is = "Inertia", J = 1 }
ring_2 = { is = "Inertia", J = 0.0020004675723061523, w = 1, phi = 0 }
carrier_2 = { is = "Inertia", J = 0.008777629762664704 }
set_1 = { is = "IdealPlanetary", ratio = 3.9283639445808127 }
gear = { is = "IdealGear", ratio = 1.7549702174772808 }
set_2 = { is = "IdealPlanetary", ratio = 2.8941342680478543 }
torque = { is = "ConstantTorque", tau_constant = 0.0579235064108396 }

[connect]
a = ["rotor.flange_b", "set_1.sun", "gear.flange_a"]
b = ["ring_1.flange_b", "set_1.ring"]
c = ["carrier_1.flange_b", "set_1.carrier", "set_2.sun"]
d = ["motor.flange_b", "gear.flange_b", "torque.flange"]
e = ["ring_2.flange_b", "set_2.ring"]
f = ["carrier_2.flange_b", "set_2.carrier"]
"""


class Pump(Damper):
    """A damper that drives instead, and says so: its loss is negative."""

    def equations(self) -> Equations:
        yield from super(Damper, self).equations()
        yield self.tau == -self.d * self.w_rel

    def dissipation(self) -> Any:
        return -self.d * self.w_rel**2


def told(run: Solution) -> str:
    console = Console(width=200, file=StringIO())
    console.print(run_report(run))
    return console.file.getvalue()  # type: ignore[attr-defined]


def test_a_negative_loss_is_noticed_with_its_time_and_power() -> None:
    """J·dw/dt = d·w: the speed is exp(d·t/J), the loss -d·w², and largest at the end."""
    parts = {"J": Inertia(J=0.5, phi=0.0, w=1.0), "pump": Pump(d=0.25), "wall": Fixed()}
    run = simulate(Assembly("drive", parts=parts, series={"s": list(parts)}), 2.0, rtol=1e-9)
    balance = run.energy()
    pump = balance["pump"]
    assert (pump.imbalance, pump.gain_time) == (0.0, 2.0)
    assert pump.gain == pytest.approx(0.25 * np.exp(2.0), rel=1e-7)
    assert balance.notices == ("pump has a negative loss, -1.84726 W at 2 s.",)
    assert str(balance).endswith(balance.notices[0])
    assert balance.notices[0] in told(run)
    assert "impacts" not in told(run)


class Sampled(Component):
    """A mass whose speed jumps through a discrete value, without a reset of a state."""

    m: Parameter = param("kg", "mass", default=2.0)
    x: Variable = var("m", "position")
    step: Parameter = param("m", "where", default=1.0)
    crawl: Parameter = param("m/s", "speed before", default=1.0)
    rapid: Parameter = param("m/s", "speed behind", default=3.0)
    v: Variable = var("m/s", "speed")
    gear = Mode("slow", "fast")

    def equations(self) -> Equations:
        yield der(self.x) == self.v
        yield self.v == self.gear.choose(slow=self.crawl, fast=self.rapid)

    def events(self) -> Events:
        yield self.gear.go("slow", "fast", when=self.x > self.step)

    def stored_energy(self) -> Any:
        return 0.5 * self.m * self.v**2


def test_energy_that_appears_at_an_event_is_noticed() -> None:
    """2 kg from 1 m/s to 3 m/s: 8 J."""
    balance = simulate(Sampled(x=0.0), 2.0).energy()
    assert balance.at_events == pytest.approx(8.0, rel=1e-12)
    assert balance[""].at_events == pytest.approx(8.0, rel=1e-12)
    assert balance.notices == ("At an event 8 J appear or vanish without an impact or a reset.",)


def test_an_impact_explains_what_vanishes_and_is_lost() -> None:
    run = simulate(Sampled(x=0.0), 2.0)
    impact = Impact(run.events[0].time, "", -8.0)
    struck = replace(run, impacts=(impact,))
    balance = struck.energy()
    assert balance.at_events < 1e-12
    assert "of it in impacts" in told(struck)
    assert (balance[""].impact, balance[""].lost) == (-8.0, -8.0)
    assert balance.notices == ()
    assert "-8 J in impacts" in str(balance)


def test_rounding_of_torques_that_are_small_differences_of_large_ones_is_no_fault_of_a_component() -> None:
    """The last carrier takes 1e-8 of the power of the drive: what rounding leaves of it is 1e-5 of its own."""
    balance = simulate(loads(TWO_SETS), 1.0, points=40, rtol=1e-9).energy()
    assert balance.imbalance == 0.0
    assert balance.notices == ()
