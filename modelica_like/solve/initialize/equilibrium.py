"""Steady starts: modes depend on states, and in the steady state, states depend on modes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.errors import InitializationError
from modelica_like.solve.initialize.holds import share
from modelica_like.solve.initialize.modes import complete, started
from modelica_like.solve.initialize.point import Point
from modelica_like.solve.initialize.settling import settle
from modelica_like.solve.initialize.start import StartProblem
from modelica_like.solve.initialize.steady import check_modes_hold, modes_between, solve_steady

MODE_ROUNDS = 5


def steady_start(model: CompiledDae, declared: Point) -> Point:
    """Find a steady state near the guesses, or else where a drive settles that runs from there.

    Args:
        model: the compiled model.
        declared: the guesses of the model with the declared modes.

    Raises:
        InitializationError: there is no steady state near them, or the modes do not stay.
    """
    try:
        return _near_guesses(model, declared)
    except InitializationError as error:
        point = _run_down(model, declared)
        if point is None:
            raise
        try:
            return found(model, point, StartProblem(model, declared.copy()).fix)
        except InitializationError:
            raise error from None


def settled_guess(model: CompiledDae, declared: Point) -> Point | None:
    """Return where a drive settles that runs from its guesses, if no steady state is found near these; else None."""
    try:
        _near_guesses(model, declared)
    except InitializationError:
        return _run_down(model, declared)
    return None


def _near_guesses(model: CompiledDae, declared: Point) -> Point:
    """Find a steady state from the modes that the guesses choose, and else from the declared ones.

    Guesses may drive a controller into its limits, and from there no steady state, or only the other limit, is found.
    Which way surfaces slide nothing but the guesses can tell.
    """
    point = declared.copy()
    problem = StartProblem(model, point)
    problem.apply(point)
    chosen = started(model, point)
    held, modes = {one.mode for one in model.holds}, chosen.copy()
    free = [mode for mode, *_ in model.start_modes if mode not in held]
    modes[free] = declared.d[free]
    point.d = chosen
    try:
        return found(model, point.copy(), problem.apply)
    except InitializationError as error:
        if np.array_equal(modes, chosen):
            raise
        point.d = modes
        try:
            return found(model, point, problem.apply)
        except InitializationError:
            raise error from None


def _run_down(model: CompiledDae, declared: Point) -> Point | None:
    point = declared.copy()
    StartProblem(model, point).apply(point)
    point.d = started(model, point)
    share(model, point)
    if not settle(model, point):
        return None
    point.d = started(model, point)
    return point


def found(model: CompiledDae, point: Point, again: Callable[[Point], None]) -> Point:
    """Find states and modes of a steady state.

    Args:
        model: the compiled model.
        point: near it.
        again: gives states their start values before each round.

    Raises:
        InitializationError: there is none nearby, or the modes do not stay.
    """
    share(model, point)
    old = modes = point.d
    for _ in range(MODE_ROUNDS):
        again(point)
        before = point.copy()
        solve_steady(model, point)
        modes = modes_between(model, before, point, started(model, point))
        if np.array_equal(modes, point.d):
            complete(model, point)
            check_modes_hold(model, point)
            return point
        old, point.d = point.d, modes
        share(model, point)
    raise unsettled(model, old, modes)


def unsettled(model: CompiledDae, old: Vector, modes: Vector) -> InitializationError:
    """Return the error of modes that keep changing."""
    changing = [one.path for one, a, b in zip(model.flat_discretes, old, modes, strict=False) if a != b]
    return InitializationError(
        f"The modes at the start do not settle: {', '.join(changing)} and the start values keep changing each other.",
        advice="Give start values of states, which no mode changes.",
    )
