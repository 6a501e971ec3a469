"""Effects of start values, as tables: the run-time in C finds states and modes with them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from modelica_like.compile.compiled import CompiledDae
from modelica_like.solve.initialize import Point, StartPlan, call, start_plan
from modelica_like.solve.initialize.plan import is_near, near_states, start_name
from modelica_like.solve.initialize.steady import moving_states

AT_REST = -1


@dataclass(frozen=True)
class StartTables:
    """Start values by position, and their effects.

    Attributes:
        direct: (state, start value, factor) of states that are given.
        defaults: the same for defaults of states; the steady start keeps them where nothing depends on the state.
        x_guesses: (state, start value, factor) of guesses; a default is one where equations determine the state.
        z_guesses: (implicit unknown, start value, factor) of guesses.
        rows: (start value, variable, row of the start system) of all equations between the unknowns; of explicit and
            implicit ones, and of variables at rest, the start value is `AT_REST`.
        dependent: the same for start values that must follow from the others.
        steady: states whose derivatives are zero in the steady start; None for another start.
        plan: which start values determine what.
    """

    direct: tuple[tuple[int, int, float], ...]
    defaults: tuple[tuple[int, int, float], ...]
    x_guesses: tuple[tuple[int, int, float], ...]
    z_guesses: tuple[tuple[int, int, float], ...]
    rows: tuple[tuple[int, int, int], ...]
    dependent: tuple[tuple[int, int, int], ...]
    steady: tuple[int, ...] | None
    plan: StartPlan


def start_tables(model: CompiledDae, plan: StartPlan | None = None) -> StartTables:
    """Choose from the start values of a model.

    Args:
        model: the compiled model.
        plan: which start values determine what; by default as its parameters and declared modes ask for.

    Raises:
        MissingStart: the start values do not determine all states.
    """
    plan = plan or _plan(model)
    count = plan.system.function.size1_out(0) + len(model.implicit)
    row_of = {node: count + k for k, node in enumerate(plan.system.nodes)}

    def of_states(strength: str) -> tuple[tuple[int, int, float], ...]:
        chosen = ((e, k) for k, e in enumerate(model.starts.entries) if e.strength == strength)
        return tuple((e.state[0], k, e.state[1]) for e, k in chosen if e.state is not None)

    def as_rows(numbers: tuple[int, ...]) -> list[tuple[int, int, int]]:
        return [(k, model.starts.entries[k].node, row_of[model.starts.entries[k].node]) for k in numbers]

    resting = ((AT_REST, node, row_of[node]) for node in plan.resting)
    names = {name: k for k, name in enumerate(model.implicit)}
    near = [(names.get(start_name(model, e)), k) for k, e in enumerate(model.starts.entries) if is_near(model, e)]
    return StartTables(
        direct=of_states("fixed"),
        defaults=of_states("default"),
        x_guesses=tuple((e.state[0], k, e.state[1]) for k, e in near_states(model) if e.state is not None),
        z_guesses=tuple((position, k, 1.0) for position, k in near if position is not None),
        rows=(*((AT_REST, 0, row) for row in plan.wanted[: plan.own]), *as_rows(plan.rows), *resting),
        dependent=tuple(as_rows(plan.dependent)),
        steady=tuple(moving_states(model)) if plan.kind == "steady" else None,
        plan=plan,
    )


def _plan(model: CompiledDae) -> StartPlan:
    point = Point(0.0, model.starts.guesses.copy(), model.starts.z_guesses.copy(), np.zeros(model.discrete_size))
    point.d = call(model, model.starts.discretes, point)
    for hold in model.held.motions:  # what is shared says nothing of motions
        if point.d[hold.mode] == hold.number and hold.loose >= 0:
            point.d[hold.mode] = hold.loose
    values = call(model, model.starts.values, point)
    fixed = [(k, e) for k, e in enumerate(model.starts.entries) if e.strength == "fixed"]
    for k, entry in (*near_states(model), *reversed(fixed)):  # of several fixed ones for one state, the first counts
        if entry.state is not None:
            point.x[entry.state[0]] = values[k] / entry.state[1]
    return start_plan(model, model.settings.get("start", "given"), point)
