"""Speed by pulses, and machines that commutate: backwards, from a large angle, there and back, as a motor."""

from math import exp, pi, sin

import pytest

from components import (
    CommutatedDCMachine,
    ConstantSpeed,
    ConstantTorque,
    ConstantVoltage,
    Ground,
    Inertia,
    PermanentMagnetDCMachine,
    PulseSpeedSensor,
    Sine,
    Speed,
)
from modelica_like import simulate
from modelica_like.language import Component, Equations, connect


class Backwards(Component):
    motor = ConstantSpeed(w_fixed="-61 rpm")
    disc = Inertia(J=1.0, phi=1000.0)
    sensor = PulseSpeedSensor(pulses=4, gate="1 s")

    def equations(self) -> Equations:
        yield connect(self.motor.flange, self.disc.flange_a)
        yield connect(self.disc.flange_b, self.sensor.flange)


class ThereAndBack(Component):
    """Swings from 0.8 to 1.1 of the distance between two magnets and back, once a second."""

    wave = Sine(amplitude=0.3 * pi**2, f=1.0)
    motor = Speed()
    disc = Inertia(J=1.0, phi=0.8 * pi)
    sensor = PulseSpeedSensor(pulses=2, gate="0.45 s")

    def equations(self) -> Equations:
        yield connect(self.wave.y, self.motor.w_ref)
        yield connect(self.motor.flange, self.disc.flange_a)
        yield connect(self.disc.flange_b, self.sensor.flange)


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


def test_backwards_from_a_large_angle() -> None:
    """Every pulse is one whole distance on; the first one is half a distance late, for it comes from the other side."""
    run = simulate(Backwards(), 3.5)
    rate, first = 4 * 61 / 60, 4 * 1000 / (2 * pi) % 1 + 0.5
    passed = [int(rate * second - first) + 1 for second in range(1, 4)]
    shown = [2 * pi / 4 * (after - before) for before, after in zip([0, *passed], passed, strict=False)]
    assert [run.at(moment)["sensor.w"] for moment in (0.5, 1.5, 2.5, 3.4)] == pytest.approx([0, *shown])


def test_a_shaft_that_swings_about_a_magnet_makes_one_pulse() -> None:
    run = simulate(ThereAndBack(), 2.0)
    shown = [run.at(moment)["sensor.w"] for moment in (0.44, 0.46, 0.91, 1.36, 1.81)]
    assert shown == pytest.approx([0, 2 * pi / (2 * 0.45), 0, 0, 0])
    assert run.final["sensor.count"] == 0


def test_a_motor_that_ripples() -> None:
    """In the mean over the angle its torque is k·i, and its induced voltage takes <flux²>·k²·w/R from that."""
    run, smooth = simulate(Rippling(), 0.5), simulate(Motor(), 0.5)
    half = pi / 6
    square = (half / sin(half)) ** 2 * (0.5 + sin(2 * half) / (4 * half))
    for motor, factor in ((smooth, 1.0), (run, square)):
        rate = factor * 0.0467**2 / 0.8
        end = (0.0467 * 24 / 0.8 - 0.2) / rate
        assert motor.final["machine.w"] == pytest.approx(end + (300 - end) * exp(-rate / 0.01 * 0.5), rel=2e-4)
    assert run.energy().closure < 1e-8
    assert run.final["machine.loop"] == pytest.approx(run.final["machine.phi"] * 2 * 3 / pi, abs=0.5)
