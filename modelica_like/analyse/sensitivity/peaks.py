"""The largest or smallest value of a variable along a replay."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.analyse.replay.chain import Replay, Step
from modelica_like.analyse.replay.jumps import Jump
from modelica_like.analyse.slopes import slopes
from modelica_like.compile.buffers import Vector, buffered
from modelica_like.initialize import Point

_NEAR = 0.05
_TRIALS = 60
_FLAT = 1e-12


@dataclass(frozen=True)
class Peak:
    """Where a variable is largest: at a node, inside the step behind it (`probe`), or at an event (`jump`)."""

    value: float
    node: int
    probe: Step | None = None
    jump: int | None = None


def peak(replay: Replay, name: str, expression: Callable[[], Any], sign: float) -> Peak:
    """Find the largest value (sign 1) or the smallest (sign -1) of a variable along a replay.

    Candidates are the nodes and the stages in between; near the best of them zeros of the rate are sought.
    """
    at_nodes = sign * _along(replay, name, expression, replay.nodes)
    inside = [
        sign * _along(replay, name, expression, move.inside(replay.functions.tableau.nodes))
        if isinstance(move, Step)
        else np.zeros(0)
        for move in replay.moves
    ]
    best = int(np.argmax(at_nodes))
    found = Peak(float(at_nodes[best]), best)
    everything = np.concatenate([at_nodes, *inside])
    level = float(np.max(everything) - _NEAR * np.ptp(everything))
    for k, values in enumerate(inside):
        highest = np.max(np.append(values, max(at_nodes[k], at_nodes[k + 1])), initial=-np.inf)
        if values.size and highest >= level:
            other = _inside(replay, name, expression, sign, k)
            if other is not None and other.value > found.value + _FLAT * abs(found.value):
                found = other
    return found if found.probe is not None else replace(found, jump=_beside(replay, found.node))


def _along(replay: Replay, name: str, expression: Callable[[], Any], points: list[Point]) -> Vector:
    """Values of a variable at points."""
    model = replay.model
    given = list(model.arguments.values())
    fast = buffered(
        model._cache, ("only", name), lambda: ca.Function("value", given, [ca.densify(ca.SX(expression()))])
    )
    return np.array([fast(o.t, o.x, o.z, model.p, model.u, o.d)[0][0] for o in points])


def _beside(replay: Replay, node: int) -> int | None:
    """The jump that a node is one side of, where the event may move."""
    for k in (node, node - 1):
        if 0 <= k < len(replay.moves):
            move = replay.moves[k]
            if isinstance(move, Jump):
                move.time()
                return k
    return None


def _inside(replay: Replay, name: str, expression: Callable[[], Any], sign: float, k: int) -> Peak | None:
    """Find the zero of the rate inside step k, from rising to falling."""
    step = replay.moves[k]
    assert isinstance(step, Step)
    points = [step.before, *step.inside(replay.functions.tableau.nodes), step.after]
    rates = [sign * _rate(replay, name, expression, point) for point in points]
    found: Peak | None = None
    for (a, first), (b, second) in zip(
        zip(points, rates, strict=True), zip(points[1:], rates[1:], strict=True), strict=False
    ):
        if first > 0.0 >= second or (first >= 0.0 > second):
            probe = _top(replay, name, expression, sign, k, (a.t, first), (b.t, second))
            if probe is not None:
                value = sign * float(_along(replay, name, expression, [probe.after])[0])
                if found is None or value > found.value:
                    found = Peak(value, k, probe)
    return found


def _top(
    replay: Replay, name: str, expression: Callable[[], Any], sign: float, k: int, low: tuple[float, float],
    high: tuple[float, float],
) -> Step | None:  # fmt: skip
    """Regula falsi (Illinois) on the rate between two times."""
    (a, fa), (b, fb) = low, high
    begin = replay.nodes[k].t
    probe: Step | None = None
    for _ in range(_TRIALS):
        t = b - fb * (b - a) / (fb - fa)
        if t <= begin:
            return None
        probe = replay.probe(k, t)
        f = sign * _rate(replay, name, expression, probe.after)
        if abs(b - a) <= 1e-13 * max(1.0, abs(t)) or abs(f) <= 1e-13 * (abs(low[1]) + abs(high[1])):
            return probe
        if f * fb < 0.0:
            a, fa = b, fb
        else:
            fa *= 0.5
        b, fb = t, f
    return probe


def _rate(replay: Replay, name: str, expression: Callable[[], Any], point: Point) -> float:
    part = slopes(replay.model, point, name, expression)
    return float(part.t[0] + part.x[0] @ slopes(replay.model, point, "ode").value)
