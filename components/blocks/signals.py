"""Signals: functions of time that drive sources, clutches and brakes.

Jumps and kinks of a signal are time events, so that the solver never steps across them.
"""

from __future__ import annotations

from itertools import pairwise
from math import log, pi
from typing import Literal

from components import icons
from components.blocks.rowwise import Rowwise, is_long
from components.tabulated import GUESSED
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
    all_of,
    any_of,
    column,
    discrete,
    element,
    exp,
    floor,
    interpolate,
    maximum,
    minimum,
    param,
    parse_formula,
    rows,
    signal_in,
    signal_out,
    sin,
    where,
)

_NEVER = 1e30
_SETTLED = 9 * log(10)
"""Time constants after which an exponential counts as settled: nine decades."""
_INSTANT = 1e-9
"""Time that counts as one instant, above the resolution of events."""


class Constant(Component):
    """Constant signal."""

    icon = icons.CONSTANT
    k: Parameter = param("*", "value")
    y: Output = signal_out("*", "signal")

    def equations(self) -> Equations:
        yield self.y == self.k


class Product(Component):
    """Product of two signals."""

    icon = icons.PRODUCT
    u1: Input = signal_in("*", "first factor")
    u2: Input = signal_in("*", "second factor")
    y: Output = signal_out("*", "signal")

    def equations(self) -> Equations:
        yield self.y == self.u1 * self.u2


class Started(Component, partial=True):
    """Signal that keeps a value until it starts."""

    offset: Parameter = param("*", "value before the start", default=0.0)
    start_time: Parameter = param("s", "time of the start", default=0.0)
    y: Output = signal_out("*", "signal")
    stage = Mode("waiting", "running", description="before or after the start")

    def running(self, elapsed: Expr) -> Expr:
        """Return the part added to the offset after the start."""
        raise NotImplementedError

    def equations(self) -> Equations:
        elapsed = self.time - self.start_time
        yield self.y == self.offset + self.stage.choose(waiting=0, running=self.running(elapsed))

    def events(self) -> Events:
        yield self.stage.initially("running", when=self.time >= self.start_time)
        yield self.stage.go("waiting", "running", at=self.start_time)


class Step(Started):
    """Signal that jumps."""

    icon = icons.STEP
    height: Parameter = param("*", "height of the jump", default=1.0)

    def running(self, elapsed: Expr) -> Expr:
        return self.height


class Sine(Started):
    """Sine signal."""

    icon = icons.SINE
    amplitude: Parameter = param("*", "amplitude", default=1.0)
    f: Parameter = param("Hz", "frequency", min=0)
    phase: Parameter = param("rad", "angle at the start", default=0.0)

    def running(self, elapsed: Expr) -> Expr:
        return self.amplitude * sin(2 * pi * self.f * elapsed + self.phase)


class CoilForce(Started):
    """Force of an electromagnet whose coil is switched on, and off again.

    The current rises as 1 - exp(-t/T) with the time constant T of the coil, the force as its square. A coil with an
    initial current rises from it, and the force of a polarized magnet is proportional to the current. After
    switching off the current falls as exp(-t/T_off) from what it has reached; after nine decades there is none.
    """

    icon = icons.RISE
    amplitude: Parameter = param("*", "final value", default=1.0)
    T: Parameter = param("s", "time constant of the coil current", min=0)
    start_current: Parameter = param("1", "current at the start over its final value", default=0.0, min=0, max=1)
    stop_time: Parameter = param("s", "time of switching off; without a value it stays on", default=None)
    T_off: Parameter = param(
        "s", "time constant of the falling current, shorter with a spark resistor; without a value T",
        default=None, min=1e-12,
    )  # fmt: skip
    polarised: bool = False
    """The force is proportional to the current, not to its square."""
    stage = Mode("waiting", "running", "falling", "off", description="before the start, on, switched off, no current")

    @property
    def falling_time(self) -> Expr:
        """Time constant of the falling current."""
        return self.T_off if self.given("T_off") else self.T

    def current(self, elapsed: Expr) -> Expr:
        """Return the current over its final value, that long after switching on."""
        return 1 - (1 - self.start_current) * exp(-elapsed / self.T)

    def force(self, current: Expr) -> Expr:
        """Return the force that a current makes."""
        return self.amplitude * (current if self.polarised else current**2)

    def equations(self) -> Equations:
        rising: Expr = self.force(self.current(self.time - self.start_time))
        falling: Expr | float = 0.0
        if self.given("stop_time"):
            reached = self.current(self.stop_time - self.start_time)
            falling = self.force(reached * exp(-(self.time - self.stop_time) / self.falling_time))
        yield self.y == self.offset + self.stage.choose(waiting=0, running=rising, falling=falling, off=0)

    def events(self) -> Events:
        if self.given("stop_time"):
            settled = self.stop_time + _SETTLED * self.falling_time
            yield self.stage.initially("off", when=all_of(self.time >= self.start_time, self.time >= settled))
            yield self.stage.initially(
                "falling", when=all_of(self.time >= self.start_time, self.time >= self.stop_time)
            )
            yield self.stage.go("running", "falling", at=self.stop_time)
            yield self.stage.go("falling", "off", at=settled)
        yield from super().events()


class TimeFormula(Component):
    """Signal given as a formula of time, e.g. `72.5*(1 - exp(-time/0.07))`.

    In the formula, `time` is the time divided by time_scale; the value is multiplied by scale.
    """

    icon = icons.FORMULA
    formula: str
    """Arithmetic of `time` with numbers, pi, sqrt, abs, sin, cos, tan, exp, log, tanh, min, max."""
    scale: Parameter = param("*", "scale of the formula", default=1.0)
    time_scale: Parameter = param("s", "scale of the time", default=1.0)
    y: Output = signal_out("*", "signal")

    def equations(self) -> Equations:
        yield self.y == self.scale * parse_formula(self.formula).evaluate(self.lookup)

    def lookup(self, name: str) -> Expr:
        """Return the meaning of a name in the formula."""
        if name != "time":
            raise LanguageError(
                f"The formula '{self.formula}' of {self.label} uses '{name}', but it can use only `time`.",
                advice="Write the number, or use a signal component with parameters.",
            )
        return self.time / self.time_scale


class Ramp(Component):
    """Signal that rises linearly and then keeps its value."""

    icon = icons.RAMP
    height: Parameter = param("*", "height of the ramp", default=1.0)
    duration: Parameter = param("s", "duration of the ramp", min=1e-12)
    offset: Parameter = param("*", "value before the ramp", default=0.0)
    start_time: Parameter = param("s", "start of the ramp", default=0.0)
    y: Output = signal_out("*", "signal")
    stage = Mode("before", "rising", "after", description="part of the ramp")

    def equations(self) -> Equations:
        part = (self.time - self.start_time) / self.duration
        yield self.y == self.offset + self.height * self.stage.choose(before=0, rising=part, after=1)

    def events(self) -> Events:
        end = self.start_time + self.duration
        yield self.stage.initially("after", when=self.time >= end)
        yield self.stage.initially("rising", when=self.time >= self.start_time)
        yield self.stage.go("before", "rising", at=self.start_time)
        yield self.stage.go("rising", "after", at=end)


class Periodic(Component, partial=True):
    """Signal that repeats a shape, with the low value in between."""

    amplitude: Parameter = param("*", "height of the shape", default=1.0)
    period: Parameter = param("s", "time of one period", min=1e-12)
    periods: Parameter = param("1", "number of periods; negative: no end", default=-1.0)
    offset: Parameter = param("*", "low value", default=0.0)
    start_time: Parameter = param("s", "start of the first period", default=0.0)
    y: Output = signal_out("*", "signal")
    done: Discrete = discrete("1", "number of completed shapes")

    def begin(self) -> Expr:
        """Return the time at which the next shape begins."""
        goes_on = any_of(self.periods < 0, self.done < self.periods)
        return self.start_time + self.period * where(goes_on, self.done, _NEVER)

    def length(self) -> Expr:
        """Return how long a shape lasts."""
        raise NotImplementedError

    def passed(self) -> Expr:
        """Return the number of shapes that have ended: a run may start late."""
        passed = floor((self.time - self.start_time - self.length()) / self.period + _INSTANT) + 1
        return maximum(where(self.periods < 0, passed, minimum(passed, self.periods)), 0)

    def completed(self) -> Expr:
        """Return the number of completed shapes where one ends."""
        return maximum(self.done + 1, self.passed())

    def begins(self, stage: BoundMode, *parts: tuple[str, Expr | float]) -> Events:
        """Yield the stage in which a run starts, of parts that begin so long after a shape does, the last one first."""
        for name, since in parts:
            yield stage.initially(name, when=self.time >= self.begin() + since - _INSTANT * self.period)

    def initial_equations(self) -> Equations:
        yield self.done == self.passed()


class Pulse(Periodic):
    """Rectangular pulses."""

    icon = icons.PULSE
    width: Parameter = param("1", "high part of the period", default=0.5, min=0, max=1)
    stage = Mode("low", "high", description="part of the period")

    def equations(self) -> Equations:
        yield self.y == self.offset + self.stage.choose(low=0, high=self.amplitude)

    def events(self) -> Events:
        begin = self.begin()
        yield self.stage.go("low", "high", at=begin)
        yield self.stage.go("high", "low", at=begin + self.length(), reset={self.done: self.completed()})
        yield from self.begins(self.stage, ("high", 0))

    def length(self) -> Expr:
        return self.width * self.period


class Trapezoid(Periodic):
    """Trapezoidal pulses."""

    icon = icons.TRAPEZOID
    rising: Parameter = param("s", "duration of the rise", min=1e-12)
    width: Parameter = param("s", "duration at the high value", min=0)
    falling: Parameter = param("s", "duration of the fall", min=1e-12)
    stage = Mode("low", "rising", "high", "falling", description="part of the period")

    def equations(self) -> Equations:
        elapsed = self.time - self.begin()
        rise = elapsed / self.rising
        fall = 1 - (elapsed - self.rising - self.width) / self.falling
        shape = self.stage.choose(low=0, rising=rise, high=1, falling=fall)
        yield self.y == self.offset + self.amplitude * shape

    def events(self) -> Events:
        begin = self.begin()
        again = begin + self.period
        high = begin + self.rising
        fall = high + self.width
        ends = {self.done: self.completed()}
        yield self.stage.go("low", "rising", at=begin)
        # A shape that is longer than the period is cut off where the next one begins.
        for stage, following, end in (("rising", "high", high), ("high", "falling", fall)):
            yield self.stage.go(stage, following, at=end + self.period * where(end > again, _NEVER, 0))
            yield self.stage.go(stage, "low", at=again + self.period * where(end > again, 0, _NEVER), reset=ends)
        yield self.stage.go("falling", "low", at=minimum(fall + self.falling, again), reset=ends)
        parts = ("falling", self.rising + self.width), ("high", self.rising), ("rising", 0)
        yield from self.begins(self.stage, *parts)

    def length(self) -> Expr:
        return minimum(self.rising + self.width + self.falling, self.period)


class Table(Rowwise):
    """Signal that interpolates in a table of time and value."""

    table: tuple[tuple[float, float], ...] = rows(
        column("time", scale="time_scale", rising=True), column("value", scale="scale")
    )
    smooth: bool = False
    """Interpolate with a continuous slope instead of straight lines."""
    extrapolate: Literal["hold", "linear", "error"] = "hold"
    """Beyond the ends `hold` the last value, continue the last slope (`linear`), or end the run (`error`)."""
    end = Mode("ahead", "passed", "awaited", description="whether the table has ended, or not begun")
    scale: Parameter = param("*", "scale of the values", default=1.0)

    def moments(self) -> tuple[float, ...]:
        return () if self.smooth else tuple(moment for moment, _ in self.table)

    def equations(self) -> Equations:
        times, values = zip(*self.table, strict=True)
        now = self.time / self.time_scale
        if not self.smooth and is_long(times) and is_long(values):
            yield self.y == self.scale * self._on_line(now, times, values)
            return
        yield self.y == self.scale * interpolate(now, times, values, self.smooth, self.extrapolate)

    def _on_line(self, now: Expr, times: tuple[float, ...], values: tuple[float, ...]) -> Expr:
        """Return the value on the line between the last row that was passed and the next one."""
        lines = [(t, y, (later - y) / (end - t)) for (t, y), (end, later) in pairwise(self.table)]
        last = (*self.table[-1], lines[-1][2])
        if self.extrapolate != "linear":
            lines, last = [(*self.table[0], 0.0), *lines], (*self.table[-1], 0.0)
        else:
            lines = [lines[0], *lines]
        begin, value, slope = (element(column, self.row + 1) for column in zip(*lines, last, strict=True))
        return value + slope * (now - begin)

    def events(self) -> Events:
        if not self.smooth:
            yield from super().events()
        # A run may begin and end with the table. Where the value stays anyway, nothing is guessed.
        (begin, first), (end, last) = self.table[0], self.table[-1]
        now, slack = self.time / self.time_scale, _INSTANT * (1 + end - begin)
        fails, goes_on = self.extrapolate == "error", self.extrapolate == "linear"
        if len(self.table) > 1 and not _stays(first, self.table[1][1]):
            notice = f"has no rows yet: its first {'slope' if goes_on else 'value'} counts"
            yield self.end.go("ahead", "awaited", when=now < begin - slack, notice=notice)
        if len(self.table) > 1 and (fails or not _stays(last, self.table[-2][1])):
            notice = f"has no more rows{GUESSED[self.extrapolate]}"
            yield self.end.go(("ahead", "awaited"), "passed", when=now > end + slack, notice=notice, fails=fails)


def _stays(value: Expr | float, following: Expr | float) -> bool:
    return isinstance(value, float | int) and isinstance(following, float | int) and value == following
