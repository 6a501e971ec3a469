"""What signals from tables over time share: a time event at every row, and long tables as lists."""

from __future__ import annotations

from collections.abc import Sequence

from components import icons
from modelica_like.language import (
    Component,
    Discrete,
    Events,
    Expr,
    Mode,
    Output,
    Parameter,
    all_of,
    discrete,
    element,
    maximum,
    param,
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
