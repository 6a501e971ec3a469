"""Waves and transients: signals to test a drive with."""

from __future__ import annotations

from math import pi
from typing import Literal

from components import icons
from components.blocks.signals import Periodic, Started, Table
from modelica_like.language import (
    Component,
    Equations,
    Events,
    Expr,
    Input,
    Mode,
    Output,
    Parameter,
    Variable,
    column,
    cos,
    der,
    exp,
    maximum,
    param,
    rows,
    signal_in,
    signal_out,
    sin,
    var,
    where,
)


class Cosine(Started):
    """Cosine signal."""

    icon = icons.SINE
    amplitude: Parameter = param("*", "amplitude", default=1.0)
    f: Parameter = param("Hz", "frequency", min=0)
    phase: Parameter = param("rad", "angle at the start", default=0.0)

    def running(self, elapsed: Expr) -> Expr:
        return self.amplitude * cos(2 * pi * self.f * elapsed + self.phase)


class ExpSine(Started):
    """Sine signal that decays exponentially, like an oscillator after a hit."""

    icon = icons.DECAY
    amplitude: Parameter = param("*", "amplitude at the start", default=1.0)
    f: Parameter = param("Hz", "frequency", min=0)
    phase: Parameter = param("rad", "angle at the start", default=0.0)
    damping: Parameter = param("1/s", "inverse of the time in which the amplitude falls to 1/e", default=0.0)

    def running(self, elapsed: Expr) -> Expr:
        return self.amplitude * exp(-self.damping * elapsed) * sin(2 * pi * self.f * elapsed + self.phase)


class Sinc(Started):
    """Signal amplitude·sin(x)/x, x = 2·pi·f·t: it contains all frequencies up to f equally."""

    icon = icons.DECAY
    amplitude: Parameter = param("*", "value at the start", default=1.0)
    f: Parameter = param("Hz", "highest frequency", min=1e-12)

    def running(self, elapsed: Expr) -> Expr:
        x = 2 * pi * self.f * elapsed
        return self.amplitude * where(x**2 < 1e-12, 1, sin(x) / x, events=False)


class Exponentials(Component):
    """Signal that rises exponentially towards a value for a time, and then falls exponentially."""

    icon = icons.RISE
    height: Parameter = param("*", "final value of the rise", default=1.0)
    rise_time: Parameter = param("s", "duration of the rise", min=1e-12)
    T_rise: Parameter = param("s", "time constant of the rise", min=1e-12)
    T_fall: Parameter = param("s", "time constant of the fall", min=1e-12)
    offset: Parameter = param("*", "value before the rise", default=0.0)
    start_time: Parameter = param("s", "start of the rise", default=0.0)
    y: Output = signal_out("*", "signal")
    stage = Mode("before", "rising", "falling", description="part of the signal")

    def equations(self) -> Equations:
        elapsed = self.time - self.start_time
        rise = 1 - exp(-elapsed / self.T_rise)
        top = 1 - exp(-self.rise_time / self.T_rise)
        # Long before its time the fall would overflow.
        fall = top * exp(-maximum(elapsed - self.rise_time, 0) / self.T_fall)
        yield self.y == self.offset + self.height * self.stage.choose(before=0, rising=rise, falling=fall)

    def events(self) -> Events:
        end = self.start_time + self.rise_time
        yield self.stage.initially("falling", when=self.time >= end)
        yield self.stage.initially("rising", when=self.time >= self.start_time)
        yield self.stage.go("before", "rising", at=self.start_time)
        yield self.stage.go("rising", "falling", at=end)


class SawTooth(Periodic):
    """Signal that rises linearly over every period and then jumps back."""

    icon = icons.SAW
    stage = Mode("low", "rising", description="before the start, or in a period")

    def equations(self) -> Equations:
        part = (self.time - self.begin()) / self.period
        yield self.y == self.offset + self.amplitude * self.stage.choose(low=0, rising=part)

    def events(self) -> Events:
        begin = self.begin()
        yield self.stage.go("low", "rising", at=begin)
        yield self.stage.go("rising", "low", at=begin + self.period, reset={self.done: self.completed()})
        yield from self.begins(self.stage, ("rising", 0))

    def length(self) -> Expr:
        return self.period


class LogFrequencySweep(Component):
    """Frequency that grows exponentially from one value to another: the same time for every octave."""

    icon = icons.SINE
    f_min: Parameter = param("Hz", "frequency at the start", min=1e-12)
    f_max: Parameter = param("Hz", "frequency at the end", min=1e-12)
    duration: Parameter = param("s", "duration of the sweep", min=1e-12)
    start_time: Parameter = param("s", "start of the sweep", default=0.0)
    y: Output = signal_out("Hz", "frequency")
    stage = Mode("before", "sweeping", "after", description="part of the sweep")

    def equations(self) -> Equations:
        part = (self.time - self.start_time) / self.duration
        growth = (self.f_max / self.f_min) ** self.stage.choose(before=0, sweeping=part, after=1)
        yield self.y == self.f_min * growth

    def events(self) -> Events:
        end = self.start_time + self.duration
        yield self.stage.initially("after", when=self.time >= end)
        yield self.stage.initially("sweeping", when=self.time >= self.start_time)
        yield self.stage.go("before", "sweeping", at=self.start_time)
        yield self.stage.go("sweeping", "after", at=end)


class VariableSine(Component):
    """Sine of an amplitude and a frequency given by signals; its angle is the integral of the frequency."""

    icon = icons.SINE
    amplitude: Input = signal_in("*", "amplitude", default=1.0)
    f: Input = signal_in("Hz", "frequency")
    offset: Parameter = param("*", "mean value", default=0.0)
    phi: Variable = var("rad", "angle; pi/2 at the start makes it a cosine", default=0)
    y: Output = signal_out("*", "signal")

    def equations(self) -> Equations:
        yield der(self.phi) == 2 * pi * self.f
        yield self.y == self.offset + self.amplitude * sin(self.phi)


class CombiTable(Component):
    """Several signals from one table over time: columns[1].y, columns[2].y, …; see `Table`."""

    icon = icons.TABLE_BLOCK
    table: tuple[tuple[float, ...], ...] = rows(
        column("time", scale="time_scale", rising=True), column("value"), more=True
    )
    smooth: bool = False
    """Interpolate with a continuous slope instead of straight lines."""
    extrapolate: Literal["hold", "linear", "error"] = "hold"
    """Beyond the ends `hold` the last values, continue the last slopes (`linear`), or end the run (`error`)."""
    time_scale: Parameter = param("s", "scale of the times", default=1.0)

    def build(self) -> None:
        times, *columns = zip(*self.table, strict=True)
        self.columns = [
            Table(
                table=tuple(zip(times, column, strict=True)),
                smooth=self.smooth,
                extrapolate=self.extrapolate,
                time_scale="time_scale",
            )
            for column in columns
        ]
