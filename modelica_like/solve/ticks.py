"""Time events that change nothing that moves: the integrator passes them, and they are fired afterwards."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from modelica_like.compile.compiled import CompiledDae, CompiledTransition
from modelica_like.solve.initialize import Point
from modelica_like.solve.instants import Instants
from modelica_like.solve.looks import Looks

_TRUST = 2
"""Further ticks that a panel may pass for each one that has changed nothing, so that panels grow threefold."""
_DEEPEST = 10


class Ticks:
    """Knows how far the integrator may go, and what a time event has changed.

    Args:
        model: the compiled model.
        instants: knows the times of its time events.
    """

    def __init__(self, model: CompiledDae, instants: Instants) -> None:
        self._instants = instants
        self._quiet = Counter[int]()
        self._felt = model.once("felt", lambda: _felt(model)) if instants.timed else []

    def stop(self, now: Point) -> float:
        """Return the time up to which the integrator may go; how often a tick changed nothing says how many it passes.

        One that does change something takes the run back to its time.
        """
        if not self._instants.timed:
            return np.inf
        ahead = self._instants.ahead(now)
        return min((t + _TRUST * self._quiet[id(one)] * (t - now.t) for one, t in ahead), default=np.inf)

    def moved(self, before: Point, after: Point, fired: Sequence[CompiledTransition]) -> bool:
        """Return whether an event has changed anything that moves: a state, or what continuous equations read.

        Of ticks that fall together, those count as its cause that have been one before.
        """
        ticks, quiet = [id(one) for one in fired if one.timed], self._quiet
        if len(ticks) < len(fired):
            return True
        moved = bool((before.x != after.x).any() or (before.d[self._felt] != after.d[self._felt]).any())
        for one in [tick for tick in ticks if not (moved and quiet[tick])] or ticks:
            quiet[one] = 0 if moved else quiet[one] + 1
        return moved

    def point(self, looks: Looks, t: float, last: int, closer: Callable[[Looks, int], Looks], depth: int = 0) -> Point:
        """Return the point at a time between looks, by closer ones where interpolation is not precise.

        Args:
            looks: integrated points.
            t: in s.
            last: the last valid look.
            closer: integrates an interval with closer looks.
            depth: number of refinements so far.
        """
        k = int(looks.intervals(np.array([t]))[0])
        cells = looks.cells(k, last)
        cell = next((one for one in cells if depth >= _DEEPEST or looks.is_precise(one)), None)
        if cell is not None:
            return looks.at(t, cell)[0]
        nearer = closer(looks, k)
        return self.point(nearer, t, nearer.count, closer, depth + 1)


def _felt(model: CompiledDae) -> Any:
    """Entries of d that continuous equations, state events and delays read, and the modes of these events."""
    found = {one.mode for one in model.transitions if not one.timed}
    for function in (model.ode, model.alg, model.guards, model.delays):
        found.update(function.jac_sparsity(0, function.index_in("d")).get_triplet()[1])
    return sorted(found)
