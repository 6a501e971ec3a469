"""Ideal sensors, without effect on the drive."""

from __future__ import annotations

from components import icons
from components.interfaces import Flange, LinearFlange
from modelica_like.language import (
    Component,
    Equations,
    Events,
    Mode,
    Output,
    Parameter,
    absolute,
    der,
    param,
    signal_out,
)


class AngleSensor(Component):
    """Angle of a shaft end."""

    icon = icons.SENSOR
    flange = Flange("measured shaft end")
    phi: Output = signal_out("rad", "angle")

    def equations(self) -> Equations:
        yield self.flange.tau == 0
        yield self.phi == self.flange.phi


class SpeedSensor(Component):
    """Speed of a shaft end."""

    icon = icons.SENSOR
    flange = Flange("measured shaft end")
    w: Output = signal_out("rad/s", "speed")

    def equations(self) -> Equations:
        yield self.flange.tau == 0
        yield self.w == der(self.flange.phi)


class SpeedLimit(SpeedSensor):
    """Speed monitor: the report of the run says when a shaft exceeds its limit in either direction.

    It does not stop the shaft. Once exceeded, it stays so, like a tripped centrifugal switch.
    """

    w_max: Parameter = param("rad/s", "largest permitted speed", min=0)
    reason: str = ""
    """Text added in the report, e.g. `a series machine runs away without load`."""
    limit = Mode("kept", "exceeded", description="speed within its limit, or exceeded")

    def events(self) -> Events:
        notice = "exceeds {w_max} rad/s" + (f": {self.reason}" if self.reason else "")
        yield self.limit.go("kept", "exceeded", when=absolute(self.w) > self.w_max, notice=notice)


class RelativeSensor(Component, partial=True):
    """Sensor between two shaft ends, without joining them."""

    icon = icons.BETWEEN_SENSOR
    flange_a = Flange("reference shaft end")
    flange_b = Flange("measured shaft end")

    def equations(self) -> Equations:
        yield self.flange_a.tau == 0
        yield self.flange_b.tau == 0


class RelativeAngleSensor(RelativeSensor):
    """Angle of one shaft end relative to another."""

    phi_rel: Output = signal_out("rad", "relative angle")

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.phi_rel == self.flange_b.phi - self.flange_a.phi


class RelativeSpeedSensor(RelativeSensor):
    """Speed of one shaft end relative to another."""

    w_rel: Output = signal_out("rad/s", "relative speed")

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.w_rel == der(self.flange_b.phi) - der(self.flange_a.phi)


class ShaftSensor(Component, partial=True):
    """Sensor in a cut through a shaft."""

    icon = icons.BETWEEN_SENSOR
    flange_a = Flange("left end")
    flange_b = Flange("right end")

    def equations(self) -> Equations:
        yield self.flange_a.phi == self.flange_b.phi
        yield self.flange_a.tau + self.flange_b.tau == 0


class TorqueSensor(ShaftSensor):
    """Torque in a shaft, flange_a.tau."""

    tau: Output = signal_out("N.m", "torque")

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.tau == self.flange_a.tau


class PowerSensor(ShaftSensor):
    """Power through a shaft, from flange_a to flange_b."""

    power: Output = signal_out("W", "power")

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.power == self.flange_a.tau * der(self.flange_a.phi)


class MultiSensor(ShaftSensor):
    """Speed, torque and power in a shaft."""

    w: Output = signal_out("rad/s", "speed")
    tau: Output = signal_out("N.m", "torque")
    power: Output = signal_out("W", "power")

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.w == der(self.flange_a.phi)
        yield self.tau == self.flange_a.tau
        yield self.power == self.tau * self.w


class PositionSensor(Component):
    """Position of a slide end."""

    icon = icons.SENSOR
    flange = LinearFlange("measured slide end")
    s: Output = signal_out("m", "position")

    def equations(self) -> Equations:
        yield self.flange.f == 0
        yield self.s == self.flange.s


class ForceSensor(Component):
    """Force in a slide, flange_a.f."""

    icon = icons.BETWEEN_SENSOR
    flange_a = LinearFlange("left end")
    flange_b = LinearFlange("right end")
    f: Output = signal_out("N", "force")

    def equations(self) -> Equations:
        yield self.flange_a.s == self.flange_b.s
        yield self.flange_a.f + self.flange_b.f == 0
        yield self.f == self.flange_a.f
