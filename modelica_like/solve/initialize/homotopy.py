"""Starts with `homotopy`: the simplified system is solved first, and its solution led to that of the actual one."""

from __future__ import annotations

from collections.abc import Callable

from modelica_like.compile.compiled import HOMOTOPY as HOMOTOPY
from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import InitializationError, SingularAtStart
from modelica_like.solve.initialize.point import Point

_STEP = 1 / 16
"""Share by which the actual expressions grow at once: a power of two, so that the last step ends at 1 exactly."""
_LEAST = 2.0**-14
"""Smaller steps mean that the solution turns back or ends."""


def lead(model: CompiledDae, point: Point, solve: Callable[[Point], Point], follow: Callable[[Point], Point]) -> Point:
    """Solve the simplified system, and lead its solution to the actual one.

    Args:
        model: the compiled model.
        point: the guesses.
        solve: for the start from guesses, with the share of the actual expressions in the point; may change it.
        follow: the same from the solution for another share.

    Raises:
        InitializationError, SingularAtStart: the simplified system is not solved, or the way ends before the actual
            one.
    """
    place = model.discrete_position.get(HOMOTOPY)
    if place is None:
        return solve(point)
    point.d[place] = 0.0
    now, step = solve(point), _STEP
    while (share := float(now.d[place])) < 1.0:
        ahead = now.copy()
        ahead.d[place] = min(share + step, 1.0)
        try:
            now = follow(ahead)
        except (InitializationError, SingularAtStart):
            step /= 2
            if step < _LEAST:
                raise
    return now
