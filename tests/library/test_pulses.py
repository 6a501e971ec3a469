"""Pulses of a shaft: forward and backward, from a large angle, and a shaft that swings about an edge."""

from math import floor, pi

import pytest

from components import ConstantSpeed, Inertia, PulseCounter, PulseSensor, Sine, Speed
from modelica_like import simulate
from modelica_like.language import Component, Equations, Parameter, connect, param


class Turning(Component):
    begin: Parameter = param("rad", "angle at the start", default=1000.0)
    motor = ConstantSpeed(w_fixed="61 rpm")
    disc = Inertia(J=1.0, phi=begin)
    sensor = PulseSensor(n=4)
    counter = PulseCounter(u_high=0.0)

    def equations(self) -> Equations:
        yield connect(self.motor.flange, self.disc.flange_a)
        yield connect(self.disc.flange_b, self.sensor.flange)
        yield connect(self.sensor.y, self.counter.u)


class Swinging(Component):
    """Swings from 0.8 to 1.1 of the distance between two teeth and back, once a second."""

    wave = Sine(amplitude=0.3 * pi**2, f=1.0)
    motor = Speed()
    disc = Inertia(J=1.0, phi=0.8 * pi)
    sensor = PulseSensor(n=2)
    counter = PulseCounter(u_high=0.0)

    def equations(self) -> Equations:
        yield connect(self.wave.y, self.motor.w_ref)
        yield connect(self.motor.flange, self.disc.flange_a)
        yield connect(self.disc.flange_b, self.sensor.flange)
        yield connect(self.sensor.y, self.counter.u)


@pytest.mark.parametrize("begin", [1000.0, 1001.0, -1000.0])
@pytest.mark.parametrize("speed", [61.0, -61.0, 4567.0])
def test_pulses_of_a_shaft_that_turns(speed: float, begin: float) -> None:
    """Forward an edge rises where a tooth begins, backward where it ends."""
    run = simulate(Turning(), 1.0, parameters={"motor.w_fixed": speed * pi / 30, "begin": begin})
    before, after = (4 * (begin + speed * pi / 30 * t) / (2 * pi) for t in (0.0, 1.0))
    count = floor(after) - floor(before) if speed > 0 else floor(before + 0.5) - floor(after + 0.5)
    assert run.final["counter.y"] == count
    assert run.final["sensor.y"] == (1 if after % 1 < 0.5 else -1)


def test_a_shaft_that_swings_about_an_edge() -> None:
    run = simulate(Swinging(), 3.0)
    assert run.final["counter.y"] == 3
    assert run.final["sensor.passed"] == 0
