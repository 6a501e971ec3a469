"""Signals from tables over time, with a time event at every row."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Literal

from components import icons
from components.tabulated import GUESSED
from modelica_like.language import (
    Component,
    Discrete,
    Equations,
    Events,
    Expr,
    Mode,
    Output,
    Parameter,
    all_of,
    column,
    discrete,
    element,
    interpolate,
    maximum,
    param,
    rows,
    signal_out,
    where,
)

_NEVER = 1e30
_INSTANT = 1e-9
"""Time that counts as one instant, above the resolution of events."""
_LONG = 64
"""Rows from which on a table of numbers is a list: looking for the row would cost more than the rest of a drive."""


def is_long(column: Sequence[Expr | float]) -> bool:
    """Tell whether a column of a table is a long list of numbers."""
    return len(column) >= _LONG and all(isinstance(value, float | int) for value in column)


class Rowwise(Component, partial=True):
    """Signal from a table over time, with a time event at every row."""

    icon = icons.TABLE_BLOCK
    time_scale: Parameter = param("s", "scale of the times", default=1.0)
    y: Output = signal_out("*", "signal")
    row: Discrete = discrete("1", "number of the last row that was passed", start=-1.0)
    kinks = Mode("ahead", description="rows still ahead")

    def moments(self) -> tuple[float, ...]:
        """Return the times of the rows."""
        raise NotImplementedError

    def passed(self) -> Expr | float:
        """Return the number of the last row that was passed: a run may start late."""
        now, passed, moments = self.time / self.time_scale, -1.0, self.moments()
        if not is_long(moments):
            return sum((where(now < moment, 0, 1) for moment in moments), passed)
        for step in (2**k for k in reversed(range(len(moments).bit_length()))):  # halving
            there = all_of(passed + step < len(moments), now >= element(moments, passed + step))
            passed = passed + where(there, step, 0)
        return passed

    def events(self) -> Events:
        moments, following = self.moments(), _NEVER
        if is_long(moments):
            following = element((*moments, _NEVER), self.row + 1)
        else:
            for k, moment in reversed(list(enumerate(moments))):
                following = where(self.row < k, moment, following)
        ahead = {self.row: maximum(self.row + 1, self.passed())}
        yield self.kinks.go("ahead", "ahead", at=following * self.time_scale, reset=ahead)


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
