"""Clutches that act by speed: centrifugal clutches, viscous clutches."""

from __future__ import annotations

from components import icons
from components.clutches.one_way import SlippingCoupling
from components.commands import Commanded
from components.interfaces import CompliantWithRelativeStates
from components.thermal import Lossy
from modelica_like.language import Equations, Events, Expr, Input, Parameter, der, exp, maximum, param, signal_in


class CentrifugalClutch(SlippingCoupling):
    """Centrifugal clutch: shoes on flange_a press on a drum above the speed at which they overcome their springs.

    n shoes of the mass m, whose centre of gravity turns on the radius r_m, give the sliding torque
    n·mu·R·(m·r_m·w² - f_spring).
    """

    icon = icons.CENTRIFUGAL
    n: Parameter = param("1", "number of shoes", default=2.0, min=0)
    m: Parameter = param("kg", "mass of a shoe", min=0)
    r_m: Parameter = param("m", "radius of the centre of gravity of a shoe", min=0)
    R: Parameter = param("m", "radius of the drum", min=0)
    mu: Parameter = param("1", "coefficient of friction", default=0.3, min=0)
    f_spring: Parameter = param("N", "force that holds a shoe back", default=0.0, min=0)
    faint: Parameter = param("N.m", "sliding torque below which the shoes count as free", default=1e-9, min=0)

    def pressed(self) -> Expr:
        # Without springs the torque leaves zero with the square of the speed: when that happens no solver can tell.
        return self.static_friction() > self.faint

    def sliding_friction(self, speed: Expr | float) -> Expr:
        press = self.m * self.r_m * der(self.flange_a.phi) ** 2 - self.f_spring
        return self.n * self.mu * self.R * maximum(press, 0)


class ViscousClutch(Commanded, Lossy, CompliantWithRelativeStates):
    """Viscous clutch: plates in silicone oil, whose viscosity falls with shear and heat.

    The torque is tau_nominal·fill·(|w|/w_nominal)^p against the slip w, with p below 1 for oil that is thinned by
    shear, and falls by exp(-beta·(T - T_nominal)) with the temperature. Below w_smooth it is linear.
    """

    icon = icons.VISCOUS
    fill: Input = signal_in("1", "filling of the working space, 0 to 1; less is none", default=1.0)
    tau_nominal: Parameter = param("N.m", "torque at w_nominal and T_nominal", min=0)
    w_nominal: Parameter = param("rad/s", "slip to which tau_nominal belongs", min=1e-12)
    p: Parameter = param("1", "exponent of the slip", default=1.0, min=0)
    w_smooth: Parameter = param("rad/s", "slip below which the torque is about linear", default=0.1, min=1e-12)
    beta: Parameter = param("1/K", "fall of the viscosity with the temperature", default=0.0, min=0)
    T_nominal: Parameter = param("K", "temperature to which tau_nominal belongs", default=293.15, min=0)
    T: Parameter = param("K", "temperature of the oil without a heat port", default="T_nominal", min=0)

    def equations(self) -> Equations:
        yield from super().equations()
        T = self.heat_port.T if self.heat_port.used else self.T
        w, scale = self.w_rel / self.w_nominal, self.w_smooth / self.w_nominal
        law = w * (w**2 + scale**2) ** (0.5 * (self.p - 1))
        yield self.tau == self.tau_nominal * maximum(self.fill, 0) * exp(-self.beta * (T - self.T_nominal)) * law

    def events(self) -> Events:
        yield from super().events()
        yield from self.above_one("fill")

    def dissipation(self) -> Expr:
        return self.tau * self.w_rel
