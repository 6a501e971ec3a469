"""Losses of rolling bearings, and drag of gears and plates in oil."""

from __future__ import annotations

from math import pi

from components import icons
from components.clutches.friction import ShaftFriction
from components.commands import Commanded
from components.feasible import Feasible
from components.interfaces import CompliantWithRelativeStates, ShaftInHousing
from components.thermal import Lossy
from modelica_like.language import (
    Equations,
    Events,
    Expr,
    Input,
    Parameter,
    Variable,
    absolute,
    exp,
    maximum,
    param,
    signal_in,
    sin,
    sqrt,
    var,
    where,
)

_SLOWEST = 1e-9


class DeepGrooveBearing(Feasible, ShaftFriction, ShaftInHousing):
    """Friction of a deep groove ball bearing after the SKF model, with its rolling, sliding and seal parts.

    With the speed n in 1/min, the viscosity nu in mm²/s, the mean diameter d_m in mm and loads in N, in N.mm (SKF:
    Rolling bearings, PUB BU/P1 17000, The SKF model for calculating the frictional moment): rolling
    phi_ish·phi_rs·R_1·d_m^1.96·(F_r + R_2·F_a/sin(alpha))^0.54·(nu·n)^0.6, sliding
    mu_sl·S_1·d_m^-0.145·(F_r^5 + S_2·d_m^1.5·F_a^4/sin(alpha))^(1/3), without axial load S_1·d_m^-0.26·F_r^(5/3), where
    alpha = 24.6°·(F_a/C_0)^0.24. The inlet shear factor phi_ish, the starvation factor phi_rs and the share of mixed
    friction in mu_sl fall with the speed. Default constants are those of the series 62.
    """

    icon = icons.BEARING
    d: Parameter = param("m", "bore", min=1e-12)
    D: Parameter = param("m", "outer diameter", min=1e-12)
    F_r: Parameter = param("N", "radial load", min=1e-9)
    F_a: Parameter = param("N", "axial load", default=0.0, min=0)
    C_0: Parameter = param("N", "static load rating", min=1e-9)
    nu: Parameter = param("m2/s", "kinematic viscosity of the oil at its temperature", min=1e-12)
    tau_seal: Parameter = param("N.m", "friction of the seals", default=0.0, min=0)
    R_1: Parameter = param("1", "constant of rolling friction", default=3.9e-7, min=0)
    R_2: Parameter = param("1", "constant of rolling friction under axial load", default=1.7, min=0)
    S_1: Parameter = param("1", "constant of sliding friction", default=3.23e-3, min=0)
    S_2: Parameter = param("1", "constant of sliding friction under axial load", default=36.5, min=0)
    mu_bl: Parameter = param("1", "coefficient of sliding friction without a film", default=0.15, min=0)
    mu_EHL: Parameter = param("1", "coefficient of sliding friction with a full film", default=0.05, min=0)
    K_rs: Parameter = param("1", "constant of starvation: 3e-8 in an oil bath, 6e-8 with grease", default=3e-8, min=0)
    K_Z: Parameter = param("1", "constant of the bearing type", default=3.1, min=0)
    mm: Parameter = param("m", "length that counts as 1 in the formulas", default=1e-3, min=1e-12)
    cSt: Parameter = param("m2/s", "viscosity that counts as 1", default=1e-6, min=1e-15)
    rpm: Parameter = param("rad/s", "speed that counts as 1", default=pi / 30, min=1e-12)
    N: Parameter = param("N", "force that counts as 1", default=1.0, min=1e-12)
    w: Variable = var("rad/s", "speed of the shaft relative to the housing", state="always")
    misfit = "is no bearing: its bore d is not below its outer diameter D"

    def fits(self) -> Expr:
        return self.d < self.D

    @property
    def slip(self) -> Expr:
        return self.w

    @property
    def friction(self) -> Expr:
        return self.tau

    @property
    def mean(self) -> Expr:
        """Mean diameter."""
        return 0.5 * (self.d + self.D) / self.mm

    @property
    def axial(self) -> Expr:
        """Axial load over the sine of the contact angle."""
        angle = 24.6 * pi / 180 * maximum(self.F_a / self.C_0, _SLOWEST) ** 0.24
        return self.F_a / self.N / sin(angle)

    def rolling(self, n: Expr, nu: Expr) -> Expr:
        """Return the rolling friction at a speed and a viscosity."""
        heating = 1 / (1 + 1.84e-9 * (n * self.mean) ** 1.28 * nu**0.64)
        width = (self.d + self.D) / self.mm * sqrt(0.5 * self.K_Z * self.mm / (self.D - self.d))
        load = (self.F_r / self.N + self.R_2 * self.axial) ** 0.54
        return heating * exp(-self.K_rs * nu * n * width) * self.R_1 * self.mean**1.96 * load * (nu * n) ** 0.6

    def gliding(self, n: Expr, nu: Expr) -> Expr:
        """Return the sliding friction at a speed and a viscosity."""
        radial, axial = self.F_r / self.N, self.axial * (self.F_a / self.N) ** 3
        mixed = exp(-2.6e-8 * (nu * n) ** 1.4 * self.mean)
        with_axial = self.mean**-0.145 * (radial**5 + self.S_2 * self.mean**1.5 * axial) ** (1 / 3)
        without = self.mean**-0.26 * radial ** (5 / 3)
        share = mixed * self.mu_bl + (1 - mixed) * self.mu_EHL
        return share * self.S_1 * where(self.F_a > 0, with_axial, without)

    def sliding_friction(self, speed: Expr | float) -> Expr:
        n, nu = maximum(speed / self.rpm, _SLOWEST), self.nu / self.cSt
        return (self.rolling(n, nu) + self.gliding(n, nu)) * self.N * self.mm + self.tau_seal


class ChurningGear(Lossy, ShaftInHousing):
    """Drag of a gear that dips into oil: torque rho·w²·R³·S/2 times C_0·Fr^-p_Fr·Re^-p_Re, against the rotation.

    S is the wetted surface R²·(2·theta - sin(2·theta)) + 2·R·b·theta of a disc that dips to the depth h, with
    cos(theta) = 1 - h/R, the Froude number is w²·R/g, the Reynolds number w·R·b/nu (R. J. Boness: Churning losses of
    discs and gears running partially submerged in oil, ASME 1989). The coefficient and its exponents are measured, or
    come from a published correlation.
    """

    icon = icons.CHURNING
    R: Parameter = param("m", "pitch radius", min=1e-12)
    b: Parameter = param("m", "face width", min=1e-12)
    theta: Parameter = param("rad", "half the angle of the arc in the oil", min=0, max=pi)
    rho: Parameter = param("kg/m3", "density of the oil", default=870.0, min=0)
    nu: Parameter = param("m2/s", "kinematic viscosity of the oil", min=1e-12)
    g: Parameter = param("m/s2", "gravity", default=9.80665, min=1e-12)
    C_0: Parameter = param("1", "coefficient at Froude and Reynolds number 1", min=0)
    p_Fr: Parameter = param("1", "fall of the coefficient with the Froude number", default=0.0)
    p_Re: Parameter = param("1", "fall of the coefficient with the Reynolds number", default=0.0)
    w_slow: Parameter = param("rad/s", "speed below which the torque is linear", default=1e-3, min=1e-12)

    def equations(self) -> Equations:
        yield from super().equations()
        S = self.R**2 * (2 * self.theta - sin(2 * self.theta)) + 2 * self.R * self.b * self.theta
        fast = maximum(absolute(self.w), self.w_slow)
        froude, reynolds = fast**2 * self.R / self.g, fast * self.R * self.b / self.nu
        coefficient = self.C_0 * froude**-self.p_Fr * reynolds**-self.p_Re
        yield self.tau == 0.5 * self.rho * self.R**3 * S * coefficient * fast * self.w

    def dissipation(self) -> Expr:
        return self.tau * self.w


class OpenPlates(Feasible, Commanded, Lossy, CompliantWithRelativeStates):
    """Drag of an open wet clutch or brake: oil is sheared in n gaps, beside the `Clutch` that closes them.

    The torque is n·pi·eta·(r_o^4 - r_i^4)/(2·h)·fill times the slip, for laminar flow; oil that is thrown out at speed
    counts as a fill below 1.
    """

    icon = icons.OPEN_PLATES
    fill: Input = signal_in("1", "part of the gaps that is full of oil, 0 to 1; less is none", default=1.0)
    n: Parameter = param("1", "number of gaps", default=1.0, min=0)
    r_o: Parameter = param("m", "outer radius of the plates", min=1e-12)
    r_i: Parameter = param("m", "inner radius of the plates", default=0.0, min=0)
    h: Parameter = param("m", "width of a gap", min=1e-12)
    eta: Parameter = param("Pa.s", "dynamic viscosity of the oil at its temperature", min=0)
    # No torque depends on the angle of open plates.
    phi_rel: Variable = var("rad", "relative angle, flange_b.phi - flange_a.phi", state="prefer", default=0)
    misfit = "has no plates: their inner radius r_i is not below their outer radius r_o"

    def fits(self) -> Expr:
        return self.r_i < self.r_o

    def equations(self) -> Equations:
        yield from super().equations()
        drag = self.n * pi * self.eta * (self.r_o**4 - self.r_i**4) / (2 * self.h)
        yield self.tau == drag * maximum(self.fill, 0) * self.w_rel

    def events(self) -> Events:
        yield from super().events()
        yield from self.above_one("fill")

    def dissipation(self) -> Expr:
        return self.tau * self.w_rel
