"""Compliant couplings: stiffness in stages, hysteresis, a breaking point, offset shafts; dual-mass flywheels."""

from __future__ import annotations

from components import icons
from components.interfaces import CompliantWithRelativeStates, Flange
from components.mechanics.inertias import Inertia
from components.thermal import Lossy
from modelica_like.language import (
    Component,
    Equations,
    Events,
    Expr,
    Hold,
    LanguageError,
    Mode,
    Parameter,
    Variable,
    absolute,
    column,
    connect,
    cos,
    der,
    maximum,
    param,
    rows,
    series,
    sin,
    tanh,
    var,
    where,
)

Stages = tuple[tuple[float, float], ...]


class ElasticCoupling(Lossy, CompliantWithRelativeStates):
    """Elastic coupling whose stiffness changes with the twist, with viscous damping; the same in both directions.

    Each row of stages gives the stiffness above a twist; the first row begins at zero.
    """

    icon = icons.ELASTIC_COUPLING
    stages: Stages = rows(
        column("twist", scale="phi_scale", min=0, rising=True), column("stiffness", scale="c_scale", min=0)
    )
    phi_scale: Parameter = param("rad", "twist that counts as 1 in stages", default=1.0)
    c_scale: Parameter = param("N.m/rad", "stiffness that counts as 1 in stages", default=1.0)
    d: Parameter = param("N.m.s/rad", "damping coefficient", default=0.0, min=0)

    def build(self) -> None:
        if self.stages[0][0] != 0:
            raise LanguageError(
                f"{self.label}: the first stage begins at {self.stages[0][0]:g}, not at zero.",
                advice="Say the stiffness from zero on; for play write a stiffness of zero there.",
            )

    def pressed(self, begin: float) -> Expr:
        """Return the twist beyond the begin of a stage."""
        return maximum(absolute(self.phi_rel) - begin * self.phi_scale, 0)

    def elastic(self) -> tuple[Expr | float, Expr | float]:
        """Return the elastic torque against the twist, and the elastic energy."""
        torque: Expr | float = 0.0
        energy: Expr | float = 0.0
        before = 0.0
        for begin, stiffness in self.stages:
            more, pressed = (stiffness - before) * self.c_scale, self.pressed(begin)
            torque, energy, before = torque + more * pressed, energy + 0.5 * more * pressed**2, stiffness
        return torque, energy

    def spring(self) -> Expr:
        """Return the elastic torque."""
        torque, _ = self.elastic()
        return where(self.phi_rel < 0, -torque, torque)

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.tau == self.spring() + self.rubbing() + self.d * self.w_rel

    def rubbing(self) -> Expr | float:
        """Return the torque of the hysteresis."""
        return 0.0

    def stored_energy(self) -> Expr | float:
        _, energy = self.elastic()
        return energy

    def dissipation(self) -> Expr:
        return self.d * self.w_rel**2


class HystereticCoupling(ElasticCoupling):
    """Elastic coupling with hysteresis: its loops lose the same work at every frequency, like rubber.

    Hysteresis is dry friction behind a spring: its elastic twist x follows w - |w|·x·c_h/tau_h, so that its torque
    c_h·x tends to tau_h (P. R. Dahl: Solid friction damping of mechanical vibrations, AIAA Journal 14, 1976). The
    relative damping of DIN 740 is the work of a loop over the largest elastic energy.
    """

    tau_h: Parameter = param("N.m", "largest torque of the hysteresis", min=1e-9)
    c_h: Parameter = param("N.m/rad", "stiffness of the hysteresis where the twist turns back", min=1e-12)
    x: Variable = var("rad", "elastic twist of the friction", default=0)

    def largest(self) -> Expr:
        """Return the largest torque of the hysteresis."""
        return self.tau_h

    def rubbing(self) -> Expr | float:
        return self.c_h * self.x

    def sliding(self) -> Expr:
        """Return the speed with which the friction slides."""
        return absolute(self.w_rel) * self.c_h * self.x / self.largest()

    def equations(self) -> Equations:
        yield from super().equations()
        yield der(self.x) == self.w_rel - self.sliding()

    def stored_energy(self) -> Expr | float:
        return super().stored_energy() + 0.5 * self.c_h * self.x**2

    def dissipation(self) -> Expr:
        return super().dissipation() + self.c_h * self.x * self.sliding()


class ArcSpring(HystereticCoupling):
    """Arc springs of a dual-mass flywheel: stages, and friction in the channel that grows with the square of the speed.

    The springs are pressed outwards by their own mass, and inwards or outwards by their curvature.
    """

    tau_w2: Parameter = param("N.m.s2/rad2", "friction over the square of the speed of flange_a", default=0.0, min=0)

    def largest(self) -> Expr:
        return self.tau_h + self.tau_w2 * der(self.flange_a.phi) ** 2


class DualMassFlywheel(Component):
    """Dual-mass flywheel: two inertias with arc springs between them, engine at flange_a, gearbox at flange_b."""

    icon = icons.DUAL_MASS
    flange_a = Flange("engine side")
    flange_b = Flange("gearbox side")
    J_1: Parameter = param("kg.m2", "moment of inertia on the engine side", min=0)
    J_2: Parameter = param("kg.m2", "moment of inertia on the gearbox side", min=0)
    primary = Inertia(J="J_1")
    secondary = Inertia(J="J_2")

    def build(self) -> None:
        self.springs = ArcSpring(stages=self.stages, d="d", tau_h="tau_h", c_h="c_h", tau_w2="tau_w2")

    stages: Stages = rows(column("twist", "rad", min=0, rising=True), column("stiffness", "N.m/rad", min=0))
    """As in an `ElasticCoupling`: twist in rad, and stiffness in N.m/rad from there on."""
    d: Parameter = param("N.m.s/rad", "damping coefficient of the springs", default=0.0, min=0)
    tau_h: Parameter = param("N.m", "friction of the springs at standstill", min=1e-9)
    c_h: Parameter = param("N.m/rad", "stiffness of the friction where the twist turns back", min=1e-12)
    tau_w2: Parameter = param("N.m.s2/rad2", "friction over the square of the speed", default=0.0, min=0)

    def equations(self) -> Equations:
        yield connect(self.flange_a, self.primary.flange_a)
        yield from series(self.primary, self.springs, self.secondary)
        yield connect(self.flange_b, self.secondary.flange_b)


class RuptureCoupling(CompliantWithRelativeStates):
    """Coupling with a breaking point, e.g. a shear pin: rigid until the torque reaches tau_break, then open."""

    icon = icons.RUPTURE
    tau_break: Parameter = param("N.m", "torque at which it breaks", min=0)
    # No torque depends on the angle of a broken coupling.
    phi_rel: Variable = var("rad", "relative angle, flange_b.phi - flange_a.phi", state="prefer", default=0)
    w_rel: Variable = var("rad/s", "relative speed", state="always", default=0)
    pin = Mode(
        "whole", "broken", description="breaking point",
        holds={"whole": Hold("w_rel", reaction="tau", capacity="limits")},
    )  # fmt: skip

    def limits(self) -> tuple[Expr, Expr]:
        """Return the largest torque in either direction."""
        return self.tau_break, self.tau_break

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.pin.choose(whole=der(self.w_rel), broken=self.tau) == 0

    def events(self) -> Events:
        yield self.pin.go(
            "whole", "broken", when=absolute(self.tau) > self.tau_break, notice="breaks at {tau_break} N.m"
        )


class OldhamCoupling(Lossy):
    """Oldham coupling between parallel, offset shafts: two crossed slots and a disc that slides in both.

    Both shafts turn at the same angle; the centre of the disc moves twice per turn round a circle with the diameter of
    the offset, which acts as the inertia m·offset². In each slot the torque is a couple of two forces on the arm,
    which have friction at the sliding speeds offset·w·|sin| and offset·w·|cos| (F. Reuleaux: Der Constructeur). Over a
    turn they lose the share (8/pi)·mu·offset/arm of the power.
    """

    icon = icons.OLDHAM
    flange_a = Flange("driving shaft")
    flange_b = Flange("driven shaft")
    offset: Parameter = param("m", "distance of the shafts", min=0)
    arm: Parameter = param("m", "arm of the couple of forces in a slot; two thirds of the disc's diameter", min=1e-12)
    mu: Parameter = param("1", "coefficient of friction in the slots", default=0.1, min=0)
    J: Parameter = param("kg.m2", "moment of inertia of the disc", default=0.0, min=0)
    m: Parameter = param("kg", "mass of the disc", default=0.0, min=0)
    w_smooth: Parameter = param("rad/s", "speed at which 76 % of the loss are reached", default=0.1, min=1e-12)
    w: Variable = var("rad/s", "speed")
    tau_loss: Variable = var("N.m", "friction torque")

    def equations(self) -> Equations:
        yield from super().equations()
        a, b = self.flange_a, self.flange_b
        yield a.phi == b.phi
        yield self.w == der(a.phi)
        slots = absolute(sin(a.phi)) + absolute(cos(a.phi))
        rubbing = 2 * self.mu * self.offset / self.arm * absolute(b.tau)
        yield self.tau_loss == rubbing * slots * tanh(self.w / self.w_smooth)
        yield (self.J + self.m * self.offset**2) * der(self.w) == a.tau + b.tau - self.tau_loss

    def stored_energy(self) -> Expr:
        return 0.5 * (self.J + self.m * self.offset**2) * self.w**2

    def dissipation(self) -> Expr:
        return self.tau_loss * self.w
