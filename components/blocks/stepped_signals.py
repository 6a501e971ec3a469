"""Signals that jump between values: switches, shift commands, set values in steps."""

from __future__ import annotations

from components import icons
from components.blocks.rowwise import Rowwise
from components.blocks.signals import Pulse
from modelica_like.language import (
    Component,
    Equations,
    Events,
    Expr,
    Mode,
    Output,
    Parameter,
    column,
    param,
    rows,
    signal_out,
    where,
)


class Stepped(Rowwise, partial=True):
    """Signal whose value is that of the last row that was passed."""

    def initial_equations(self) -> Equations:
        yield self.row == self.passed()


class StepTable(Stepped):
    """Signal that keeps the value of a row until the next one; before the first row it has the first value."""

    table: tuple[tuple[float, float], ...] = rows(
        column("time", scale="time_scale", rising=True), column("value", scale="scale")
    )
    scale: Parameter = param("*", "scale of the values", default=1.0)

    def moments(self) -> tuple[float, ...]:
        return tuple(moment for moment, _ in self.table)

    def equations(self) -> Equations:
        value: Expr | float = self.table[0][1]
        for k, (_, following) in enumerate(self.table):
            value = where(self.row < k, value, following)
        yield self.y == self.scale * value


class BooleanTable(Stepped):
    """Signal 0 or 1 that changes at every time of a table."""

    times: tuple[float, ...] = rows(column("time of a change", scale="time_scale", rising=True), flat=True)
    start_value: bool = False
    """Value before the first change."""
    y: Output = signal_out("1", "signal, 0 or 1")

    def moments(self) -> tuple[float, ...]:
        return self.times

    def equations(self) -> Equations:
        value: Expr | float = float(self.start_value)
        for k in range(len(self.times)):
            value = where(self.row < k, value, float((k % 2 == 0) != self.start_value))
        yield self.y == value


class BooleanStep(Component):
    """Signal 0 or 1 that changes once."""

    icon = icons.STEP
    start_time: Parameter = param("s", "time of the change", default=0.0)
    start_value: bool = False
    """Value before the change."""
    y: Output = signal_out("1", "signal, 0 or 1")
    stage = Mode("before", "after", description="before or after the change")

    def equations(self) -> Equations:
        yield self.y == self.stage.choose(before=float(self.start_value), after=float(not self.start_value))

    def events(self) -> Events:
        yield self.stage.initially("after", when=self.time >= self.start_time)
        yield self.stage.go("before", "after", at=self.start_time)


class BooleanPulse(Component):
    """Signal that is 1 during the first part of every period, and 0 in the rest of it and before the start."""

    icon = icons.PULSE
    period: Parameter = param("s", "time of one period", min=1e-12)
    width: Parameter = param("1", "part of the period in which it is 1", default=0.5, min=0, max=1)
    start_time: Parameter = param("s", "start of the first period", default=0.0)
    y: Output = signal_out("1", "signal, 0 or 1")
    pulse = Pulse(amplitude=1.0, period="period", width="width", start_time="start_time")

    def equations(self) -> Equations:
        yield self.y == self.pulse.y
