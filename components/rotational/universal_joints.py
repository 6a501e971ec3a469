"""Joints between shafts that meet at an angle."""

from __future__ import annotations

from components import icons
from components.interfaces import TwoFlanges
from modelica_like.language import Equations, Expr, Parameter, atan2, cos, param, sin


class UniversalJoint(TwoFlanges):
    """Universal joint (Cardan, Hooke): tan(phi_b) = tan(phi_a)/cos(beta).

    At a constant speed of flange_a, the speed of flange_b fluctuates twice per turn between cos(beta) and 1/cos(beta)
    times that speed. It is largest at phi_a = 0, where the fork of flange_a is in the plane of both shafts. A second
    joint of the same angle, with flange_a and flange_b exchanged, cancels the fluctuation: the forks of the shaft
    between them are in one plane. The housing carries the difference of the torques. Without inertia and friction.
    VDI 2722.
    """

    icon = icons.JOINT
    beta: Parameter = param("rad", "angle between the shafts", min=0, max=1.5)

    def lead(self, phi: Expr) -> Expr:
        """Return the lead of flange_b over flange_a."""
        bent = cos(self.beta)
        return atan2((1 - bent) * sin(phi) * cos(phi), bent * cos(phi) ** 2 + sin(phi) ** 2)

    def speed_ratio(self, phi: Expr) -> Expr:
        """Return the speed of flange_b over that of flange_a."""
        bent = cos(self.beta)
        return bent / (bent**2 * cos(phi) ** 2 + sin(phi) ** 2)

    def equations(self) -> Equations:
        yield from super().equations()
        a, b = self.flange_a, self.flange_b
        phi = a.phi - self.phi_support
        yield b.phi - self.phi_support == phi + self.lead(phi)
        yield a.tau + self.speed_ratio(phi) * b.tau == 0
