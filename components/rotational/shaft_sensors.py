"""Ideal sensors of shafts: acceleration, pulses."""

from __future__ import annotations

from math import pi

from components import icons
from components.interfaces import Flange
from components.mechanics.sensors import RelativeSensor
from components.mechanics.sources import AT_ONCE
from modelica_like.language import (
    Component,
    Discrete,
    Equations,
    Events,
    Mode,
    Output,
    Parameter,
    Variable,
    der,
    discrete,
    floor,
    param,
    signal_out,
    var,
)


class AccelerationSensor(Component):
    """Angular acceleration of a shaft end."""

    icon = icons.SENSOR
    flange = Flange("measured shaft end")
    w: Variable = var("rad/s", "speed")
    a: Output = signal_out("rad/s2", "angular acceleration")

    def equations(self) -> Equations:
        yield self.flange.tau == 0
        yield self.w == der(self.flange.phi)
        yield self.a == der(self.w)


class RelativeAccelerationSensor(RelativeSensor):
    """Angular acceleration of one shaft end relative to another."""

    w_rel: Variable = var("rad/s", "relative speed")
    a_rel: Output = signal_out("rad/s2", "relative angular acceleration")

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.w_rel == der(self.flange_b.phi) - der(self.flange_a.phi)
        yield self.a_rel == der(self.w_rel)


class PulseSensor(Component):
    """Sensor that sees n teeth or magnets of a shaft pass, such as a Hall sensor: y is the sign of sin(n·phi).

    Every edge is an event that the angle makes: a wave that nothing but its counter reads would pass between the steps
    of the solver, and pulses would be lost.
    """

    icon = icons.SENSOR
    renamed = {
        "pulses": "n", "gate": "the period of a FrequencyMeter behind a PulseCounter", "w": "the y of a FrequencyMeter",
    }  # fmt: skip
    flange = Flange("measured shaft end")
    n: Parameter = param("1", "pulses per turn", min=1e-12)
    y: Output = signal_out("1", "pulses, 1 or -1")
    begin: Discrete = discrete("s", "time of the start", start=AT_ONCE)
    passed: Discrete = discrete("1", "teeth that have passed, backwards counted down")
    pulse = Mode("high", "low", description="tooth or gap")

    def equations(self) -> Equations:
        yield self.flange.tau == 0
        yield self.y == self.pulse.choose(high=1, low=-1)

    def events(self) -> Events:
        pulse, passed, position = self.pulse, self.passed, self.n * self.flange.phi / (2 * pi)
        yield pulse.initially("low", when=position - floor(position) > 0.5)
        first = {passed: floor(position), self.begin: -self.begin}  # and never again
        for name in ("high", "low"):
            yield pulse.go(name, name, at=self.begin, reset=first, because="start")
        yield pulse.go("high", "low", when=position > passed + 0.5, because="end of a tooth")
        yield pulse.go("low", "high", when=position > passed + 1, reset={passed: passed + 1}, because="next tooth")
        yield pulse.go(
            "high", "low", when=position < passed, reset={passed: passed - 1}, because="tooth left backwards"
        )
        yield pulse.go("low", "high", when=position < passed + 0.5, because="tooth entered backwards")
