"""Controllers, and actuators of clutches and brakes."""

from __future__ import annotations

from math import log

from components import icons
from modelica_like.language import (
    BoundMode,
    Component,
    Discrete,
    Equations,
    Events,
    Expr,
    Input,
    LanguageError,
    Mode,
    Output,
    Parameter,
    der,
    discrete,
    exp,
    param,
    signal_in,
    signal_out,
)

_LN_10 = log(10)
_SETTLED_AFTER = 9
"""Decades after which an exponential counts as settled."""


def at_limits(limit: BoundMode, free: Expr, low: Expr, high: Expr) -> Events:
    """Yield the events at which an unlimited signal reaches and leaves its limits; the run ends where these cross."""
    yield limit.go("*", "free", when=high < low, notice="has its upper limit below its lower one", fails=True)
    yield limit.initially("high", when=free > high)
    yield limit.initially("low", when=free < low)
    yield limit.go("free", "high", when=free > high)
    yield limit.go("free", "low", when=free < low)
    yield limit.go("high", "free", when=free < high)
    yield limit.go("low", "free", when=free > low)


class Feedback(Component):
    """Difference of set value and measured value."""

    icon = icons.DIFFERENCE
    u1: Input = signal_in("*", "set value")
    u2: Input = signal_in("*", "measured value")
    y: Output = signal_out("*", "u1 - u2")

    def equations(self) -> Equations:
        yield self.y == self.u1 - self.u2


class Gain(Component):
    """Signal times a constant."""

    icon = icons.GAIN
    u: Input = signal_in("*", "signal")
    k: Parameter = param("*", "factor")
    y: Output = signal_out("*", "product")

    def equations(self) -> Equations:
        yield self.y == self.k * self.u


class Sum(Component):
    """Sum of two signals."""

    icon = icons.SUM
    u1: Input = signal_in("*", "first signal")
    u2: Input = signal_in("*", "second signal")
    y: Output = signal_out("*", "u1 + u2")

    def equations(self) -> Equations:
        yield self.y == self.u1 + self.u2


class Limiter(Component):
    """Signal that keeps between ±y_max; with y_min given, between y_min and y_max. It has a kink at an event."""

    icon = icons.LIMITER
    u: Input = signal_in("*", "signal")
    y_max: Parameter = param("*", "upper limit")
    y_min: Parameter = param("*", "lower limit; without a value -y_max", default=None)
    y: Output = signal_out("*", "limited signal")
    limit = Mode("free", "high", "low", description="limit of the signal")

    @property
    def lowest(self) -> Expr:
        """Lower limit."""
        return self.y_min if self.given("y_min") else -self.y_max

    def equations(self) -> Equations:
        yield self.y == self.limit.choose(free=self.u, high=self.y_max, low=self.lowest)

    def events(self) -> Events:
        yield from at_limits(self.limit, self.u, self.lowest, self.y_max)


class FirstOrder(Component):
    """Signal that follows another with a time constant: T·der(y) = k·u - y."""

    icon = icons.RISE
    u: Input = signal_in("*", "signal")
    T: Parameter = param("s", "time constant", min=1e-12)
    k: Parameter = param("*", "output over signal at rest", default=1.0)
    y: Output = signal_out("*", "delayed signal")

    def equations(self) -> Equations:
        yield self.T * der(self.y) == self.k * self.u - self.y


class Integrator(Component):
    """Integral of a signal over time, times k."""

    icon = icons.INTEGRATOR
    u: Input = signal_in("*", "signal")
    k: Parameter = param("*", "factor", default=1.0)
    y: Output = signal_out("*", "integral")

    def equations(self) -> Equations:
        yield der(self.y) == self.k * self.u


class Controller(Component, partial=True):
    """Controller of an error u_s - u_m, whose output may have limits.

    With y_max given, the output is limited to ±y_max; with y_min given, too, to y_min and y_max.
    """

    u_s: Input = signal_in("*", "set value")
    u_m: Input = signal_in("*", "measured value")
    u_ff: Input = signal_in("*", "feed-forward, in units of the output", default=0.0)
    k: Parameter = param("*", "gain, output over error")
    y_max: Parameter = param("*", "upper limit of the output; without a value it has none", default=None)
    y_min: Parameter = param("*", "lower limit of the output; without a value -y_max", default=None)
    y: Output = signal_out("*", "output")
    limit = Mode("free", "high", "low", description="limit of the output")

    @property
    def lowest(self) -> Expr:
        """Lower limit."""
        return self.y_min if self.given("y_min") else -self.y_max

    def free_output(self) -> Expr:
        """Return the output without limit."""
        raise NotImplementedError

    def equations(self) -> Equations:
        free = self.free_output()
        limited = self.given("y_max")
        if self.given("y_min") and not limited:
            raise LanguageError(
                f"{self.label} has a y_min, but no y_max.", advice="Give y_max, too, or leave y_min out."
            )
        yield self.y == (self.limit.choose(free=free, high=self.y_max, low=self.lowest) if limited else free)

    def events(self) -> Events:
        if self.given("y_max"):
            yield from at_limits(self.limit, self.free_output(), self.lowest, self.y_max)


class P(Controller):
    """Proportional controller y = k·(wp·u_s - u_m) + u_ff; it needs no anti-windup."""

    icon = icons.CONTROL_P
    wp: Parameter = param("1", "weight of the set value", default=1.0, min=0)

    def free_output(self) -> Expr:
        return self.k * (self.wp * self.u_s - self.u_m) + self.u_ff


class PI(Controller):
    """Proportional-integral controller y = k·(wp·u_s - u_m + 1/Ti·∫e dt) + u_ff, e = u_s - u_m.

    What exceeds a limit is fed back to the integral with the time constant Ni·Ti, so that it does not wind up
    (anti-windup by back-calculation, as in the Modelica Standard Library, Blocks.Continuous.LimPID).
    """

    icon = icons.CONTROL_PI
    Ti: Parameter = param("s", "reset time", min=1e-12)
    Ni: Parameter = param("1", "time constant of the anti-windup over Ti", default=0.9, min=1e-12)
    wp: Parameter = param("1", "weight of the set value in the proportional part", default=1.0, min=0)
    e: Output = signal_out("*", "error")
    integral: Output = signal_out("*", "integral of the error over Ti")

    def free_output(self) -> Expr:
        return self.k * (self.wp * self.u_s - self.u_m + self.integral) + self.u_ff

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.e == self.u_s - self.u_m
        excess = (self.free_output() - self.y) / (self.k * self.Ni) if self.given("y_max") else 0
        yield self.Ti * der(self.integral) == self.e - excess


class PID(PI):
    """Controller y = k·(wp·u_s - u_m + 1/Ti·∫e dt + Td·der(wd·u_s - u_m)) + u_ff, e = u_s - u_m.

    The derivative is filtered with the time constant Td/Nd. This is the LimPID of the Modelica Standard Library,
    Blocks.Continuous, but that wd is 1 if nothing is said.
    """

    icon = icons.CONTROL_PID
    Td: Parameter = param("s", "derivative time", min=1e-12)
    Nd: Parameter = param("1", "derivative time over that of its filter", default=10.0, min=1e-12)
    wd: Parameter = param("1", "weight of the set value in the derivative part", default=1.0, min=0)
    smoothed: Output = signal_out("*", "filtered error, with the set value weighted")

    @property
    def ahead(self) -> Expr:
        """How far the weighted error is ahead of the filtered one."""
        return self.wd * self.u_s - self.u_m - self.smoothed

    def free_output(self) -> Expr:
        return super().free_output() + self.k * self.Nd * self.ahead

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.Td / self.Nd * der(self.smoothed) == self.ahead


class ClutchActuator(Component):
    """Electromagnetic actuator of a clutch or brake: delay, rise and release of the torque (VDI 2241).

    After switching on nothing happens for the response delay t11. Then the torque rises linearly to its full value in
    the time t12; after switching off it falls linearly to zero in the time t2. With `exponential`, like the current of
    a coil, it reaches 90 % of its full value after t12, and falls to 10 % after t2, as in data sheets: in each of these
    times its distance from the final value is divided by ten. Its output goes to `f_normalized`.
    """

    icon = icons.RISE
    on: Input = signal_in("1", "the coil is switched on above 0.5")
    t11: Parameter = param("s", "response delay", default=0.0, min=0)
    t12: Parameter = param("s", "rise time to full torque; exponential: to 90 %", min=1e-12)
    t2: Parameter = param("s", "release time from full to no torque; exponential: to 10 %", min=1e-12)
    exponential: bool = False
    """The torque rises as 1 - exp(-t/T), T = t12/ln(10), and falls as exp(-t/T), T = t2/ln(10)."""
    y: Output = signal_out("1", "torque over full torque")
    since: Discrete = discrete("s", "time at which the present state of the coil began")
    level: Discrete = discrete("1", "torque over full torque at that time")
    coil = Mode("off", "waiting", "rising", "on", "falling", description="state of the coil")

    def remaining(self, distance: Expr, time: Expr) -> Expr:
        """Return the distance of the torque from its final value."""
        decades = (self.time - self.since) / time
        return distance * exp(-_LN_10 * decades) if self.exponential else distance - decades

    def arrival(self, distance: Expr, time: Expr) -> Expr:
        """Return the time at which it has its final value."""
        return self.since + time * (_SETTLED_AFTER if self.exponential else distance)

    def equations(self) -> Equations:
        rising = 1 - self.remaining(1 - self.level, self.t12)
        falling = self.remaining(self.level, self.t2)
        # Exactly 0 and 1 at rest: a clutch closed with 1e-30 of its force would be in another mode.
        yield self.y == self.coil.choose(off=0, waiting=0, rising=rising, on=1, falling=falling)

    def events(self) -> Events:
        coil, on, off = self.coil, self.on > 0.5, self.on < 0.5
        now = {self.since: self.time, self.level: self.y}
        yield coil.go("off", "waiting", when=on, reset=now)
        yield coil.go("waiting", "off", when=off)
        yield coil.go("waiting", "rising", at=self.since + self.t11, reset=now)
        yield coil.go(("rising", "on"), "falling", when=off, reset=now)
        yield coil.go("rising", "on", at=self.arrival(1 - self.level, self.t12))
        yield coil.go("falling", "rising", when=on, reset=now)
        yield coil.go("falling", "off", at=self.arrival(self.level, self.t2))
