"""Consistent start values and modes."""

from __future__ import annotations

from typing import get_args

import numpy as np

from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.errors import InitializationError, UnknownName, did_you_mean
from modelica_like.initialize.holds import INSTANT as INSTANT
from modelica_like.initialize.holds import Impact as Impact
from modelica_like.initialize.holds import Strike as Strike
from modelica_like.initialize.holds import holding as holding
from modelica_like.initialize.holds import rest as rest
from modelica_like.initialize.holds import share as share
from modelica_like.initialize.holds import sharing as sharing
from modelica_like.initialize.ideal import meet as meet
from modelica_like.initialize.ideal import replace_dependent
from modelica_like.initialize.plan import StartKind as StartKind
from modelica_like.initialize.plan import StartPlan as StartPlan
from modelica_like.initialize.plan import start_plan as start_plan
from modelica_like.initialize.point import Point as Point
from modelica_like.initialize.point import call as call
from modelica_like.initialize.point import check_singular as check_singular
from modelica_like.initialize.point import implicit_at as implicit_at
from modelica_like.initialize.point import is_linear as is_linear
from modelica_like.initialize.point import newton_at as newton_at
from modelica_like.initialize.point import solve_implicit as solve_implicit
from modelica_like.initialize.slopes import variable_slopes as variable_slopes
from modelica_like.initialize.start import StartProblem
from modelica_like.initialize.steady import check_modes_hold, modes_between, solve_steady

_MODE_ROUNDS = 5


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
        point = _settled_steady(model, point)
    else:
        _settle(model, point, StartProblem(model, point), start)
    rest(model, point)
    replace_dependent(model, point)
    solve_implicit(model, point)
    check_singular(model, point)
    if start == "steady":
        check_modes_hold(model, point)
    return point


def _settled_steady(model: CompiledDae, declared: Point) -> Point:
    """Find a steady state from the modes that the guesses choose, and else from the declared ones.

    Guesses may drive a controller into its limits, and from there no steady state, or only the other limit, is found.
    Which way surfaces slide nothing but the guesses can tell.
    """
    failed: InitializationError | None = None
    for chosen in (True, False):
        point = declared.copy()
        problem = StartProblem(model, point)
        problem.apply(point)
        modes = started(model, point)
        holding = {one.mode for one in model.holds}
        free = [mode for mode, *_ in model.start_modes if mode not in holding]
        if not chosen:
            modes[free] = declared.d[free]
        point.d = modes
        share(model, point)
        try:
            _settle(model, point, problem, "steady")
        except InitializationError as error:
            failed = failed or error
        else:
            return point
    assert failed is not None
    raise failed


def _settle(model: CompiledDae, point: Point, problem: StartProblem, start: StartKind) -> None:
    """Find states and modes: modes depend on states, and in the steady state, states depend on modes."""
    old = modes = point.d
    for _ in range(_MODE_ROUNDS):
        if start == "steady":
            problem.apply(point)
            before = point.copy()
            solve_steady(model, point)
            modes = modes_between(model, before, point, started(model, point))
        else:
            problem.solve(point, start)
            modes = started(model, point)
        if np.array_equal(modes, point.d):
            return
        old, point.d = point.d, modes
        share(model, point)
    changing = [one.path for one, a, b in zip(model.flat_discretes, old, modes, strict=False) if a != b]
    raise InitializationError(
        f"The modes at the start do not settle: {', '.join(changing)} and the start values keep changing each other.",
        advice="Give start values of states, which no mode changes.",
    )


def chosen_modes(model: CompiledDae, point: Point) -> Vector:
    """Choose modes by their start conditions: the first true one wins; without one, it is the declared start."""
    d, decided = point.d.copy(), dict[int, int]()
    for holds, (mode, target, _) in zip(call(model, model.start_conditions, point), model.start_modes, strict=True):
        if holds:
            decided.setdefault(mode, target)
    left = list({mode for mode, *_ in model.start_modes} - decided.keys())
    if left:
        d[left] = call(model, model.discrete_starts, point)[left]
    d[list(decided)] = list(decided.values())
    return d


def started(model: CompiledDae, point: Point) -> Vector:
    """Choose modes, and evaluate the equations of discrete variables, whose `pre` are their start values."""
    d = chosen_modes(model, point)
    places = [(k, one.reset.index) for k, one in enumerate(model.update_rows) if one.at_start]
    if places:
        rows, own = map(list, zip(*places, strict=True))
        d[own] = call(model, model.discrete_starts, point)[own]
        d[own] = call(model, model.updates, Point(point.t, point.x, point.z, d))[rows]
    return d
