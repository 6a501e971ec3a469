"""What machines with a rotor in a housing have in common."""

from __future__ import annotations

from components.interfaces import Flange, Supported
from modelica_like.language import Equations, Expr, Parameter, Variable, der, param, var


class Rotor(Supported, partial=True):
    """Rotor in a housing, which feels a torque from it; a subclass says which moment of inertia it has."""

    flange = Flange("shaft end")
    outlet = "flange"
    phi: Variable = var("rad", "angle of the rotor relative to the housing")
    w: Variable = var("rad/s", "speed of the rotor relative to the housing")
    w_rotor: Variable = var("rad/s", "speed of the rotor")

    def turning(self, J: Expr, torque: Expr) -> Equations:
        """Yield the equations of motion.

        Args:
            J: moment of inertia.
            torque: of the housing on the rotor.
        """
        yield self.phi == self.flange.phi - self.phi_support
        yield der(self.phi) == self.w
        yield self.w_rotor == der(self.flange.phi)
        yield J * der(self.w_rotor) == torque + self.flange.tau
        yield from self.support_torque(-torque)


class Machine(Rotor, partial=True):
    """Electrical machine with p pairs of poles."""

    p: Parameter = param("1", "pairs of poles", default=2.0, min=1)
    Jr: Parameter = param("kg.m2", "moment of inertia of the rotor", min=0)
    tau: Variable = var("N.m", "torque of the air gap on the rotor")

    def equations(self) -> Equations:
        yield from super().equations()
        yield from self.turning(self.Jr, self.tau)

    def kinetic_energy(self) -> Expr:
        """Return the kinetic energy of the rotor."""
        return 0.5 * self.Jr * self.w_rotor**2
