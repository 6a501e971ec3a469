"""The ground."""

from __future__ import annotations

from components.interfaces import Flange, LinearFlange
from modelica_like.language import Component, Equations, Parameter, param


class Fixed(Component):
    """Point of the housing: a shaft end fixed at an angle."""

    flange = Flange("fixed end")
    phi0: Parameter = param("rad", "angle", default=0.0)

    def equations(self) -> Equations:
        yield self.flange.phi == self.phi0


class TranslationalFixed(Component):
    """Point of the housing: a slide end fixed at a position."""

    flange = LinearFlange("fixed end")
    s0: Parameter = param("m", "position", default=0.0)

    def equations(self) -> Equations:
        yield self.flange.s == self.s0
