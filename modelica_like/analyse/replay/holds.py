"""Derivatives of impacts, shared reactions and projections; see initialize.holds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.compile.buffers import Vector
from modelica_like.compile.cached import Cached
from modelica_like.compile.compiled import Circuit, CompiledDae
from modelica_like.flatten.holds import TERMS
from modelica_like.language.holding import UNLIMITED
from modelica_like.solve.initialize import Point, variable_slopes
from modelica_like.solve.initialize.holds import capacities

Total = Callable[..., tuple[Vector, Vector]]
"""Value of a function at a point, and its derivatives by (x, theta) before an event; arguments as for `slopes`."""

_RESTITUTION = 3
_ROUNDING = 1e-9


def impact(model: CompiledDae, struck: Sequence[int]) -> ca.Function:
    """Return the jump of the states by which an impact stops motions, at a point with the modes of the impact.

    Args:
        model: the compiled model.
        struck: positions of the stopped motions.
    """
    given = model.arguments
    arguments = list(given.values())
    holds = [model.held.motions[k] for k in struck]
    motions = model.equations.variables(*arguments)[[hold.motion for hold in holds]]
    restitution = ca.reshape(model.held.terms(*arguments), TERMS, -1)[_RESTITUTION, list(struck)].T
    approaches = given["d"][[hold.approach for hold in holds]]
    by = [
        ca.jtimes(f(*arguments), approaches, -(1 + restitution) * motions)
        for f in (model.equations.ode, model.equations.alg)
    ]
    by += [ca.jacobian(f(*arguments), given["z"]) for f in (model.equations.ode, model.equations.alg)]
    parts = ca.Function("response", arguments, [ca.densify(slope) for slope in by])
    symbols = parts.mx_in()
    change, residual, ode_z, alg_z = parts(*symbols)
    if model.implicit:
        change -= ca.mtimes(ode_z, ca.solve(alg_z, residual, "lapacklu"))
    return ca.Function("impact", symbols, [change])


def projection(model: CompiledDae, nodes: list[int]) -> ca.Function:
    """Return the smallest change of the states that changes variables by the last argument."""
    slopes, symbols = _following(model, nodes)
    missing = ca.MX.sym("missing", len(nodes))
    change = ca.mtimes(slopes.T, ca.solve(ca.mtimes(slopes, slopes.T), missing, "lapacklu"))
    return ca.Function("projection", [*symbols, missing], [change])


def _following(model: CompiledDae, nodes: list[int]) -> tuple[Any, list[Any]]:
    """Slopes of variables by the states, z following, shape (nodes, states), and the symbols that they are made of."""
    given = model.arguments
    arguments = list(given.values())
    values = model.equations.variables(*arguments)[nodes], model.equations.alg(*arguments)
    by = [ca.densify(ca.jacobian(value, given[name])) for value in values for name in "xz"]
    parts = ca.Function("parts", arguments, by)
    symbols = parts.mx_in()
    slopes, by_z, alg_x, alg_z = parts(*symbols)
    if model.implicit:
        slopes -= ca.mtimes(by_z, ca.solve(alg_z, alg_x, "lapacklu"))
    return slopes, symbols


def share_slopes(model: CompiledDae, point: Point, circuit: Circuit, columns: int, total: Total) -> Vector:
    """Differentiate the shares of a circuit by (x, theta) before an event, shape (entries, columns).

    A share is the part of an element in a dependence of the motions, over its capacity; a common factor is free.
    """
    by_share = np.zeros((*[len(circuit.members)] * 2, columns))
    pivots = circuit.switches.of(point.d)[0].nonzero()[0].tolist()
    for pivot in pivots:
        shares = circuit.shares.of(point.d)[pivot]
        places = [k for k, share in enumerate(shares) if share or k in pivots]
        members = [circuit.members[k] for k in places]
        free = [n for n, k in enumerate(places) if k not in pivots and abs(shares[k]) > _ROUNDING]
        slopes = -shares[places, None] * _relative(model, point, members, total)
        row = places.index(pivot)
        slopes[free] += shares[[places[n] for n in free], None] * _turned(model, point, members, row, free, total)
        by_share[pivot, places] = slopes
    return by_share.reshape(-1, columns)


def _relative(model: CompiledDae, point: Point, members: list[int], total: Total) -> Vector:
    """Derivatives of capacities over the capacities; zero for unlimited and zero capacities."""
    given = capacities(model, point)[members]
    rows = [k * TERMS + 1 + int(np.argmax(pair)) for k, pair in zip(members, given, strict=True)]
    values, slopes = total("hold_terms", rows)
    limited = (values > 0.0) & (values < UNLIMITED)
    return np.divide(slopes, values[:, None], out=np.zeros_like(slopes), where=limited[:, None])


def _turned(model: CompiledDae, point: Point, members: list[int], row: int, free: list[int], total: Total) -> Vector:
    """Derivatives of a dependence of motions over its parts; one part is 1, and all but the `free` ones are 0."""
    nodes = [model.held.motions[k].motion for k in members]
    motions, parts = variable_slopes(model, point, nodes), np.zeros(len(nodes))
    parts[row] = 1.0
    parts[free] = -np.linalg.lstsq(motions[free].T, motions[row], rcond=None)[0]

    def make() -> ca.Function:
        slopes, symbols = _following(model, nodes)
        weights = ca.MX.sym("weights", len(nodes))
        return ca.Function("dependence", [*symbols, weights], [ca.mtimes(slopes.T, weights)])

    change = np.linalg.lstsq(motions[free].T, total((Cached.SHARES, *members), None, make, parts)[1], rcond=None)[0]
    return np.asarray(-change / parts[free, None], np.float64)
