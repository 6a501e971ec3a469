"""The equations between start values and states, kept as sparse as the model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from modelica_like.compile.elastic import Elastic, elastic
from modelica_like.flatten.template import column
from modelica_like.structure.reduce import ReducedDae

_STORED = 0


@dataclass(frozen=True)
class StartSystem:
    """Equations between start values and states.

    Attributes:
        function: of (t, x, y, z, p, u, d) with y the variables that start values need: y itself, the Jacobian of the
            values by (x, y, z), and the values of [y - expression, alg, variables of `nodes`].
        nodes: variables (nodes) at its end; numbers beyond all nodes are relative motions that are no variable.
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
    resting = rest_order(reduced) if rest else []
    count = len(flat.nodes)
    order = tuple((count + k if rest.node is None else rest.node, rest.state) for k, rest in enumerate(resting))
    nodes = tuple(dict.fromkeys([*(s.node for s in flat.starts), *(node for node, state in order if state is None)]))
    of_nodes = [placed[0] for node in nodes if node < count and (placed := system.node_level[node]) is not None]
    needed = _needed(reduced, {*of_nodes, *(level for rest in resting for level in rest.levels)})
    y = column(system.symbols[level] for level, _ in needed)
    explicit = ca.vertcat(*(system.symbols[level] - expression for level, expression in needed))
    wanted = ca.vertcat(*(system.node_values[k] if k < count else resting[k - count].value for k in nodes))
    values = ca.densify(ca.vertcat(explicit, reduced.alg, wanted))
    unknowns = ca.vertcat(reduced.x, y, reduced.z)
    arguments = [flat.time, reduced.x, y, reduced.z, flat.p, reduced.u, flat.d]
    results = [y, ca.jacobian(values, unknowns), values]
    names = ["t", "x", "y", "z", "p", "u", "d"]
    function = ca.Function("start_system", arguments, results, names, ["variables", "jacobian", "values"])
    rates = _rates(reduced, [level for level, _ in needed]) if rest else ()
    return StartSystem(function, nodes, order, rates, _guesses(reduced, [node for node, _ in order if node < count]))


def _guesses(reduced: ReducedDae, resting: list[int]) -> tuple[int, ...]:
    """Numbers of the guesses of variables at rest; of equal variables, the first by name comes first."""
    placed, guessed = reduced.system.node_level, dict[int, list[tuple[str, int]]]()
    for k, start in enumerate(reduced.flat.starts):
        if start.strength == "guess" and (place := placed[start.node]) is not None:
            guessed.setdefault(place[0], []).append((reduced.flat.node_name(start.node), k))
    levels = [place[0] for node in resting if (place := placed[node]) is not None]
    return tuple(k for level in levels for _, k in sorted(guessed.get(level, ())))


def _rates(reduced: ReducedDae, needed: list[int]) -> tuple[int, ...]:
    """Positions of derivatives of others among the states and the needed unknowns."""
    levels, placed = reduced.system.levels, zip(reduced.node_states, reduced.system.node_level, strict=True)
    states = {state[0] for state, place in placed if state and place and levels[place[0]].order}
    return *sorted(states), *(reduced.x.numel() + k for k, level in enumerate(needed) if levels[level].order)


@dataclass(frozen=True)
class Resting:
    """What may be at rest.

    Attributes:
        name: of the variable; of a relative motion that is no variable, that of its spring.
        node: the variable, or None.
        state: the state, if it is one.
        value: expression in levels that is zero, if there is neither a variable nor a state.
        levels: levels in `value`.
    """

    name: str
    node: int | None
    state: int | None
    value: Any = None
    levels: tuple[int, ...] = ()


def rest_order(reduced: ReducedDae) -> list[Resting]:
    """What is undetermined and zero at rest, in an order that does not depend on the order of lines.

    Relative speeds of springs come first: what is coupled elastically turns with a part that is given a speed. Then
    variables that store energy: speeds of inertias and masses before currents, pressures and twists of springs. Other
    relative speeds, those of clutches and dampers, come next, then positions. Equal variables count as one; among
    equal ranks the first by name counts.
    """
    system = reduced.system
    stores = {placed[0] for node in _storing(reduced) if (placed := system.node_level[node]) is not None}
    coupled = elastic(reduced)
    springs = coupled.rates - stores
    first: dict[int, tuple[str, int]] = {}
    for node, placed in enumerate(system.node_level):
        if placed is not None and (placed[0] in stores or system.derivative(placed[0]) is not None):
            candidate = reduced.flat.node_name(node), node
            first[placed[0]] = min(candidate, first.get(placed[0], candidate))

    def rank(level: int) -> tuple[Any, ...]:
        about = system.levels[level]
        # Relative motions are those that prefer to be states.
        relative = -about.preference if about.order == 0 else about.preference
        # A state is free to be zero; another position may be a way that no angle leads to.
        follows = about.order == 0 and reduced.node_states[first[level][1]] is None
        return level not in stores, about.order == 0, relative, follows, first[level][0]

    others = (level for level in sorted(first.keys() - springs, key=rank) if level not in system.inputs)
    named = (Resting(*first[level], _state(reduced, first[level][1])) for level in others)
    return [*_between_springs(reduced, coupled, springs, first), *named]


def _between_springs(
    reduced: ReducedDae, coupled: Elastic, springs: frozenset[int], named: dict[int, tuple[str, int]]
) -> list[Resting]:
    """Relative speeds of springs, those that are a variable or state first."""
    system = reduced.system
    of_states = ca.jacobian_sparsity(reduced.x, system.everything)
    states = {level: k for k, level in zip(*of_states.get_triplet(), strict=True)}
    rates: list[Resting] = []
    for level in springs.difference(system.inputs):
        name, node = named.get(level, (system.levels[level].name, None))
        rates.append(Resting(name, node, states.get(level), system.symbols[level], (level,)))
    rows = (Resting(name, None, None, value, levels) for name, value, levels in coupled.rows)
    return [*sorted(rates, key=lambda resting: resting.name), *sorted(rows, key=lambda resting: resting.name)]


def _storing(reduced: ReducedDae) -> list[int]:
    """Variables that occur in the stored energy of a component."""
    variable = {entry.path: k for k, entry in enumerate(reduced.flat.variables)}
    nodes: list[int] = []
    for instance in reduced.flat.instances:
        template = instance.template
        prefix = f"{instance.path}." if instance.path else ""
        if not template.energy_slots:
            continue
        used = zip(*template.energy.sparsity_jac(0, 0).get_triplet(), strict=True)
        slots = (template.energy_slots[slot] for row, slot in used if row == _STORED)
        nodes += [variable[prefix + slot.path] for slot in slots if slot.order == 0]
    return nodes


def _state(reduced: ReducedDae, node: int) -> int | None:
    state = reduced.node_states[node]
    return None if state is None else state[0]


def _needed(reduced: ReducedDae, pending: set[int]) -> list[tuple[int, Any]]:
    """The explicit unknowns that some levels need, directly or indirectly."""
    position = {level: k for k, (level, _) in enumerate(reduced.explicit)}
    uses, needed = _uses(reduced), set[int]()
    while pending := (pending & position.keys()) - needed:
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
