"""Connectors of mechanical components, and common bases of machine elements.

Signs as in the Modelica Standard Library: a cut torque or force is positive into the component, relative quantities are
those of `flange_b` minus those of `flange_a`, and the torque or force of a component between two flanges is the one at
`flange_b`.
"""

from __future__ import annotations

from components import icons
from modelica_like.language import Component, Connector, Domain, Equations, Expr, Variable, der, flow, var


class Flange(Connector):
    """End of a shaft: angle, and the torque in a cut through it."""

    domain = Domain(
        "torque",
        "motion",
        "a spring or clutch",
        converters={"LinearFlange": "A spindle or rack"},
        spring="SpringDamper",
    )
    stroke = icons.SHAFT
    phi: Variable = var("rad", "angle")
    tau: Variable = flow("N.m", "cut torque, positive into the component")

    def power(self) -> Expr:
        return self.tau * der(self.phi)


class LinearFlange(Connector):
    """End of a rod or slide: position, and the force in a cut through it."""

    domain = Domain(
        "force", "motion", "a spring or brake", converters={"Flange": "A spindle or rack"},
        spring="TranslationalSpringDamper",
    )  # fmt: skip
    stroke = icons.SLIDE
    s: Variable = var("m", "position")
    f: Variable = flow("N", "cut force, positive into the component")

    def power(self) -> Expr:
        return self.f * der(self.s)


class Compliant(Component, partial=True):
    """Two shaft ends that can turn against each other, without inertia: the torque passes through."""

    flange_a = Flange("left end")
    flange_b = Flange("right end")
    phi_rel: Variable = var("rad", "relative angle, flange_b.phi - flange_a.phi", state="prefer")
    tau: Variable = var("N.m", "torque between the flanges, flange_b.tau", driving=-1)

    def equations(self) -> Equations:
        yield self.phi_rel == self.flange_b.phi - self.flange_a.phi
        yield self.flange_a.tau == -self.tau
        yield self.flange_b.tau == self.tau


class CompliantWithRelativeStates(Compliant, partial=True):
    """Two shaft ends whose relative angle and speed make good states.

    Absolute angles grow without bound while a drive turns, and their small differences would be lost in rounding.
    """

    w_rel: Variable = var("rad/s", "relative speed", state="prefer")

    def equations(self) -> Equations:
        yield from super().equations()
        yield der(self.phi_rel) == self.w_rel


class LinearCompliant(Component, partial=True):
    """Two slide ends that can move against each other, without mass: the force passes through."""

    flange_a = LinearFlange("left end")
    flange_b = LinearFlange("right end")
    s_rel: Variable = var("m", "relative position, flange_b.s - flange_a.s", state="prefer")
    f: Variable = var("N", "force between the flanges, flange_b.f", driving=-1)

    def equations(self) -> Equations:
        yield self.s_rel == self.flange_b.s - self.flange_a.s
        yield self.flange_a.f == -self.f
        yield self.flange_b.f == self.f


class LinearCompliantWithRelativeStates(LinearCompliant, partial=True):
    """Two slide ends whose relative position and velocity make good states."""

    v_rel: Variable = var("m/s", "relative velocity", state="prefer")

    def equations(self) -> Equations:
        yield from super().equations()
        yield der(self.s_rel) == self.v_rel


class Supported(Component, partial=True):
    """Element with a housing, which is at rest unless something is connected to it."""

    support = Flange("housing", optional=True)

    @property
    def phi_support(self) -> Expr | float:
        """Angle of the housing."""
        return self.support.phi if self.support.used else 0.0

    @property
    def w_support(self) -> Expr | float:
        """Speed of the housing."""
        return der(self.support.phi) if self.support.used else 0.0

    def support_torque(self, shaft_torque: Expr) -> Equations:
        """Yield the balance of the housing: it carries the torques of the shafts."""
        if self.support.used:
            yield self.support.tau == -shaft_torque


class OneFlange(Supported, partial=True):
    """Element between one shaft end and the housing."""

    flange = Flange("shaft end")
    phi: Variable = var("rad", "angle of the shaft relative to the housing")

    def equations(self) -> Equations:
        yield self.phi == self.flange.phi - self.phi_support
        yield from self.support_torque(self.flange.tau)


class TwoFlanges(Supported, partial=True):
    """Element between two shaft ends and the housing."""

    flange_a = Flange("left end")
    flange_b = Flange("right end")

    def equations(self) -> Equations:
        yield from self.support_torque(self.flange_a.tau + self.flange_b.tau)


class ShaftInHousing(Supported, partial=True):
    """Rigid shaft without inertia that feels a torque from the housing."""

    flange_a = Flange("left end", free=True)
    flange_b = Flange("right end", free=True)
    phi: Variable = var("rad", "angle of the shaft relative to the housing")
    w: Variable = var("rad/s", "speed of the shaft relative to the housing")
    tau: Variable = var("N.m", "torque of the housing against forward rotation")

    def equations(self) -> Equations:
        a, b = self.flange_a, self.flange_b
        yield self.phi == a.phi - self.phi_support
        yield b.phi == a.phi
        yield der(self.phi) == self.w
        yield self.tau == a.tau + b.tau
        yield from self.support_torque(a.tau + b.tau)


class LinearSupported(Component, partial=True):
    """Element with a housing, which is at rest unless something is connected to it."""

    support = LinearFlange("housing", optional=True)

    @property
    def s_support(self) -> Expr | float:
        """Position of the housing."""
        return self.support.s if self.support.used else 0.0

    def support_force(self, slide_force: Expr) -> Equations:
        """Yield the balance of the housing: it carries the forces of the slides."""
        if self.support.used:
            yield self.support.f == -slide_force


class LinearOneFlange(LinearSupported, partial=True):
    """Element between one slide end and the housing."""

    flange = LinearFlange("slide end")
    s: Variable = var("m", "position of the slide relative to the housing")

    def equations(self) -> Equations:
        yield self.s == self.flange.s - self.s_support
        yield from self.support_force(self.flange.f)


class SlideInHousing(LinearSupported, partial=True):
    """Rigid slide without mass that feels a force from the housing."""

    flange_a = LinearFlange("left end", free=True)
    flange_b = LinearFlange("right end", free=True)
    s: Variable = var("m", "position of the slide relative to the housing")
    v: Variable = var("m/s", "velocity of the slide relative to the housing")
    f: Variable = var("N", "force of the housing against forward motion")

    def equations(self) -> Equations:
        a, b = self.flange_a, self.flange_b
        yield self.s == a.s - self.s_support
        yield b.s == a.s
        yield der(self.s) == self.v
        yield self.f == a.f + b.f
        yield from self.support_force(a.f + b.f)
