"""Prescribed forces and motions of slides.

A positive force drives the connected part in positive direction.
"""

from __future__ import annotations

from math import pi
from typing import Literal

from components import icons
from components.interfaces import LinearFlange, LinearOneFlange
from components.mechanics.sources import AT_ONCE, ForceSource
from components.mechanics.speed_laws import inverse_law, linear_law, quadratic_law, sign_law
from modelica_like.language import (
    Component,
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


class Force2(Component):
    """Force between two slides, given by a signal: it drives flange_b in positive, flange_a in negative direction."""

    icon = icons.BETWEEN_FORCE
    flange_a = LinearFlange("slide end with the reaction")
    flange_b = LinearFlange("slide end that is driven")
    f: Input = signal_in("N", "force on flange_b")

    def equations(self) -> Equations:
        yield self.flange_a.f == self.f
        yield self.flange_b.f == -self.f

    def source_power(self) -> Expr:
        return self.f * (der(self.flange_b.s) - der(self.flange_a.s))


class ForceStep(ForceSource):
    """Force that jumps at a time."""

    step_force: Parameter = param("N", "height of the jump")
    offset_force: Parameter = param("N", "force before the jump", default=0.0)
    start_time: Parameter = param("s", "time of the jump", default=0.0)
    stage = Mode("before", "after", description="before or after the jump")

    def force(self) -> Expr:
        return self.offset_force + self.stage.choose(before=0, after=self.step_force)

    def events(self) -> Events:
        yield self.stage.initially("after", when=self.time >= self.start_time)
        yield self.stage.go("before", "after", at=self.start_time)


class SpeedDependentForce(ForceSource, partial=True):
    """Force that depends on the velocity; a negative f_nominal brakes."""

    icon = icons.LOAD
    f_nominal: Parameter = param("N", "force on the connected part at v_nominal; negative for a load")
    v_nominal: Parameter = param("m/s", "nominal velocity", min=1e-12)
    reverses: bool = True
    """The force changes its direction with the velocity, like friction."""
    v: Variable = var("m/s", "velocity of the slide relative to the housing")

    def equations(self) -> Equations:
        yield from super().equations()
        yield der(self.s) == self.v


class LinearSpeedDependentForce(SpeedDependentForce):
    """Force proportional to the velocity, e.g. viscous friction."""

    def force(self) -> Expr:
        return self.f_nominal * linear_law(self.v / self.v_nominal, self.reverses)


class QuadraticSpeedDependentForce(SpeedDependentForce):
    """Force proportional to the square of the velocity, e.g. drag."""

    def force(self) -> Expr:
        return self.f_nominal * quadratic_law(self.v / self.v_nominal, self.reverses)


class InverseSpeedDependentForce(SpeedDependentForce):
    """Force inversely proportional to the velocity, i.e. of constant power; linear below v0."""

    v0: Parameter = param("m/s", "velocity below which the force falls to zero", min=1e-12)

    def force(self) -> Expr:
        law = inverse_law(self.v / self.v_nominal, self.v0 / self.v_nominal, self.reverses)
        return self.f_nominal * law


class SignForce(ForceSource):
    """Constant force with the sign of the velocity, smoothed around standstill; see `SignTorque`."""

    icon = icons.LOAD
    f_nominal: Parameter = param("N", "force on the connected part in forward motion; negative for a load")
    v0: Parameter = param("m/s", "velocity above which the sign is ±1", default=0.1, min=1e-12)
    reg: Literal["exp", "sine", "linear", "cosine"] = "exp"
    """Between -v0 and v0: tanh(50·v/v0) (`exp`), a quarter of a sine, a straight line, or one minus a cosine."""
    v: Variable = var("m/s", "velocity of the slide relative to the housing")

    def equations(self) -> Equations:
        yield from super().equations()
        yield der(self.s) == self.v

    def force(self) -> Expr:
        return self.f_nominal * sign_law(self.v / self.v0, self.reg)


class MotionSource(LinearOneFlange, partial=True):
    """Motion of a slide relative to the housing, whatever force it takes."""

    v: Variable = var("m/s", "velocity of the slide relative to the housing")

    def equations(self) -> Equations:
        yield from super().equations()
        yield der(self.s) == self.v

    def source_power(self) -> Expr:
        return -self.flange.f * self.v


class TranslationalPosition(MotionSource):
    """Position given by a signal: exactly, or through a Bessel filter of second order; see `Position`."""

    icon = icons.POSITION
    s_ref: Input = signal_in("m", "position")
    exact: bool = True
    """Follow the signal exactly: it must then have derivatives."""
    f_crit: Parameter = param("Hz", "cut-off frequency of the filter", default=50.0, min=1e-12)

    def equations(self) -> Equations:
        yield from super().equations()
        if self.exact:
            yield self.s == self.s_ref
        else:
            w_crit = 2 * pi * self.f_crit
            yield der(self.v) == ((self.s_ref - self.s) * w_crit - 1.3617 * self.v) * w_crit / 0.6180


class TranslationalSpeed(MotionSource):
    """Velocity given by a signal: exactly, or through a filter of first order; see `Speed`."""

    icon = icons.VELOCITY
    v_ref: Input = signal_in("m/s", "velocity")
    exact: bool = True
    """Follow the signal exactly: it must then have a derivative."""
    f_crit: Parameter = param("Hz", "cut-off frequency of the filter", default=50.0, min=1e-12)
    s: Variable = var("m", "position of the slide relative to the housing", default=0)
    v: Variable = var("m/s", "velocity of the slide relative to the housing", default=0)
    stage = Mode("before", "moving", description="before or after the start")
    begin: Discrete = discrete("s", "time of the start", start=AT_ONCE)

    def equations(self) -> Equations:
        yield from super().equations()
        filtered = 2 * pi * self.f_crit * (self.v_ref - self.v)
        yield self.v == self.v_ref if self.exact else der(self.v) == filtered

    def events(self) -> Events:
        if not self.exact:
            yield self.stage.go("before", "moving", at=self.begin, reset={self.begin: self.time, self.v: self.v_ref})


class TranslationalAccelerate(MotionSource):
    """Acceleration given by a signal."""

    icon = icons.POSITION
    a_ref: Input = signal_in("m/s2", "acceleration")

    def equations(self) -> Equations:
        yield from super().equations()
        yield der(self.v) == self.a_ref


class ConstantVelocity(MotionSource):
    """Constant velocity, whatever force it takes."""

    icon = icons.VELOCITY
    s: Variable = var("m", "position of the slide relative to the housing", default=0)
    v_fixed: Parameter = param("m/s", "velocity")

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.v == self.v_fixed
