"""Hydrodynamic torque converters and couplings."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

from components import icons
from components.interfaces import TwoFlanges
from components.tabulated import Tabulated
from components.thermal import Lossy
from modelica_like.language import (
    Equations,
    Events,
    Expr,
    LanguageError,
    Parameter,
    Variable,
    absolute,
    column,
    der,
    maximum,
    minimum,
    param,
    rows,
    var,
    where,
)

Rows = tuple[tuple[float, float], ...]
_ROUNDING = 1e-9


class TorqueConverter(Tabulated, Lossy, TwoFlanges):
    """Hydrodynamic torque converter: flange_a drives the pump, the turbine flange_b, the housing holds the stator.

    The pump takes the torque C(x)·w_pump·|w_pump|, the turbine gives t(x) times as much, where x is the speed of the
    turbine over that of the pump. If the turbine is faster, it drives the pump as in a coupling: t = 1, with the
    capacity at 1/x. If they turn against each other, t is linear up to its value at x = -1, so that no torque jumps.
    The rest of the power is lost in the fluid, so t must not exceed 1/x, or it would deliver energy. With
    the torque ratio 1 throughout it is a hydrodynamic coupling. VDI 2153.
    """

    icon = icons.CONVERTER
    capacity: Rows = rows(column("speed ratio", rising=True), column("capacity", scale="C_scale", min=0))
    """Rows of speed ratio and capacity in C_scale, which should end with zero at the speed ratio 1."""
    torque_ratio: Rows = rows(
        column("speed ratio", rising=True), column("torque of the turbine over that of the pump", min=0),
        default=((0.0, 1.0),),
    )  # fmt: skip
    C_scale: Parameter = param("N.m.s2/rad2", "scale of `capacity`", default=1.0)
    w_still: Parameter = param("rad/s", "speed that counts as standstill", default=1e-6, min=1e-12)
    w_pump: Variable = var("rad/s", "speed of the pump relative to the housing")
    w_turbine: Variable = var("rad/s", "speed of the turbine relative to the housing")
    x: Variable = var("1", "lower speed over higher speed")
    tau_leading: Variable = var("N.m", "torque that the faster one gives to the fluid")

    @property
    def overrun(self) -> Expr:
        """Condition: the turbine is faster."""
        return absolute(self.w_turbine) > absolute(self.w_pump)

    @property
    def leading(self) -> Expr:
        """Speed of the faster one."""
        return where(self.overrun, self.w_turbine, self.w_pump, events=False)

    @property
    def gain(self) -> Expr:
        """Torque of the turbine over that of the pump."""
        against = 1 - minimum(self.x, 0) * (self.look_up(-1.0, self.torque_ratio) - 1)
        return where(self.overrun, against, self.look_up(self.x, self.torque_ratio), events=False)

    def equations(self) -> Equations:
        self._check()
        yield from super().equations()
        pump, turbine, leading = self.w_pump, self.w_turbine, self.leading
        yield pump == der(self.flange_a.phi) - self.w_support
        yield turbine == der(self.flange_b.phi) - self.w_support
        yield self.x == pump * turbine / maximum(leading**2, self.w_still**2)
        capacity = self.C_scale * self.look_up(self.x, self.capacity)
        yield self.tau_leading == capacity * leading * absolute(leading)
        passed = where(self.overrun, -self.tau_leading, self.tau_leading, events=False)
        yield self.flange_a.tau == passed
        yield self.flange_b.tau == -self.gain * passed

    def events(self) -> Events:
        for name, table in (("capacity", self.capacity), ("torque_ratio", self.torque_ratio)):
            yield from self.leaving(name, where(self.overrun, table[0][0], self.x), table, least=-1.0)

    def _check(self) -> None:
        """Check that no torque ratio exceeds 1/x, also at the maximum of t·x between two rows."""
        if not all(isinstance(cell, float | int) for row in self.torque_ratio for cell in row):
            return  # symbols for rows already checked as numbers
        end: Any = self.look_up(1.0, self.torque_ratio)
        table = {x: t for x, t in self.torque_ratio if x < 1} | {1.0: float(end)}
        for (x, t), (x_next, t_next) in pairwise(sorted(table.items())):
            top = 0.5 * (x + t * (x_next - x) / (t - t_next)) if t != t_next else x
            if x < top < x_next:
                table[top] = t + (t_next - t) * (top - x) / (x_next - x)
        worst = max(table, key=lambda x: table[x] * x)
        if table[worst] * worst > 1 + _ROUNDING:
            raise LanguageError(
                f"{self.label}: with the torque ratio {table[worst]:g} at the speed ratio {worst:.4g} the turbine "
                "gives more power than the pump takes.",
                advice=f"Let torque_ratio fall to {1 / worst:.4g} or less there, and to 1 at the speed ratio 1.",
            )

    def dissipation(self) -> Expr:
        """Return torque times slip: the share of the faster side's power that is not transmitted."""
        useful = where(self.overrun, self.x, self.gain * self.x)
        taken = where(self.overrun, self.gain, 1.0)
        return self.tau_leading * self.leading * (taken - useful)
