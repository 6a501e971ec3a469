"""Ideal sensors of the acceleration of shafts."""

from __future__ import annotations

from components import icons
from components.interfaces import Flange
from components.sensors import RelativeSensor
from modelica_like.language import Component, Equations, Output, Variable, der, signal_out, var


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
