"""Shafts with distributed elasticity, and friction of lubricated bearings."""

from __future__ import annotations

from components import icons
from components.clutches.friction import ShaftFriction
from components.interfaces import Flange, ShaftInHousing
from components.mechanics.inertias import Inertia
from components.mechanics.springs import SpringDamper
from modelica_like.language import (
    Component,
    Equations,
    Expr,
    LanguageError,
    Parameter,
    Variable,
    connect,
    exp,
    param,
    series,
    var,
)


class FlexibleShaft(Component):
    """Shaft of n equal pieces: each a torsion spring with damping between two halves of its inertia.

    More pieces approximate the natural frequencies of the continuous shaft better: the k-th of a free shaft,
    k·pi·sqrt(c/J), to (k·pi/n)²/24.
    """

    icon = icons.LONG_SHAFT
    flange_a = Flange("left end")
    flange_b = Flange("right end")
    n: int = 5
    """Number of pieces."""
    J: Parameter = param("kg.m2", "moment of inertia of the whole shaft", min=0)
    c: Parameter = param("N.m/rad", "torsional stiffness of the whole shaft", min=0)
    d: Parameter = param("N.m.s/rad", "damping coefficient of the whole shaft", default=0.0, min=0)

    def build(self) -> None:
        if self.n < 1:
            raise LanguageError(f"A flexible shaft has at least one piece, not {self.n}.")
        ends = (0, self.n)
        self.masses = [Inertia(J=f"J / {2 * self.n if k in ends else self.n}") for k in range(self.n + 1)]
        self.springs = [SpringDamper(c=f"{self.n} * c", d=f"{self.n} * d") for _ in range(self.n)]

    def equations(self) -> Equations:
        masses, springs = self.masses, self.springs
        chain = [part for pair in zip(masses, springs, strict=False) for part in pair]
        yield connect(self.flange_a, masses[0].flange_a)
        yield from series(*chain, masses[-1])
        yield connect(self.flange_b, masses[-1].flange_b)


class StribeckBearing(ShaftFriction, ShaftInHousing):
    """Friction of a lubricated plain bearing after R. Stribeck: d·w + tau_Coulomb + tau_Stribeck·exp(-w/w_Stribeck).

    R. Stribeck: Die wesentlichen Eigenschaften der Gleit- und Rollenlager, Z. VDI 46 (1902).
    """

    icon = icons.BEARING
    w: Variable = var("rad/s", "speed of the shaft relative to the housing", state="always")
    d: Parameter = param("N.m.s/rad", "viscous friction", default=0.0, min=0)
    tau_Coulomb: Parameter = param("N.m", "dry friction at high speed, without the viscous part", min=0)
    tau_Stribeck: Parameter = param("N.m", "excess of friction at rest", default=0.0, min=0)
    w_Stribeck: Parameter = param("rad/s", "speed at which the excess has fallen to 1/e", default=1.0, min=1e-12)

    @property
    def slip(self) -> Expr:
        return self.w

    @property
    def friction(self) -> Expr:
        return self.tau

    def sliding_friction(self, speed: Expr | float) -> Expr:
        return self.d * speed + self.tau_Coulomb + self.tau_Stribeck * exp(-speed / self.w_Stribeck)
