"""Effects of start values, as tables.

The choice depends only on the structure, so it is made once, by the code that starts a simulation.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from modelica_like.compile.compiled import CompiledDae
from modelica_like.solve.initialize import HOMOTOPY, Point, call, initialize, settled_guess, share, start_plan
from modelica_like.solve.initialize.plan import is_near, start_name
from modelica_like.solve.initialize.start import StartProblem
from modelica_like.solve.initialize.steady import moving_states

AT_REST = -1


@dataclass(frozen=True)
class StartTables:
    """Start values by position, and their effects.

    Attributes:
        direct: (state, start value, factor) of states that are given.
        defaults: the same for defaults of states; only the steady start uses them.
        x_guesses: (state, start value, factor) of guesses.
        z_guesses: (implicit unknown, start value, factor) of guesses.
        rows: (start value, variable, row of the start system) of all equations between the unknowns; of explicit and
            implicit ones, and of variables at rest, the start value is `AT_REST`.
        dependent: the same for start values that must follow from the others.
        system: the start system.
        zero: states that start at zero because nothing else is given.
        columns: unknowns of the start system among (x, y, z).
        wanted: its rows.
        steady: states whose derivatives are zero in the steady start; None for another start.
        guesses: of the states and the implicit unknowns. A steady start that is not found near those of the model
            begins where the drive settles, one with `homotopy` at its solution; then other guesses and defaults do not
            count.
    """

    direct: tuple[tuple[int, int, float], ...]
    defaults: tuple[tuple[int, int, float], ...]
    x_guesses: tuple[tuple[int, int, float], ...]
    z_guesses: tuple[tuple[int, int, float], ...]
    rows: tuple[tuple[int, int, int], ...]
    dependent: tuple[tuple[int, int, int], ...]
    system: ca.Function
    zero: tuple[int, ...]
    columns: tuple[int, ...]
    wanted: tuple[int, ...]
    steady: tuple[int, ...] | None
    guesses: tuple[float, ...]


def start_tables(model: CompiledDae) -> StartTables:
    """Choose from the start values of a model like a simulation.

    Raises:
        MissingStart, ContradictingStart: the start values do not determine all states.
    """
    point = Point(0.0, model.guesses.copy(), model.z_guesses.copy(), np.zeros(model.discrete_size))
    point.d = call(model, model.discrete_starts, point)
    share(model, point)
    kind = model.settings.get("start", "given")
    settled = settled_guess(model, point) if kind == "steady" else None
    if HOMOTOPY in model.discrete_position:
        settled = initialize(model, start=kind)
    StartProblem(model, point).fix(point)
    plan = start_plan(model, kind, point)
    count = plan.system.function.size1_out(0) + len(model.implicit)
    row_of = {node: count + k for k, node in enumerate(plan.system.nodes)}

    def of_states(strength: str) -> tuple[tuple[int, int, float], ...]:
        if settled is not None and strength != "fixed":
            return ()
        chosen = [(e.state, k) for k, e in enumerate(model.starts) if e.strength == strength and e.state is not None]
        return tuple((state[0], k, state[1]) for state, k in chosen)

    def as_rows(numbers: tuple[int, ...]) -> list[tuple[int, int, int]]:
        return [(k, model.starts[k].node, row_of[model.starts[k].node]) for k in numbers]

    resting = ((AT_REST, node, row_of[node]) for node in plan.resting)
    names = {name: k for k, name in enumerate(model.implicit)}
    near = [(names.get(start_name(model, e)), k) for k, e in enumerate(model.starts) if is_near(model, e)]
    begin = settled or Point(0.0, model.guesses, model.z_guesses, point.d)
    return StartTables(
        direct=of_states("fixed"),
        defaults=of_states("default"),
        x_guesses=of_states("guess"),
        z_guesses=tuple((position, k, 1.0) for position, k in near if position is not None and settled is None),
        rows=(*((AT_REST, 0, row) for row in plan.wanted[: plan.own]), *as_rows(plan.rows), *resting),
        dependent=tuple(as_rows(plan.dependent)),
        system=plan.system.function,
        zero=plan.zero,
        columns=plan.columns,
        wanted=plan.wanted,
        steady=tuple(moving_states(model)) if plan.kind == "steady" else None,
        guesses=(*begin.x.tolist(), *begin.z.tolist()),
    )
