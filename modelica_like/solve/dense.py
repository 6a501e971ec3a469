"""Dense output of a run: states at any time, as the polynomials of its steps give them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.solve.initialize import polished

MOST_KEPT = 2**24
"""Largest count of numbers that a run keeps."""


class Dense:
    """Smooth pieces of a run in order of time; `piece_at` in integrate.c has the same polynomials.

    Args:
        model: the compiled model.
        steps: rows of `steps_taken` in native.c.
        modes: modes and discrete values of the segments, shape (segments, nd).

    Attributes:
        begins: of the pieces in s, shape (m,).
        ends: shape (m,).
        d: modes and discrete values of each, shape (nd, m).
    """

    def __init__(self, model: CompiledDae, steps: Vector, modes: Vector) -> None:
        self._model, self._steps = model, steps
        self.begins, self.ends, self.d = steps[:, 1], steps[:, 2], modes[steps[:, 0].astype(int)].T

    def points(self, pieces: Any, times: Vector) -> tuple[Vector, Vector]:
        """Return states and implicit unknowns within pieces at times, both ascending; shapes (nx, n), (nz, n)."""
        rows, nx = self._steps[pieces], len(self._model.states)
        s = ((times - rows[:, 1]) / (rows[:, 2] - rows[:, 1]))[:, None]
        first, last, a, b, c = np.split(rows[:, 3:], 5, axis=1)
        y = (first + s * (last - first + (1 - s) * (a + s * (b + s * c)))).T
        return y[:nx], polished(self._model, times, y[:nx], y[nx:], self.d[:, pieces])

    def at(self, times: Vector) -> tuple[Vector, Vector]:
        """Return states and implicit unknowns at ascending times, before an event at one of them."""
        return self.points(np.maximum(np.searchsorted(self.begins, times) - 1, 0), times)


@dataclass
class Keeper:
    """Keeps the steps of a run as far as there is room; what there is no room for is read and forgotten.

    Attributes:
        read: reads steps that are forgotten; without it the rest of the run is not kept.
        steps: the last ones, rows of `steps_taken` in native.c.
        forgotten: whether there were others before.
    """

    read: Callable[[Vector], None] | None = None
    steps: Vector = field(default_factory=lambda: np.zeros((0, 3)))
    forgotten: bool = False

    def dense(self, loop: Any) -> Callable[[], Dense] | None:
        """Return what returns the dense output of the whole run of a loop; None if it was not kept."""
        dense, steps = loop.dense, self.steps
        return (lambda: dense(steps)) if not self.forgotten else None

    def forget(self, steps: Vector) -> None:
        """Read what is not kept, or give up."""
        self.forgotten = True
        if self.read is not None:
            self.read(steps)
