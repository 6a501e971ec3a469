"""Messages about start values that contradict each other, or that no start has."""

from __future__ import annotations

from modelica_like.compile.compiled import CompiledDae, StartEntry, Vector
from modelica_like.errors import ContradictingStart, InitializationError
from modelica_like.flatten.model import INITIAL_EQUATION
from modelica_like.solve.initialize.plan import StartKind, StartPlan, start_name, start_plan
from modelica_like.solve.initialize.point import Point, check_singular, solve_implicit


def _valued(model: CompiledDae, entry: StartEntry, value: float) -> str:
    """Tell a start value, or the initial equation that asks for it."""
    description = model.flat_variables[entry.node].description
    return description if description.startswith(INITIAL_EQUATION) else f"{start_name(model, entry)} = {value:g}"


def same_motion(model: CompiledDae, first: tuple[int, float], second: tuple[int, float]) -> ContradictingStart:
    """Return the error of two start values (number in `starts`, and value) of one state."""
    values = [_valued(model, model.starts.entries[number], value) for number, value in (first, second)]
    return ContradictingStart(
        f"{values[0]} and {values[1]} contradict each other: they are the same motion.",
        where=model.places_of([start_name(model, model.starts.entries[k]) for k, _ in (first, second)]),
        advice="Remove one of the two start values.",
    )


def not_found(model: CompiledDae, kind: StartKind, point: Point) -> InitializationError:
    """Return the error of a start that Newton's method does not find from a point.

    Raises:
        SingularAtStart, InitializationError: the equations have no solution there, which is the reason.
    """
    solve_implicit(model, point)
    check_singular(model, point)
    return not_together(model, start_plan(model, kind, point))


def not_together(model: CompiledDae, plan: StartPlan) -> InitializationError:
    """Return the error of start values that no start has together."""
    given = [start_name(model, model.starts.entries[k]) for k in plan.rows]
    resting = [model.flat_variables[k].path for k in plan.resting if k < len(model.flat_variables)]
    have = f"{', '.join(given[:6])} {'have' if len(given) > 1 else 'has'} the requested value" if given else ""
    rest = f"{', '.join(resting[:6])} {'are' if len(resting) > 1 else 'is'} at rest" if resting else ""
    return InitializationError(
        f"No start was found at which {' and '.join(filter(None, (have, rest))) or 'the equations are met'}.",
        advice="Give guesses near the solution, or start values of states.",
    )


def not_met(model: CompiledDae, present: Vector, number: int, value: float) -> ContradictingStart:
    """Return the error of a start value that must follow from others but does not.

    Args:
        model: the compiled model.
        present: all variables at the start with the others.
        number: of the start value in `Starts.entries`.
        value: what it should be.
    """
    starts = model.starts.entries
    entry = starts[number]
    fixed = [e for e in starts if e.strength == "fixed" and e is not entry and _coupled(model, entry, e)]
    partners, start = [_valued(model, e, present[e.node]) for e in fixed[:2]], _valued(model, entry, value)
    wrong = "contradict each other" if partners else "cannot be met"
    sides = f"left minus right{' of the last one' * bool(partners)}"
    name = sides if start.startswith(INITIAL_EQUATION) else start_name(model, entry)
    return ContradictingStart(
        f"{' and '.join([*partners, start])} {wrong}: {name} would be {present[entry.node]:g}.",
        where=model.places_of([start_name(model, other) for other in (*fixed[:2], entry)])
        or [o.source for o in model.equations.differentiated if o.source.file][:3],
        advice="Remove one of the start values, or make one a guess.",
    )


def _coupled(model: CompiledDae, first: StartEntry, second: StartEntry) -> bool:
    """Return whether two variables depend on a common state."""
    by_variable = model.equations.variables.jac_sparsity(0, 1).T
    starts, states = by_variable.colind(), by_variable.row()
    columns = [set(states[starts[e.node] : starts[e.node + 1]]) for e in (first, second)]
    return bool(columns[0] & columns[1])
