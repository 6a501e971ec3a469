"""Finds the best design of a problem by IPOPT (A. Waechter, L. T. Biegler, 2006) with exact gradients.

What is free is scaled by its bounds, outputs by their sizes at the beginning. The largest of several numbers (load
cases, both signs of a peak) has no derivative where another one overtakes: a bound of all is minimised instead. A run
that is refused, or has no derivative, is not a number for IPOPT, which then takes a shorter step. The end of the run
is a limit of times of events: later ones do not happen in it. Where IPOPT stops without an optimum, because a peak over
time jumps from one instant to another, COBYQA (T. M. Ragonneau, 2022) goes on from the best design so far, without
derivatives.
"""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from modelica_like.analyse.optimize.designs import FEASIBLE, Outcome
from modelica_like.analyse.optimize.problem import Problem
from modelica_like.analyse.optimize.runs import Runs
from modelica_like.analyse.optimize.terms import Row
from modelica_like.analyse.sensitivity.callback import NamedCallback
from modelica_like.compile.buffers import Vector
from modelica_like.errors import extra_module

MOST_STEPS = 80
"""Of IPOPT: what converges does so within half of them."""
_OPTIONS = {
    # Differences of gradients as Hessians take two to three times the runs: each costs a run for each parameter.
    "print_level": 0, "sb": "yes", "hessian_approximation": "limited-memory", "max_iter": MOST_STEPS,
    # Relative to sizes: gradients are known to 1e-7.
    "tol": 1e-7, "acceptable_tol": 1e-6, "acceptable_iter": 4,
    # With a Hessian that is not known yet, corrections of second order jump to and fro across a limit: thrice the runs.
    "max_soc": 0,
    # Bounds are those of parameters, which may not be left.
    "bound_relax_factor": 0.0,
}  # fmt: skip
_SOLVED = ("Solve_Succeeded", "Solved_To_Acceptable_Level")
_FIRST, _LAST = 1e-2, 1e-7
"""Radii of COBYQA's trust region, relative to the bounds."""
_TRIALS = 40
"""Its runs per free parameter."""


class Scale:
    """What is to be small and what is limited, over their sizes.

    Args:
        problem: the problem.
        begin: outputs of the drive as it is, shape (cases, outputs); None where it does not run.
        aim: position of the objective.
        more: further limits, those of a point on a Pareto front.

    Attributes:
        sizes: of the outputs, at the beginning or as limited, shape (outputs,).
    """

    def __init__(self, problem: Problem, begin: Vector | None, aim: int = 0, more: tuple[Row, ...] = ()) -> None:
        self.aim = problem.numbers(problem.aims[aim].rows)
        self.rows = (*(row for limit in problem.limits for row in limit.rows()), *more)
        places, _, most = problem.numbers(self.rows)
        values = np.abs(begin).max(axis=0) if begin is not None else np.zeros(len(problem.outputs))
        self.sizes = np.where(values > 0, values, 1.0)
        np.maximum.at(self.sizes, places, np.abs(most))
        self.rows += problem.within
        self.limits = problem.numbers(self.rows)
        self.aim_size = float(self.sizes[self.aim[0]].max())

    @property
    def aim_scale(self) -> float:
        """The objective in SI units over what is minimised."""
        return float(self.aim_size * self.aim[1][0])

    def measures(self, values: Vector) -> tuple[float, float]:
        """Return the objective and the largest excess of values, shape (cases, outputs), both over their sizes."""
        places, signs, _ = self.aim
        objective = (signs * values[:, places]).max() / self.aim_size
        return float(objective), float(max(0.0, self.excess(values).max(initial=0.0)))

    def excess(self, values: Vector) -> Vector:
        """Return by how much limits are exceeded, over their sizes, shape (cases, limits)."""
        places, signs, most = self.limits
        return (signs * values[:, places] - most) / self.sizes[places]


class Search(Scale):
    """The search for one objective, from one design.

    Args:
        problem: the problem.
        runs: of its load cases.
        aim: position of the objective.
        more: further limits, those of a point on a Pareto front.
    """

    def __init__(self, problem: Problem, runs: Runs, aim: int = 0, more: tuple[Row, ...] = ()) -> None:
        begin = runs.at(problem.begin)
        super().__init__(problem, begin.values if begin is not None else None, aim, more)
        self.problem, self.runs = problem, runs

    def from_design(self, x: Vector) -> Outcome:
        """Search from a design; where nothing is free it is the best one."""
        if not self.problem.free:
            prices = np.zeros((len(self.problem.cases), len(self.rows)))
            return Outcome(x, *self.measures(self._values(x)), prices, True, "")
        with self.runs.interruptible(self.measures, self.aim_scale):
            return self._from(x)

    def _from(self, x: Vector) -> Outcome:
        outcome = self._ipopt(x, elastic=False)
        if outcome.optimal and outcome.excess <= FEASIBLE:
            return outcome
        if outcome.excess > FEASIBLE:
            least = self._ipopt(outcome.x, elastic=True)
            if least.excess > FEASIBLE:
                return least
            outcome = self._ipopt(least.x, elastic=False)
        return outcome if outcome.optimal else self._polished(outcome)

    def _ipopt(self, x: Vector, *, elastic: bool) -> Outcome:
        problem, callback = self.problem, _Values(self)
        n, cases = len(x), len(problem.cases)
        q, bound = ca.MX.sym("q", n), ca.MX.sym("bound")
        y = ca.reshape(callback(q), len(problem.outputs), cases)
        places, signs, most = self.limits
        excess = ca.vec(signs * y[places, :] - most / self.sizes[places]) if places else ca.MX(0, 1)
        aims = ca.vec(self.aim[1] * self.sizes[self.aim[0]] / self.aim_size * y[self.aim[0], :])
        bounded = elastic or aims.numel() > 1
        if elastic:
            objective, excess = bound, excess - bound
        else:
            objective = bound if bounded else aims
        above = aims - bound if bounded and not elastic else ca.MX(0, 1)
        apart = [factor * q[low] - q[high] + shift for low, high, factor, shift in self._order()]
        g = ca.vertcat(excess, above, *apart)
        unknowns = ca.vertcat(q, bound) if bounded else q
        begin = (x - problem.low) / problem.span
        first = self.measures(self._values(x))[1 if elastic else 0]
        nlp = {"x": unknowns, "f": objective, "g": g}
        solver = ca.nlpsol(
            "design", "ipopt", nlp, {"ipopt": _OPTIONS, "print_time": False, "show_eval_warnings": False}
        )
        free_bound = [-np.inf if not elastic else 0.0] if bounded else []
        solved = solver(
            x0=[*begin, *([first] if bounded else [])], lbx=[0.0] * n + free_bound,
            ubx=[1.0] * n + [np.inf] * bounded, lbg=-np.inf, ubg=0.0,
        )  # fmt: skip
        if callback.interrupt is not None:
            raise callback.interrupt
        prices = np.array(solved["lam_g"]).ravel()[: excess.numel()]
        status = str(solver.stats()["return_status"])
        end = problem.low + problem.span * np.clip(np.array(solved["x"]).ravel()[:n], 0.0, 1.0)
        return self._outcome(end, prices, status, elastic=elastic)

    def _order(self) -> list[tuple[int, int, float, float]]:
        """Return positions of two scaled values, and factor and shift by which the first is at most the second."""
        low, span = self.problem.low, self.problem.span
        return [(k, m, span[k] / span[m], (low[k] - low[m]) / span[m]) for k, m in self.problem.ordered]

    def _values(self, x: Vector) -> Vector:
        design = self.runs.at(x)
        return design.values if design is not None else np.full((len(self.problem.cases), len(self.sizes)), np.inf)

    def _outcome(self, end: Vector, prices: Vector, status: str, *, elastic: bool) -> Outcome:
        """Return the better one of where the solver ended and the best design on its way."""
        tried = [(design.x, design.values) for design in self.runs.designs]
        design = self.runs.at(end)
        if design is not None:
            objective, excess = self.measures(design.values)
            if status in _SOLVED and (elastic or excess <= FEASIBLE):
                return Outcome(end, objective, excess, self._prices(prices), True, status)
            tried.append((end, design.values))
        ordered = [(x, *self.measures(values)) for x, values in tried if self._in_order(x)]
        x, objective, excess = min(ordered, key=lambda item: (max(item[2], FEASIBLE), item[1]))
        return Outcome(x, objective, excess, self._prices(prices), False, status)

    def _in_order(self, x: Vector) -> bool:
        return all(x[low] <= x[high] + FEASIBLE * self.problem.span[low] for low, high in self.problem.ordered)

    def _prices(self, multipliers: Vector) -> Vector:
        places, signs, _ = self.limits
        per_row = multipliers.reshape(len(self.problem.cases), len(places)) if places else np.zeros((1, 0))
        return -per_row * signs * self.aim_scale / self.sizes[places]

    def _polished(self, outcome: Outcome) -> Outcome:
        """Go on without derivatives."""
        optimize = extra_module("scipy.optimize", "analyse")
        problem = self.problem
        begin = (outcome.x - problem.low) / problem.span

        def values(q: Vector) -> Vector:
            known = self.runs.values_at(problem.low + problem.span * np.clip(q, 0.0, 1.0))
            return np.full((len(problem.cases), len(self.sizes)), np.nan) if known is None else known

        limits: list[Any] = []
        if self.rows:
            limits.append(optimize.NonlinearConstraint(lambda q: self.excess(values(q)).ravel(), -np.inf, 0.0))
        for low, high, factor, shift in self._order():
            row = np.zeros(len(begin))
            row[low], row[high] = factor, -1.0
            limits.append(optimize.LinearConstraint(row, -np.inf, -shift))
        radius = {"initial_tr_radius": _FIRST, "final_tr_radius": _LAST, "maxfev": _TRIALS * (len(begin) + 1)}
        result = optimize.minimize(
            lambda q: self.measures(values(q))[0], begin, method="COBYQA", bounds=[(0.0, 1.0)] * len(begin),
            constraints=limits, options=radius,
        )  # fmt: skip
        x = problem.low + problem.span * np.clip(result.x, 0.0, 1.0)
        objective, excess = self.measures(values(result.x))
        better = objective <= outcome.objective and excess <= max(outcome.excess, FEASIBLE)
        if not better:
            return outcome
        # Without derivatives nothing tells what a limit costs there.
        return Outcome(x, objective, excess, 0.0 * outcome.prices, bool(result.success), "COBYQA")


class _Values(NamedCallback):
    """Outputs of all load cases over their sizes, as a function of what is free, scaled by its bounds."""

    def __init__(self, search: Search) -> None:
        super().__init__()
        self._search = search
        self.interrupt: KeyboardInterrupt | None = None
        problem = search.problem
        self._size = len(problem.cases) * len(problem.outputs), len(problem.free)
        self._slopes = _Slopes(self, self._size)
        dense = ca.Sparsity.dense
        self.declare("design", {"q": dense(self._size[1])}, {"y": dense(self._size[0])})

    def numbers(self, q: Any) -> tuple[Vector, Vector] | None:
        """Return values and slopes, None where a run is refused."""
        search = self._search
        problem = search.problem
        try:
            design = search.runs.at(problem.low + problem.span * np.clip(np.array(q, float).ravel(), 0.0, 1.0))
        except KeyboardInterrupt as interrupt:
            self.interrupt = interrupt  # CasADi ends the search, and tells nobody why
            raise
        if design is None:
            return None
        values = (design.values / search.sizes).ravel()
        slopes = design.slopes * problem.span / search.sizes[:, None]
        return values, slopes.reshape(self._size)

    def eval(self, arg: Any) -> list[Any]:
        """Run."""
        numbers = self.numbers(arg[0])
        return [ca.DM(np.full(self._size[0], np.nan) if numbers is None else numbers[0])]

    def has_jacobian(self) -> bool:
        """Tell CasADi that the derivatives are known."""
        return True

    def get_jacobian(self, name: str, inames: Any, onames: Any, opts: Any) -> Any:
        """Return the function of the derivatives."""
        return self._slopes


class _Slopes(NamedCallback):
    def __init__(self, values: _Values, size: tuple[int, int]) -> None:
        super().__init__()
        self._values, self._size = values, size
        arguments = {"q": ca.Sparsity.dense(size[1]), "out_y": ca.Sparsity(size[0], 1)}
        self.declare("slopes", arguments, {"jac_y_q": ca.Sparsity.dense(*size)})

    def eval(self, arg: Any) -> list[Any]:
        numbers = self._values.numbers(arg[0])
        return [ca.DM(np.full(self._size, np.nan) if numbers is None else numbers[1])]
