"""Friction clutches with temperature of the plates, fading friction and wear (VDI 2241)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from components import icons
from components.clutches.friction import Brake, Clutch, PressedFriction, Rows
from components.interfaces import Flange
from modelica_like.language import (
    Equations,
    Events,
    Expr,
    Output,
    Parameter,
    Variable,
    absolute,
    column,
    der,
    maximum,
    param,
    rows,
    signal_out,
    var,
)

_NONE = ((0.0, 1.0),)
_STILL = 1e-9
"""Part of w_G below which there is no wind."""


class HotFriction(PressedFriction, partial=True):
    """Friction surfaces whose plates store the friction work as heat and release it to the air or the heat port.

    C·der(T) = P - G·(T - T_air); with w_G given, G grows by (w/w_G)^0.8, as the convection of a turbulent flow does.
    The coefficient of friction is multiplied by mu_T over the temperature (fading) and by mu_p over the surface
    pressure p_max·f_normalized. Wear is in proportion to the friction work: its depth is wear_rate·W/A (VDI 2241:
    Schaltbare fremdbetätigte Reibkupplungen und -bremsen). The heat in the plates counts as lost unless a heat port is
    connected. The design check `clutch_heat` gives the limits per engagement and per hour.
    """

    if TYPE_CHECKING:
        flange_a: Flange
    C: Parameter = param("J/K", "heat capacity of the plates", min=1e-12)
    G: Parameter = param("W/K", "conductance to the air, or to what is at the heat port", default=0.0, min=0)
    w_G: Parameter = param(
        "rad/s", "speed of flange_a that doubles G by its wind; without a value there is none", default=None, min=1e-12
    )
    T_air: Parameter = param("K", "temperature of the air without a heat port", default=293.15, min=0)
    mu_T: Rows = rows(
        column("temperature", scale="T_scale", rising=True),
        column("factor of the coefficient of friction", min=0),
        default=_NONE,
    )
    p_max: Parameter = param("Pa", "surface pressure at f_normalized = 1", default=1e6, min=1e-12)
    mu_p: Rows = rows(
        column("surface pressure", scale="p_scale", rising=True), column("factor of the coefficient", min=0),
        default=_NONE,
    )  # fmt: skip
    T_scale: Parameter = param("K", "temperature that counts as 1 in mu_T", default=1.0)
    p_scale: Parameter = param("Pa", "pressure that counts as 1 in mu_p", default=1.0)
    A: Parameter = param("m2", "area of all friction surfaces", default=1.0, min=1e-12)
    wear_rate: Parameter = param("m3/J", "volume that wears off per friction work", default=0.0, min=0)
    T: Variable = var("K", "temperature of the plates", state="avoid", nominal=300.0, default="T_air", guess=293.15)
    rise: Variable = var("K", "temperature above T_air", state="prefer", nominal=10.0, difference=True)
    W: Variable = var("J", "friction work since the start", nominal=1000.0, default=0)
    wear: Output = signal_out("m", "depth that has worn off all surfaces together")

    @property
    def pressure(self) -> Expr:
        """Surface pressure as mu_p counts it."""
        return self.p_max * self.f_normalized / self.p_scale

    @property
    def fade(self) -> Expr | float:
        """Factor of the coefficient of friction."""
        return self.look_up(self.T / self.T_scale, self.mu_T) * self.look_up(self.pressure, self.mu_p)

    @property
    def cooling(self) -> Expr:
        """Heat flow from the plates."""
        wind = 1.0
        if self.given("w_G"):
            wind = 1 + maximum(absolute(der(self.flange_a.phi)) / self.w_G, _STILL) ** 0.8
        return self.G * wind * (self.T - (self.heat_port.T if self.heat_port.used else self.T_air))

    def sliding_friction(self, speed: Expr | float) -> Expr:
        return (super().sliding_friction(speed) - self.tau_drag) * self.fade + self.tau_drag

    def heat(self) -> Expr:
        return self.cooling

    def equations(self) -> Equations:
        yield from super().equations()
        # The rise is the state: it is integrated more precisely than the temperature, which is large.
        yield self.T_air + self.rise == self.T
        yield self.C * der(self.rise) == self.dissipation() - self.cooling
        yield der(self.W) == self.dissipation()
        yield self.wear == self.wear_rate * self.W / self.A

    def measured(self) -> Events:
        yield from super().measured()
        yield from self.leaving("mu_T", self.T / self.T_scale, self.mu_T)
        yield from self.leaving("mu_p", self.pressure, self.mu_p)

    def stored_energy(self) -> Expr | float:
        return self.C * (self.T - self.T_air) if self.heat_port.used else 0.0


class ThermalClutch(HotFriction, Clutch):
    """Friction clutch with the temperature of its plates, fading and wear."""

    icon = icons.THERMAL_CLUTCH


class ThermalBrake(HotFriction, Brake):
    """Friction brake with the temperature of its disc, fading and wear."""
