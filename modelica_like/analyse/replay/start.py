"""Derivatives of start values by parameters: the start system, differentiated."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.compile.buffers import Vector
from modelica_like.compile.cached import Cached
from modelica_like.compile.compiled import CompiledDae
from modelica_like.solve.initialize import Point, StartKind, StartPlan, call, start_plan
from modelica_like.solve.initialize.slopes import Sizes, slopes
from modelica_like.solve.initialize.steady import steady_change

_MAX_NEWTON = 50


def start_slopes(model: CompiledDae, point: Point, kind: StartKind) -> tuple[ca.DM, ca.DM]:
    """Differentiate the states and the discrete values of a start by (p, u).

    Args:
        model: the compiled model.
        point: the consistent start, before events.
        kind: the kind of start of the run.

    Returns:
        Shapes (nx, np + nu) and (nd, np + nu), sparse: of many parameters few influence the start.
    """
    size, plan, given = Sizes.of(model), start_plan(model, kind, point), (model.p, model.u, point.d)
    jacobians = [
        model.once((Cached.BY_PARAMETERS, name), lambda name=name: _by_parameters(model, name))(
            point.t, point.x, point.z, *given
        )
        for name in ("discrete_starts", "start_values")
    ]
    system = () if kind == "steady" else _start_system(model, plan, point)
    # Few of many parameters influence the start: only their columns are computed.
    parts = [*jacobians, *system[1:2]]
    moved = sorted({column for part in parts for column in _columns(part)}) if system else list(range(size.fixed))
    starts, values = (np.asarray(jacobian[:, moved].full()) for jacobian in jacobians)
    states = np.zeros((size.x, len(moved)))
    if kind == "steady":
        # States that equilibrium does not determine keep their start values or defaults.
        for number, entry in enumerate(model.starts.entries):
            if entry.strength == "default" and entry.state is not None:
                states[entry.state[0]] = values[number] / entry.state[1]
    for state, number in plan.direct:
        states[state] = values[number] / (model.starts.entries[number].state or (state, 1.0))[1]
    if kind == "steady":
        theta = np.concatenate([np.eye(size.fixed), starts])
        states = steady_change(model, point, theta, states)
    elif plan.columns and moved:
        _follow(plan, system, moved, states, starts, values)
    x, d = ca.DM(size.x, size.fixed), ca.DM(size.d, size.fixed)
    x[:, moved], d[:, moved] = ca.sparsify(ca.DM(states)), ca.sparsify(ca.DM(starts))
    return x, _determined(model, point, x, d)


def product(left: Vector | ca.DM, right: Vector | ca.DM) -> Vector:
    """Return a product of matrices, one of them sparse, as an array."""
    return np.asarray(ca.mtimes(ca.DM(left), ca.DM(right)).full())


def _determined(model: CompiledDae, point: Point, x: ca.DM, d: ca.DM) -> ca.DM:
    """Derivatives of discrete values, those with an equation by it; see initialize.started."""
    places = [(k, row.reset.index) for k, row in enumerate(model.events.update_rows) if row.at_start]
    if not places:
        return d
    (rows, variables), before = map(list, zip(*places, strict=True)), point.copy()
    before.d[variables] = call(model, model.starts.discretes, point)[variables]
    part, fixed = slopes(model, before, "updates"), x.shape[1]
    total = product(part.x, x) + part.theta[:, :fixed] + product(part.theta[:, fixed:], d)
    d[variables, :] = ca.sparsify(ca.DM(total[rows]))
    return d


def _by_parameters(model: CompiledDae, name: str) -> ca.Function:
    """Derivatives of a function by (p, u), sparse."""
    given = model.arguments
    fixed = ca.vertcat(given["p"], given["u"])
    return ca.Function("slopes", [*given.values()], [ca.jacobian(model.functions[name](*given.values()), fixed)])


def _follow(
    plan: StartPlan, system: tuple[Any, ...], moved: list[int], states: Vector, starts: Vector, values: Vector
) -> None:
    """Add the derivatives of the other states: the implicit function theorem on the start system."""
    by_unknowns, by_fixed, by_d = (matrix[list(plan.wanted), :] for matrix in system)
    derivatives = np.asarray(by_d.full()) @ starts + np.asarray(ca.mtimes(by_unknowns[:, : len(states)], ca.DM(states)))
    right = plan.targets(values) - np.asarray(by_fixed[:, moved].full()) - derivatives
    if right.size:
        solved = np.asarray(ca.solve(by_unknowns[:, list(plan.columns)], ca.DM(right)).full())
        of_states = [(row, column) for row, column in enumerate(plan.columns) if column < len(states)]
        for row, column in of_states:
            states[column] = solved[row]


def _start_system(model: CompiledDae, plan: StartPlan, point: Point) -> tuple[Any, ...]:
    """Jacobians of the start system by its unknowns (x, y, z), by (p, u) and by d, sparse."""
    system = plan.system.function

    def make() -> ca.Function:
        arguments = [ca.SX.sym(name, system.size1_in(k)) for k, name in enumerate(system.name_in())]
        _, jacobian, values = system(*arguments)
        by = ca.vertcat(arguments[4], arguments[5]), arguments[6]
        return ca.Function("start_slopes", arguments, [jacobian, *(ca.jacobian(values, slope) for slope in by)])

    def at(function: ca.Function, y: Vector) -> tuple[Any, ...]:
        return function(point.t, point.x, y, point.z, model.p, model.u, point.d)

    # The variables y are its first equations, solved.
    y, rows = np.zeros(system.size1_out(0)), list(range(system.size1_out(0)))
    for _ in range(_MAX_NEWTON if rows else 0):
        _, jacobian, values = at(system, y)
        step = np.array(ca.solve(jacobian[rows, [len(point.x) + k for k in rows]], -values[rows])).ravel()
        y = y + step
        if np.max(np.abs(step) / (1.0 + np.abs(y))) < 1e-13:
            break
    return at(model.once((Cached.START_SLOPES, plan.kind), make), y)


def _columns(matrix: Any) -> list[int]:
    """Columns of a sparse matrix with entries."""
    starts = matrix.sparsity().colind()
    return [k for k, (first, last) in enumerate(pairwise(starts)) if last > first]
