"""Friction with bristles: sticking as a small elastic deformation, without events."""

from __future__ import annotations

from components import icons
from components.interfaces import ShaftInHousing
from components.thermal import Lossy
from modelica_like.language import Equations, Expr, Parameter, Variable, absolute, der, exp, param, var


class LuGreFriction(Lossy, ShaftInHousing):
    """Friction of a shaft in its housing after the LuGre model: the surfaces touch through elastic bristles.

    Their mean deflection z follows der(z) = w - sigma_0·|w|/g(w)·z, with the friction of steady sliding
    g(w) = tau_Coulomb + tau_Stribeck·exp(-(w/w_Stribeck)²); the torque is sigma_0·z + sigma_1·der(z) + sigma_2·w. So it
    shows presliding, a break-away that depends on the rate of the torque, and stick-slip with one smooth state.
    The damping sigma_1 decreases with exp(-(w/w_damping)²), because otherwise it would deliver energy in fast sliding.
    C. Canudas de Wit, H. Olsson, K. J. Åström, P. Lischinsky: A new model for control of systems with friction, IEEE
    Trans. Automatic Control 40 (1995).
    """

    icon = icons.BEARING
    sigma_0: Parameter = param("N.m/rad", "stiffness of the bristles", min=1e-12)
    sigma_1: Parameter = param("N.m.s/rad", "damping of the bristles at standstill", default=0.0, min=0)
    sigma_2: Parameter = param("N.m.s/rad", "viscous friction", default=0.0, min=0)
    tau_Coulomb: Parameter = param("N.m", "dry friction at high speed, without the viscous part", min=1e-12)
    tau_Stribeck: Parameter = param("N.m", "excess of friction at rest", default=0.0, min=0)
    w_Stribeck: Parameter = param("rad/s", "speed at which the excess has fallen to 1/e", default=1.0, min=1e-12)
    w_damping: Parameter = param(
        "rad/s", "speed at which sigma_1 has fallen to 1/e; without a value it is constant", default=None, min=1e-12
    )
    z: Variable = var("rad", "mean deflection of the bristles", default=0)

    def steady(self) -> Expr:
        """Return the dry friction of steady sliding."""
        return self.tau_Coulomb + self.tau_Stribeck * exp(-((self.w / self.w_Stribeck) ** 2))

    def damping(self) -> Expr:
        """Return the damping of the bristles."""
        return self.sigma_1 * (exp(-((self.w / self.w_damping) ** 2)) if self.given("w_damping") else 1.0)

    def equations(self) -> Equations:
        yield from super().equations()
        yield der(self.z) == self.w - self.sigma_0 * absolute(self.w) / self.steady() * self.z
        yield self.tau == self.sigma_0 * self.z + self.damping() * der(self.z) + self.sigma_2 * self.w

    def stored_energy(self) -> Expr:
        return 0.5 * self.sigma_0 * self.z**2

    def dissipation(self) -> Expr:
        slipping = self.sigma_0 * self.z**2 * self.sigma_0 * absolute(self.w) / self.steady()
        return slipping + self.damping() * der(self.z) * self.w + self.sigma_2 * self.w**2
