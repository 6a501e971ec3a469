"""Dry friction that sticks and slides: bearings, clutches, brakes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from components import icons
from components.commands import Commanded
from components.interfaces import CompliantWithRelativeStates, ShaftInHousing
from components.tabulated import Tabulated
from components.thermal import Lossy
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
    column,
    der,
    maximum,
    negate,
    param,
    prescribed,
    rows,
    signal_in,
    var,
    where,
)

Rows = tuple[tuple[float, float], ...]

HOLDS = {"stuck": Hold("slip", reaction="friction", capacity="limits")}
"""Declaration of the motion held by stuck surfaces, in any unit."""
_NOW = 1e-9
"""Time that counts as one instant, in creep_time."""
_FAINT = 1e-10
"""Excess over the capacity that counts as rounding: surfaces do not break away in a tie."""


class Sticking(Lossy, partial=True):
    """Surfaces that slide, come to rest on each other and break away again.

    While they stick, friction is not a function of the speed but keeps the relative acceleration at zero, so the speed
    is a state in every mode (Otter, Elmqvist, Mattsson: Hybrid modeling in Modelica based on the synchronous
    data flow principle, CACSD 1999). Friction is then undetermined if another friction element holds the same motion; a
    tiny `creep` (1e-9) decides: the other one holds as long as it can.

    Under a prescribed motion the surfaces cannot stick: friction acts against the motion; while the motion is at rest,
    friction, which could have any value up to the static one, is zero.

    A subclass declares `creep`, `creep_time` and `rest` in its units, and defines its slip speed and its friction.
    """

    if TYPE_CHECKING:
        creep: Parameter
        creep_time: Parameter
        rest: Parameter
    mode = Mode(
        "stuck", "start_forward", "start_backward", "forward", "backward", description="friction mode", holds=HOLDS
    )

    @property
    def slip(self) -> Expr:
        """Speed of sliding."""
        raise NotImplementedError

    @property
    def friction(self) -> Expr:
        """Friction torque or force, against forward sliding."""
        raise NotImplementedError

    def holds_forward(self) -> Expr:
        """Return the largest friction of stuck surfaces against forward sliding."""
        raise NotImplementedError

    def holds_backward(self) -> Expr:
        """Return the largest friction of stuck surfaces against backward sliding; it is negative."""
        return -self.holds_forward()

    def limits(self) -> tuple[Expr | None, Expr | None]:
        """Return the capacities of stuck surfaces against forward and against backward sliding."""
        return self.holds_forward(), -self.holds_backward()

    def carried(self) -> Expr | bool:
        """Return the condition under which a prescribed motion moves the surfaces, so that they cannot stick."""
        return False if self.given("creep") else prescribed(self.slip) > 0

    def sticking(self) -> Expr:
        """Return the expression that is zero while the surfaces stick."""
        creeping = self.creep * self.friction - self.slip / self.creep_time if self.given("creep") else 0.0
        return where(self.carried(), self.friction, der(self.slip) - creeping)

    def breaks_forward(self) -> Expr:
        """Return the condition under which stuck surfaces begin to slide forward."""
        bearable = self.holds_forward()
        return where(self.carried(), self._soon() - self.rest, self.friction - bearable - _FAINT * bearable) > 0

    def breaks_backward(self) -> Expr:
        """Return the condition under which stuck surfaces begin to slide backward."""
        bearable = self.holds_backward()
        return where(self.carried(), self._soon() + self.rest, self.friction - bearable - _FAINT * bearable) < 0

    def _soon(self) -> Expr:
        return self.slip + self.creep_time * der(self.slip)

    def stops(self, direction: int) -> Expr:
        """Return the condition under which sliding surfaces come to rest."""
        # A prescribed motion may end at standstill without passing it; then nothing brakes it.
        still = 0.5 * self.rest - direction * self.creep_time * der(self.slip)
        return direction * self.slip < where(self.carried(), _NOW * still, 0)

    def events(self) -> Events:
        mode, slip = self.mode, self.slip
        yield mode.go("stuck", "start_forward", when=self.breaks_forward(), because="friction limit exceeded")
        yield mode.go("stuck", "start_backward", when=self.breaks_backward(), because="friction limit exceeded")
        yield mode.go("start_forward", "forward", when=slip > 0, because="slip begins")
        yield mode.go("start_backward", "backward", when=slip < 0, because="slip begins")
        yield mode.go("start_forward", "stuck", when=der(slip) < 0, because="no slip follows")
        yield mode.go("start_backward", "stuck", when=der(slip) > 0, because="no slip follows")
        yield mode.go("forward", "stuck", when=self.stops(1), because="slip reached zero")
        yield mode.go("backward", "stuck", when=self.stops(-1), because="slip reached zero")

    def dissipation(self) -> Expr:
        return self.friction * self.slip


class ShaftSticking(Sticking, partial=True):
    """Turning surfaces that slide or stick."""

    creep: Parameter = param("1/(kg.m2)", "acceleration per torque while stuck", default=None, min=0)
    creep_time: Parameter = param("s", "time after which the creep speed stays constant", default=1e-3, min=0)
    rest: Parameter = param("rad/s", "speed that a prescribed motion must exceed to break away", default=1e-12, min=0)


class DryFriction(Sticking, partial=True):
    """Two surfaces that stick until the static friction is exceeded, and then slide against the sliding friction.

    A surface that breaks away keeps the sliding friction of standstill until it moves. Surfaces without static friction
    are free: nothing holds them, and any friction at speed goes through zero smoothly.

    A subclass defines the laws of sliding and static friction.
    """

    peak: Parameter = param("1", "static friction over sliding friction at standstill", default=1.0, min=1)
    mode = Mode(
        "free", "stuck", "start_forward", "start_backward", "forward", "backward",
        description="friction mode", holds=HOLDS,
    )  # fmt: skip

    def sliding_friction(self, speed: Expr | float) -> Expr:
        """Return the friction while sliding forward at a speed."""
        raise NotImplementedError

    def static_friction(self) -> Expr:
        """Return the largest friction of stuck surfaces."""
        return self.peak * self.sliding_friction(0)

    def holds_forward(self) -> Expr:
        return self.static_friction()

    def pressed(self) -> Expr:
        """Return the condition under which the surfaces touch."""
        return self.static_friction() > 0

    def idle_friction(self) -> Expr:
        """Return the friction of free surfaces: none if nothing presses them together."""
        # Zero at rest even while an event is being passed, so that it never jumps with the direction.
        against = maximum(self.sliding_friction(absolute(self.slip)), 0) - maximum(self.sliding_friction(0), 0)
        return where(self.slip < 0, -against, against)

    def equations(self) -> Equations:
        yield from super().equations()
        at_rest = self.sliding_friction(0)
        # On the way to an event the speed may go slightly past zero, where the friction laws are not valid.
        forward = self.sliding_friction(maximum(self.slip, 0))
        backward = self.sliding_friction(maximum(-self.slip, 0))
        yield self.mode.choose(
            free=self.friction - self.idle_friction(), stuck=self.sticking(),
            start_forward=self.friction - at_rest, start_backward=self.friction + at_rest,
            forward=self.friction - forward, backward=self.friction + backward,
        ) == 0  # fmt: skip

    def events(self) -> Events:
        mode, slip, pressed = self.mode, self.slip, self.pressed()
        yield mode.initially("forward", when=all_of(pressed, slip > 0))
        yield mode.initially("backward", when=all_of(pressed, slip < 0))
        yield mode.initially("stuck", when=pressed)
        yield mode.go(
            ("stuck", "start_forward", "start_backward", "forward", "backward"), "free", when=negate(pressed),
            because="no pressure",
        )  # fmt: skip
        yield mode.go("free", "forward", when=all_of(pressed, slip > 0), because="pressed while slipping")
        yield mode.go("free", "backward", when=all_of(pressed, slip < 0), because="pressed while slipping")
        yield mode.go("free", "stuck", when=pressed, because="pressed without slip")
        yield from super().events()


class ShaftFriction(ShaftSticking, DryFriction, partial=True):
    """Dry friction between turning parts."""


class PressedFriction(Tabulated, Commanded, ShaftFriction, partial=True):
    """Friction surfaces pressed together by a normal force.

    Friction torque cgeo·mu(slip)·fn with the normal force fn = fn_max·f_normalized. For N surfaces with the radii r_i
    and r_o, cgeo = N·(r_i + r_o)/2 (uniform wear). If only the torque of the closed surfaces is known, give it as
    `capacity` instead. A residual drag torque acts whenever the surfaces slide.
    """

    f_normalized: Input = signal_in("1", "normal force over fn_max; the surfaces are free at 0", default=1.0)
    fn_max: Parameter = param("N", "normal force at f_normalized = 1", default=None, min=0)
    cgeo: Parameter = param("m", "friction radius times number of friction surfaces", default=1.0, min=0)
    mu_pos: Rows = rows(
        column("slip speed", scale="w_scale", rising=True),
        column("sliding friction coefficient", min=0),
        default=((0.0, 0.5),),
    )
    w_scale: Parameter = param("rad/s", "slip speed that counts as 1 in mu_pos", default=1.0)
    capacity: Parameter = param(
        "N.m", "sliding torque at f_normalized = 1; replaces fn_max, cgeo and mu_pos", default=None, min=0
    )
    tau_drag: Parameter = param("N.m", "residual drag torque", default=0.0, min=0)

    def mu(self, speed: Expr | float) -> Expr | float:
        """Return the coefficient of sliding friction."""
        return self.look_up(speed / self.w_scale, self.mu_pos)

    def sliding_friction(self, speed: Expr | float) -> Expr:
        if self.given("capacity"):
            return self.capacity * self.f_normalized + self.tau_drag
        return self.cgeo * self.mu(speed) * (self.fn_max * self.f_normalized) + self.tau_drag

    def events(self) -> Events:
        yield from super().events()
        yield from self.measured()
        yield from self.above_one("f_normalized")

    def measured(self) -> Events:
        """Yield the event at which the slip leaves mu_pos while the surfaces are pressed together."""
        if not self.given("capacity"):
            speed = absolute(self.slip) / self.w_scale
            yield from self.leaving("mu_pos", speed, self.mu_pos, self.f_normalized > 0)


class Clutch(PressedFriction, CompliantWithRelativeStates):
    """Friction clutch between two shafts."""

    icon = icons.CLUTCH
    # No torque depends on the slip angle of a clutch.
    phi_rel: Variable = var("rad", "relative angle, flange_b.phi - flange_a.phi", state="prefer", default=0)
    w_rel: Variable = var("rad/s", "slip speed", state="always")

    @property
    def slip(self) -> Expr:
        return self.w_rel

    @property
    def friction(self) -> Expr:
        return self.tau


class MultiPlateClutch(Clutch):
    """Wet multi-plate clutch with a measured friction law.

    The coefficient of sliding friction falls with the cube of the distance to its minimum, and rises linearly above it.
    The coefficient of static friction is a separate value, no less than that of sliding at standstill (M. Pajor,
    M. Hoffman: Dynamika rozruchu układu ze sprzęgłem, Politechnika Szczecińska, after K. Marchelek: Dynamika
    obrabiarek, 4.4.2).
    """

    icon = icons.MULTI_PLATE
    mu_min: Parameter = param("1", "smallest coefficient of sliding friction", min=0)
    w_min: Parameter = param("rad/s", "slip speed there", min=0)
    curvature: Parameter = param("s3/rad3", "factor of the cube below w_min", min=0)
    slope: Parameter = param("s/rad", "slope above w_min")
    mu_static: Parameter = param("1", "coefficient of static friction", min=0)

    def mu(self, speed: Expr | float) -> Expr | float:
        below = self.w_min - speed
        return self.mu_min + where(below > 0, self.curvature * below**3, -self.slope * below)

    def measured(self) -> Events:
        return iter(())

    def static_friction(self) -> Expr:
        return self.cgeo * maximum(self.mu_static, self.mu(0)) * (self.fn_max * self.f_normalized) + self.tau_drag


class Brake(PressedFriction, ShaftInHousing):
    """Friction brake: a clutch between a shaft and the housing."""

    icon = icons.BRAKE
    w: Variable = var("rad/s", "speed of the shaft relative to the housing", state="always")

    @property
    def slip(self) -> Expr:
        return self.w

    @property
    def friction(self) -> Expr:
        return self.tau


class BearingFriction(Tabulated, ShaftFriction, ShaftInHousing):
    """Friction of a bearing: a speed-dependent torque against the rotation, with stiction."""

    icon = icons.BEARING
    w: Variable = var("rad/s", "speed of the shaft relative to the housing", state="always")
    tau_pos: Rows = rows(
        column("speed", scale="w_scale", rising=True), column("friction torque", scale="tau_scale", min=0),
        default=((0.0, 1.0),),
    )  # fmt: skip
    w_scale: Parameter = param("rad/s", "speed that counts as 1 in tau_pos", default=1.0)
    tau_scale: Parameter = param("N.m", "torque that counts as 1 in tau_pos", default=1.0)

    @property
    def slip(self) -> Expr:
        return self.w

    @property
    def friction(self) -> Expr:
        return self.tau

    def sliding_friction(self, speed: Expr | float) -> Expr:
        return self.tau_scale * self.look_up(speed / self.w_scale, self.tau_pos)

    def events(self) -> Events:
        yield from super().events()
        yield from self.leaving("tau_pos", absolute(self.w) / self.w_scale, self.tau_pos)
