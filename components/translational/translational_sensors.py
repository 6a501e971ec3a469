"""Ideal sensors of slides, without effect on the drive."""

from __future__ import annotations

from components import icons
from components.interfaces import LinearFlange
from modelica_like.language import Component, Equations, Output, Variable, der, signal_out, var


class SlideSensor(Component, partial=True):
    """Sensor at a slide end."""

    icon = icons.SENSOR
    flange = LinearFlange("measured slide end")

    def equations(self) -> Equations:
        yield self.flange.f == 0


class VelocitySensor(SlideSensor):
    """Velocity of a slide end."""

    v: Output = signal_out("m/s", "velocity")

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.v == der(self.flange.s)


class LinearAccelerationSensor(SlideSensor):
    """Acceleration of a slide end."""

    v: Variable = var("m/s", "velocity")
    a: Output = signal_out("m/s2", "acceleration")

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.v == der(self.flange.s)
        yield self.a == der(self.v)


class RelativeSlideSensor(Component, partial=True):
    """Sensor between two slide ends, without joining them."""

    icon = icons.BETWEEN_SENSOR
    flange_a = LinearFlange("reference slide end")
    flange_b = LinearFlange("measured slide end")

    def equations(self) -> Equations:
        yield self.flange_a.f == 0
        yield self.flange_b.f == 0


class RelativePositionSensor(RelativeSlideSensor):
    """Position of one slide end relative to another."""

    s_rel: Output = signal_out("m", "relative position")

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.s_rel == self.flange_b.s - self.flange_a.s


class RelativeVelocitySensor(RelativeSlideSensor):
    """Velocity of one slide end relative to another."""

    v_rel: Output = signal_out("m/s", "relative velocity")

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.v_rel == der(self.flange_b.s) - der(self.flange_a.s)


class RelativeLinearAccelerationSensor(RelativeSlideSensor):
    """Acceleration of one slide end relative to another."""

    v_rel: Variable = var("m/s", "relative velocity")
    a_rel: Output = signal_out("m/s2", "relative acceleration")

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.v_rel == der(self.flange_b.s) - der(self.flange_a.s)
        yield self.a_rel == der(self.v_rel)


class CutSlideSensor(Component, partial=True):
    """Sensor in a cut through a slide."""

    icon = icons.BETWEEN_SENSOR
    flange_a = LinearFlange("left end")
    flange_b = LinearFlange("right end")

    def equations(self) -> Equations:
        yield self.flange_a.s == self.flange_b.s
        yield self.flange_a.f + self.flange_b.f == 0


class LinearPowerSensor(CutSlideSensor):
    """Power through a slide, from flange_a to flange_b."""

    power: Output = signal_out("W", "power")

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.power == self.flange_a.f * der(self.flange_a.s)


class LinearMultiSensor(CutSlideSensor):
    """Velocity, force and power in a slide."""

    v: Output = signal_out("m/s", "velocity")
    f: Output = signal_out("N", "force")
    power: Output = signal_out("W", "power")

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.v == der(self.flange_a.s)
        yield self.f == self.flange_a.f
        yield self.power == self.f * self.v
