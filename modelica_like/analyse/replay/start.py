"""How start values depend on parameters: the start system, differentiated."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.analyse.linear.linearize import held_by
from modelica_like.analyse.replay.slopes import Sizes
from modelica_like.compile.buffers import Vector
from modelica_like.compile.compiled import CompiledDae
from modelica_like.initialize import Point, StartKind, start_plan
from modelica_like.initialize.kept import find_kept, solve_kept
from modelica_like.initialize.steady import moving_states

_MAX_NEWTON = 50


class StartSlopes:
    """Derivatives of the start by (p, u).

    Args:
        model: the compiled model.
        point: the consistent start, before events.
        start: the kind of start of the run.

    Attributes:
        x: shape (nx, np + nu).
        d: shape (nd, np + nu).
    """

    def __init__(self, model: CompiledDae, point: Point, start: StartKind) -> None:
        self.model = model
        self.point = point
        self.size = Sizes.of(model)
        given = point.t, point.x, point.z, model.p, model.u, point.d
        jacobians = [self._of_parameters(name, given) for name in ("discrete_starts", "start_values")]
        self.plan = start_plan(model, start, point)
        jacobians += [] if start == "steady" else [self._start_system()[1]]
        # Of many parameters few have a part in the start: only their columns are followed.
        moved = range(self.size.fixed) if start == "steady" else sorted({c for one in jacobians for c in _columns(one)})
        self.moved = list(moved)
        starts, values = (np.asarray(one[:, self.moved].full()) for one in jacobians[:2])
        self.starts, self.values = starts, values
        states = self._steady(given) if start == "steady" else self._given()
        self.x, self.d = np.zeros((self.size.x, self.size.fixed)), np.zeros((self.size.d, self.size.fixed))
        self.x[:, self.moved], self.d[:, self.moved] = states, starts

    def _of_parameters(self, name: str, given: Any) -> Any:
        """Derivatives of a function by (p, u), sparse."""
        model = self.model
        key = "slopes by parameters", name
        if key not in model._cache:
            arguments = model.arguments
            value = getattr(model, name)(*arguments.values())
            fixed = ca.vertcat(arguments["p"], arguments["u"])
            model._cache[key] = ca.Function("slopes", list(arguments.values()), [ca.jacobian(value, fixed)])
        return model._cache[key](*given)

    def _direct(self) -> Vector:
        """Derivatives of the states that have start values of their own."""
        slopes = np.zeros((self.size.x, len(self.moved)))
        for _, number in self.plan.direct:
            self._take(slopes, number)
        return slopes

    def _take(self, slopes: Vector, number: int) -> None:
        state = self.model.starts[number].state
        assert state is not None
        slopes[state[0]] = self.values[number] / state[1]

    def _given(self) -> Vector:
        """Implicit function theorem on the start system."""
        size, plan = self.size, self.plan
        slopes = self._direct()
        if not plan.columns or not self.moved:
            return slopes
        wanted, columns = list(plan.wanted), list(plan.columns)
        by_unknowns, by_fixed, by_d = self._start_system()
        fixed = np.asarray(by_fixed[wanted, self.moved].full()) + np.asarray(by_d[wanted, :].full()) @ self.starts
        known = ca.mtimes(by_unknowns[wanted, : size.x], ca.DM(slopes))
        right = plan.targets(self.values) - fixed - np.asarray(known.full())
        if right.size:
            solved = np.asarray(ca.solve(by_unknowns[wanted, columns], ca.DM(right)).full())
            for row, column in enumerate(columns):
                if column < size.x:
                    slopes[column] = solved[row]
        return slopes

    def _start_system(self) -> tuple[Any, Any, Any]:
        """Jacobians of the start system by its unknowns (x, y, z), by (p, u) and by d, sparse."""
        model, point, system = self.model, self.point, self.plan.system.function
        key = "start slopes", self.plan.kind
        if key not in model._cache:
            names = system.name_in()
            arguments = [ca.SX.sym(name, system.size1_in(k)) for k, name in enumerate(names)]
            _, jacobian, values = system(*arguments)
            by_d = ca.jacobian(values, arguments[6])
            fixed = ca.jacobian(values, ca.vertcat(arguments[4], arguments[5]))
            model._cache[key] = ca.Function("start_slopes", arguments, [jacobian, fixed, by_d])
        given = point.t, point.x, self._start_variables(), point.z, model.p, model.u, point.d
        return model._cache[key](*given)

    def _start_variables(self) -> Vector:
        """The variables y of the start system: its first equations, solved."""
        model, point, system = self.model, self.point, self.plan.system.function
        count = system.size1_out(0)
        y = np.zeros(count)
        if not count:
            return y
        own, places = list(range(count)), list(range(self.size.x, self.size.x + count))
        for _ in range(_MAX_NEWTON):
            _, jacobian, values = system(point.t, point.x, y, point.z, model.p, model.u, point.d)
            step = np.array(ca.solve(jacobian[own, places], -values[own])).ravel()
            y = y + step
            if np.max(np.abs(step) / (1.0 + np.abs(y))) < 1e-13:
                break
        return y

    def _steady(self, given: Any) -> Vector:
        """Implicit function theorem on the steady state; what that leaves open is held, or keeps to the guess."""
        model, size = self.model, self.size
        guess = self._direct()
        fixed = {state for state, _ in self.plan.direct}
        for number, entry in enumerate(model.starts):
            if entry.strength == "default" and entry.state is not None and entry.state[0] not in fixed:
                self._take(guess, number)
        arguments = model.arguments
        x, z = arguments["x"], arguments["z"]
        symbols = list(arguments.values())
        equations = ca.vertcat(model.ode(*symbols), model.alg(*symbols))
        moving = moving_states(model)
        chosen = equations[[*moving, *range(size.x, size.x + size.z)]]
        fixed = ca.vertcat(arguments["p"], arguments["u"])
        by = ca.vertcat(*(x[k] for k in moving), z), fixed, arguments["d"]
        function = ca.Function("steady", symbols, [ca.jacobian(chosen, one) for one in by])
        unknowns, by_fixed, by_d = (np.asarray(part.full()) for part in function(*given))
        before = np.concatenate([guess[moving], np.zeros((size.z, len(self.moved)))])
        kept = find_kept(model, self.point, moving, unknowns)
        names = [*model.parameter_position, *(model.flat_variables[k].path for k in model.inputs)]
        of_held = held_by(model, self.point, kept, names)[:, self.moved]
        of_held = -of_held - kept.rows[: len(kept.held)] @ guess[moving]
        right = -(by_fixed + by_d @ self.starts + unknowns @ before)
        guess[moving] += solve_kept(kept, unknowns, right, of_held)[: len(moving)]
        return guess


def _columns(matrix: Any) -> list[int]:
    """Columns of a sparse matrix with entries."""
    starts = matrix.sparsity().colind()
    return [k for k, (first, last) in enumerate(pairwise(starts)) if last > first]
