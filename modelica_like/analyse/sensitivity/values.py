"""Values of a variable or formula along a replay, with their derivatives."""

from __future__ import annotations

import casadi as ca
import numpy as np

from modelica_like.analyse.replay.chain import Reading, Replay
from modelica_like.analyse.replay.jumps import Jump
from modelica_like.compile.buffers import Vector
from modelica_like.compile.cached import Cached
from modelica_like.compile.compiled import CompiledDae
from modelica_like.runs.readings import expression_of
from modelica_like.solve.initialize import Point
from modelica_like.solve.initialize.slopes import Slopes, slopes


def value_at(replay: Replay, path: str, node: Point, jump: Jump | None = None) -> Reading:
    """Read a variable at a node, or at a jump that moves with it."""
    part = slopes_of(replay.model, path, node)
    parts = [(node, part.by[0])]
    if jump is not None:
        parts.append((jump.before, float(part.rate[0]) * jump.time().by))
    return Reading(float(part.value[0]), tuple(parts))


def slopes_of(model: CompiledDae, path: str, node: Point) -> Slopes:
    """Value, derivatives and rate of a variable at a point."""
    return slopes(model, node, (Cached.VALUE, path), None, lambda: _function(model, path))


def along(replay: Replay, path: str, points: list[Point]) -> Vector:
    """Values of a variable at points."""
    model = replay.model
    fast = model.fast((Cached.VALUE, path), lambda: _function(model, path))
    return np.array([fast(o.t, o.x, o.z, model.p, model.u, o.d)[0][0] for o in points])


def _function(model: CompiledDae, path: str) -> ca.Function:
    return ca.Function("value", [*model.arguments.values()], [ca.densify(ca.SX(expression_of(model, path)[0]()))])
