"""Loads: torques of a process on a shaft."""

from __future__ import annotations

from components import icons
from components.clutches.friction import ShaftFriction
from components.interfaces import OneFlange
from modelica_like.language import Equations, Expr, Parameter, Variable, der, maximum, param, var, where

_STANDSTILL = 1e-20


class SpeedDependentLoad(ShaftFriction, OneFlange):
    """Torque (a + b·(|w|/w_ref)^p)·sgn(w) against the rotation; the constant part also holds the shaft at standstill.

    With p = 0 that is a + b. With p = 2/3 it is a bearing after A. Palmgren, with p = 1 a viscous load, with p = 2 a
    fan or pump.
    """

    icon = icons.LOAD
    a: Parameter = param("N.m", "constant part", default=0.0, min=0)
    b: Parameter = param("N.m", "speed-dependent part at the speed w_ref", default=0.0, min=0)
    w_ref: Parameter = param("rad/s", "reference speed", default=1.0)
    p: Parameter = param("1", "exponent of the speed", default=1.0, min=0)
    w: Variable = var("rad/s", "speed of the shaft relative to the housing", state="always")
    tau: Variable = var("N.m", "load torque against forward rotation")

    @property
    def slip(self) -> Expr:
        return self.w

    @property
    def friction(self) -> Expr:
        return self.tau

    def sliding_friction(self, speed: Expr | float) -> Expr:
        # For p < 1 the slope at standstill is infinite; below a tiny speed the law is linear.
        relative = speed / self.w_ref
        near = where(self.p > 0, relative / _STANDSTILL * _STANDSTILL**self.p, 1)
        return self.a + self.b * where(relative > _STANDSTILL, maximum(relative, _STANDSTILL) ** self.p, near)

    def equations(self) -> Equations:
        yield from super().equations()
        yield der(self.phi) == self.w
        yield self.flange.tau == self.tau
