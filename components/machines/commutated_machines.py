"""DC machine whose torque and voltage pulsate, because its winding has few loops."""

from __future__ import annotations

from math import pi

from components.machines.dc_machines import PermanentMagnetDCMachine
from modelica_like.language import (
    Discrete,
    Events,
    Expr,
    Mode,
    Parameter,
    cos,
    discrete,
    param,
    sin,
)


class CommutatedDCMachine(PermanentMagnetDCMachine):
    """DC machine with permanent magnets and few loops, which the commutator switches one after the other.

    Torque over current and voltage over speed are the crest of a cosine, |x| ≤ pi/(2·loops), once for every half turn
    of every loop; k is their mean value. So both ripple alike, and the power balance holds at every angle (W. Böhm:
    Elektrische Antriebe).
    """

    loops: Parameter = param("1", "loops of the rotor per pair of poles", default=2.0, min=1)
    pole_pairs: Parameter = param("1", "pairs of poles", default=1.0, min=1)
    loop: Discrete = discrete("1", "loop that is connected, counted on with every commutation")
    commutator = Mode("connected", description="commutator")

    def angle(self) -> Expr:
        """Return the electrical angle of the connected loop from where its flux is largest."""
        return self.pole_pairs * self.phi - self.loop * pi / self.loops

    def flux(self) -> Expr:
        half = pi / (2 * self.loops)
        return cos(self.angle()) * half / sin(half)

    def events(self) -> Events:
        yield from super().events()
        half = pi / (2 * self.loops)
        for step, turned in ((1, self.angle() > half), (-1, self.angle() < -half)):
            reset = {self.loop: self.loop + step}
            yield self.commutator.go("connected", "connected", when=turned, reset=reset, because="commutation")
