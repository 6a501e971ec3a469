"""Planetary gear sets."""

from __future__ import annotations

from components.interfaces import Flange
from modelica_like.language import Component, Equations, Parameter, param


class IdealPlanetary(Component):
    """Planetary gear set of sun, ring and carrier without inertia and loss.

    Seen from the carrier, sun and ring turn as in a gear with the fixed-carrier ratio -ratio (R. Willis, Principles of
    Mechanism, 1841). With equal torque arms it is a differential.
    """

    sun = Flange("sun gear shaft")
    carrier = Flange("planet carrier shaft")
    ring = Flange("ring gear shaft")
    inlet, outlet = "sun", "carrier"
    ratio: Parameter = param("1", "number of ring teeth over number of sun teeth")

    def equations(self) -> Equations:
        sun, carrier, ring = self.sun, self.carrier, self.ring
        yield (1 + self.ratio) * carrier.phi == sun.phi + self.ratio * ring.phi
        yield ring.tau == self.ratio * sun.tau
        yield carrier.tau == -(1 + self.ratio) * sun.tau


class Differential(Component):
    """Bevel gear differential: both wheels get half the torque, the cage turns with the mean of their speeds.

    An `IdealPlanetary` with equal torque arms, behind the final drive of the given ratio.
    """

    flange = Flange("drive shaft")
    left = Flange("left wheel shaft")
    right = Flange("right wheel shaft")
    inlet, outlet = "flange", "left"
    ratio: Parameter = param("1", "speed of the drive shaft over speed of the cage", default=1.0)

    def equations(self) -> Equations:
        drive, left, right = self.flange, self.left, self.right
        yield 2 * drive.phi == self.ratio * (left.phi + right.phi)
        yield left.tau == right.tau
        yield 2 * left.tau == -self.ratio * drive.tau
