"""Shift schedules of automatic gearboxes: pressures of clutches and brakes."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

from components import icons
from modelica_like.language import (
    Component,
    Discrete,
    Equations,
    Events,
    Expr,
    LanguageError,
    Mode,
    Output,
    Parameter,
    all_of,
    column,
    discrete,
    param,
    rows,
    signal_out,
    where,
)

_NEVER = 1e30
_GEARS = (
    ("N", "d"), ("1", "ad"), ("2", "ac"), ("3", "ab"), ("4", "ae"), ("5", "be"), ("6", "ce"), ("R", "bd"),
)  # fmt: skip
_NUMBERS = {"N": 0.0, "R": -1.0}
_DIGITS = "0123456789"


class ShiftSchedule(Component):
    """Pressures of five shift elements, gear after gear at fixed times.

    In a shift the pressures of closing elements rise linearly while those of opening elements fall: the torque passes
    over while both slip, without a gap and without two gears locked at once. Elements that stay closed keep their
    pressure.
    """

    icon = icons.SCHEDULE
    shifts: tuple[tuple[float, str, float], ...] = rows(
        column("time", scale="time_scale"), column("gear", text=True),
        column("duration of the shift", scale="time_scale"),
    )  # fmt: skip
    """Rows of time, gear, and duration of the shift, both in time_scale; the run begins in the first gear."""
    pattern: tuple[tuple[str, str], ...] = rows(
        column("gear", text=True), column("closed elements", text=True), default=_GEARS
    )
    """Gears and their closed elements; the default is that of a `Lepelletier` gearbox."""
    time_scale: Parameter = param("s", "scale of the times", default=1.0)
    a: Output = signal_out("1", "pressure of element a")
    b: Output = signal_out("1", "pressure of element b")
    c: Output = signal_out("1", "pressure of element c")
    d: Output = signal_out("1", "pressure of element d")
    e: Output = signal_out("1", "pressure of element e")
    gear: Output = signal_out("1", "gear that is engaged or being engaged; 0 neutral, -1 reverse")
    row: Discrete = discrete("1", "number of shifts that have begun")
    stage = Mode("holding", "shifting", description="a shift is going on")

    def build(self) -> None:
        pattern = dict(self.pattern)
        for _, gear, _ in self.shifts:
            if gear not in pattern:
                raise LanguageError(
                    f"The shift schedule asks for the gear '{gear}'; its pattern has {', '.join(pattern)}.",
                    advice="Name one of these, or give the pattern another row.",
                )
        for gear in pattern:
            if gear not in _NUMBERS and not (gear and set(gear) <= set(_DIGITS)):
                raise LanguageError(
                    f"The pattern of a shift schedule has a gear '{gear}'.",
                    advice="Write gears as numbers, neutral as N, reverse as R.",
                )
        for (first, gear, duration), (second, following, _) in pairwise(self.shifts[1:]):
            if first + duration > second:
                raise LanguageError(
                    f"The shift to gear {gear} ends at {first + duration:g} s, after that to {following} has begun.",
                    advice="Start each shift after the end of the one before.",
                )

    def in_row(self, value: Callable[[int], float], ahead: int = 0) -> Expr | float:
        """Return the value of the present row, or of one some rows ahead."""
        last = len(self.shifts) - 1
        chosen: Expr | float = value(last)
        for k in reversed(range(last)):
            chosen = where(self.row + ahead <= k, value(k), chosen)
        return chosen

    def closed(self, element: str) -> Callable[[int], float]:
        """Return the pressure of an element in a row."""
        elements = dict(self.pattern)
        return lambda k: float(element in elements[self.shifts[k][1]])

    def equations(self) -> Equations:
        begin, duration = self.in_row(lambda k: self.shifts[k][0]), self.in_row(lambda k: self.shifts[k][2])
        done = self.stage.choose(holding=1, shifting=(self.time / self.time_scale - begin) / duration)
        for element, pressure in (("a", self.a), ("b", self.b), ("c", self.c), ("d", self.d), ("e", self.e)):
            level = self.closed(element)
            before = self.in_row(level, ahead=-1)
            yield pressure == before + (self.in_row(level) - before) * done
        yield self.gear == self.in_row(lambda k: _gear_number(self.shifts[k][1]))

    def initial_equations(self) -> Equations:
        begun: Expr | float = 0.0
        for moment, *_ in self.shifts[1:]:
            begun = begun + where(self.time / self.time_scale < moment, 0, 1)
        yield self.row == begun

    def events(self) -> Events:
        moments = [row[0] for row in self.shifts]
        following = _NEVER
        for k in reversed(range(1, len(moments))):
            following = where(self.row < k, moments[k], following)
        end = self.in_row(lambda k: self.shifts[k][0] + self.shifts[k][2])
        yield self.stage.initially("shifting", when=all_of(self.row > 0, self.time < end * self.time_scale))
        yield self.stage.go("holding", "shifting", at=following * self.time_scale, reset={self.row: self.row + 1})
        yield self.stage.go("shifting", "holding", at=end * self.time_scale)


def _gear_number(gear: str) -> float:
    return _NUMBERS[gear] if gear in _NUMBERS else float(gear)
