"""Prescribed torques, speeds and forces.

A positive torque or force drives the connected part in positive direction.
"""

from __future__ import annotations

from components import icons
from components.interfaces import LinearFlange, LinearOneFlange, OneFlange
from modelica_like.language import (
    Component,
    Equations,
    Events,
    Expr,
    Input,
    Mode,
    Parameter,
    Variable,
    der,
    param,
    signal_in,
    var,
)


class TorqueSource(OneFlange, partial=True):
    """Torque between the housing and a shaft."""

    icon = icons.TORQUE

    def torque(self) -> Expr:
        """Return the torque on the connected part."""
        raise NotImplementedError

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.flange.tau == -self.torque()

    def source_power(self) -> Expr:
        return self.torque() * der(self.phi)


class Torque(TorqueSource):
    """Torque given by a signal."""

    tau: Input = signal_in("N.m", "torque on the connected part")

    def torque(self) -> Expr:
        return self.tau


class ConstantTorque(TorqueSource):
    """Constant torque."""

    tau_constant: Parameter = param("N.m", "torque on the connected part; negative for a load")

    def torque(self) -> Expr:
        return self.tau_constant


class TorqueStep(TorqueSource):
    """Torque that jumps at a time."""

    step_torque: Parameter = param("N.m", "height of the jump")
    offset_torque: Parameter = param("N.m", "torque before the jump", default=0.0)
    start_time: Parameter = param("s", "time of the jump", default=0.0)
    stage = Mode("before", "after", description="before or after the jump")

    def torque(self) -> Expr:
        return self.offset_torque + self.stage.choose(before=0, after=self.step_torque)

    def events(self) -> Events:
        yield self.stage.initially("after", when=self.time >= self.start_time)
        yield self.stage.go("before", "after", at=self.start_time)


class SpeedSource(OneFlange, partial=True):
    """Speed between the housing and a shaft, whatever torque it takes."""

    icon = icons.SPEED
    phi: Variable = var("rad", "angle of the shaft relative to the housing", default=0)
    w: Variable = var("rad/s", "speed")

    def speed(self) -> Expr:
        """Return the prescribed speed."""
        raise NotImplementedError

    def equations(self) -> Equations:
        yield from super().equations()
        yield der(self.phi) == self.w
        yield self.w == self.speed()

    def source_power(self) -> Expr:
        return -self.flange.tau * self.w


class Speed(SpeedSource):
    """Speed given by a signal."""

    w_ref: Input = signal_in("rad/s", "speed")

    def speed(self) -> Expr:
        return self.w_ref


class ConstantSpeed(SpeedSource):
    """Constant speed, e.g. a motor on a stiff supply."""

    w_fixed: Parameter = param("rad/s", "speed")

    def speed(self) -> Expr:
        return self.w_fixed


class ForceSource(LinearOneFlange, partial=True):
    """Force between the housing and a slide."""

    icon = icons.FORCE

    def force(self) -> Expr:
        """Return the force on the connected part."""
        raise NotImplementedError

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.flange.f == -self.force()

    def source_power(self) -> Expr:
        return self.force() * der(self.s)


class Force(ForceSource):
    """Force given by a signal."""

    f: Input = signal_in("N", "force on the connected part")

    def force(self) -> Expr:
        return self.f


class ConstantForce(ForceSource):
    """Constant force."""

    f_constant: Parameter = param("N", "force on the connected part; negative for a load")

    def force(self) -> Expr:
        return self.f_constant


class TranslationalSpeed(Component):
    """Velocity of a slide given by a signal, whatever force it takes."""

    icon = icons.VELOCITY
    flange = LinearFlange("slide end")
    v_ref: Input = signal_in("m/s", "velocity")
    s: Variable = var("m", "position")

    def equations(self) -> Equations:
        yield self.flange.s == self.s
        yield der(self.s) == self.v_ref

    def source_power(self) -> Expr:
        return -self.flange.f * self.v_ref
