"""Consistent start values and modes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from modelica_like.buffers import buffered
from modelica_like.compile import CompiledDae, StartEntry, Vector
from modelica_like.errors import ContradictingStart, InitializationError, MissingStart, SingularAtStart

StartKind = Literal["given", "rest", "steady"]

_RANK = 1e-9
_CONSISTENT = 1e-8
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


def initialize(model: CompiledDae, t0: float = 0.0, start: StartKind = "given") -> Point:
    """Find consistent start values.

    Args:
        model: the compiled model.
        t0: start time in s.
        start: `given`: the start values of the model determine everything; `rest`: states without a start value begin at zero;
            `steady`: all derivatives are zero, except of states that nothing depends on.

    Returns:
        The start; events at t0 have not happened yet.

    Raises:
        MissingStart: start values are missing.
        ContradictingStart: start values contradict each other.
        InitializationError: the solver did not find a solution.
        SingularAtStart: the implicit equations have no unique solution.
    """
    point = Point(t0, model.guesses.copy(), model.z_guesses.copy(), np.zeros(len(model.flat_discretes)))
    point.d = call(model, model.discrete_starts, point)
    problem = _StartProblem(model, point)
    for _ in range(5):
        if start == "steady":
            _solve_steady(model, point, problem)
        else:
            problem.solve(point, rest=start == "rest")
        modes = _start_modes(model, point)
        if np.array_equal(modes, point.d):
            break
        point.d = modes
    solve_implicit(model, point)
    check_singular(model, point)
    return point


def _start_modes(model: CompiledDae, point: Point) -> Vector:
    """Choose modes by their start conditions: the first that holds wins."""
    d = point.d.copy()
    decided: set[int] = set()
    for holds, (mode, target, _) in zip(call(model, model.start_conditions, point), model.start_modes, strict=True):
        if holds and mode not in decided:
            decided.add(mode)
            d[mode] = target
    return d


def solve_implicit(model: CompiledDae, point: Point) -> None:
    """Solve the implicit equations for z by Newton's method.

    Raises:
        SingularAtStart: their Jacobian is singular.
        InitializationError: no convergence.
    """
    if not model.implicit:
        return
    for _ in range(_MAX_NEWTON):
        residual = call(model, model.alg, point)
        jacobian = np.asarray(model.alg_jacobian(point.t, point.x, point.z, model.p, model.u, point.d).full())
        if not np.all(np.isfinite(residual)) or np.linalg.matrix_rank(jacobian) < len(residual):
            raise _singular(model, point, [tuple(model.implicit)], ())
        step = np.linalg.solve(jacobian, -residual)
        point.z = point.z + step
        if np.max(np.abs(step) / (1.0 + np.abs(point.z))) < 1e-13:
            return
    if np.max(np.abs(step) / (1.0 + np.abs(point.z))) > 1e-9:
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
            raise _singular(model, point, [names], tuple(o.source for o in origins))
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
    shown = ", ".join(names[:6]) + (", …" if len(names) > 6 else "")
    stuck = [
        one.path.rpartition(".")[0]
        for k, one in enumerate(model.flat_discretes)
        if one.names and one.names[int(point.d[k])] == "stuck"
    ]
    if len(stuck) > 1:
        why = f"{' and '.join(stuck)} stick: where they hold the same motion, their torque split is undetermined."
    else:
        why = "Its equations do not determine all of its unknowns."
    return SingularAtStart(
        f"The Jacobian is singular at t = {point.t:.9g} s in block {number} ({shown}).",
        where=where, why=why, advice="Make one compliant, or let one start open.",
    )  # fmt: skip


class _StartProblem:
    """Start values that are not simply those of states: nonlinear equations for the states that are left."""

    def __init__(self, model: CompiledDae, point: Point) -> None:
        self.model = model
        values = call(model, model.start_values, point)
        self.entries = list(zip(model.starts, values, strict=True))
        self.direct: dict[int, tuple[float, StartEntry]] = {}
        self.general: list[tuple[StartEntry, float]] = []
        for entry, value in self.entries:
            if entry.strength == "guess":
                self._guess(point, entry, value)
            elif entry.strength == "fixed" and entry.state is not None:
                self._direct(entry, value)
            elif entry.strength == "fixed":
                self.general.append((entry, value))

    def name(self, entry: StartEntry) -> str:
        return self.model.flat_variables[entry.node].path

    def _guess(self, point: Point, entry: StartEntry, value: float) -> None:
        path = self.name(entry)
        if entry.state is not None:
            point.x[entry.state[0]] = value / entry.state[1]
        elif path in self.model.implicit:
            point.z[self.model.implicit.index(path)] = value

    def _direct(self, entry: StartEntry, value: float) -> None:
        assert entry.state is not None
        position, factor = entry.state
        number = value / factor
        if position in self.direct:
            other, earlier = self.direct[position]
            if abs(number - other) > _CONSISTENT * (1.0 + abs(other)):
                raise ContradictingStart(
                    f"{self.name(earlier)} = {other * earlier.state[1] if earlier.state else other:g} and "
                    f"{self.name(entry)} = {value:g} contradict each other: they are the same motion.",
                    advice="Remove one of the two start values.",
                )
            return
        self.direct[position] = (number, entry)

    def solve(self, point: Point, rest: bool) -> None:
        """Determine all states."""
        for position, (number, _) in self.direct.items():
            point.x[position] = number
        free = [k for k in range(len(self.model.states)) if k not in self.direct]
        solve_implicit(self.model, point)
        if not free and not self.general:
            return
        defaults = [(e, v) for e, v in self.entries if e.strength == "default"]
        self._solve_free(point, free, defaults, rest)

    def _solve_free(self, point: Point, free: list[int], defaults: list[tuple[StartEntry, float]], rest: bool) -> None:
        accepted, dependent = self._choose(point, free, self.general)
        basis = [row for _, _, row in accepted]
        more, _ = self._choose(point, free, defaults, basis)
        accepted += more
        basis += [row for _, _, row in more]
        missing = [k for k in free if _independent(_unit(free, k), basis)]
        if rest:
            for k in missing:
                if _independent(_unit(free, k), basis):
                    basis.append(_unit(free, k))
                    point.x[k] = 0.0
                    accepted.append((None, 0.0, _unit(free, k)))
        elif len(basis) < len(free):
            raise self._missing(missing, len(free) - len(basis))
        self._newton(point, free, [(e, v, row) for e, v, row in accepted])
        for entry, value in dependent:
            self._check_dependent(point, entry, value)

    def _choose(
        self, point: Point, free: list[int], entries: list[tuple[StartEntry, float]], basis: list[Vector] | None = None
    ) -> tuple[list[tuple[Any, float, Vector]], list[tuple[StartEntry, float]]]:
        """Take the start values that say something new about the free states."""
        accepted: list[tuple[Any, float, Vector]] = []
        dependent: list[tuple[StartEntry, float]] = []
        rows = list(basis or [])
        slopes = self._slopes(point, [e.node for e, _ in entries])[:, free] if entries else np.zeros((0, len(free)))
        for (entry, value), row in zip(entries, slopes, strict=True):
            if _independent(row, rows):
                rows.append(row)
                accepted.append((entry, value, row))
            else:
                dependent.append((entry, value))
        return accepted, dependent

    def _slopes(self, point: Point, nodes: list[int]) -> Vector:
        """Total derivative of variables by the states, z following the states."""
        return variable_slopes(self.model, point, nodes)

    def _newton(self, point: Point, free: list[int], accepted: list[tuple[Any, float, Vector]]) -> None:
        equations = [(e.node, v) for e, v, _ in accepted if e is not None]
        if not equations:
            solve_implicit(self.model, point)
            return
        nodes = [node for node, _ in equations]
        target = np.array([value for _, value in equations])
        for _ in range(_MAX_NEWTON):
            solve_implicit(self.model, point)
            error = call(self.model, self.model.variables, point)[nodes] - target
            slopes = self._slopes(point, nodes)[:, free]
            step = np.linalg.lstsq(slopes, -error, rcond=None)[0]
            point.x[free] += step
            if np.max(np.abs(step) / (1.0 + np.abs(point.x[free]))) < 1e-14:
                break
        solve_implicit(self.model, point)
        error = call(self.model, self.model.variables, point)[nodes] - target
        if np.max(np.abs(error) / (1.0 + np.abs(target))) > _CONSISTENT:
            names = ", ".join(self.model.flat_variables[node].path for node in nodes)
            raise InitializationError(
                f"No start values were found that give {names} the values asked for.", advice="Give guesses near the solution."
            )

    def _check_dependent(self, point: Point, entry: StartEntry, value: float) -> None:
        actual = call(self.model, self.model.variables, point)[entry.node]
        if abs(actual - value) <= _CONSISTENT * (1.0 + abs(value)):
            return
        slopes = self._slopes(point, [entry.node])[0]
        partners = [
            f"{self.name(other)} = {call(self.model, self.model.variables, point)[other.node]:g}"
            for other, _ in self.entries
            if other.strength == "fixed" and other is not entry
            and np.any((np.abs(self._slopes(point, [other.node])[0]) > _RANK) & (np.abs(slopes) > _RANK))
        ]  # fmt: skip
        couplings = [o.source for o in self.model.differentiated if o.source.file]
        what = f"{self.name(entry)} = {value:g}"
        together = f"{' and '.join([*partners[:2], what])} contradict each other" if partners else f"{what} cannot be met"
        raise ContradictingStart(
            f"{together}: {self.name(entry)} follows to be {actual:g}.", where=couplings[:3],
            advice="Remove one of the start values, or make one a guess.",
        )  # fmt: skip

    def _missing(self, states: list[int], count: int) -> MissingStart:
        names = [self.model.states[k] for k in states]
        shown = " or ".join(names[:4]) + (" …" if len(names) > 4 else "")
        lacks = "one equation" if count == 1 else f"{count} equations"
        what = f"give {shown} a start value" if count == 1 else f"give {count} of {', '.join(names[:8])} start values"
        return MissingStart(
            f"Initialisation (not the model) lacks {lacks}: {what}.",
            advice='Or start from rest (start = "rest") or in the steady state (start = "steady").',
        )


def variable_slopes(model: CompiledDae, point: Point, nodes: list[int]) -> Vector:
    """Total derivative of variables by the states at a point, z following the states; shape (nodes, states)."""
    if "slopes" not in model._cache:
        call_arguments = list(model.arguments.values())
        x, z = model.arguments["x"], model.arguments["z"]
        import casadi as ca

        variables, alg = model.variables(*call_arguments), model.alg(*call_arguments)
        outputs = [ca.jacobian(variables, x), ca.jacobian(variables, z), ca.jacobian(alg, x), ca.jacobian(alg, z)]
        model._cache["slopes"] = ca.Function("slopes", call_arguments, outputs)
    parts = model._cache["slopes"](point.t, point.x, point.z, model.p, model.u, point.d)
    by_x, by_z, alg_x, alg_z = (np.asarray(part[nodes, :].full() if k < 2 else part.full()) for k, part in enumerate(parts))
    return by_x - by_z @ np.linalg.solve(alg_z, alg_x) if model.implicit else by_x


def _unit(free: list[int], state: int) -> Vector:
    return np.array([1.0 if k == state else 0.0 for k in free])


def _independent(row: Vector, basis: list[Vector]) -> bool:
    if not np.any(np.abs(row) > _RANK) or not np.all(np.isfinite(row)):
        return False
    if not basis:
        return True
    stacked = np.array([*basis, row])
    stacked = stacked / np.linalg.norm(stacked, axis=1, keepdims=True)
    return bool(np.linalg.matrix_rank(stacked, tol=_RANK) == len(stacked))


def _solve_steady(model: CompiledDae, point: Point, problem: _StartProblem) -> None:
    """Find states with zero derivatives; states that nothing depends on keep their start value or guess."""
    import casadi as ca

    for position, (number, _) in problem.direct.items():
        point.x[position] = number
    for entry, value in problem.entries:
        if entry.strength == "default" and entry.state is not None and entry.state[0] not in problem.direct:
            point.x[entry.state[0]] = value / entry.state[1]
    arguments = list(model.arguments.values())
    x, z = model.arguments["x"], model.arguments["z"]
    equations = ca.vertcat(model.ode(*arguments), model.alg(*arguments))
    used = ca.which_depends(equations, x, 1, False)
    moving = [k for k, depends in enumerate(used) if depends]
    unknowns = ca.vertcat(x[moving], z)
    rows = [*moving, *range(len(model.states), len(model.states) + len(model.implicit))]
    function = ca.Function("steady", arguments, [equations[rows], ca.jacobian(equations[rows], unknowns)])
    for _ in range(_MAX_NEWTON):
        value, jacobian = function(point.t, point.x, point.z, model.p, model.u, point.d)
        step = np.linalg.lstsq(np.asarray(jacobian.full()), -np.asarray(value.full()).ravel(), rcond=1e-12)[0]
        point.x[moving] += step[: len(moving)]
        point.z += step[len(moving) :]
        if step.size == 0 or np.max(np.abs(step) / (1.0 + np.abs(step))) < 1e-13:
            break
    residual = np.asarray(function(point.t, point.x, point.z, model.p, model.u, point.d)[0].full()).ravel()
    if residual.size and (not np.all(np.isfinite(residual)) or np.max(np.abs(residual)) > 1e-6):
        worst = model.states[moving[int(np.argmax(np.abs(residual[: len(moving)])))]] if moving else "the model"
        raise InitializationError(
            f"No steady state was found at t = {point.t:g} s: {worst} keeps changing.",
            advice="Check that the drive can be in equilibrium there, or give start values instead.",
        )


