"""The equations between start values and states, kept as sparse as the model."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import casadi as ca

from modelica_like.flatten.template import column
from modelica_like.structure.alias import PREFERRED
from modelica_like.structure.reduce import ReducedDae
from modelica_like.structure.system import System

_STORED = 0
_RATES = 2
"""Levels of a chain whose speed may rest: a position and its speed, below an acceleration."""


@dataclass(frozen=True)
class StartSystem:
    """Equations between start values and states.

    Attributes:
        function: of (t, x, y, z, p, u, d) with y the variables that start values need: y itself, the Jacobian of the
            values by (x, y, z), and the values of [y - expression, alg, variables of `nodes`].
        nodes: variables (nodes) at its end.
        rest: variables at rest if not given, in order of priority: node, and the state if it is one.
        rates: positions in (x, y) of derivatives of others, which are all zero at rest.
        guesses: numbers of the guessed start values of variables that may be at rest, in the same order.
    """

    function: ca.Function
    nodes: tuple[int, ...]
    rest: tuple[tuple[int, int | None], ...] = ()
    rates: tuple[int, ...] = ()
    guesses: tuple[int, ...] = ()


def start_system(reduced: ReducedDae, rest: bool) -> StartSystem:
    """Build the start system.

    A variable such as the speed of the last mass of a chain is the sum of all relative speeds. Written out, N such
    variables are N^2 terms; with the variables in between as unknowns y of their own, the system stays as sparse as
    the chain.

    Args:
        reduced: the reduced system.
        rest: include variables that may be at rest.
    """
    flat, system = reduced.flat, reduced.system
    order = tuple((node, _state(reduced, node)) for node in rest_order(reduced)) if rest else ()
    resting = [node for node, state in order if state is None]
    nodes = tuple(dict.fromkeys([*(s.node for s in flat.starts), *resting]))
    needed = _needed(reduced, nodes)
    y = column(system.symbols[level] for level, _ in needed)
    explicit = ca.vertcat(*(system.symbols[level] - expression for level, expression in needed))
    wanted = ca.vertcat(*(system.node_values[node] for node in nodes))
    values = ca.densify(ca.vertcat(explicit, reduced.alg, wanted))
    unknowns = ca.vertcat(reduced.x, y, reduced.z)
    arguments = [flat.time, reduced.x, y, reduced.z, flat.p, reduced.u, flat.d]
    results = [y, ca.jacobian(values, unknowns), values]
    names = ["t", "x", "y", "z", "p", "u", "d"]
    function = ca.Function("start_system", arguments, results, names, ["variables", "jacobian", "values"])
    rates = _rates(reduced, [level for level, _ in needed]) if rest else ()
    return StartSystem(function, nodes, order, rates, _guesses(reduced, [node for node, _ in order]))


def _guesses(reduced: ReducedDae, resting: list[int]) -> tuple[int, ...]:
    """Numbers of the guesses of variables at rest; of equal variables, the first by name comes first."""
    placed, guessed = reduced.system.node_level, dict[int, list[tuple[str, int]]]()
    for k, one in enumerate(reduced.flat.starts):
        if one.strength == "guess" and (place := placed[one.node]) is not None:
            guessed.setdefault(place[0], []).append((reduced.flat.node_name(one.node), k))
    levels = [place[0] for node in resting if (place := placed[node]) is not None]
    return tuple(k for level in levels for _, k in sorted(guessed.get(level, ())))


def _rates(reduced: ReducedDae, needed: list[int]) -> tuple[int, ...]:
    """Positions of derivatives of others among the states and the needed unknowns."""
    levels, placed = reduced.system.levels, zip(reduced.node_states, reduced.system.node_level, strict=True)
    states = {state[0] for state, place in placed if state and place and levels[place[0]].order}
    return *sorted(states), *(reduced.x.numel() + k for k, level in enumerate(needed) if levels[level].order)


def rest_order(reduced: ReducedDae) -> list[int]:
    """Undetermined variables (nodes) that are zero at rest, in an order that does not depend on the order of lines.

    Relative speeds of springs come first: what is coupled elastically turns with a part that is given a speed. Then
    variables that store energy: speeds of inertias and masses before currents, pressures and twists of springs. Other
    relative speeds, those of clutches and dampers, come next, then positions. Equal variables count as one; among
    equal ranks the first by name counts.
    """
    system = reduced.system
    stores = {placed[0] for node in _storing(reduced) if (placed := system.node_level[node]) is not None}
    springs = _spring_rates(reduced) - stores
    first: dict[int, tuple[str, int]] = {}
    for node, placed in enumerate(system.node_level):
        if placed is not None and (placed[0] in stores or system.derivative(placed[0]) is not None):
            one = reduced.flat.node_name(node), node
            first[placed[0]] = min(one, first.get(placed[0], one))

    def rank(level: int) -> tuple[Any, ...]:
        one = system.levels[level]
        # Relative motions are those that prefer to be states.
        relative = -one.preference if one.order == 0 else one.preference
        # A state is free to be zero; another position may be a way that no angle leads to.
        follows = one.order == 0 and reduced.node_states[first[level][1]] is None
        return level not in springs, level not in stores, one.order == 0, relative, follows, first[level][0]

    return [first[level][1] for level in sorted(first, key=rank) if level not in system.inputs]


def _spring_rates(reduced: ReducedDae) -> set[int]:
    """Rates of relative positions that a force follows in every mode: those of springs.

    A gap couples nothing before it closes: its force follows the position in some modes only. The angle of a clutch
    or damper occurs in kinematic equations, and perhaps in an output, by which nothing moves.
    """
    system, model = reduced.system, reduced.flat
    wanted = [one.preference >= PREFERRED for one in system.levels]
    relative = [chain for chain in system.chains if len(chain) > _RATES and any(wanted[level] for level in chain[:2])]
    bases = system.column(chain[0] for chain in relative)
    slopes = ca.jacobian(system.residual, bases)
    by_mode = {*ca.jacobian_sparsity(ca.vertcat(ca.SX(0, 1), *slopes.nonzeros()), model.d).row()}
    forces = _force_rows(system)
    read = {column for k, (row, column) in enumerate(_entries(slopes.sparsity())) if row in forces and k not in by_mode}
    states, moving = (
        {column for _, column in _entries(ca.jacobian_sparsity(one, bases))}
        for one in (reduced.x, ca.vertcat(reduced.ode, reduced.alg))
    )
    return {relative[k][1] for k in read - (states - moving)}


def _force_rows(system: System) -> set[int]:
    """Equations with an unknown that has no derivatives and is no place of a connector: not kinematic ones."""
    kinds, nodes = system.model.variables, zip(system.model.nodes, system.node_level, strict=True)
    places = {placed[0] for (k, _), placed in nodes if placed is not None and kinds[k].kind == "potential"}
    incidence = _entries(ca.jacobian_sparsity(system.residual, system.everything))
    single = {chain[0] for chain in system.chains if len(chain) == 1} - places
    return {row for row, level in incidence if level in single}


def _entries(pattern: ca.Sparsity) -> list[tuple[int, int]]:
    return [*zip(*pattern.get_triplet(), strict=True)]


def _storing(reduced: ReducedDae) -> list[int]:
    """Variables that occur in the stored energy of a component."""
    variable = {one.path: k for k, one in enumerate(reduced.flat.variables)}
    found: list[int] = []
    for instance in reduced.flat.instances:
        template = instance.template
        prefix = f"{instance.path}." if instance.path else ""
        if not template.energy_slots:
            continue
        used = zip(*template.energy.sparsity_jac(0, 0).get_triplet(), strict=True)
        slots = (template.energy_slots[slot] for row, slot in used if row == _STORED)
        found += [variable[prefix + slot.path] for slot in slots if slot.order == 0]
    return found


def _state(reduced: ReducedDae, node: int) -> int | None:
    state = reduced.node_states[node]
    return None if state is None else state[0]


def _needed(reduced: ReducedDae, nodes: Iterable[int]) -> list[tuple[int, Any]]:
    """The explicit unknowns that the start nodes need, directly or indirectly."""
    system = reduced.system
    pending = {placed[0] for node in nodes if (placed := system.node_level[node]) is not None}
    position = {level: k for k, (level, _) in enumerate(reduced.explicit)}
    uses, needed = _uses(reduced), set[int]()
    while pending := pending & position.keys():
        needed |= pending
        pending = {other for level in pending for other in uses[position[level]]}
    return [pair for pair in reduced.explicit if pair[0] in needed]


def _uses(reduced: ReducedDae) -> list[list[int]]:
    """Levels that occur in the expression of each explicit unknown."""
    flat, system = reduced.flat, reduced.system
    symbols = ca.vertcat(*system.symbols)
    expressions = ca.vertcat(*(expression for _, expression in reduced.explicit))
    function = ca.Function("explicit", [symbols, flat.p, flat.d, flat.time], [expressions])
    uses: list[list[int]] = [[] for _ in reduced.explicit]
    for row, level in zip(*function.jac_sparsity(0, 0).get_triplet(), strict=True):
        uses[row].append(level)
    return uses
