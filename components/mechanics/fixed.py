"""The ground."""

from __future__ import annotations

from components import icons
from components.interfaces import Flange, LinearFlange
from modelica_like.language import Component, Equations, Parameter, param


class Fixed(Component):
    """Point of the housing: a shaft end fixed at an angle."""

    icon = icons.FIXED
    flange = Flange("fixed end")
    phi0: Parameter = param("rad", "angle", default=0.0)

    def equations(self) -> Equations:
        yield self.flange.phi == self.phi0


class Disc(Component):
    """Joint that is turned by a fixed angle, e.g. two keyways that do not face each other; it has no inertia."""

    icon = icons.DISC
    flange_a = Flange("left shaft end")
    flange_b = Flange("right shaft end")
    delta_phi: Parameter = param("rad", "angle of flange_b relative to flange_a", default=0.0)

    def equations(self) -> Equations:
        yield self.flange_b.phi - self.flange_a.phi == self.delta_phi
        yield self.flange_a.tau + self.flange_b.tau == 0


class TranslationalFixed(Component):
    """Point of the housing: a slide end fixed at a position."""

    icon = icons.FIXED
    flange = LinearFlange("fixed end")
    s0: Parameter = param("m", "position", default=0.0)

    def equations(self) -> Equations:
        yield self.flange.s == self.s0
