"""Couplings and stops of rigid parts, which meet in impacts."""

from __future__ import annotations

from components import icons
from components.interfaces import CompliantWithRelativeStates
from modelica_like.language import (
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
    der,
    param,
    signal_in,
    var,
    where,
)


class RigidBacklash(CompliantWithRelativeStates):
    """Backlash between rigid flanks, e.g. of claws; with one end fixed, two stops of a turning part.

    Inside there is no torque. Flanks that meet rebound with e times the speed. Below w_rest they stay together, and one
    pushes the other until it is pulled back. An `ElastoBacklash` has elastic flanks instead.
    """

    icon = icons.PLAY
    b: Parameter = param("rad", "total backlash", min=1e-10)
    phi_rel0: Parameter = param("rad", "relative angle in the middle of the backlash", default=0.0)
    e: Parameter = param("1", "restitution: speed after an impact over that before", default=0.0, min=0, max=1)
    w_rest: Parameter = param("rad/s", "impact speed below which flanks stay together", default=1e-3, min=0)
    faint: Parameter = param("N.m", "separating torque that counts as rounding", default=1e-9, min=0)
    phi_rel: Variable = var("rad", "relative angle, flange_b.phi - flange_a.phi", state="always", default=0)
    w_rel: Variable = var("rad/s", "relative speed", state="always")
    contact = Mode(
        "gap", "forward", "backward", description="flanks in contact",
        holds={
            "forward": Hold("w_rel", reaction="tau", capacity="forward_limits", restitution="restitution"),
            "backward": Hold("w_rel", reaction="tau", capacity="backward_limits", restitution="restitution"),
        },
    )  # fmt: skip

    def forward_limits(self) -> tuple[None, float]:
        """Return the capacities of the forward flanks: any torque, but they cannot pull."""
        return None, 0.0

    def backward_limits(self) -> tuple[float, None]:
        """Return the capacities of the backward flanks."""
        return 0.0, None

    def restitution(self) -> Expr:
        """Return the ratio of the speeds after and before an impact."""
        return where(absolute(self.w_rel) < self.w_rest, 0, self.e)

    def equations(self) -> Equations:
        yield from super().equations()
        together = der(self.w_rel)
        yield self.contact.choose(gap=self.tau, forward=together, backward=together) == 0

    def events(self) -> Events:
        contact, w = self.contact, self.w_rel
        for name, sign in (("forward", 1), ("backward", -1)):
            side = sign * (self.phi_rel - self.phi_rel0) - 0.5 * self.b
            end = {self.phi_rel: self.phi_rel0 + sign * 0.5 * self.b}
            yield contact.initially(name, when=side >= 0)
            yield contact.go("gap", name, when=all_of(side > 0, sign * w > 0), reset=end, because="flanks meet")
            yield contact.go(name, "gap", when=sign * self.tau < -self.faint, because="the flanks would pull")


class DogClutch(CompliantWithRelativeStates):
    """Dog clutch: its teeth engage while the slip is small enough, and then both shafts turn as one.

    The remaining slip ends in an impact. It has no play and engages at any angle; for play, put a `RigidBacklash` in
    series.
    """

    icon = icons.DOGS
    # No torque depends on the angle of an open clutch.
    phi_rel: Variable = var("rad", "relative angle, flange_b.phi - flange_a.phi", state="prefer", default=0)
    w_rel: Variable = var("rad/s", "slip speed", state="always")
    engage: Input = signal_in("1", "the teeth engage above 0.5 and disengage below", default=1.0)
    w_max: Parameter = param("rad/s", "largest slip at which the teeth engage", default=1e30, min=0)
    dogs = Mode("out", "in", description="teeth out or in", holds={"in": Hold("w_rel", reaction="tau")})

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.dogs.choose(**{"out": self.tau, "in": der(self.w_rel)}) == 0

    def events(self) -> Events:
        wanted = all_of(self.engage > 0.5, absolute(self.w_rel) < self.w_max)
        yield self.dogs.initially("in", when=self.engage > 0.5)
        yield self.dogs.go("out", "in", when=wanted)
        yield self.dogs.go("in", "out", when=self.engage < 0.5)
