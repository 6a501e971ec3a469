"""A point of the solution.

Evaluate functions there, solve the implicit equations, check that the blocks are regular.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.compile.buffers import buffered
from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.errors import InitializationError, SingularAtStart

_MAX_NEWTON = 50


@dataclass
class Point:
    """A point of the solution: time, states, implicit unknowns, modes and discrete values."""

    t: float
    x: Vector
    z: Vector
    d: Vector

    def copy(self) -> Point:
        """Return an independent copy."""
        return Point(self.t, self.x.copy(), self.z.copy(), self.d.copy())


def call(model: CompiledDae, function: Any, point: Point) -> Vector:
    """Evaluate a function of the model at a point; the result is flat."""
    fast = buffered(model._cache, function.name(), lambda: function)
    return fast(point.t, point.x, point.z, model.p, model.u, point.d)[0]


def solve_implicit(model: CompiledDae, point: Point) -> None:
    """Solve the implicit equations for z by Newton's method.

    Raises:
        SingularAtStart: their Jacobian is singular.
        InitializationError: no convergence.
    """
    if not model.implicit:
        return
    change = np.inf
    for _ in range(_MAX_NEWTON):
        residual = call(model, model.alg, point)
        jacobian = np.asarray(model.alg_jacobian(point.t, point.x, point.z, model.p, model.u, point.d).full())
        if not np.all(np.isfinite(residual)) or np.linalg.matrix_rank(jacobian) < len(residual):
            raise _singular(model, point, [tuple(model.implicit)], ())
        step = np.linalg.solve(jacobian, -residual)
        point.z = point.z + step
        change = float(np.max(np.abs(step) / (1.0 + np.abs(point.z))))
        if change < 1e-13:
            return
    if not change <= 1e-9:
        raise InitializationError(
            f"The equations for {', '.join(model.implicit)} were not solved at t = {point.t:.9g} s.",
            advice="Give guesses near the solution.",
        )


def check_singular(model: CompiledDae, point: Point) -> None:
    """Check that every block has a unique solution.

    Raises:
        SingularAtStart: one has not.
    """
    determinants = call(model, model.determinants, point)
    for value, (names, origins) in zip(determinants, model.singular, strict=True):
        if not np.isfinite(value) or abs(value) < 1e-12:
            raise _singular(model, point, [names], tuple(dict.fromkeys(o.source for o in origins)))
    rates = call(model, model.ode, point)
    for name, rate in zip(model.states, rates, strict=True):
        if not np.isfinite(rate):
            raise SingularAtStart(
                f"The derivative of {name} is not finite at t = {point.t:.9g} s.",
                advice="Look for a mass, inertia or ratio of zero, or a function outside its domain.",
            )


def _singular(model: CompiledDae, point: Point, blocks: list[tuple[str, ...]], where: Any) -> SingularAtStart:
    names = [name for block in blocks for name in block]
    number = 1 + next((k for k, (known, _) in enumerate(model.singular) if known == blocks[0]), 0)
    stuck = [
        one.path.rpartition(".")[0]
        for k, one in enumerate(model.flat_discretes)
        if one.names and one.names[int(point.d[k])] == "stuck"
    ]
    held = [name for name in names if name.rpartition(".")[0] in stuck]
    told = held if len(stuck) > 1 and held else names
    shown = ", ".join(told[:6]) + (", …" if len(told) > 6 else "")
    if len(stuck) > 1:
        why = f"{' and '.join(stuck)} stick: where they hold the same motion, their torque split is undetermined."
        advice = "Make one compliant, or let one start open."
    else:
        why = "Its equations do not determine all of its unknowns there."
        advice = 'Start elsewhere, or let other variables be states (state="always").'
    return SingularAtStart(
        f"The Jacobian is singular at t = {point.t:.9g} s in block {number} ({shown}).",
        where=where,
        why=why,
        advice=advice,
    )


def variable_slopes(model: CompiledDae, point: Point, nodes: list[int]) -> Vector:
    """Total derivative of variables by the states at a point, z following the states; shape (nodes, states)."""
    if "slopes" not in model._cache:
        call_arguments = list(model.arguments.values())
        x, z = model.arguments["x"], model.arguments["z"]
        variables, alg = model.variables(*call_arguments), model.alg(*call_arguments)
        outputs = [ca.jacobian(variables, x), ca.jacobian(variables, z), ca.jacobian(alg, x), ca.jacobian(alg, z)]
        model._cache["slopes"] = ca.Function("slopes", call_arguments, outputs)
    parts = model._cache["slopes"](point.t, point.x, point.z, model.p, model.u, point.d)
    by_x, by_z, alg_x, alg_z = (
        np.asarray(part[nodes, :].full() if k < 2 else part.full()) for k, part in enumerate(parts)
    )
    return by_x - by_z @ np.linalg.solve(alg_z, alg_x) if model.implicit else by_x
