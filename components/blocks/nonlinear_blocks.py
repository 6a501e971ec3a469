"""Blocks with kinks and jumps, each at an event: limits, dead zones, hysteresis."""

from __future__ import annotations

from components import icons
from components.blocks.control import at_limits
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
    der,
    discrete,
    floor,
    maximum,
    minimum,
    param,
    signal_in,
    signal_out,
)


class VariableLimiter(Component):
    """Signal limited by two others. Modelica Standard Library, Blocks.Nonlinear.VariableLimiter."""

    icon = icons.LIMITER
    u: Input = signal_in("*", "signal")
    limit1: Input = signal_in("*", "upper limit")
    limit2: Input = signal_in("*", "lower limit")
    y: Output = signal_out("*", "limited signal")
    limit = Mode("free", "high", "low", description="limit of the signal")

    def equations(self) -> Equations:
        yield self.y == self.limit.choose(free=self.u, high=self.limit1, low=self.limit2)

    def events(self) -> Events:
        yield from at_limits(self.limit, self.u, self.limit2, self.limit1)


class SlewRateLimiter(Component):
    """Signal that follows another, but not faster than its limits.

    Within them it follows with the small time constant Td. Modelica Standard Library, Blocks.Nonlinear.SlewRateLimiter.
    """

    icon = icons.RAMP
    u: Input = signal_in("*", "signal")
    rising: Parameter = param("*", "largest rate")
    falling: Parameter = param("*", "lowest rate; without a value -rising", default=None)
    Td: Parameter = param("s", "time constant within the limits", default=0.001, min=1e-12)
    y: Output = signal_out("*", "limited signal")
    limit = Mode("free", "high", "low", description="limit of the rate")

    @property
    def wanted(self) -> Expr:
        """Rate without limits."""
        return (self.u - self.y) / self.Td

    @property
    def lowest(self) -> Expr:
        """Lowest rate."""
        return self.falling if self.given("falling") else -self.rising

    def equations(self) -> Equations:
        yield der(self.y) == self.limit.choose(free=self.wanted, high=self.rising, low=self.lowest)

    def events(self) -> Events:
        yield from at_limits(self.limit, self.wanted, self.lowest, self.rising)


class DeadZone(Component):
    """Signal that is zero within a zone, and the excess beyond it. Modelica Standard Library, Blocks.Nonlinear."""

    icon = icons.DEAD_ZONE
    u: Input = signal_in("*", "signal")
    u_max: Parameter = param("*", "upper end of the zone")
    u_min: Parameter = param("*", "lower end of the zone; without a value -u_max", default=None)
    y: Output = signal_out("*", "what exceeds the zone")
    zone = Mode("free", "high", "low", description="within the zone, above it or below it")

    @property
    def lowest(self) -> Expr:
        """Lower end."""
        return self.u_min if self.given("u_min") else -self.u_max

    def equations(self) -> Equations:
        yield self.y == self.zone.choose(free=0, high=self.u - self.u_max, low=self.u - self.lowest)

    def events(self) -> Events:
        yield from at_limits(self.zone, self.u, self.lowest, self.u_max)


class Hysteresis(Component):
    """Signal 1 once another exceeds u_high, and 0 once it falls below u_low: a two-point controller.

    Modelica Standard Library, Blocks.Logical.Hysteresis.
    """

    icon = icons.HYSTERESIS
    u: Input = signal_in("*", "signal")
    u_low: Parameter = param("*", "where it becomes 0")
    u_high: Parameter = param("*", "where it becomes 1")
    y: Output = signal_out("1", "signal, 0 or 1")
    state = Mode("off", "on", description="what the signal is")

    def equations(self) -> Equations:
        yield self.y == self.state.choose(off=0, on=1)

    def events(self) -> Events:
        crossed = self.u_high < self.u_low
        yield self.state.go("*", "off", when=crossed, notice="becomes 1 below where it becomes 0", fails=True)
        yield self.state.initially("on", when=self.u > self.u_high)
        yield self.state.go("off", "on", when=self.u > self.u_high)
        yield self.state.go("on", "off", when=self.u < self.u_low)


class Quantizer(Component):
    """Signal rounded to a multiple of q, as from a converter or an encoder."""

    icon = icons.SCHEDULE
    u: Input = signal_in("*", "signal")
    q: Parameter = param("*", "step", min=1e-30)
    y: Output = signal_out("*", "rounded signal")
    level: Discrete = discrete("1", "number of steps")
    rounding = Mode("kept", description="each change of level is an event")

    def equations(self) -> Equations:
        yield self.y == self.q * self.level

    def events(self) -> Events:
        steps, level, go = self.u / self.q, self.level, self.rounding.go
        nearest = floor(steps + 0.5)
        # A jump passes many levels at once; at the edge of a level rounding may give the old one.
        up, down = {level: maximum(nearest, level + 1)}, {level: minimum(nearest, level - 1)}
        yield go("kept", "kept", when=steps > level + 0.5, reset=up)
        yield go("kept", "kept", when=steps < level - 0.5, reset=down)


class PulseCounter(Component):
    """Counts how often a signal rises above a threshold, such as the pulses of a Hall sensor.

    Between two pulses the signal has to fall below u_low.
    """

    icon = icons.PULSE
    u: Input = signal_in("*", "pulses")
    u_high: Parameter = param("*", "threshold that counts")
    u_low: Parameter = param("*", "where the pulse has ended; without a value u_high", default=None)
    y: Output = signal_out("1", "number of pulses")
    number: Discrete = discrete("1", "number of pulses")
    pulse = Mode("low", "high", description="part of a pulse")

    def equations(self) -> Equations:
        yield self.y == self.number

    def events(self) -> Events:
        low = self.u_low if self.given("u_low") else self.u_high
        yield self.pulse.go("*", "low", when=self.u_high < low, notice="has u_high below u_low", fails=True)
        yield self.pulse.initially("high", when=self.u > self.u_high)
        yield self.pulse.go("low", "high", when=self.u > self.u_high, reset={self.number: self.number + 1})
        yield self.pulse.go("high", "low", when=self.u < low)
