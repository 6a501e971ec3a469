"""Impacts and shared reactions, differentiated; see initialize.holds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.compile.buffers import Vector, buffered
from modelica_like.compile.compiled import Circuit, CompiledDae
from modelica_like.flatten.holds import TERMS
from modelica_like.initialize import Point, variable_slopes
from modelica_like.initialize.holds import terms
from modelica_like.language.hold import UNLIMITED

Total = Callable[..., tuple[Vector, Vector]]
"""Value of a function at a point, and its derivatives by (x, theta) before an event."""

_RESTITUTION = 3
_ROUNDING = 1e-9


def impact(model: CompiledDae, point: Point, struck: Sequence[int], total: Total) -> Vector:
    """Differentiate the jump of the states by which an impact stops motions; shape (states, x and theta).

    Args:
        model: the compiled model.
        point: the point before it, with the modes in which the impulse passes.
        struck: positions of the held motions that are stopped.
        total: differentiates at that point.
    """
    nx, name = len(model.states), f"impact {list(struck)}"

    def make(w: Any = None) -> Any:
        return _response(model, struck, ca.SX(0, 1) if w is None else w)

    if not model.implicit:
        return total(name, None, make)[1]
    ode_z, alg_z, _ = _by_implicit(model, point)
    follow = -np.linalg.solve(alg_z, total(name, None, make, np.zeros(len(alg_z)))[0][nx:])
    slope = total(name, None, make, follow)[1]
    return slope[:nx] - ode_z @ np.linalg.solve(alg_z, slope[nx:])


def _response(model: CompiledDae, struck: Sequence[int], w: Any) -> Any:
    """What approaches, and implicit unknowns that follow them by w, change of rates and residuals."""
    given = model.arguments
    arguments = given.values()
    holds = [model.holds[k] for k in struck]
    motions = model.variables(*arguments)[[one.motion for one in holds]]
    restitution = ca.reshape(model.hold_terms(*arguments), TERMS, -1)[_RESTITUTION, list(struck)].T
    by = ca.vertcat(given["d"][[one.approach for one in holds]], given["z"])
    slopes = ca.jacobian(ca.vertcat(model.ode(*arguments), model.alg(*arguments)), by)
    return ca.mtimes(slopes, ca.vertcat(-(1 + restitution) * motions, w))


def _by_implicit(model: CompiledDae, point: Point) -> tuple[Vector, Vector, Vector]:
    """Slopes of ode and alg by z, and of alg by x."""

    def make() -> ca.Function:
        arguments, x, z = list(model.arguments.values()), model.arguments["x"], model.arguments["z"]
        ode, alg = model.ode(*arguments), model.alg(*arguments)
        parts = ca.jacobian(ode, z), ca.jacobian(alg, z), ca.jacobian(alg, x)
        return ca.Function("by_implicit", arguments, [ca.densify(one) for one in parts])

    given = point.t, point.x, point.z, model.p, model.u, point.d
    nx, nz = len(model.states), len(model.implicit)
    parts = zip(buffered(model._cache, "by implicit", make)(*given), ((nx, nz), (nz, nz), (nz, nx)), strict=True)
    ode_z, alg_z, alg_x = (part.reshape(shape, order="F") for part, shape in parts)
    return ode_z, alg_z, alg_x


def share_slopes(model: CompiledDae, point: Point, circuit: Circuit, columns: int, total: Total) -> Vector:
    """Differentiate switches and shares of a circuit by (x, theta) before an event, shape (entries of d, columns).

    A share is the part of an element in a dependence of the motions, over its capacity; a common factor is free.
    """
    count = len(circuit.members)
    found = np.zeros((count * (1 + count), columns))
    entries = point.d[circuit.first : circuit.first + count * (1 + count)]
    pivots = [k for k in range(count) if entries[k]]
    for pivot in pivots:
        first = count + pivot * count
        shares = entries[first : first + count]
        places = [k for k in range(count) if shares[k] or k in pivots]
        members = [circuit.members[k] for k in places]
        free = [n for n, k in enumerate(places) if k not in pivots and abs(shares[k]) > _ROUNDING]
        by_capacity = _relative(model, point, members, total)
        slopes = -shares[places, None] * by_capacity
        slopes[free] += shares[[places[n] for n in free], None] * _turned(
            model, point, members, places.index(pivot), free, total
        )
        found[[first + k for k in places]] = slopes
    return found


def _relative(model: CompiledDae, point: Point, members: list[int], total: Total) -> Vector:
    """Derivatives of capacities over the capacities; what nothing limits, or bears nothing, has none."""
    given = terms(model, point)[members, 1:3]
    rows = [k * TERMS + 1 + int(np.argmax(pair)) for k, pair in zip(members, given, strict=True)]
    values, slopes = total("hold_terms")
    limited = (values[rows] > 0.0) & (values[rows] < UNLIMITED)
    found = np.zeros((len(rows), slopes.shape[1]))
    found[limited] = slopes[rows][limited] / values[rows][limited, None]
    return found


def _turned(model: CompiledDae, point: Point, members: list[int], own: int, free: list[int], total: Total) -> Vector:
    """Derivatives of a dependence of motions over its parts; one part is 1, and others than the `free` ones are 0."""
    nodes = [model.holds[k].motion for k in members]
    nx, nz, name = len(model.states), len(model.implicit), f"dependence {members}"
    motions, parts = variable_slopes(model, point, nodes), np.zeros(len(nodes))
    parts[own] = 1.0
    parts[free] = -np.linalg.lstsq(motions[free].T, motions[own], rcond=None)[0]
    weights = np.concatenate([parts, np.zeros(nz)])

    def make(given: Any) -> Any:
        arguments = model.arguments
        sum_ = ca.dot(given[: len(nodes)], model.variables(*arguments.values())[nodes])
        sum_ -= ca.dot(given[len(nodes) :], model.alg(*arguments.values()))
        return ca.gradient(sum_, ca.vertcat(arguments["x"], arguments["z"]))

    if nz:
        _, alg_z, alg_x = _by_implicit(model, point)
        weights[len(parts) :] = np.linalg.solve(alg_z.T, total(name, None, make, weights)[0][nx:])
        slope = total(name, None, make, weights)[1]
        turned = slope[:nx] - alg_x.T @ np.linalg.solve(alg_z.T, slope[nx:])
    else:
        turned = total(name, None, make, weights)[1]
    change = np.linalg.lstsq(motions[free].T, turned, rcond=None)[0]
    return np.asarray(-change / parts[free, None], np.float64)
