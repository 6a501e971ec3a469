"""First derivatives of a compiled model's functions at a point, with the implicit unknowns following."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.compile.buffers import Vector, buffered
from modelica_like.compile.compiled import CompiledDae
from modelica_like.initialize import Point

_NONE = np.zeros(0)


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
        """Parameters and inputs: what does not change during a run."""
        return self.p + self.u


@dataclass(frozen=True)
class Slopes:
    """Derivatives of a function; shapes (rows, nx), (rows,), (rows, ntheta), and the value.

    The implicit unknowns follow from the others.
    """

    value: Vector
    x: Vector
    t: Vector
    theta: Vector


def slopes(
    model: CompiledDae, point: Point, name: str, expression: Callable[..., Any] | None = None, constants: Vector = _NONE
) -> Slopes:
    """Differentiate a function of the model.

    Args:
        model: the compiled model.
        point: where.
        name: name of one of its functions, or of `expression` in the cache.
        expression: makes an SX column in the model's arguments, of the symbols of `constants` if there are some.
        constants: numbers in the expression that are not differentiated.
    """
    given = point.t, point.x, point.z, model.p, model.u, point.d, constants
    key = "slopes of", name
    value, *parts = buffered(model._cache, key, lambda: _partials(model, name, expression, len(constants)))(*given)
    size = Sizes.of(model)
    rows = value.size
    by_x, by_z, by_t, by_theta = (
        part.reshape(columns, rows).T for part, columns in zip(parts, (size.x, size.z, 1, size.theta), strict=True)
    )
    if size.z and np.any(by_z):
        z_x, z_t, z_theta = implicit_slopes(model, point)
        by_x, by_t, by_theta = by_x + by_z @ z_x, by_t + by_z @ z_t, by_theta + by_z @ z_theta
    return Slopes(value, by_x, by_t[:, 0], by_theta)


def implicit_slopes(model: CompiledDae, point: Point) -> tuple[Vector, Vector, Vector]:
    """Derivatives of z by x, t and theta; shapes (nz, nx), (nz, 1), (nz, ntheta)."""
    size = Sizes.of(model)
    fast = buffered(model._cache, "slopes of alg", lambda: _partials(model, "alg", None, 0))
    given = point.t, point.x, point.z, model.p, model.u, point.d, _NONE
    _, x, z, t, theta = fast(*given)
    right = np.concatenate([part.reshape(-1, size.z) for part in (x, t, theta)]).T
    solved = np.asarray(-np.linalg.solve(z.reshape(size.z, size.z).T, right), np.float64)
    return solved[:, : size.x], solved[:, size.x : size.x + 1], solved[:, size.x + 1 :]


def _partials(model: CompiledDae, name: str, expression: Callable[..., Any] | None, constants: int) -> ca.Function:
    """Value and dense derivatives by x, z, t and (p, u, d)."""
    arguments = model.arguments
    given = list(arguments.values())
    numbers = ca.SX.sym("constants", constants)
    value = getattr(model, name)(*given) if expression is None else expression(*([numbers] if constants else []))
    theta = ca.vertcat(arguments["p"], arguments["u"], arguments["d"])
    by = (arguments["x"], arguments["z"], arguments["t"], theta)
    outputs = [ca.densify(one) for one in (value, *(ca.jacobian(value, one) for one in by))]
    return ca.Function("slopes", [*given, numbers], outputs)
