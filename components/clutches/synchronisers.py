"""Synchronisers of gearboxes: cone friction, blocking, and engagement of the teeth."""

from __future__ import annotations

from components import icons
from components.clutches.friction import Clutch
from modelica_like.language import (
    UNLIMITED,
    Discrete,
    Events,
    Expr,
    Mode,
    Parameter,
    all_of,
    any_of,
    cos,
    discrete,
    maximum,
    negate,
    param,
    sin,
    where,
)


class Synchroniser(Clutch):
    """Synchroniser with blocking ring: friction cones equalise both speeds before the teeth engage.

    The sleeve force fn_max·f_normalized presses the cones; for n cones of the radius r and the angle alpha, cgeo is
    n·r/sin(alpha). As long as they slip, the ring blocks the sleeve, if the cones' torque is larger than the one with
    which the chamfered teeth turn the ring away, F·r_t·(cos(beta) - mu_t·sin(beta))/(sin(beta) + mu_t·cos(beta));
    otherwise the sleeve passes it, and the teeth engage with an impact. A negative force pulls them out (H. Naunheimer,
    B. Bertsche, J. Ryborz, W. Novak: Fahrzeuggetriebe, 9.2).
    """

    icon = icons.SYNCHRO
    r_t: Parameter = param("m", "radius of the teeth", min=0)
    beta: Parameter = param("rad", "half the angle of the chamfered teeth", default=1.0, min=1e-3, max=1.57)
    mu_t: Parameter = param("1", "coefficient of friction of the chamfers", default=0.1, min=0)
    travel_time: Parameter = param("s", "time from unblocking until the teeth are in", default=0.01, min=0)
    t_in: Discrete = discrete("s", "time at which the teeth are in", start=1e30)
    sleeve = Mode("out", "blocked", "turning", "in", description="sleeve")

    def turning_torque(self) -> Expr:
        """Return the torque with which the chamfered teeth turn the ring away."""
        edge = (cos(self.beta) - self.mu_t * sin(self.beta)) / (sin(self.beta) + self.mu_t * cos(self.beta))
        return self.fn_max * self.f_normalized * self.r_t * maximum(edge, 0)

    def pressed(self) -> Expr:
        return any_of(super().pressed(), self.sleeve.is_("in"))

    def limits(self) -> tuple[Expr, Expr]:
        limit = where(self.sleeve.is_("in"), UNLIMITED, self.static_friction())
        return limit, limit

    def carried(self) -> Expr | bool:
        return where(self.sleeve.is_("in"), 0, super().carried())

    def breaks_forward(self) -> Expr:
        return all_of(super().breaks_forward(), negate(self.sleeve.is_("in")))

    def breaks_backward(self) -> Expr:
        return all_of(super().breaks_backward(), negate(self.sleeve.is_("in")))

    def events(self) -> Events:
        mode, sleeve = self.mode, self.sleeve
        moving = ("free", "start_forward", "start_backward", "forward", "backward")
        yield mode.go(moving, "stuck", when=sleeve.is_("in"), because="the teeth are in")
        yield from super().events()
        pushed, soon = self.f_normalized > 0, {self.t_in: self.time + self.travel_time}
        passes = any_of(mode.is_("stuck"), self.turning_torque() > self.sliding_friction(0))
        yield sleeve.go("out", "blocked", when=pushed)
        yield sleeve.go("blocked", "turning", when=passes, reset=soon, because="the ring turns away")
        yield sleeve.go("turning", "in", at=self.t_in, because="the teeth have met")
        yield sleeve.go(("blocked", "turning", "in"), "out", when=self.f_normalized < 0, because="pulled out")
