"""Modes at the start, and what follows from them."""

from __future__ import annotations

from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.solve.initialize.holds import rest
from modelica_like.solve.initialize.ideal import replace_dependent
from modelica_like.solve.initialize.point import Point, call, check_singular, solve_implicit


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


def complete(model: CompiledDae, point: Point) -> None:
    """Let held motions within rounding rest, and solve for all that follows.

    Raises:
        SingularAtStart: the equations have no unique solution.
        InitializationError: the implicit equations were not solved.
    """
    rest(model, point)
    replace_dependent(model, point)
    solve_implicit(model, point)
    check_singular(model, point)
