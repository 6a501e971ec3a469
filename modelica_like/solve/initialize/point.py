"""A point of the solution.

Evaluate functions there, solve the implicit equations, check that the blocks are regular.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.compile.cached import Cached
from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.errors import InitializationError, SingularAtStart
from modelica_like.solve.initialize.singular import VANISHES, implicit_singular, is_regular, singular_block

_MAX_NEWTON = 50
_ROUNDING = 1e-14
_POLISHING, _POLISHED = 8, 1e-8
"""Steps of Newton's method, and change below which the next one is rounding."""
_FEW = 3
"""Largest number of implicit unknowns for which a step of Newton's method is unrolled."""
_WELL_CONDITIONED = 1e10
"""Bound of the condition number below which a matrix is regular in any units."""


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
    """Evaluate a function at a point.

    Args:
        model: with parameters and inputs.
        function: of (t, x, z, p, u, d), with one result.
        point: with the other arguments.

    Returns:
        The result, flat: columns one after the other.
    """
    # By identity: reading the name of a CasADi function costs as much as evaluating a small one.
    fast = model.fast((Cached.CALLED, id(function)), lambda: function)
    return fast(point.t, point.x, point.z, model.p, model.u, point.d)[0]


def largest(model: CompiledDae, sizes: Vector, node: int) -> float:
    """Return the largest size of the variables in the unit of one, at least its nominal value."""
    variable = model.flat_variables[node]
    alike = (k for k, other in enumerate(model.flat_variables) if other.unit == variable.unit)
    return max(variable.nominal, *(float(sizes[k]) for k in alike))


def solve_implicit(model: CompiledDae, point: Point) -> None:
    """Solve the implicit equations for z by Newton's method.

    Raises:
        SingularAtStart: their Jacobian is singular.
        InitializationError: no convergence.
    """
    if not model.implicit:
        return
    fast = model.fast(Cached.NEWTON, lambda: newton_at(model, look=True))
    change = np.inf
    for _ in range(_MAX_NEWTON):
        new, condition = fast(point.t, point.x, point.z, model.p, model.u, point.d)
        sizes = np.abs(new - point.z)
        farthest = sizes.max()
        if not (condition[0] < _WELL_CONDITIONED and isfinite(farthest)):
            _check_regular(model, point)
        change = float((sizes / (1.0 + np.abs(new))).max())
        point.z = new
        # The residual of a small unknown cannot fall below the rounding of the largest one.
        if change < 1e-13 or farthest <= _ROUNDING * np.abs(new).max():
            return
    if not change <= 1e-9:
        raise not_solved(model, point)


def not_solved(model: CompiledDae, point: Point) -> InitializationError:
    """Return the error of implicit equations for which Newton's method does not converge."""
    return InitializationError(
        f"The equations for {', '.join(model.implicit)} were not solved at t = {point.t:.9g} s.",
        advice="Give guesses near the solution.",
    )


def implicit_at(model: CompiledDae) -> ca.Function:
    """Return residuals of the implicit equations and their dense Jacobian, columns one after the other."""
    arguments = list(model.arguments.values())
    both = ca.cse([model.equations.alg(*arguments), ca.densify(model.equations.alg_jacobian(*arguments))])
    return ca.Function("residual", arguments, both)


def newton_at(model: CompiledDae, *, look: bool) -> ca.Function:
    """Return z after one step of Newton's method and, with `look`, a bound of the condition of the Jacobian.

    The inverse, computed for the step, shows that most matrices are far from singular.
    """
    size = len(model.implicit)
    arguments = list(model.arguments.values()) if size <= _FEW else implicit_at(model).mx_in()
    residual, entries = implicit_at(model)(*arguments)
    jacobian = ca.reshape(entries, size, size)
    right = ca.horzcat(residual, ca.DM.eye(size)) if look else residual
    solved = ca.solve(jacobian, right) if size <= _FEW else ca.solve(jacobian, right, "qr")
    new = arguments[2] - solved[:, 0]
    condition = size * ca.mmax(ca.fabs(jacobian)) * ca.mmax(ca.fabs(solved[:, 1:])) if look else 0
    return ca.Function("newton", arguments, [new, condition])


def polished(model: CompiledDae, times: Vector, x: Vector, z: Vector, d: Vector) -> Vector:
    """Solve for the implicit unknowns by Newton's method, from what an integrator has within its tolerance.

    Otherwise constraints on them would be no more precise.

    Args:
        model: the compiled model.
        times: shape (n,), in s.
        x: states, shape (nx, n).
        z: guesses, shape (nz, n).
        d: modes and discrete values, shape (nd,), or (nd, n) if they vary.
    """
    if not model.implicit:
        return z
    everywhere = model.along(Cached.NEWTON, lambda: newton_at(model, look=False))
    d = np.broadcast_to(d if d.ndim > 1 else d[:, None], (len(d), len(times)))
    for _ in range(_POLISHING):
        new = everywhere(times, x, z, model.p, model.u, d)[0]
        # Behind an event, the equations of the old mode may have no solution.
        new = np.where(np.isfinite(new).all(axis=0), new, z)
        step, z = new - z, new
        # The error after a step of Newton's method is about the square of the step.
        if is_linear(model) or not np.max(np.abs(step) - _POLISHED * np.abs(z)) > _POLISHED:
            break
    return z


def is_linear(model: CompiledDae) -> bool:
    """Whether the implicit equations are linear in z: then one step of Newton's method solves them."""
    slopes = model.equations.alg_jacobian
    return model.once(Cached.LINEAR, lambda: not slopes.jac_sparsity(0, slopes.index_in("z")).nnz())


def _check_regular(model: CompiledDae, point: Point) -> None:
    """Check a Jacobian that may be singular, independent of its units.

    Raises:
        SingularAtStart: it is.
    """
    fast, size = model.fast(Cached.RESIDUAL, lambda: implicit_at(model)), len(model.implicit)
    residual, entries = fast(point.t, point.x, point.z, model.p, model.u, point.d)
    jacobian = entries.reshape(size, size).T
    if not (np.isfinite(residual).all() and is_regular(jacobian)):
        raise implicit_singular(model, point)


def check_singular(model: CompiledDae, point: Point) -> None:
    """Check that every block has a unique solution.

    Raises:
        SingularAtStart: one has no unique solution.
    """
    fast = model.fast(Cached.REGULAR, lambda: _regular(model))
    if not fast(point.t, point.x, point.z, model.p, model.u, point.d)[0][0]:
        return
    determinants = call(model, model.equations.determinants, point)
    regular = np.isfinite(determinants) & (np.abs(determinants) >= VANISHES)
    if not regular.all():
        raise singular_block(model, point, int(np.argmin(regular)))
    finite = np.isfinite(call(model, model.equations.ode, point))
    raise rate_not_finite(model, point, int(np.argmin(finite)))


def rate_not_finite(model: CompiledDae, point: Point, state: int) -> SingularAtStart:
    """Return the error of a state, given by its position, without a finite derivative."""
    return SingularAtStart(
        f"The derivative of {model.states[state]} is not finite at t = {point.t:.9g} s.",
        where=model.places_of([model.states[state].removeprefix("der(").rpartition(".")[0]]),
        advice="Look for a mass, inertia or ratio of zero, or a function outside its domain.",
    )


def _regular(model: CompiledDae) -> ca.Function:
    """Return the numbers of zero determinants and of derivatives that are not finite."""
    arguments = list(model.arguments.values())
    sizes, rates = ca.fabs(model.equations.determinants(*arguments)), ca.fabs(model.equations.ode(*arguments))
    wrong = ca.vertcat(0, ca.logic_not(ca.logic_and(sizes >= VANISHES, sizes < np.inf)), ca.logic_not(rates < np.inf))
    return ca.Function("regular", arguments, [ca.cse(ca.densify(ca.sum1(wrong)))])
