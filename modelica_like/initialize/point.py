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
_WELL_CONDITIONED = 1e10
"""Bound of the condition of a matrix that is regular whatever its units are."""


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
    # By identity: asking a CasADi function for its name costs as much as evaluating a small one.
    fast = buffered(model._cache, id(function), lambda: function)
    return fast(point.t, point.x, point.z, model.p, model.u, point.d)[0]


def solve_implicit(model: CompiledDae, point: Point) -> None:
    """Solve the implicit equations for z by Newton's method.

    Raises:
        SingularAtStart: their Jacobian is singular.
        InitializationError: no convergence.
    """
    if not model.implicit:
        return
    fast = buffered(model._cache, "residual at", lambda: implicit_at(model))
    change, size = np.inf, len(model.implicit)
    for _ in range(_MAX_NEWTON):
        residual, entries = fast(point.t, point.x, point.z, model.p, model.u, point.d)
        jacobian = entries.reshape(size, size).T
        step = _newton_step(jacobian, residual)
        if step is None:
            raise implicit_singular(model, point.t, point.d, jacobian)
        point.z = point.z + step
        sizes = np.abs(step)
        change = float((sizes / (1.0 + np.abs(point.z))).max())
        # What the largest unknown leaves of a small one when it is rounded does not get smaller.
        if change < 1e-13 or sizes.max() <= _ROUNDING * np.abs(point.z).max():
            return
    if not change <= 1e-9:
        raise InitializationError(
            f"The equations for {', '.join(model.implicit)} were not solved at t = {point.t:.9g} s.",
            advice="Give guesses near the solution.",
        )


def implicit_at(model: CompiledDae) -> ca.Function:
    """Return residuals of the implicit equations and their dense Jacobian, columns one after the other."""
    arguments = list(model.arguments.values())
    both = ca.cse([model.alg(*arguments), ca.densify(model.alg_jacobian(*arguments))])
    return ca.Function("residual", arguments, both)


def _newton_step(jacobian: Any, residual: Vector) -> Vector | None:
    """Solve a step of Newton's method; None where its matrix is singular or something is not finite.

    The inverse, which comes along, shows that most matrices are far from singular; only the others are scaled and
    looked at closely.
    """
    size = len(residual)
    try:
        solved = np.linalg.solve(jacobian, np.column_stack([-residual, np.eye(size)]))
    except np.linalg.LinAlgError:
        return None
    condition = size * np.abs(jacobian).max() * np.abs(solved[:, 1:]).max()
    if not (condition < _WELL_CONDITIONED and np.isfinite(solved).all()) and (
        not np.isfinite(residual).all() or not np.isfinite(jacobian).all() or not is_regular(jacobian)
    ):
        return None
    return solved[:, 0]


def check_singular(model: CompiledDae, point: Point) -> None:
    """Check that every block has a unique solution.

    Raises:
        SingularAtStart: one has not.
    """
    determinants = call(model, model.determinants, point)
    if len(determinants):
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
    fast = buffered(model._cache, ("slopes", tuple(nodes)), lambda: _slopes(model, nodes))
    results = fast(point.t, point.x, point.z, model.p, model.u, point.d)
    shapes = [(rows, columns) for rows in (len(nodes), len(point.z)) for columns in (len(point.x), len(point.z))]
    by_x, by_z, alg_x, alg_z = (v.reshape(shape, order="F") for v, shape in zip(results, shapes, strict=True))
    # Reactions whose split is undetermined make the equations for z singular; what depends on them is left out.
    return by_x - by_z @ np.linalg.lstsq(alg_z, alg_x, rcond=None)[0] if by_z.any() else by_x


def _slopes(model: CompiledDae, nodes: list[int]) -> ca.Function:
    """Partial derivatives of variables, and of the implicit equations, by the states and by z; all dense."""
    arguments = list(model.arguments.values())
    x, z = model.arguments["x"], model.arguments["z"]
    variables, alg = model.variables(*arguments)[nodes], model.alg(*arguments)
    parts = [ca.jacobian(variables, x), ca.jacobian(variables, z), ca.jacobian(alg, x), ca.jacobian(alg, z)]
    return ca.Function("slopes", arguments, ca.cse([ca.densify(part) for part in parts]))
