"""Hydrodynamic torque converters and couplings."""

from __future__ import annotations

from components import icons
from components.interfaces import TwoFlanges
from components.thermal import Lossy
from modelica_like.language import (
    Equations,
    Expr,
    Parameter,
    Variable,
    absolute,
    all_of,
    column,
    der,
    interpolate,
    maximum,
    minimum,
    param,
    rows,
    var,
    where,
)

Rows = tuple[tuple[float, float], ...]


def _held(x: Expr, rows: Rows) -> Expr:
    """Interpolate in a table whose ends go on with their value."""
    xs, ys = zip(*rows, strict=True)
    return interpolate(maximum(minimum(x, xs[-1]), xs[0]), xs, ys)


class TorqueConverter(Lossy, TwoFlanges):
    """Hydrodynamic torque converter: flange_a drives the pump, the turbine flange_b, the housing holds the stator.

    The pump takes the torque C(x)·w_pump·|w_pump|, the turbine gives t(x) times as much, where x is the speed of the
    turbine over that of the pump; beyond the rows of a table its value stays. Where the turbine is the faster one, it
    drives the pump as in a coupling: t = 1, with the capacity at 1/x. No t may exceed 1/x: it would deliver energy.
    With the torque ratio 1 throughout it is a hydrodynamic coupling. VDI 2153.
    """

    icon = icons.CONVERTER
    capacity: Rows = rows(column("speed ratio", rising=True), column("capacity", scale="C_scale"))
    """Rows of speed ratio and capacity in C_scale, which should end with zero at the speed ratio 1."""
    torque_ratio: Rows = rows(
        column("speed ratio", rising=True), column("torque of the turbine over that of the pump"), default=((0.0, 1.0),)
    )
    C_scale: Parameter = param("N.m.s2/rad2", "what counts as 1 in capacity", default=1.0)
    w_still: Parameter = param("rad/s", "speed that counts as standstill", default=1e-6, min=1e-12)
    w_pump: Variable = var("rad/s", "speed of the pump relative to the housing")
    w_turbine: Variable = var("rad/s", "speed of the turbine relative to the housing")
    x: Variable = var("1", "lower speed over higher speed")

    def equations(self) -> Equations:
        yield from super().equations()
        pump, turbine = self.w_pump, self.w_turbine
        yield pump == der(self.flange_a.phi) - self.w_support
        yield turbine == der(self.flange_b.phi) - self.w_support
        overrun = all_of(absolute(turbine) > absolute(pump), pump * turbine >= 0)
        leading = where(overrun, turbine, pump)
        yield self.x == pump * turbine / maximum(leading**2, self.w_still**2)
        torque = self.C_scale * _held(self.x, self.capacity) * leading * absolute(leading)
        yield self.flange_a.tau == where(overrun, -torque, torque)
        yield self.flange_b.tau == where(overrun, torque, -_held(self.x, self.torque_ratio) * torque)

    def dissipation(self) -> Expr:
        return self.flange_a.tau * self.w_pump + self.flange_b.tau * self.w_turbine
