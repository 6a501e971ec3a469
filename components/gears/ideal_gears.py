"""Gears with parallel shafts."""

from __future__ import annotations

from components import icons
from components.interfaces import TwoFlanges
from modelica_like.language import Equations, Parameter, param


class IdealGear(TwoFlanges):
    """Gear without inertia, loss, elasticity and backlash.

    All angles are relative to the housing, which carries the difference of the torques.
    """

    icon = icons.GEAR
    ratio: Parameter = param("1", "transmission ratio, speed of flange_a over speed of flange_b")

    def equations(self) -> Equations:
        yield from super().equations()
        a, b = self.flange_a, self.flange_b
        yield a.phi - self.phi_support == self.ratio * (b.phi - self.phi_support)
        yield self.ratio * a.tau + b.tau == 0
