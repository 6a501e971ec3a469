"""Couplings that limit the torque or let a shaft overrun: freewheels, one-way clutches, torque limiters."""

from __future__ import annotations

from components import icons
from components.clutches.friction import Clutch, ShaftFriction
from components.interfaces import CompliantWithRelativeStates
from modelica_like.language import (
    Equations,
    Events,
    Expr,
    Hold,
    Mode,
    Parameter,
    Variable,
    all_of,
    any_of,
    der,
    param,
    var,
    where,
)


class Freewheel(CompliantWithRelativeStates):
    """Ideal freewheel: flange_b may overrun flange_a, but not fall behind.

    Either the shafts turn together and flange_a drives flange_b, or flange_b is faster and there is no torque:
    overrunning speed and driving torque are never negative, and at least one of them is zero.
    """

    icon = icons.FREEWHEEL
    # No torque depends on the angle of overrun.
    phi_rel: Variable = var("rad", "relative angle, flange_b.phi - flange_a.phi", state="prefer", default=0)
    w_rel: Variable = var("rad/s", "overrunning speed", state="always")
    slow: Parameter = param("rad/s", "speed of falling behind that counts as rounding", default=1e-9, min=0)
    soon: Parameter = param("s", "time limit for reaching that speed", default=1.0, min=0)
    faint: Parameter = param("N.m", "releasing torque that counts as rounding", default=1e-9, min=0)
    mode = Mode(
        "overrunning", "locked", description="state of the freewheel",
        holds={"locked": Hold("w_rel", reaction="tau", capacity="limits")},
    )  # fmt: skip

    def limits(self) -> tuple[float, None]:
        """Return the capacities: none against overrunning, unlimited against falling behind."""
        return 0.0, None

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.mode.choose(overrunning=self.tau, locked=der(self.w_rel)) == 0

    def events(self) -> Events:
        yield self.mode.initially("locked", when=all_of(self.w_rel <= 0, self.w_rel >= 0))
        yield self.mode.go("locked", "overrunning", when=self.tau > self.faint, because="the torque would reverse")
        # Just after the release the speed is zero within rounding; its rate decides.
        falling = all_of(self.w_rel < 0, any_of(self.soon * der(self.w_rel) < -self.slow, self.w_rel < -self.slow))
        yield self.mode.go("overrunning", "locked", when=falling, because="overrunning speed reached zero")


class OneWayClutch(Clutch):
    """Friction clutch and freewheel in parallel: flange_b may overrun flange_a, against the friction of the clutch.

    They are one element, because the torque of a freewheel and a clutch that both hold would not be unique. Modelica
    Standard Library, Rotational.OneWayClutch.
    """

    icon = icons.ONE_WAY_CLUTCH

    def sliding_friction(self, speed: Expr | float) -> Expr:
        return where(self.f_normalized > 0, super().sliding_friction(speed), self.tau_drag)

    def limits(self) -> tuple[Expr, None]:
        return self.holds_forward(), None

    def carried(self) -> Expr | bool:
        # It holds against falling behind, even if that motion is prescribed.
        return False

    def equations(self) -> Equations:
        yield from CompliantWithRelativeStates.equations(self)
        at_rest = self.sliding_friction(0)
        moving = self.tau - self.sliding_friction(where(self.w_rel > 0, self.w_rel, 0))
        yield self.mode.choose(
            stuck=self.sticking(), start_forward=self.tau - at_rest,
            forward=moving, otherwise=self.tau,
        ) == 0  # fmt: skip
        if self.heat_port.used:
            yield self.heat_port.Q_flow == -self.dissipation()

    def events(self) -> Events:
        mode, w = self.mode, self.w_rel
        yield mode.initially("forward", when=any_of(w > 0, w < 0))
        yield mode.initially("stuck", when=w >= 0)
        yield mode.go("stuck", "start_forward", when=self.breaks_forward(), because="friction limit exceeded")
        yield mode.go("start_forward", "forward", when=w > 0, because="slip begins")
        yield mode.go("start_forward", "stuck", when=der(w) < 0, because="no slip follows")
        yield mode.go("forward", "stuck", when=w < 0, because="slip reached zero")
        yield from self.measured()


class SlippingCoupling(ShaftFriction, CompliantWithRelativeStates, partial=True):
    """Coupling that slips where the torque is too large; a subclass says from which torque on."""

    phi_rel: Variable = var("rad", "relative angle, flange_b.phi - flange_a.phi", state="prefer", default=0)
    w_rel: Variable = var("rad/s", "slip speed", state="always")

    @property
    def slip(self) -> Expr:
        return self.w_rel

    @property
    def friction(self) -> Expr:
        return self.tau


class TorqueLimiter(SlippingCoupling):
    """Slipping coupling that protects a drive: rigid up to tau_max·peak, then it slips at tau_max."""

    icon = icons.LIMITER_CLUTCH
    tau_max: Parameter = param("N.m", "torque at which it slips", min=0)

    def sliding_friction(self, speed: Expr | float) -> Expr:
        return self.tau_max
