"""Rigid masses."""

from __future__ import annotations

from components import icons
from components.interfaces import Flange, LinearFlange
from modelica_like.language import Component, Equations, Expr, Parameter, Variable, der, param, sin, var


class Inertia(Component):
    """Rigid rotating mass.

    The acceleration torque J·der(w) is the sum of both cut torques.
    """

    icon = icons.INERTIA
    flange_a = Flange("left end", free=True)
    flange_b = Flange("right end", free=True)
    J: Parameter = param("kg.m2", "moment of inertia", min=0)
    phi: Variable = var("rad", "angle")
    w: Variable = var("rad/s", "speed")

    def equations(self) -> Equations:
        a, b = self.flange_a, self.flange_b
        yield a.phi == self.phi
        yield b.phi == self.phi
        yield der(self.phi) == self.w
        yield self.J * der(self.w) == a.tau + b.tau

    def stored_energy(self) -> Expr:
        return 0.5 * self.J * self.w**2


class OnSlope(Component, partial=True):
    """Mass whose weight acts where its way has a slope."""

    m: Parameter = param("kg", "mass", min=0)
    angle: Parameter = param(
        "rad", "slope of the path, 90° is upwards: m·g·sin(angle) acts against motion; no value: no weight",
        default=None, min=-1.6, max=1.6,
    )  # fmt: skip
    g: Parameter = param("m/s2", "gravity", default=9.80665)
    s: Variable = var("m", "position")
    v: Variable = var("m/s", "velocity")

    @property
    def weight(self) -> Expr | float:
        """Part of the weight against positive motion."""
        return self.m * self.g * sin(self.angle) if self.given("angle") else 0.0

    def stored_energy(self) -> Expr:
        return 0.5 * self.m * self.v**2 + self.weight * self.s


class Mass(OnSlope):
    """Rigid sliding mass.

    The acceleration force m·der(v) is the sum of both cut forces. On a slope, or hanging, its weight also acts.
    """

    icon = icons.MASS
    flange_a = LinearFlange("left end", free=True)
    flange_b = LinearFlange("right end", free=True)
    L: Parameter = param("m", "distance from left to right end; without a value both ends are at s", default=None)

    def equations(self) -> Equations:
        a, b = self.flange_a, self.flange_b
        half = 0.5 * self.L if self.given("L") else 0.0
        yield a.s == self.s - half
        yield b.s == self.s + half
        yield der(self.s) == self.v
        yield self.m * der(self.v) == a.f + b.f - self.weight
