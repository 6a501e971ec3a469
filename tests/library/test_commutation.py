"""Machines that commutate."""

from math import exp, pi, sin

import pytest

from components import (
    CommutatedDCMachine,
    ConstantTorque,
    ConstantVoltage,
    Ground,
    PermanentMagnetDCMachine,
)
from modelica_like import simulate
from modelica_like.language import Component, Equations, connect


class Motor(Component):
    battery = ConstantVoltage(V="24 V")
    earth = Ground()
    machine = PermanentMagnetDCMachine(k=0.0467, Ra=0.8, La=0.0, Jr=0.01, quasi_static=True, w=300.0, phi=0.0)
    load = ConstantTorque(tau_constant=-0.2)

    def equations(self) -> Equations:
        yield connect(self.battery.p, self.machine.ap)
        yield connect(self.battery.n, self.machine.an, self.earth.p)
        yield connect(self.machine.flange, self.load.flange)


class Rippling(Motor):
    machine = CommutatedDCMachine(
        k=0.0467, Ra=0.8, La=0.0, Jr=0.01, quasi_static=True, loops=3, pole_pairs=2, w=300.0, phi=0.0
    )


@pytest.mark.slow
def test_a_motor_that_ripples() -> None:
    """In the mean over the angle its torque is k·i, and its induced voltage takes <flux²>·k²·w/R from that."""
    run, smooth = simulate(Rippling(), 0.5), simulate(Motor(), 0.5)
    half = pi / 6
    square = (half / sin(half)) ** 2 * (0.5 + sin(2 * half) / (4 * half))
    for motor, factor in ((smooth, 1.0), (run, square)):
        rate = factor * 0.0467**2 / 0.8
        end = (0.0467 * 24 / 0.8 - 0.2) / rate
        assert motor.final["machine.w"] == pytest.approx(end + (300 - end) * exp(-rate / 0.01 * 0.5), rel=2e-4)
    assert run.energy().power_closure < 1e-8
    assert run.final["machine.loop"] == pytest.approx(run.final["machine.phi"] * 2 * 3 / pi, abs=0.5)


@pytest.mark.parametrize("w", [-300.0, 300.0])
def test_the_loop_that_is_connected_is_the_one_at_the_flux_in_both_directions(w: float) -> None:
    motor = Rippling()
    motor.machine.give("w", w)
    run = simulate(motor, 0.05)
    assert run.final["machine.phi"] * w > 0
    assert run["machine.loop"] == pytest.approx(run["machine.phi"] * 2 * 3 / pi, abs=0.5 + 1e-6)
