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
from modelica_like.initialize.singular import implicit_singular, is_regular, singular_block

_MAX_NEWTON = 50
_ROUNDING = 1e-14


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
        if not np.all(np.isfinite(residual)) or not is_regular(jacobian):
            raise implicit_singular(model, point.t, point.d, jacobian)
        step = np.linalg.solve(jacobian, -residual)
        point.z = point.z + step
        change = float(np.max(np.abs(step) / (1.0 + np.abs(point.z))))
        # What the largest unknown leaves of a small one when it is rounded does not get smaller.
        if change < 1e-13 or np.max(np.abs(step)) <= _ROUNDING * np.max(np.abs(point.z)):
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
    regular = np.isfinite(determinants) & (np.abs(determinants) >= 1e-12)
    if not regular.all():
        raise singular_block(model, point.t, point.d, int(np.argmin(regular)))
    finite = np.isfinite(call(model, model.ode, point))
    if not finite.all():
        raise SingularAtStart(
            f"The derivative of {model.states[int(np.argmin(finite))]} is not finite at t = {point.t:.9g} s.",
            advice="Look for a mass, inertia or ratio of zero, or a function outside its domain.",
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
    # Reactions whose split is undetermined make the equations for z singular; what depends on them is left out.
    return by_x - by_z @ np.linalg.lstsq(alg_z, alg_x, rcond=None)[0] if np.any(by_z) else by_x
