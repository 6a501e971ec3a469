"""Prescribed torques, speeds and forces.

A positive torque or force drives the connected part in positive direction.
"""

from __future__ import annotations

from math import pi

from components import icons
from components.interfaces import LinearOneFlange, OneFlange
from modelica_like.language import (
    Discrete,
    Equations,
    Events,
    Expr,
    Input,
    Mode,
    Parameter,
    Variable,
    der,
    discrete,
    param,
    signal_in,
    var,
)

AT_ONCE = -1e30
"""A time before every start: an event at it happens at the start."""


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
    w: Variable = var("rad/s", "speed of the shaft relative to the housing")

    def speed(self) -> Expr:
        """Return the prescribed speed."""
        raise NotImplementedError

    def follows(self) -> Equations:
        """Yield the equations that make the shaft turn with this speed."""
        yield self.w == self.speed()

    def equations(self) -> Equations:
        yield from super().equations()
        yield der(self.phi) == self.w
        yield from self.follows()

    def source_power(self) -> Expr:
        return -self.flange.tau * self.w


class Speed(SpeedSource):
    """Speed given by a signal: exactly, or through a filter of first order, which starts with the signal.

    The filter makes the acceleration finite where the signal jumps. In the Modelica Standard Library, Rotational.Speed,
    `exact` is false by default.
    """

    w_ref: Input = signal_in("rad/s", "speed")
    exact: bool = True
    """Follow the signal exactly: it must then have a derivative."""
    f_crit: Parameter = param("Hz", "cut-off frequency of the filter", default=50.0, min=1e-12)
    w: Variable = var("rad/s", "speed of the shaft relative to the housing", default=0)
    stage = Mode("before", "moving", description="before or after the start")
    begin: Discrete = discrete("s", "time of the start", start=AT_ONCE)

    def speed(self) -> Expr:
        return self.w_ref

    def follows(self) -> Equations:
        filtered = 2 * pi * self.f_crit * (self.w_ref - self.w)
        yield self.w == self.w_ref if self.exact else der(self.w) == filtered

    def events(self) -> Events:
        if not self.exact:
            yield self.stage.go("before", "moving", at=self.begin, reset={self.begin: self.time, self.w: self.w_ref})


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
