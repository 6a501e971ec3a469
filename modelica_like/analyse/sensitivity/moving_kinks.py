"""Kinks of a value in time, without an event: where they are, and how their times move."""

from __future__ import annotations

import casadi as ca
import numpy as np

from modelica_like.analyse.replay.kinks import Kinks
from modelica_like.analyse.sensitivity.values import slopes_of
from modelica_like.compile.buffers import Vector
from modelica_like.compile.cached import Cached
from modelica_like.compile.compiled import CompiledDae
from modelica_like.compile.edges import kinks_of
from modelica_like.runs.readings import expression_of
from modelica_like.solve.initialize import Point, call, solve_implicit

_AT_IT = 1e-8
"""Distance of an extreme from its kink, relative to the time: steps end 2e-13 before it, searches of it within 1e-9."""
_BESIDE = 1e-7
"""Distance of points on both sides of a kink, relative to the time."""
_NEARER, _STAYS = 0.1, 0.5
"""Nearer to a kink, at this part of the distance, what jumps is as large; what is merely bent is this part of it."""
_FELT = 1e-6
"""Jump of a value or of its rate, relative to those on both sides, that is more than rounding."""


def kinks_at(model: CompiledDae, path: str, node: Point) -> list[tuple[float, Vector]]:
    """Return how much later than a node the value or its rate jumps, and the derivatives of that by (x, theta) there.

    Kinks of the value itself, and of what it follows from, come first: others that the run passes at the same time, as
    those of a table in the equations of states, leave its rate as it is unless they jump.
    """
    kinks, of_value = model.once((Cached.KINKS_OF, path), lambda: _kinks_of(model, path))
    rates, size = call(model, model.equations.ode, node), max(1.0, abs(node.t))

    def along(time: float) -> Point:
        point = Point(node.t + time, node.x + time * rates, node.z.copy(), node.d)
        solve_implicit(model, point)
        return point

    def both(time: float) -> Vector:
        """Value and rate a moment from the node."""
        part = slopes_of(model, path, along(time))
        return np.array([part.value[0], part.rate[0]])

    def jumps(late: float) -> bool:
        """Whether the value or its rate jumps so much later than the node."""
        sides = [[both(late + sign * by) for sign in (1, -1)] for by in (_BESIDE * size, _NEARER * _BESIDE * size)]
        far, near = (abs(after - before) for after, before in sides)
        sizes = np.sum(np.abs(sides[0]), axis=0)
        return bool(np.any((near > _STAYS * far) & (near > _FELT * sizes)))

    sides = (kinks.at(along(sign * _AT_IT * size)).copy() for sign in (1, -1))
    near = np.abs(kinks.at(node)) <= np.abs(np.subtract(*sides))  # by half their change between them, and by its error
    for numbers in (range(kinks.count - of_value, kinks.count), range(kinks.count - of_value)):
        every = (kinks.slopes(node, number) for number in numbers if near[number])
        # Without a division: a rate may be so small that a time has no number.
        there = [kink for kink in every if kink.rate[0] and abs(kink.value[0]) <= _AT_IT * size * abs(kink.rate[0])]
        times = [-float(kink.value[0] / kink.rate[0]) for kink in there]
        jumping = [(late, -kink.by[0] / kink.rate[0]) for kink, late in zip(there, times, strict=True) if jumps(late)]
        if jumping:
            return jumping
    return []


def _kinks_of(model: CompiledDae, path: str) -> tuple[Kinks, int]:
    """Kinks of the equations and of a value, and how many, the last ones, are of the value and of its equations."""
    value, given = ca.SX(expression_of(model, path)[0]()), model.arguments
    if ca.depends_on(value, given["z"]):
        value = ca.vertcat(value, model.equations.alg(*given.values()))
    return Kinks(model, (), value), len(kinks_of(given, value))
