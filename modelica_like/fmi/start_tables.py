"""Which start values determine what, as tables.

The choice depends on the structure only, so it is made once, by the same code that starts a simulation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from modelica_like.compile.compiled import CompiledDae
from modelica_like.initialize import Point
from modelica_like.initialize.start import Rows, StartProblem, _StartSystem
from modelica_like.initialize.steady import moving_states


@dataclass(frozen=True)
class StartTables:
    """Start values by position, and what they determine.

    Attributes:
        direct: (state, start value, factor) of states that are given.
        defaults: the same for defaults of states; only the steady start uses them.
        x_guesses: (state, start value, factor) of guesses.
        z_guesses: (implicit unknown, start value, factor) of guesses.
        rows: (start value, variable, row of the start system) of start values that are equations.
        dependent: the same for start values that must follow from the others.
        zero: states that begin at zero because nothing else is said.
        columns: unknowns of the start system among (x, y, z).
        wanted: its rows.
        steady: states whose derivatives are zero in the steady start; None for another start.
    """

    direct: tuple[tuple[int, int, float], ...]
    defaults: tuple[tuple[int, int, float], ...]
    x_guesses: tuple[tuple[int, int, float], ...]
    z_guesses: tuple[tuple[int, int, float], ...]
    rows: tuple[tuple[int, int, int], ...]
    dependent: tuple[tuple[int, int, int], ...]
    zero: tuple[int, ...]
    columns: tuple[int, ...]
    wanted: tuple[int, ...]
    steady: tuple[int, ...] | None


def start_tables(model: CompiledDae) -> StartTables:
    """Choose among the start values of a model as a simulation does.

    Raises:
        MissingStart, ContradictingStart: they do not determine all states.
    """
    point = Point(0.0, model.guesses.copy(), model.z_guesses.copy(), np.zeros(model.discrete_size))
    kind = model.settings.get("start", "given")
    problem = StartProblem(model, point)
    place = {id(entry): k for k, entry in enumerate(model.starts)}
    free = [k for k in range(len(model.states)) if k not in problem.direct]
    rows, dependent, columns = Rows(), [], []
    if kind != "steady" and (free or problem.general):
        system = _StartSystem(model, point, free)
        rows, dependent = problem._choose(system, free, kind == "rest")
        columns = [column for column in system.columns if column not in set(rows.states)]
    own = model.start_system.size1_out(0) + len(model.implicit)
    node_row = {node: own + k for k, node in enumerate(model.start_nodes)}

    def of_states(strength: str) -> tuple[tuple[int, int, float], ...]:
        chosen = [(e.state, k) for k, e in enumerate(model.starts) if e.strength == strength and e.state is not None]
        return tuple((state[0], k, state[1]) for state, k in chosen)

    names = {name: k for k, name in enumerate(model.implicit)}
    guessed = [
        (names.get(problem.name(e)), k) for k, e in enumerate(model.starts) if e.strength == "guess" and e.state is None
    ]
    triples = [tuple((place[id(e)], e.node, node_row[e.node]) for e in some) for some in (rows.entries, dependent)]
    return StartTables(
        direct=of_states("fixed"),
        defaults=of_states("default"),
        x_guesses=of_states("guess"),
        z_guesses=tuple((position, k, 1.0) for position, k in guessed if position is not None),
        rows=triples[0],
        dependent=triples[1],
        zero=tuple(rows.states),
        columns=tuple(columns),
        wanted=(*range(own), *(row for _, _, row in triples[0])) if columns else (),
        steady=tuple(moving_states(model)) if kind == "steady" else None,
    )
