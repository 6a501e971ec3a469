"""Ideal sensors of shafts: acceleration, pulses."""

from __future__ import annotations

from components import icons
from components.interfaces import Flange
from components.sensors import RelativeSensor
from modelica_like.language import Component, Equations, Output, Parameter, Variable, der, param, signal_out, sin, var


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
    """Sensor that sees n teeth or magnets of a shaft pass, such as a Hall sensor: y = sin(n·phi)."""

    icon = icons.SENSOR
    flange = Flange("measured shaft end")
    n: Parameter = param("1", "pulses per turn", min=0)
    y: Output = signal_out("1", "pulses, between -1 and 1")

    def equations(self) -> Equations:
        yield self.flange.tau == 0
        yield self.y == sin(self.n * self.flange.phi)
