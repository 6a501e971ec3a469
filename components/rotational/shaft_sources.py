"""Torques that depend on the speed, and prescribed motions of shafts.

A positive torque drives the connected part in positive direction.
"""

from __future__ import annotations

from math import pi
from typing import Literal

from components import icons
from components.interfaces import Flange, OneFlange
from components.mechanics.sources import TorqueSource
from components.mechanics.speed_laws import inverse_law, linear_law, quadratic_law, sign_law
from modelica_like.language import Component, Equations, Expr, Input, Parameter, Variable, der, param, signal_in, var


class Torque2(Component):
    """Torque between two shafts, given by a signal: it drives flange_b in positive, flange_a in negative direction."""

    icon = icons.BETWEEN_TORQUE
    flange_a = Flange("shaft end with the reaction")
    flange_b = Flange("shaft end that is driven")
    tau: Input = signal_in("N.m", "torque on flange_b")

    def equations(self) -> Equations:
        yield self.flange_a.tau == self.tau
        yield self.flange_b.tau == -self.tau

    def source_power(self) -> Expr:
        return self.tau * (der(self.flange_b.phi) - der(self.flange_a.phi))


class SpeedDependentTorque(TorqueSource, partial=True):
    """Torque that depends on the speed; a negative tau_nominal brakes."""

    icon = icons.LOAD
    tau_nominal: Parameter = param("N.m", "torque on the connected part at w_nominal; negative for a load")
    w_nominal: Parameter = param("rad/s", "nominal speed", min=1e-12)
    reverses: bool = True
    """The torque changes its direction with the speed, like friction."""
    w: Variable = var("rad/s", "speed of the shaft relative to the housing")

    def equations(self) -> Equations:
        yield from super().equations()
        yield der(self.phi) == self.w


class LinearSpeedDependentTorque(SpeedDependentTorque):
    """Torque proportional to the speed, e.g. viscous friction."""

    def torque(self) -> Expr:
        return self.tau_nominal * linear_law(self.w / self.w_nominal, self.reverses)


class QuadraticSpeedDependentTorque(SpeedDependentTorque):
    """Torque proportional to the square of the speed, e.g. a fan or a pump."""

    def torque(self) -> Expr:
        return self.tau_nominal * quadratic_law(self.w / self.w_nominal, self.reverses)


class InverseSpeedDependentTorque(SpeedDependentTorque):
    """Torque inversely proportional to the speed, i.e. of constant power, e.g. a winder; linear below w0."""

    w0: Parameter = param("rad/s", "speed below which the torque falls to zero", min=1e-12)

    def torque(self) -> Expr:
        law = inverse_law(self.w / self.w_nominal, self.w0 / self.w_nominal, self.reverses)
        return self.tau_nominal * law


class SignTorque(TorqueSource):
    """Constant torque with the sign of the speed, smoothed around standstill.

    Modelica Standard Library, Rotational.SignTorque.
    """

    icon = icons.LOAD
    tau_nominal: Parameter = param("N.m", "torque on the connected part in forward rotation; negative for a load")
    w0: Parameter = param("rad/s", "speed above which the sign is ±1", default=0.1, min=1e-12)
    reg: Literal["exp", "sine", "linear", "cosine"] = "exp"
    """Between -w0 and w0: tanh(50·w/w0) (`exp`), a quarter of a sine, a straight line, or one minus a cosine."""
    w: Variable = var("rad/s", "speed of the shaft relative to the housing")

    def equations(self) -> Equations:
        yield from super().equations()
        yield der(self.phi) == self.w

    def torque(self) -> Expr:
        return self.tau_nominal * sign_law(self.w / self.w0, self.reg)


class ShaftMotionSource(OneFlange, partial=True):
    """Motion of a shaft relative to the housing, whatever torque it takes."""

    w: Variable = var("rad/s", "speed of the shaft relative to the housing")

    def equations(self) -> Equations:
        yield from super().equations()
        yield der(self.phi) == self.w

    def source_power(self) -> Expr:
        return -self.flange.tau * self.w


class Position(ShaftMotionSource):
    """Angle given by a signal: exactly, or through a Bessel filter of second order.

    The filter makes speed and acceleration of any signal finite. In the Modelica Standard Library, Rotational.Position,
    `exact` is false by default.
    """

    icon = icons.ANGLE
    phi_ref: Input = signal_in("rad", "angle")
    exact: bool = True
    """Follow the signal exactly: it must then have derivatives."""
    f_crit: Parameter = param("Hz", "cut-off frequency of the filter", default=50.0, min=1e-12)

    def equations(self) -> Equations:
        yield from super().equations()
        if self.exact:
            yield self.phi == self.phi_ref
        else:
            w_crit = 2 * pi * self.f_crit
            yield der(self.w) == ((self.phi_ref - self.phi) * w_crit - 1.3617 * self.w) * w_crit / 0.6180


class Accelerate(ShaftMotionSource):
    """Angular acceleration given by a signal."""

    icon = icons.ANGLE
    a_ref: Input = signal_in("rad/s2", "angular acceleration")

    def equations(self) -> Equations:
        yield from super().equations()
        yield der(self.w) == self.a_ref
