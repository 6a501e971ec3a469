"""First derivatives of a compiled model's functions at a point, with the implicit unknowns following."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from threading import get_ident
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.compile.buffers import BufferedFunction, Vector
from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import UnknownName, did_you_mean
from modelica_like.initialize import Point
from modelica_like.initialize.kept import find_kept, solve_kept
from modelica_like.initialize.steady import moving_states


@dataclass(frozen=True)
class Sizes:
    """Numbers of states, implicit unknowns, parameters, inputs, discrete values; theta is (p, u, d)."""

    x: int
    z: int
    p: int
    u: int
    d: int

    @classmethod
    def of(cls, model: CompiledDae) -> Sizes:
        """Read them off a model."""
        return cls(len(model.states), len(model.implicit), len(model.p), len(model.u), model.discrete_size)

    @property
    def theta(self) -> int:
        """Parameters, inputs and discrete values."""
        return self.p + self.u + self.d

    @property
    def fixed(self) -> int:
        """Parameters and inputs: all that is constant during a run."""
        return self.p + self.u


@dataclass(frozen=True)
class Slopes:
    """Derivatives of a function; shapes (rows, nx), (rows,), (rows, ntheta), and the value, shape (rows,).

    The implicit unknowns follow from the others.
    """

    model: CompiledDae
    point: Point
    value: Vector
    x: Vector
    t: Vector
    theta: Vector

    @cached_property
    def by(self) -> Vector:
        """Derivatives by (x, theta), shape (rows, nx + ntheta)."""
        return np.hstack([self.x, self.theta])

    @cached_property
    def rate(self) -> Vector:
        """Change over time along the motion, shape (rows,)."""
        return self.t + self.x @ slopes(self.model, self.point, "ode").value


class _Partials:
    """Value and partial derivatives by x, z, t and (p, u, d), called sparse and given dense."""

    def __init__(self, symbols: list[Any], value: Any) -> None:
        t, x, z, *theta = symbols[:6]
        outputs = [ca.densify(value), *(ca.jacobian(value, one) for one in (x, z, t, ca.vertcat(*theta)))]
        self._fast = BufferedFunction(ca.Function("slopes", symbols, outputs))
        patterns = [self._fast.function.sparsity_out(k) for k in range(len(outputs))]
        self._patterns = [(one.shape, np.array(one.find(), int)) for one in patterns]

    def __call__(self, model: CompiledDae, point: Point, *constants: Vector) -> list[Vector]:
        found = self._fast(point.t, point.x, point.z, model.p, model.u, point.d, *constants)
        return [_filled(entries, *pattern) for entries, pattern in zip(found, self._patterns, strict=True)]


def _filled(entries: Vector, shape: tuple[int, int], places: Any) -> Vector:
    """Fill a matrix column by column."""
    if len(places) < shape[0] * shape[1]:
        given, entries = entries, np.zeros(shape[0] * shape[1])
        entries[places] = given
    return entries.reshape(shape, order="F")


def slopes(
    model: CompiledDae, point: Point, name: str, rows: Sequence[int] | None = None,
    function: Callable[[], ca.Function] | None = None, *constants: Vector,
) -> Slopes:  # fmt: skip
    """Differentiate a function of the model.

    Args:
        model: the compiled model.
        point: where.
        name: name of one of its functions, or of `function` in the cache.
        rows: which results of the function; by default all.
        function: makes a function of the model's arguments, and of `constants`.
        constants: numbers that are not differentiated.
    """

    def make() -> _Partials:
        made: ca.Function = getattr(model, name) if function is None else function()
        # Linear equations are solved in numbers.
        as_numbers = function is not None and not made.is_a("SXFunction")
        symbols = made.mx_in() if as_numbers else [*model.arguments.values()]
        value = made(*symbols)
        return _Partials(symbols, value if rows is None else value[list(rows)])

    chosen = None if rows is None else tuple(rows)
    partials = model.once(("slopes of", name, chosen, get_ident()), make)
    value, x, z, t, theta = partials(model, point, *constants)
    if np.any(z):
        z_x, z_t, z_theta = implicit_slopes(model, point)
        x, t, theta = x + z @ z_x, t + z @ z_t, theta + z @ z_theta
    return Slopes(model, point, value[:, 0], x, t[:, 0], theta)


def implicit_slopes(model: CompiledDae, point: Point) -> tuple[Vector, Vector, Vector]:
    """Derivatives of z by x, t and theta; shapes (nz, nx), (nz, 1), (nz, ntheta)."""
    symbols = [*model.arguments.values()]
    make = lambda: _Partials(symbols, model.alg(*symbols))  # noqa: E731
    _, x, z, t, theta = model.once(("slopes of z", get_ident()), make)(model, point)
    solved = np.asarray(-np.linalg.solve(z, np.hstack([x, t, theta])), np.float64)
    columns = x.shape[1]
    return solved[:, :columns], solved[:, columns : columns + 1], solved[:, columns + 1 :]


def nodes_of(model: CompiledDae, names: Iterable[str]) -> list[int]:
    """Return the positions of variables.

    Raises:
        UnknownName: a name is not a variable of the model.
    """
    return _found(model, names, model.position, "variable")


def columns_of(model: CompiledDae, names: Iterable[str]) -> list[int]:
    """Return the positions in (p, u) of parameters and inputs.

    Raises:
        UnknownName: the model has no such parameter or input.
    """
    return _found(model, names, model.fixed_position, "input or parameter")


def _found(model: CompiledDae, names: Iterable[str], known: Mapping[str, int], what: str) -> list[int]:
    missing = next((name for name in names if name not in known), None)
    if missing is not None:
        raise UnknownName(f"{model.name} has no {what} '{missing}'{did_you_mean(missing, known) or '.'}")
    return [known[name] for name in names]


def steady_change(model: CompiledDae, point: Point, theta: Vector, guess: Vector | None = None) -> Vector:
    """Return how the states of a steady state change: the implicit function theorem.

    Args:
        model: the compiled model.
        point: the steady state.
        theta: changes of (p, u, d), shape (ntheta, columns).
        guess: changes of the states that equilibrium does not determine, shape (nx, columns); none by default.
    """
    moving, rates = moving_states(model), slopes(model, point, "ode")
    change = np.zeros((len(rates.x), theta.shape[1])) if guess is None else guess.copy()
    inner = rates.x[np.ix_(moving, moving)]
    kept = find_kept(model, point, moving, inner)
    held = slopes(model, point, "variables", kept.held)
    right = rates.theta[moving] @ theta + inner @ change[moving]
    of_held = held.theta @ theta + held.x[:, moving] @ change[moving]
    change[moving] += solve_kept(kept, inner, -right, -of_held)
    return change
