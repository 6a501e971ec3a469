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
