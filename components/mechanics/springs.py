"""Elastic and damping elements, with and without backlash."""

from __future__ import annotations

from components import icons
from components.interfaces import (
    Compliant,
    CompliantWithRelativeStates,
    LinearCompliant,
    LinearCompliantWithRelativeStates,
)
from components.thermal import Lossy
from modelica_like.language import Equations, Events, Expr, Mode, Parameter, param


class Spring(Compliant):
    """Torsion spring: the torque is proportional to the twist."""

    icon = icons.SPRING
    c: Parameter = param("N.m/rad", "stiffness", min=0)
    phi_rel0: Parameter = param("rad", "relative angle without torque", default=0.0)

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.tau == self.c * (self.phi_rel - self.phi_rel0)

    def stored_energy(self) -> Expr:
        return 0.5 * self.c * (self.phi_rel - self.phi_rel0) ** 2


class Damper(Lossy, CompliantWithRelativeStates):
    """Viscous damper: the torque is proportional to the relative speed."""

    icon = icons.DAMPER
    d: Parameter = param("N.m.s/rad", "damping coefficient", min=0)

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.tau == self.d * self.w_rel

    def dissipation(self) -> Expr:
        return self.d * self.w_rel**2


class SpringDamper(Lossy, CompliantWithRelativeStates):
    """Torsion spring and viscous damper in parallel, e.g. an elastic coupling."""

    icon = icons.SPRING_DAMPER
    c: Parameter = param("N.m/rad", "stiffness", min=0)
    d: Parameter = param("N.m.s/rad", "damping coefficient", min=0)
    phi_rel0: Parameter = param("rad", "relative angle without torque", default=0.0)

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.tau == self.c * (self.phi_rel - self.phi_rel0) + self.d * self.w_rel

    def stored_energy(self) -> Expr:
        return 0.5 * self.c * (self.phi_rel - self.phi_rel0) ** 2

    def dissipation(self) -> Expr:
        return self.d * self.w_rel**2


class Backlash(Lossy, CompliantWithRelativeStates, partial=True):
    """Backlash in series with a parallel spring and damper, e.g. a pair of gear flanks or a claw coupling.

    Inside the backlash there is no torque, and flanks that touch never pull: if a fast separation leaves the flank
    behind, the energy of its deformation is lost. A subclass defines the torque of flanks in contact.
    Without backlash use a `SpringDamper`.
    """

    icon = icons.BACKLASH
    c: Parameter = param("N.m/rad", "stiffness in contact", min=1e-12)
    d: Parameter = param("N.m.s/rad", "damping coefficient in contact", default=0.0, min=0)
    b: Parameter = param("rad", "total backlash", min=1e-10)
    phi_rel0: Parameter = param("rad", "relative angle in the middle of the backlash", default=0.0)
    contact = Mode("gap", "forward", "backward", description="flanks in contact")

    @property
    def phi_diff(self) -> Expr:
        """Relative angle from the middle of the backlash."""
        return self.phi_rel - self.phi_rel0

    @property
    def spring(self) -> Expr:
        """Elastic part of the torque that presses the flanks together."""
        half = 0.5 * self.b
        forward, backward = self.c * (self.phi_diff - half), self.c * (-self.phi_diff - half)
        return self.contact.choose(gap=0, forward=forward, backward=backward)

    @property
    def damper(self) -> Expr:
        """Viscous part of the torque that presses the flanks together."""
        return self.contact.choose(gap=0, forward=self.d * self.w_rel, backward=-self.d * self.w_rel)

    def pressure(self) -> Expr:
        """Return the torque that presses the flanks together."""
        raise NotImplementedError

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.tau == self.contact.choose(gap=0, forward=self.pressure(), backward=-self.pressure())

    def events(self) -> Events:
        half = 0.5 * self.b
        yield self.contact.initially("forward", when=self.phi_diff > half)
        yield self.contact.initially("backward", when=self.phi_diff < -half)
        yield self.contact.go("gap", "forward", when=self.phi_diff > half, because="flanks meet")
        yield self.contact.go("gap", "backward", when=self.phi_diff < -half, because="flanks meet")
        yield self.contact.go("forward", "gap", when=self.phi_diff < half, because="flanks part")
        yield self.contact.go("backward", "gap", when=self.phi_diff > -half, because="flanks part")

    def stored_energy(self) -> Expr:
        return 0.5 * self.spring**2 / self.c

    def dissipation(self) -> Expr:
        elastic = self.contact.choose(gap=0, forward=self.spring, backward=-self.spring)
        return (self.tau - elastic) * self.w_rel


class ElastoBacklash(Backlash):
    """Backlash whose damper torque is limited to the spring torque, so that the torque rises from zero on contact.

    Modelica Standard Library, Rotational.ElastoBacklash.
    """

    flanks = Mode("pressed", "meeting", "leaving", description="spring and damper, limited damper, separating")

    def pressure(self) -> Expr:
        return self.flanks.choose(pressed=self.spring + self.damper, meeting=2 * self.spring, leaving=0)

    def events(self) -> Events:
        yield from super().events()
        spring, damper = self.spring, self.damper
        yield self.flanks.go("pressed", "meeting", when=damper > spring)
        yield self.flanks.go("meeting", "pressed", when=damper < spring)
        yield self.flanks.go("pressed", "leaving", when=damper < -spring)
        yield self.flanks.go("leaving", "pressed", when=damper > -spring)


class ElastoBacklash2(Backlash):
    """Backlash whose damper acts in full as soon as the flanks meet: the torque may jump there.

    Modelica Standard Library, Rotational.ElastoBacklash2.
    """

    flanks = Mode("pressed", "leaving", description="spring and damper, separating")

    def pressure(self) -> Expr:
        return self.flanks.choose(pressed=self.spring + self.damper, leaving=0)

    def events(self) -> Events:
        yield from super().events()
        yield self.flanks.go("pressed", "leaving", when=self.damper < -self.spring)
        yield self.flanks.go("leaving", "pressed", when=self.damper > -self.spring)


class TranslationalSpring(LinearCompliant):
    """Spring: the force is proportional to the extension."""

    icon = icons.SPRING
    c: Parameter = param("N/m", "stiffness", min=0)
    s_rel0: Parameter = param("m", "relative position without force", default=0.0)

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.f == self.c * (self.s_rel - self.s_rel0)

    def stored_energy(self) -> Expr:
        return 0.5 * self.c * (self.s_rel - self.s_rel0) ** 2


class TranslationalDamper(Lossy, LinearCompliantWithRelativeStates):
    """Viscous damper: the force is proportional to the relative velocity."""

    icon = icons.DAMPER
    d: Parameter = param("N.s/m", "damping coefficient", min=0)

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.f == self.d * self.v_rel

    def dissipation(self) -> Expr:
        return self.d * self.v_rel**2


class TranslationalSpringDamper(Lossy, LinearCompliantWithRelativeStates):
    """Spring and viscous damper in parallel."""

    icon = icons.SPRING_DAMPER
    c: Parameter = param("N/m", "stiffness", min=0)
    d: Parameter = param("N.s/m", "damping coefficient", min=0)
    s_rel0: Parameter = param("m", "relative position without force", default=0.0)

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.f == self.c * (self.s_rel - self.s_rel0) + self.d * self.v_rel

    def stored_energy(self) -> Expr:
        return 0.5 * self.c * (self.s_rel - self.s_rel0) ** 2

    def dissipation(self) -> Expr:
        return self.d * self.v_rel**2
