"""Start values: from given values to all states."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.errors import InitializationError
from modelica_like.solve.initialize.contradictions import not_met, not_together, same_motion
from modelica_like.solve.initialize.plan import StartKind, StartPlan, direct_starts, is_near, start_name, start_plan
from modelica_like.solve.initialize.point import Point, call, check_singular, solve_implicit

_CONSISTENT = 1e-8
_MAX_NEWTON = 50
_DENSE = 100
_STRENGTHS = ("fixed", "guess", "default")
_EPS = float(np.finfo(float).eps)


class _Places:
    """Start values and their targets: (number, position, factor) of each."""

    def __init__(self, places: Iterable[tuple[int, int, float]]) -> None:
        self._numbers, self._positions, self._factors = np.array([*places], float).reshape(-1, 3).T
        self._numbers, self._positions = self._numbers.astype(int), self._positions.astype(int)

    def put(self, unknowns: Vector, given: Vector) -> None:
        """Write them into the states or implicit unknowns; of several for one target, the last counts."""
        unknowns[self._positions] = given[self._numbers] / self._factors


class _Sorted:
    """Start values of a model, sorted by their use.

    Attributes:
        fixed, guesses, defaults: of states; only the first of several fixed ones of a state.
        again: the other fixed ones, each with the first.
        factors: of all fixed ones.
        implicit: of implicit unknowns, used as first guesses.
    """

    def __init__(self, model: CompiledDae) -> None:
        direct = direct_starts(model)
        states = [(k, *entry.state) for k, entry in enumerate(model.starts) if entry.state is not None]
        of = {kind: [one for one in states if model.starts[one[0]].strength == kind] for kind in _STRENGTHS}
        self.factors = {k: factor for k, _, factor in of["fixed"]}
        self.again = [(k, direct[state]) for k, state, _ in of["fixed"] if direct[state] != k]
        self.fixed = _Places(one for one in of["fixed"] if direct[one[1]] == one[0])
        self.guesses, self.defaults = _Places(of["guess"]), _Places(of["default"])
        position = {name: k for k, name in enumerate(model.implicit)}
        near = [k for k, one in enumerate(model.starts) if is_near(model, one)]
        begins = [(k, start_name(model, model.starts[k])) for k in near]
        self.implicit = _Places((k, position[name], 1.0) for k, name in begins if name in position)


class StartProblem:
    """From start values to states.

    Start values of states are taken as given; those of other variables are equations for the remaining states.
    The equations are solved together with the explicit equations between states and those variables (as sparse as the
    model itself), and with the implicit ones.

    Attributes:
        given: start values in SI units, one for each in `CompiledDae.starts`.
    """

    def __init__(self, model: CompiledDae, point: Point) -> None:
        self.model = model
        self.given = call(model, model.start_values, point)
        self._solved: StartPlan | None = None
        self._sorted = model.once("start entries", lambda: _Sorted(model))
        self._sorted.guesses.put(point.x, self.given)
        self._sorted.implicit.put(point.z, self.given)
        for pair in self._sorted.again:
            self._compare(*pair)

    def _compare(self, number: int, earlier: int) -> None:
        """Compare a start value with the earlier one of the same motion."""
        value, other = (self.given[k] / self._sorted.factors[k] for k in (number, earlier))
        if abs(value - other) > _CONSISTENT * (1.0 + abs(other)):
            raise same_motion(self.model, (earlier, self.given[earlier]), (number, self.given[number]))

    def fix(self, point: Point) -> None:
        """Give states their own start values."""
        self._sorted.fixed.put(point.x, self.given)

    def apply(self, point: Point) -> None:
        """Give states their own start values, or defaults."""
        self._sorted.defaults.put(point.x, self.given)
        self.fix(point)

    def solve(self, point: Point, kind: StartKind) -> None:
        """Determine all states.

        Raises:
            MissingStart, ContradictingStart, InitializationError: the start values do not determine them.
        """
        self.fix(point)
        plan = start_plan(self.model, kind, point)
        if plan.columns and not (plan is self._solved and _is_free_of_modes(self.model, plan)):
            self._solve(plan, point)
            self._solved = plan
        solve_implicit(self.model, point)
        for number in plan.dependent:
            self._check_dependent(point, number)

    def _solve(self, plan: StartPlan, point: Point) -> None:
        """Newton's method on the sparse system."""
        model = self.model
        target = plan.targets(self.given)
        point.x[list(plan.zero)] = 0.0
        columns = np.array(plan.columns, int)
        y = np.zeros(plan.system.function.size1_out(0))
        nx, ny = len(model.states), len(y)
        state = np.concatenate([point.x, y, point.z])
        error = sizes = np.full(len(target), np.nan)
        system = _Evaluation(model, plan)
        for _ in range(_MAX_NEWTON):
            matrix, values = system(
                point.t, state[:nx], state[nx : nx + ny], state[nx + ny :], model.p, model.u, point.d
            )
            error = values - target
            if np.all(np.abs(error) <= _EPS * sizes):
                break  # only rounding is left
            step = _solve(matrix, -error)
            state[columns] += step
            sizes = _sizes(matrix, state[columns])
            if np.max(np.abs(step) / (1.0 + np.abs(state[columns]))) <= 1e-13:
                break
        if not np.all(np.abs(error) < _CONSISTENT * (1.0 + sizes)):
            raise self._not_found(plan, point)
        point.x, point.z = state[:nx], state[nx + ny :]

    def _not_found(self, plan: StartPlan, point: Point) -> InitializationError:
        # If the equations are singular, that is the reason.
        solve_implicit(self.model, point)
        check_singular(self.model, point)
        return not_together(self.model, plan)

    def _check_dependent(self, point: Point, number: int) -> None:
        value, present = self.given[number], call(self.model, self.model.variables, point)
        if not abs(present[self.model.starts[number].node] - value) <= _CONSISTENT * (1.0 + abs(value)):
            raise not_met(self.model, present, number, value)


class _Evaluation:
    """Some rows of the start system, and their Jacobian by some columns: a small one dense, a large one sparse."""

    def __init__(self, model: CompiledDae, plan: StartPlan) -> None:
        function, key = plan.system.function, f"start system {plan.kind}"
        self._fast = model.fast(key, lambda: _dense_values(function), (1, 2))
        self._plan, self._rows = plan, np.array(plan.wanted, int)

    def __call__(self, *arguments: Any) -> tuple[Any, Vector]:
        entries, values = self._fast(*arguments)
        matrix = self._plan.matrix(self._plan.entries(entries))
        return matrix.full() if matrix.size1() <= _DENSE else matrix, values[self._rows]


def _is_free_of_modes(model: CompiledDae, plan: StartPlan) -> bool:
    function = plan.system.function
    values, modes = function.name_out().index("values"), function.name_in().index("d")
    return model.once(("free of modes", plan.kind), lambda: not function.jac_sparsity(values, modes).nnz())


def _dense_values(system: ca.Function) -> ca.Function:
    """The start system with all of its values, including structural zeros."""
    arguments = system.mx_in()
    own, jacobian, values = system(*arguments)
    return ca.Function("start", arguments, [own, jacobian, ca.densify(values)])


def _sizes(matrix: Any, state: Vector) -> Vector:
    """Sizes of the terms of every row: the scale of rounding."""
    if isinstance(matrix, ca.DM):
        return np.array(ca.mtimes(ca.fabs(matrix), ca.DM(np.abs(state)))).ravel()
    return np.asarray(np.abs(matrix) @ np.abs(state))


def _solve(matrix: Any, right: Vector) -> Vector:
    """Solve a square system; nan where it is singular."""
    if isinstance(matrix, ca.DM):
        try:
            return np.array(ca.solve(matrix, ca.DM(right), "csparse")).ravel()
        except RuntimeError:  # the answer of CSparse for a singular matrix
            return np.full(right.shape, np.nan)
    try:
        return np.linalg.solve(matrix, right)
    except np.linalg.LinAlgError:
        return np.full(right.shape, np.nan)
