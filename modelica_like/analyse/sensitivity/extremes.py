"""Extremes along a replay with their derivatives: at smooth tops, at ends, at events, at kinks that move."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from modelica_like.analyse.replay.chain import Reading, Replay
from modelica_like.analyse.replay.jumps import Jump
from modelica_like.analyse.replay.step import Step, shortened
from modelica_like.analyse.sensitivity.moving_kinks import kinks_at
from modelica_like.analyse.sensitivity.values import along, slopes_of, value_at
from modelica_like.compile.buffers import Vector
from modelica_like.errors import NoGradient
from modelica_like.solve.initialize import Point

_NEAR = 0.05
_FLAT = 1e-12
STILL = 1e-11
"""Rate, relative to those on both sides, that is zero."""
_MOVES = 1e-3
"""Rate at an extreme, relative to the largest one beside it, that is not zero: where a node is as high as the top to
twelve digits, it has about a millionth."""
_RISES = 1e-6
"""Rise over a step beside an extreme, relative to the range of the value, that is more than errors of its nodes: among
those of a value that comes to rest, any may be the largest."""
_ALIKE = 1e-6
"""Difference of how the times of two kinks move, relative to their changes, that is rounding."""


def extreme(replay: Replay, path: str, sign: float) -> Reading:
    """Read the largest (`sign` 1) or smallest (-1) value along a replay.

    Candidates are the nodes and the stages in between; near the best ones, zeros of the rate are located.

    Raises:
        NoGradient: it is where the value has a kink, or jumps, and nothing tells how the time of that moves.
    """
    rate: Callable[[Point], float] = lambda point: sign * float(slopes_of(replay.model, path, point).rate[0])  # noqa: E731
    values: Callable[[list[Point]], Vector] = lambda points: sign * along(replay, path, points)  # noqa: E731
    at_nodes = values(replay.nodes)
    inside = [values(move.inside()) if isinstance(move, Step) else np.zeros(0) for move in replay.moves]
    everything = np.concatenate([at_nodes, *inside])
    width = float(np.ptp(everything))
    level = float(np.max(everything)) - _NEAR * width
    best, top, top_step = int(np.argmax(at_nodes)), float(np.max(at_nodes)), None
    for k, (move, between) in enumerate(zip(replay.moves, inside, strict=True)):
        if isinstance(move, Step) and max(at_nodes[k], at_nodes[k + 1], *between) >= level:
            for step in _tops(move, rate):
                value = float(values([step.after])[0])
                if value > top + _FLAT * abs(top):
                    best, top, top_step = k, value, step
    if top_step is not None:
        replay.split(best, top_step)
        return _inside(replay, path, best + 1, width)
    # Beside a jump, the event may move.
    beside = (replay.moves[k] for k in (best, best - 1) if 0 <= k < len(replay.moves))
    jump = next((move for move in beside if isinstance(move, Jump)), None)
    if jump is None and 0 < best < len(replay.moves):
        return _inside(replay, path, best, width)
    return value_at(replay, path, replay.nodes[best], jump)


def _tops(step: Step, rate: Callable[[Point], float]) -> list[Step]:
    """Shorten a step to where a rate passes zero from above."""
    points = [step.before, *step.inside(), step.after]
    rates = [(point.t - step.before.t, rate(point)) for point in points]
    steps = [
        shortened(step, rate, low, high, STILL)
        for low, high in pairwise(rates)
        if low[1] > 0.0 >= high[1] or low[1] >= 0.0 > high[1]
    ]
    return [s for s in steps if s is not None]


def _inside(replay: Replay, path: str, k: int, width: float) -> Reading:
    """Read an extreme at a node between two steps; `width` is the range of the value.

    Where its rate is zero, a shift of its time has no effect. At a kink the rate is not zero, and the time moves with
    the kink g(t, x, p) = 0: by -g_p/g', g' being the rate of g.
    """
    node = replay.nodes[k]
    part, reading = slopes_of(replay.model, path, node), value_at(replay, path, node)
    shifts = [by for _, by in kinks_at(replay.model, path, node)]
    if shifts:
        first, *others = shifts
        apart = max((float(np.max(np.abs(other - first))) for other in others), default=0.0)
        if apart > _ALIKE * float(np.max(np.abs(shifts))):
            raise _unknown(replay, path, node, "Kinks that move differently meet there.")
        return Reading(reading.value, ((node, part.by[0] + float(part.rate[0]) * first),))
    steps = [move for move in replay.moves[k - 1 : k + 1] if isinstance(move, Step)]
    largest = max(abs(float(slopes_of(replay.model, path, point).rate[0])) for step in steps for point in step.inside())
    rate, longest = abs(float(part.rate[0])), max(step.h for step in steps)
    if rate > _MOVES * largest and rate * longest > max(_RISES * width, _FLAT * abs(reading.value)):
        raise _unknown(replay, path, node, "It has a kink there, and nothing tells how its time moves.")
    return reading


def _unknown(replay: Replay, path: str, node: Point, why: str) -> NoGradient:
    return NoGradient(
        f"No gradient of the extreme of {path} in {replay.model.name} at t = {node.t:.9g} s: its rate is not "
        "zero there.",
        why=why,
        advice="Ask for the value at a time, or move the parameters.",
    )
