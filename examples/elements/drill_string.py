"""A long shaft as a delay: torsional waves run through it without losses."""

from components import Flange
from modelica_like.language import (
    Component,
    Equations,
    Expr,
    Parameter,
    Variable,
    delay,
    der,
    param,
    var,
)


class WaveShaft(Component):
    """Uniform shaft whose torsional waves need the time `T` from end to end (J. d'Alembert's solution).

    What leaves an end, τ + Z·ω, arrives at the other one as Z·ω − τ. The impedance is Z = J_p·√(G·ρ).
    """

    T: Parameter = param("s", "time of a wave from end to end", min=1e-9)
    Z: Parameter = param("N.m.s/rad", "impedance", min=1e-12)
    flange_a, flange_b = Flange(), Flange()
    phi_rel: Variable = var("rad", "twist")
    w_a: Variable = var("rad/s", "speed of the end at flange_a")
    w_b: Variable = var("rad/s", "speed of the end at flange_b")
    E: Variable = var("J", "energy of the waves", default=0)

    def equations(self) -> Equations:
        yield self.phi_rel == self.flange_b.phi - self.flange_a.phi
        yield der(self.flange_a.phi) == self.w_a
        yield der(self.flange_b.phi) == self.w_b
        from_a = self.flange_a.tau + self.Z * self.w_a
        from_b = self.flange_b.tau + self.Z * self.w_b
        to_a, to_b = delay(from_b, self.T), delay(from_a, self.T)
        yield self.Z * self.w_a - self.flange_a.tau == to_a
        yield self.Z * self.w_b - self.flange_b.tau == to_b
        yield 4 * self.Z * der(self.E) == from_a**2 - to_b**2 + from_b**2 - to_a**2

    def stored_energy(self) -> Expr:
        return self.E
