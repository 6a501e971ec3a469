"""Consistent start values and modes."""

from __future__ import annotations

from typing import get_args

import numpy as np

from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import InitializationError, UnknownName, did_you_mean
from modelica_like.solve.initialize.contradictions import not_found as not_found
from modelica_like.solve.initialize.contradictions import not_met as not_met
from modelica_like.solve.initialize.contradictions import same_motion as same_motion
from modelica_like.solve.initialize.equilibrium import MODE_ROUNDS, found, steady_start
from modelica_like.solve.initialize.equilibrium import settled_guess as settled_guess
from modelica_like.solve.initialize.equilibrium import unsettled as unsettled
from modelica_like.solve.initialize.holds import INSTANT as INSTANT
from modelica_like.solve.initialize.holds import Impact as Impact
from modelica_like.solve.initialize.holds import Strike as Strike
from modelica_like.solve.initialize.holds import holding as holding
from modelica_like.solve.initialize.holds import rest as rest
from modelica_like.solve.initialize.holds import share as share
from modelica_like.solve.initialize.holds import sharing as sharing
from modelica_like.solve.initialize.homotopy import HOMOTOPY as HOMOTOPY
from modelica_like.solve.initialize.homotopy import lead
from modelica_like.solve.initialize.ideal import contradiction as contradiction
from modelica_like.solve.initialize.ideal import no_valid_modes as no_valid_modes
from modelica_like.solve.initialize.ideal import refuse_contradiction as refuse_contradiction
from modelica_like.solve.initialize.modes import complete, started
from modelica_like.solve.initialize.plan import StartKind as StartKind
from modelica_like.solve.initialize.plan import StartPlan as StartPlan
from modelica_like.solve.initialize.plan import start_plan as start_plan
from modelica_like.solve.initialize.point import Point as Point
from modelica_like.solve.initialize.point import call as call
from modelica_like.solve.initialize.point import check_singular as check_singular
from modelica_like.solve.initialize.point import implicit_at as implicit_at
from modelica_like.solve.initialize.point import is_linear as is_linear
from modelica_like.solve.initialize.point import newton_at as newton_at
from modelica_like.solve.initialize.point import not_solved as not_solved
from modelica_like.solve.initialize.point import polished as polished
from modelica_like.solve.initialize.point import rate_not_finite as rate_not_finite
from modelica_like.solve.initialize.point import solve_implicit as solve_implicit
from modelica_like.solve.initialize.singular import implicit_singular as implicit_singular
from modelica_like.solve.initialize.singular import singular_block as singular_block
from modelica_like.solve.initialize.slopes import variable_slopes as variable_slopes
from modelica_like.solve.initialize.start import StartProblem
from modelica_like.solve.initialize.steady import mode_not_steady as mode_not_steady
from modelica_like.solve.initialize.steady import not_steady as not_steady


def initialize(model: CompiledDae, t0: float = 0.0, start: StartKind = "given") -> Point:
    """Find consistent start values.

    Args:
        model: the compiled model.
        t0: start time in s.
        start: `given`: the start values of the model determine everything; `rest`: variables without a start value
            are at rest, absolute speeds before relative ones; `steady`: all derivatives are zero, except those of
            states on which nothing depends.

    Returns:
        The start, before events at t0.

    Raises:
        MissingStart: start values are missing.
        ContradictingStart: start values contradict each other.
        InitializationError: the solver did not find a solution.
        UnknownName: there is no such kind of start.
        SingularAtStart: the equations have no unique solution.
    """
    if start not in get_args(StartKind):
        raise UnknownName(
            f"There is no start '{start}'{did_you_mean(start, get_args(StartKind)) or '.'}",
            advice="A run can start as given, at rest or in the steady state: given, rest, steady.",
        )
    if start == "steady":
        model.refuse_delays(InitializationError, f"{model.name} cannot start in the steady state")
    point = Point(t0, model.guesses.copy(), model.z_guesses.copy(), np.zeros(model.discrete_size))
    point.d = call(model, model.discrete_starts, point)
    share(model, point)
    if start == "steady":
        return lead(model, point, lambda at: steady_start(model, at), lambda at: found(model, at, lambda _: None))
    problem = StartProblem(model, point)

    def solve(at: Point) -> Point:
        _find_modes(problem, at, start)
        complete(model, at)
        return at

    return lead(model, point, solve, solve)


def _find_modes(problem: StartProblem, point: Point, start: StartKind) -> None:
    """Find states and modes: modes depend on states, and start values may depend on modes."""
    model = problem.model
    old = modes = point.d
    for _ in range(MODE_ROUNDS):
        problem.solve(point, start)
        modes = started(model, point)
        if np.array_equal(modes, point.d):
            return
        old, point.d = point.d, modes
        share(model, point)
    raise unsettled(model, old, modes)
