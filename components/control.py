"""Controllers, and actuators of clutches and brakes."""

from __future__ import annotations

from modelica_like.language import (
    Component,
    Discrete,
    Equations,
    Events,
    Expr,
    Input,
    Mode,
    Output,
    Parameter,
    Variable,
    all_of,
    der,
    discrete,
    param,
    signal_in,
    signal_out,
    var,
)


class Feedback(Component):
    """Difference of set value and measured value."""

    u1: Input = signal_in("*", "set value")
    u2: Input = signal_in("*", "measured value")
    y: Output = signal_out("*", "u1 - u2")

    def equations(self) -> Equations:
        yield self.y == self.u1 - self.u2


class Gain(Component):
    """Signal times a constant."""

    u: Input = signal_in("*", "signal")
    k: Parameter = param("*", "factor")
    y: Output = signal_out("*", "product")

    def equations(self) -> Equations:
        yield self.y == self.k * self.u


class FirstOrder(Component):
    """Signal that follows another with a time constant."""

    u: Input = signal_in("*", "signal")
    T: Parameter = param("s", "time constant", min=1e-12)
    y: Output = signal_out("*", "delayed signal")

    def equations(self) -> Equations:
        yield self.T * der(self.y) == self.u - self.y


class Integrator(Component):
    """Integral of a signal over time."""

    u: Input = signal_in("*", "signal")
    y: Output = signal_out("*", "integral")

    def equations(self) -> Equations:
        yield der(self.y) == self.u


class PI(Component):
    """Proportional-integral controller y = k·(e + 1/Ti·∫e dt), e = u_s - u_m.

    With y_max given, the output is limited to ±y_max, and the integral keeps its value while the output is at a limit
    that the error would push further (anti-windup by clamping).
    """

    u_s: Input = signal_in("*", "set value")
    u_m: Input = signal_in("*", "measured value")
    k: Parameter = param("*", "gain, output over error")
    Ti: Parameter = param("s", "reset time", min=1e-12)
    y_max: Parameter = param("*", "limit of the output")
    y: Output = signal_out("*", "output")
    e: Output = signal_out("*", "error")
    integral: Output = signal_out("*", "integral of the error over Ti")
    limit = Mode("free", "high", "low", description="limit of the output")

    def free_output(self) -> Expr:
        """Return the output without limit."""
        return self.k * (self.e + self.integral)

    def equations(self) -> Equations:
        yield self.e == self.u_s - self.u_m
        if self.given("y_max"):
            yield self.Ti * der(self.integral) == self.limit.choose(free=self.e, high=0, low=0)
            yield self.y == self.limit.choose(free=self.free_output(), high=self.y_max, low=-self.y_max)
        else:
            yield self.Ti * der(self.integral) == self.e
            yield self.y == self.free_output()

    def events(self) -> Events:
        if self.given("y_max"):
            limit, free = self.limit, self.free_output()
            yield limit.initially("high", when=free > self.y_max)
            yield limit.initially("low", when=free < -self.y_max)
            yield limit.go("free", "high", when=free > self.y_max)
            yield limit.go("free", "low", when=free < -self.y_max)
            yield limit.go("high", "free", when=free < self.y_max)
            yield limit.go("low", "free", when=free > -self.y_max)


class PID(Component):
    """Controller y = k·(e + 1/Ti·∫e dt + Td·der(e)), e = u_s - u_m; the derivative is filtered with Td/Nd."""

    u_s: Input = signal_in("*", "set value")
    u_m: Input = signal_in("*", "measured value")
    k: Parameter = param("*", "gain, output over error")
    Ti: Parameter = param("s", "reset time", min=1e-12)
    Td: Parameter = param("s", "derivative time", min=1e-12)
    Nd: Parameter = param("1", "derivative time over that of its filter", default=10.0, min=1e-12)
    y: Output = signal_out("*", "output")
    e: Output = signal_out("*", "error")
    integral: Output = signal_out("*", "integral of the error over Ti")
    smoothed: Output = signal_out("*", "filtered error")

    def equations(self) -> Equations:
        yield self.e == self.u_s - self.u_m
        yield self.Ti * der(self.integral) == self.e
        yield self.Td / self.Nd * der(self.smoothed) == self.e - self.smoothed
        yield self.y == self.k * (self.e + self.integral + self.Nd * (self.e - self.smoothed))


class ClutchActuator(Component):
    """Electromagnetic actuator of a clutch or brake: delay, rise and release of the torque (VDI 2241).

    After switching on nothing happens for the response delay t11, then the torque rises linearly in the time t12; after
    switching off it falls linearly in the time t2. Its output goes to `f_normalized`.
    """

    on: Input = signal_in("1", "the coil is switched on above 0.5")
    t11: Parameter = param("s", "response delay", default=0.0, min=0)
    t12: Parameter = param("s", "rise time from none to full torque", min=1e-12)
    t2: Parameter = param("s", "release time from full to no torque", min=1e-12)
    y: Output = signal_out("1", "torque over full torque")
    level: Variable = var("1", "torque over full torque", state="always", default=0)
    t_rise: Discrete = discrete("s", "time at which the torque begins to rise", start=0.0)
    coil = Mode("off", "waiting", "rising", "on", "falling", description="state of the coil")

    def equations(self) -> Equations:
        rate = self.coil.choose(off=0, waiting=0, rising=1 / self.t12, on=0, falling=-1 / self.t2)
        yield der(self.level) == rate
        # At rest exactly 0 and 1: a clutch that is closed by 1e-30 of its force would be another mode.
        yield self.y == self.coil.choose(off=0, waiting=0, rising=self.level, on=1, falling=self.level)

    def events(self) -> Events:
        coil, on, off = self.coil, self.on > 0.5, self.on < 0.5
        yield coil.go("off", "waiting", when=on, reset={self.t_rise: self.time + self.t11})
        yield coil.go("waiting", "off", when=all_of(off, self.level <= 0))
        yield coil.go("waiting", "rising", at=self.t_rise)
        yield coil.go(("rising", "on"), "falling", when=off)
        yield coil.go("rising", "on", when=self.level >= 1, reset={self.level: 1})
        yield coil.go("falling", "rising", when=on)
        yield coil.go("falling", "off", when=self.level <= 0, reset={self.level: 0})
