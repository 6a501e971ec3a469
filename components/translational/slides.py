"""Sliding machine parts: rods, contacts, slideways, brakes and stops."""

from __future__ import annotations

from components import icons
from components.clutches.friction import DryFriction, Rows, Sticking
from components.commands import Commanded
from components.interfaces import LinearCompliantWithRelativeStates, LinearFlange, SlideInHousing
from components.mechanics.inertias import OnSlope
from components.tabulated import Tabulated
from components.thermal import Lossy
from modelica_like.language import (
    UNLIMITED,
    Component,
    Equations,
    Events,
    Expr,
    Hold,
    Input,
    Mode,
    Parameter,
    Variable,
    absolute,
    all_of,
    any_of,
    column,
    der,
    exp,
    maximum,
    negate,
    param,
    rows,
    signal_in,
    var,
    where,
)


class Rod(Component):
    """Rigid rod without mass."""

    icon = icons.ROD
    flange_a = LinearFlange("left end")
    flange_b = LinearFlange("right end")
    L: Parameter = param("m", "length, flange_b.s - flange_a.s", default=0.0)

    def equations(self) -> Equations:
        yield self.flange_b.s == self.flange_a.s + self.L
        yield self.flange_a.f + self.flange_b.f == 0


class ElastoGap(Lossy, LinearCompliantWithRelativeStates):
    """Contact of two bodies that can separate: spring and damper act while the distance is below s_rel0.

    The spring force is c·s_ref·(penetration/s_ref)^n: n = 1 between plates, 1.5 between spheres (H. Hertz, 1881). The
    damper force is limited to the spring force, so that the force rises from zero on contact and never pulls; if a
    fast separation leaves the surface behind, the energy of its deformation is lost. Modelica Standard
    Library, Translational.ElastoGap.
    """

    icon = icons.STOP
    c: Parameter = param("N/m", "stiffness in contact; for n above 1 the secant stiffness at s_ref", min=0)
    d: Parameter = param("N.s/m", "damping coefficient in contact", default=0.0, min=0)
    s_rel0: Parameter = param("m", "distance at which the bodies touch", default=0.0)
    n: Parameter = param("1", "exponent of the spring force; without a value the spring is linear", default=None, min=1)
    s_ref: Parameter = param("m", "penetration at which the force is c·s_ref", default=1.0, min=1e-12)
    contact = Mode("gap", "touching", description="whether the bodies touch")
    surfaces = Mode("pressed", "meeting", "leaving", description="spring and damper, limited damper, separating")

    @property
    def penetration(self) -> Expr:
        """Penetration of the bodies."""
        return self.s_rel0 - self.s_rel

    @property
    def spring(self) -> Expr:
        """Elastic part of the force that presses the bodies together."""
        force = self.c * self.penetration
        if self.given("n"):
            force = self.c * self.s_ref * (maximum(self.penetration, 0) / self.s_ref) ** self.n
        return self.contact.choose(gap=0, touching=force)

    @property
    def damper(self) -> Expr:
        """Viscous part of that force, before it is limited."""
        return self.contact.choose(gap=0, touching=-self.d * self.v_rel)

    def equations(self) -> Equations:
        yield from super().equations()
        both = self.spring + self.damper
        yield self.f == -self.surfaces.choose(pressed=both, meeting=2 * self.spring, leaving=0)

    def events(self) -> Events:
        spring, damper = self.spring, self.damper
        yield self.contact.initially("touching", when=self.s_rel < self.s_rel0)
        yield self.contact.go("gap", "touching", when=self.s_rel < self.s_rel0, because="surfaces meet")
        yield self.contact.go("touching", "gap", when=self.s_rel > self.s_rel0, because="surfaces part")
        yield self.surfaces.go("pressed", "meeting", when=damper > spring)
        yield self.surfaces.go("meeting", "pressed", when=damper < spring)
        yield self.surfaces.go("pressed", "leaving", when=damper < -spring)
        yield self.surfaces.go("leaving", "pressed", when=damper > -spring)

    def stored_energy(self) -> Expr:
        linear = self.contact.choose(gap=0, touching=0.5 * self.c * self.penetration**2)
        if not self.given("n"):
            return linear
        relative = maximum(self.penetration, 0) / self.s_ref
        hertz = self.c * self.s_ref**2 / (self.n + 1) * relative ** (self.n + 1)
        return self.contact.choose(gap=0, touching=hertz)

    def dissipation(self) -> Expr:
        return (self.f + self.spring) * self.v_rel


class SlideSticking(Sticking, partial=True):
    """Surfaces of a slide that slide or stick."""

    creep: Parameter = param("1/kg", "acceleration per force while stuck", default=None, min=0)
    creep_time: Parameter = param("s", "time after which the creep speed stays constant", default=1e-3, min=0)
    rest: Parameter = param("m/s", "velocity that a prescribed motion must exceed to break away", default=1e-12, min=0)


class SlideFriction(SlideSticking, DryFriction, SlideInHousing, partial=True):
    """Dry friction between a slide and the housing."""

    icon = icons.SLIDEWAY
    v: Variable = var("m/s", "velocity of the slide relative to the housing", state="always")

    @property
    def slip(self) -> Expr:
        return self.v

    @property
    def friction(self) -> Expr:
        return self.f


class SupportFriction(Tabulated, SlideFriction):
    """Friction of a slideway: a velocity-dependent force against the motion, with stiction."""

    f_pos: Rows = rows(
        column("velocity", scale="v_scale", rising=True), column("friction force", scale="f_scale", min=0),
        default=((0.0, 1.0),),
    )  # fmt: skip
    v_scale: Parameter = param("m/s", "velocity that counts as 1 in f_pos", default=1.0)
    f_scale: Parameter = param("N", "force that counts as 1 in f_pos", default=1.0)

    def sliding_friction(self, speed: Expr | float) -> Expr:
        return self.f_scale * self.look_up(speed / self.v_scale, self.f_pos)

    def events(self) -> Events:
        yield from super().events()
        yield from self.leaving("f_pos", absolute(self.v) / self.v_scale, self.f_pos)


class StribeckFriction(SlideFriction):
    """Friction of a lubricated slideway after R. Stribeck: f = F_prop·v + F_Coulomb + F_Stribeck·exp(-fexp·v).

    R. Stribeck: Die wesentlichen Eigenschaften der Gleit- und Rollenlager, Z. VDI 46 (1902).
    """

    F_prop: Parameter = param("N.s/m", "viscous friction", default=0.0, min=0)
    F_Coulomb: Parameter = param("N", "dry friction at high velocity, without the viscous part", min=0)
    F_Stribeck: Parameter = param("N", "excess of friction at rest", default=0.0, min=0)
    fexp: Parameter = param("s/m", "inverse of the velocity at which the excess has fallen to 1/e", default=1.0, min=0)

    def sliding_friction(self, speed: Expr | float) -> Expr:
        return self.F_prop * speed + self.F_Coulomb + self.F_Stribeck * exp(-self.fexp * speed)


class TranslationalBrake(Tabulated, Commanded, SlideFriction):
    """Friction brake between a slide and the housing: friction force cgeo·mu(v)·fn, fn = fn_max·f_normalized."""

    icon = icons.SLIDE_BRAKE
    f_normalized: Input = signal_in("1", "normal force over fn_max; the brake is free at 0", default=1.0)
    fn_max: Parameter = param("N", "normal force at f_normalized = 1", min=0)
    cgeo: Parameter = param("1", "number of friction surfaces", default=1.0, min=0)
    mu_pos: Rows = rows(
        column("velocity", scale="v_scale", rising=True),
        column("sliding friction coefficient", min=0),
        default=((0.0, 0.5),),
    )
    v_scale: Parameter = param("m/s", "velocity that counts as 1 in mu_pos", default=1.0)

    def sliding_friction(self, speed: Expr | float) -> Expr:
        mu = self.look_up(speed / self.v_scale, self.mu_pos)
        return self.cgeo * mu * (self.fn_max * self.f_normalized)

    def events(self) -> Events:
        yield from super().events()
        yield from self.leaving("mu_pos", absolute(self.v) / self.v_scale, self.mu_pos, self.f_normalized > 0)
        yield from self.above_one("f_normalized")


class MassWithStopAndFriction(SlideSticking, DryFriction, OnSlope):
    """Sliding mass between hard stops, with the friction of R. Stribeck.

    A mass that meets a stop rebounds with e times its speed; with e = 0 it comes to rest there at once, and its kinetic
    energy is lost. The stop bears any force that presses the mass against it. Modelica Standard Library,
    Translational.MassWithStopAndFriction, where e is 0.
    """

    icon = icons.TABLE
    flange_a = LinearFlange("left end", free=True)
    flange_b = LinearFlange("right end", free=True)
    L: Parameter = param("m", "length of the mass", default=0.0, min=0)
    smin: Parameter = param("m", "position of the left stop, where flange_a meets it", default=-25.0)
    smax: Parameter = param("m", "position of the right stop, where flange_b meets it", default=25.0)
    F_prop: Parameter = param("N.s/m", "viscous friction", default=0.0, min=0)
    F_Coulomb: Parameter = param("N", "dry friction at high velocity, without the viscous part", default=0.0, min=0)
    F_Stribeck: Parameter = param("N", "excess of friction at rest", default=0.0, min=0)
    fexp: Parameter = param("s/m", "inverse of the velocity at which the excess has fallen to 1/e", default=1.0, min=0)
    peak: Parameter = param("1", "static friction over sliding friction at standstill", default=1.001, min=1)
    e: Parameter = param("1", "restitution of the stops: speed after over before an impact", default=0.0, min=0, max=1)
    v_rest: Parameter = param("m/s", "impact velocity below which it rests at a stop", default=1e-3, min=0)
    s: Variable = var("m", "position of the centre of mass", state="always")
    v: Variable = var("m/s", "velocity", state="always")
    f: Variable = var("N", "force of the housing against forward motion")
    mode = Mode(
        *DryFriction.mode.names, description="friction mode",
        holds={"stuck": Hold("slip", reaction="friction", capacity="limits", restitution="restitution")},
    )  # fmt: skip
    stop = Mode("none", "left", "right", description="stop at which the mass rests")

    @property
    def slip(self) -> Expr:
        return self.v

    @property
    def friction(self) -> Expr:
        return self.f

    def sliding_friction(self, speed: Expr | float) -> Expr:
        return self.F_prop * speed + self.F_Coulomb + self.F_Stribeck * exp(-self.fexp * speed)

    def idle_friction(self) -> Expr:
        return self.F_prop * self.v

    def pressed(self) -> Expr:
        return any_of(super().pressed(), negate(self.stop.is_("none")))

    def restitution(self) -> Expr:
        """Return the restitution of the stop; friction surfaces have none."""
        return where(any_of(self.stop.is_("none"), absolute(self.v) < self.v_rest), 0, self.e)

    def limits(self) -> tuple[Expr, Expr]:
        forward, backward = self.holds_forward(), -self.holds_backward()
        return where(self.stop.is_("right"), UNLIMITED, forward), where(self.stop.is_("left"), UNLIMITED, backward)

    def carried(self) -> Expr | bool:
        return where(self.stop.is_("none"), super().carried(), 0)

    def breaks_forward(self) -> Expr:
        return all_of(super().breaks_forward(), negate(self.stop.is_("right")))

    def breaks_backward(self) -> Expr:
        return all_of(super().breaks_backward(), negate(self.stop.is_("left")))

    def equations(self) -> Equations:
        yield from super().equations()
        a, b = self.flange_a, self.flange_b
        yield a.s == self.s - 0.5 * self.L
        yield b.s == self.s + 0.5 * self.L
        yield der(self.s) == self.v
        yield self.m * der(self.v) == a.f + b.f - self.f - self.weight

    def events(self) -> Events:
        mode, stop = self.mode, self.stop
        for side, end in (("left", self.smin + 0.5 * self.L), ("right", self.smax - 0.5 * self.L)):
            # When it leaves the stop, its position may be beyond it by rounding.
            beyond = all_of(self.s < end, self.v < 0) if side == "left" else all_of(self.s > end, self.v > 0)
            there = all_of(self.s <= end, self.v <= 0) if side == "left" else all_of(self.s >= end, self.v >= 0)
            yield mode.initially("stuck", when=there)
            yield stop.initially(side, when=there)
            moving = ("free", "start_forward", "start_backward", "forward", "backward")
            yield mode.go(moving, "stuck", when=beyond, reset={self.s: end}, because="end stop reached")
            yield stop.go("none", side, when=beyond, because="end stop reached")
        # While it is held, its velocity is only rounding.
        yield stop.go(
            "left", "none", when=all_of(negate(mode.is_("stuck")), self.v > 0), because="moves away from the stop"
        )
        yield stop.go(
            "right", "none", when=all_of(negate(mode.is_("stuck")), self.v < 0), because="moves away from the stop"
        )
        yield from super().events()
