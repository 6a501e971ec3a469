"""First derivatives of a compiled model's functions at a point, with the implicit unknowns following."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from threading import get_ident
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.compile.buffers import BufferedFunction, Vector
from modelica_like.compile.cached import Cached, Key
from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import SingularAtStart, UnknownName, did_you_mean
from modelica_like.solve.initialize.point import Point
from modelica_like.solve.initialize.singular import is_regular

_Names = tuple[str, ...]
_Columns = Sequence[int] | None
_ALL: _Names = ("x", "t", "theta")


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
    """Value and partial derivatives by z and some of x, t and theta = (p, u, d), called sparse and given dense."""

    def __init__(self, symbols: list[Any], value: Any, by: _Names) -> None:
        t, x, z, *theta = symbols[:6]
        columns = {"x": x, "t": t, "theta": ca.vertcat(*theta)}
        outputs = [ca.densify(value), *(ca.jacobian(value, column) for column in (z, *(columns[name] for name in by)))]
        self._fast = BufferedFunction(ca.Function("slopes", symbols, outputs))
        patterns = [self._fast.function.sparsity_out(k) for k in range(len(outputs))]
        self._patterns = [(pattern.shape, np.array(pattern.find(), int)) for pattern in patterns]
        self._names = "value", "z", *by

    def __call__(self, model: CompiledDae, point: Point, *constants: Vector, columns: _Columns = None) -> list[Vector]:
        results = self._fast(point.t, point.x, point.z, model.p, model.u, point.d, *constants)
        parts = zip(self._names, results, self._patterns, strict=True)
        return [_filled(entries, *pattern, columns if name == "theta" else None) for name, entries, pattern in parts]


def _filled(entries: Vector, shape: tuple[int, int], places: Any, columns: _Columns) -> Vector:
    """Fill a matrix column by column, of which only some columns may be wanted."""
    if columns is not None:
        new = np.full(shape[1], -1)
        new[list(columns)] = range(len(columns))
        column = new[places // shape[0]]
        places, entries = (column * shape[0] + places % shape[0])[column >= 0], entries[column >= 0]
        shape = shape[0], len(columns)
    filled = np.zeros(shape[0] * shape[1])
    filled[places] = entries
    return filled.reshape(shape, order="F")


def slopes(
    model: CompiledDae, point: Point, name: str | Key, rows: Sequence[int] | None = None,
    function: Callable[[], ca.Function] | None = None, *constants: Vector, columns: Sequence[int] | None = None,
) -> Slopes:  # fmt: skip
    """Differentiate a function of the model.

    Args:
        model: the compiled model.
        point: where.
        name: name of one of its functions, or of `function` in the cache.
        rows: which results of the function; by default all.
        function: makes a function of the model's arguments, and of `constants`.
        constants: numbers that are not differentiated.
        columns: different positions in theta, by which alone to differentiate; by default all, which are many.
    """

    def make() -> tuple[list[Any], Any]:
        differentiated: ca.Function = model.functions[str(name)] if function is None else function()
        # Linear equations are solved in numbers.
        symbols = [*model.arguments.values()] if differentiated.is_a("SXFunction") else differentiated.mx_in()
        value = differentiated(*symbols)
        return symbols, value if rows is None else value[list(rows), :]

    key = name, None if rows is None else tuple(rows)
    value, x, t, theta = _total(model, point, key, make, _ALL, *constants, columns=columns)
    return Slopes(model, point, value[:, 0], x, t[:, 0], theta)


def variable_slopes(model: CompiledDae, point: Point, nodes: Sequence[int]) -> Vector:
    """Return the derivatives of variables by the states alone.

    Args:
        model: the compiled model.
        point: where.
        nodes: positions of the variables.

    Returns:
        Shape (nodes, states).

    Raises:
        SingularAtStart: a slope is not finite.
    """

    def make() -> tuple[list[Any], Any]:
        symbols = [*model.arguments.values()]
        return symbols, model.equations.variables(*symbols)[list(nodes)]

    _, x = _total(model, point, ("variables", tuple(nodes)), make, ("x",))
    _check_finite(model, point, [x], (model.flat_variables[node].path for node in nodes))
    return x


def implicit_slopes(model: CompiledDae, point: Point, by: _Names = _ALL, columns: _Columns = None) -> list[Vector]:
    """Derivatives of z by x, t and theta, or its `columns`; shapes (nz, nx), (nz, 1), (nz, ntheta).

    Raises:
        SingularAtStart: a slope is not finite.
    """
    symbols = [*model.arguments.values()]
    make = lambda: _Partials(symbols, model.equations.alg(*symbols), by)  # noqa: E731
    _, z, *parts = model.once((Cached.IMPLICIT_SLOPES, by, get_ident()), make)(model, point, columns=columns)
    _check_finite(model, point, [z, *parts], model.implicit)
    right = -np.hstack(parts)
    # Reactions whose split is undetermined make the equations for z singular; what depends on them is left out.
    solved: Any = np.linalg.solve(z, right) if is_regular(z) else np.linalg.lstsq(z, right, rcond=None)[0]
    return np.split(solved, np.cumsum([part.shape[1] for part in parts])[:-1], axis=1)


def _total(
    model: CompiledDae, point: Point, key: Hashable, make: Callable[[], tuple[list[Any], Any]], by: _Names,
    *constants: Vector, columns: _Columns = None,
) -> list[Vector]:  # fmt: skip
    """Return value and derivatives of what `make` gives (symbols and expression), z following."""
    partials = model.once((Cached.SLOPES, key, by, get_ident()), lambda: _Partials(*make(), by))
    value, z, *parts = partials(model, point, *constants, columns=columns)
    if np.any(z):
        following = implicit_slopes(model, point, by, columns)
        parts = [part + z @ follows for part, follows in zip(parts, following, strict=True)]
    return [value, *parts]


def _check_finite(model: CompiledDae, point: Point, parts: list[Vector], names: Iterable[str]) -> None:
    if not all(np.isfinite(part).all() for part in parts):
        raise SingularAtStart(
            f"The slopes of {', '.join(names)} are not finite at t = {point.t:.9g} s.",
            advice="Look for a mass, inertia or ratio of zero, or a function outside its domain.",
        )


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


def _found(model: CompiledDae, names: Iterable[str], positions: Mapping[str, int], what: str) -> list[int]:
    missing = next((name for name in names if name not in positions), None)
    if missing is not None:
        raise UnknownName(f"{model.name} has no {what} '{missing}'{did_you_mean(missing, positions) or '.'}")
    return [positions[name] for name in names]
