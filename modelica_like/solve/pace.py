"""How far IDAS goes in one call, and where results lie."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from modelica_like.compile.compiled import Vector
from modelica_like.solve.instants import SAME_TIME
from modelica_like.solve.options import Options

_SIZES = (8, 32, 128, 512, 2048)
"""Looks of one call: few different numbers, for each is an instance of IDAS."""
_LARGEST = 4096
"""Results of one call without events: memory, not time, bounds them."""
_ROOM = 1.5
_STEPS_PER_CHECK = 6
"""Guards are looked at about as often as the integrator needs steps: what oscillates between results is not missed."""
_DENSE = 1.5
"""Steps between two looks from which results beside the looks ask for more of them."""
_FINER = 4
_STEPS_TO_START = 30
_MAX_CHECKS = 2**16
_ON_GRID = 1e-7


class Pace:
    """Chooses panels: pieces of a smooth segment that are integrated in one call.

    Args:
        begin: start of the run in s.
        end: its end.
        options: number of results.
        guarded: whether there may be state events: then panels are as long as segments are expected to be.
        timed: whether there may be time events.
    """

    def __init__(self, begin: float, end: float, options: Options, *, guarded: bool, timed: bool) -> None:
        self.begin, self.end, self.points = begin, end, options.points
        self.step = (end - begin) / options.points
        self.checks = 1
        self.finer = 1
        self.guarded, self.eventful = guarded, guarded or timed
        even = -(-options.points // -(-options.points // _LARGEST))
        self.longest = _SIZES[-1] if guarded or timed else even
        self.size = _SIZES[1] if guarded else self.longest

    @property
    def look(self) -> float:
        """Distance of looks at guards in s."""
        return self.step / self.checks

    def panel(self, t: float, stop: float) -> tuple[float, int]:
        """Return length in s and number of looks of the next panel.

        It ends on the grid of looks or at `stop`. Behind an event its looks lie beside the results, which are
        interpolated.
        """
        position = float(t - self.begin) / self.look
        whole = math.floor(position + _ON_GRID)
        span = self.begin + (whole + self.size) * self.look - t
        beside = abs(position - round(position)) > _ON_GRID
        if t + span < stop - SAME_TIME * max(1.0, abs(stop)):
            return span, _at_least(self.size * self.finer) if beside and self.eventful else self.size
        left = max(math.ceil(float(stop - t) / self.look - _ON_GRID), 1)
        return stop - t, left if not self.eventful else _at_least(left * self.finer)

    def snap(self, times: Vector) -> None:
        """Put times exactly on the regular grid, so that they do not collect rounding errors."""
        grid = self._at(np.rint((times - self.begin) / self.look), self.points * self.checks)
        on_grid = np.abs(times - grid) <= self._same(grid)
        times[on_grid] = grid[on_grid]

    def _at(self, numbers: Vector, count: int) -> Vector:
        return self.begin + (self.end - self.begin) * (numbers / count)

    def _same(self, times: Any) -> Any:
        """Distance of times that are the same, and surely of no others on the grid."""
        return np.minimum(_ON_GRID * self.look, SAME_TIME * np.maximum(1.0, np.abs(times)))

    def results(self, first: float, last: float) -> Vector:
        """Return the times of results after `first` up to `last`, both with a little room."""
        low = math.floor(float(first + self._same(first) - self.begin) / self.step) + 1
        high = math.floor(float(last + self._same(last) - self.begin) / self.step)
        return self._at(np.arange(low, high + 1, dtype=float), self.points)

    def before(self, t: float) -> float:
        """Return the latest time of results that lie before an event."""
        return t - 2 * _ON_GRID * self.step

    def refine(self, steps: int, looks: int) -> bool:
        """Adapt the number of looks per result to the integrator's steps; True if it was too small."""
        each = max(steps - _STEPS_TO_START, 0) / looks
        self.finer = _FINER if each * self.finer > _DENSE else 1
        if each > _STEPS_PER_CHECK and self.checks < _MAX_CHECKS:
            self.checks = min(self.checks << int(np.ceil(np.log2(each / _STEPS_PER_CHECK))), _MAX_CHECKS)
            return True
        if looks > _SIZES[0] and each < _STEPS_PER_CHECK / 8:
            self.checks = max(self.checks // 2, 1)
        return False

    def laborious(self, steps: int, looks: int) -> bool:
        """Whether a panel took more steps than its looks are made for."""
        return looks > 1 and steps > _STEPS_PER_CHECK * looks

    def shorter(self, looks: int) -> None:
        """Let the next panel be shorter than one of so many looks."""
        self.size = max([size for size in _SIZES if size < looks], default=1)

    def longer(self, looks: int, ahead: float = np.inf) -> None:
        """Let the next panel be longer than one of so many looks, but not much longer than what is ahead, in s."""
        if looks >= self.size:
            expected = max(_at_least(_ROOM * ahead / self.look), _SIZES[1])
            self.size = min(_at_least(self.size + 1), expected, self.longest)

    def anew(self, span: float) -> None:
        """Begin a segment that is expected to last so long, in s: as the last one with the same modes."""
        if self.guarded:
            self.size = _at_least(_ROOM * span / self.look)


def _at_least(looks: float) -> int:
    return next((size for size in _SIZES if size >= looks), _SIZES[-1])
