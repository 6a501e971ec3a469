"""Length of the calls of IDAS, and times of results."""

from __future__ import annotations

import math
from bisect import bisect_left

import numpy as np

from modelica_like.compile.compiled import Vector
from modelica_like.options import Options
from modelica_like.solve.instants import SAME_TIME, just_after

_SIZES = tuple(2**k for k in range(3, 12))
"""Looks of one call: few different numbers, because each needs an instance of IDAS."""
_LARGEST = 4096
"""Results of one call without events, limited by memory."""
_ROOM = 1.5
_FIRST = 32
"""Number of results in the first panel."""
_FEWEST = 0.25
"""Smallest number of looks at guards per result: oscillations visible in the results are not missed."""
_SPARE = 2.0
"""Looks of a panel per expected look at guards: the number of steps is not known before."""
_STEPS_PER_LOOK = 2.0
_DENSE = 3.0
"""Number of steps between two looks from which on events may be missed."""
_STEPS_TO_START = 30
_COST = 100.0
"""Overhead of a panel, in steps."""
_GROWTH = 8
_ON_GRID = 1e-7
_NEVER = 1e-12
"""Rates, relative to the value and per second, that do not count as rising."""


class Pace:
    """Chooses panels: pieces of a smooth segment that are integrated in one call.

    Without events, looks are results. With events, panels are as long as segments are expected to be, with about one
    look for each step of the integrator; results lie between.

    Args:
        begin: start of the run in s.
        end: its end.
        options: number of results.
        guarded: whether there may be state events.
        timed: whether there may be time events.
    """

    def __init__(self, begin: float, end: float, options: Options, *, guarded: bool, timed: bool) -> None:
        self.begin, self.end, self.points = begin, end, options.points
        self.step = (end - begin) / options.points
        self._grid = begin + (end - begin) * (np.arange(options.points + 1) / options.points)
        self.on_grid = not (guarded or timed)
        self._even = -(-options.points // -(-options.points // _LARGEST))
        # Few results do not change where IDAS steps and looks.
        self._look = min(self.step, (end - begin) / Options.points)
        self._density = 1 / self._look / _SPARE
        self._waves = 0.0
        self._span = _FIRST * self._look if guarded else np.inf
        self._known: dict[bytes, tuple[float, float]] = {}

    def panel(self, t: float, stop: float) -> tuple[float, int]:
        """Return length in s and number of looks of the next panel."""
        if not self.on_grid:
            density = max(_SPARE * self._density, 1 / self._look, self._waves)
            # Most of a panel may lie behind an event; a start also costs some steps.
            span = min(self._span, _SIZES[-1] / density)
            if self._density:
                span = min(span, max(math.sqrt(_COST * self._span / self._density), _COST / self._density))
            if t + 1.1 * span >= stop:
                span = stop - t
            return span, _SIZES[min(bisect_left(_SIZES, span * density), len(_SIZES) - 1)]
        whole = math.floor(float(t - self.begin) / self.step + _ON_GRID)
        span = self.begin + (whole + self._even) * self.step - t
        if just_after(t + span) < stop:
            return span, self._even
        return stop - t, max(math.ceil(float(stop - t) / self.step - _ON_GRID), 1)

    def results(self, first: float, last: float) -> Vector:
        """Return the times of results after `first` up to `last`, with a tolerance."""
        same = min(_ON_GRID * self.step, SAME_TIME * max(1.0, abs(first), abs(last)))
        low = math.floor((first + same - self.begin) / self.step) + 1
        high = math.floor((last + same - self.begin) / self.step)
        return self._grid[low : high + 1]

    def before(self, t: float) -> float:
        """Return the latest time of results before an event."""
        return t - 2 * _ON_GRID * self.step

    def stride(self, steps: int, looks: int, width: float) -> int:
        """Choose the number of looks per look at guards, by the integrator's steps in a panel.

        Zero if there are too few looks; the next panel has more.
        """
        each = max(steps - _STEPS_TO_START, 0) / looks
        self._density = each / width
        if each > _DENSE:
            return 0
        stride = 1
        while (
            looks >= 2 * stride * _SIZES[0]
            and 2 * stride * each <= _STEPS_PER_LOOK
            and 2 * stride * width <= self._look / _FEWEST
        ):
            stride *= 2
        return stride

    def resolved(self, stride: int, advance: float, width: float) -> int:
        """Return a number of looks per look at guards with which these see all waves, at most `stride`.

        Zero if there are too few looks; the next panel has more.

        Args:
            stride: as the steps ask for.
            advance: largest advance of a phase from one look to the next, over the advance that is allowed.
            width: distance of looks in s.
        """
        self._waves = _ROOM * advance / width
        while stride and stride * advance > 1:
            stride //= 2
        return stride

    def shorter(self, span: float, *, denser: bool = False) -> None:
        """Limit the length of the next panel, in s; with `denser`, a shorter panel has closer looks."""
        if denser:
            self.on_grid = False
            span /= _GROWTH
            self._density = max(self._density, 1 / self._look / _SPARE) * _GROWTH
        self._span = span

    def again(self, span: float) -> None:
        """Try a panel of this length in s with looks as at the beginning: what made them close is no more."""
        self._span, self._density = span, 1 / self._look / _SPARE

    def longer(self, span: float, ahead: float) -> None:
        """Make the next panel longer than one of this length in s, but not much longer than the time ahead."""
        if span > 0.9 * self._span:
            self._span = min(_GROWTH * self._span, max(_ROOM * ahead, self._shortest()))

    def anew(self, before: Vector, lasted: float, after: Vector) -> None:
        """Begin a segment.

        Its expected length is that of the last one with the same modes, or of the one before.

        Args:
            before: modes and discrete values of the segment before.
            lasted: its duration in s.
            after: modes and discrete values now.
        """
        self._known[before.tobytes()] = lasted, self._density
        expected, self._density = self._known.get(after.tobytes(), (lasted, self._density))
        if self._span < np.inf:
            self._span = max(_ROOM * expected, self._shortest())

    def _shortest(self) -> float:
        """Length of a panel that costs little more than its start."""
        return _STEPS_TO_START / max(self._density, 1 / self._look)


def foreseen(values: Vector, rates: Vector) -> float:
    """Return the time in s until the first guard rises, by linear extrapolation from values and rates at one time."""
    rising = (values < 0) & (rates > -_NEVER * values)
    return float(np.min(-values[rising] / rates[rising], initial=np.inf))
