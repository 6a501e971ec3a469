"""States that follow the motion, where nonlinear constraints would make any fixed choice singular somewhere.

m constraints g(q) = 0 leave n - m of their n variables free. In the Cartesian pendulum, x is a state as long as the rod
is not horizontal, y as long as it is not vertical. Here the states are sums s = N'q instead, with weights N that span
the null space of the Jacobian G = dg/dq where they were chosen. They are constant between events. A guard watches how
much of N is left in the null space; where it is too little, an event projects N on the null space of that place:

- guard: det(N'PN) < `_LEAST`, with the projection P = 1 - G'(GG')⁻¹G; it is 1 at the choice, and 0 where singular;
- new weights: PN, made orthonormal; new states: N'q, N'der(q), … with these. No variable of the user jumps.

Gram-Schmidt on [G', N] gives both at once. q is measured in nominal values.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import prod
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.flatten.generic import spread
from modelica_like.flatten.model import FlatDiscrete, Origin
from modelica_like.language.units import ONE
from modelica_like.structure.alias import PREFERENCES
from modelica_like.structure.system import Level, System

_LEAST = 0.25
_SAMPLES = 200
_TIMES = -3, 6
"""Powers of ten of the times of samples, in s."""
_VANISHES = 1e-3
"""Smallest determinant, relative to the largest one among samples, that is no sign of a singular choice."""
_OFF = 0.2
"""First weights lie off the null space at the start by this much, so that they fit other start values, too."""
_ALWAYS = PREFERENCES.index("always")


@dataclass(frozen=True)
class Group:
    """Constraints whose fixed choice of states becomes singular.

    Attributes:
        rows: positions in the residual; only of those that have no variable of their own.
        levels: variables of these rows.
        count: number of differentiations.
        own: variables that another of the constraints determines anywhere; they are no states.
    """

    rows: tuple[int, ...]
    levels: tuple[int, ...]
    count: int
    own: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Following:
    """States that follow the motion.

    Attributes:
        group: the constraints.
        moved: names of the variables.
        mode: position in d of a mode with one name, which every choice enters again; the weights follow it, those of
            each state together.
        chains: of the states.
        slopes: Jacobian of the constraints by the variables over their nominal values.
        origin: of the first constraint.
    """

    group: Group
    moved: tuple[str, ...]
    mode: int
    chains: tuple[int, ...]
    slopes: Any
    origin: Origin

    @property
    def weights(self) -> list[int]:
        """Positions of the weights in d."""
        return [*range(self.mode + 1, self.mode + 1 + len(self.moved) * len(self.chains))]


@dataclass(frozen=True, eq=False)
class Choice:
    """A choice of states that follow the motion.

    Attributes:
        mode: position in d of the mode that its event enters again.
        moved: names of the constrained variables.
        guard: positive where the states must be chosen again.
        resets: (`state` or `discrete`, position in x or d, new value).
        origin: of a constraint.
    """

    mode: int
    moved: tuple[str, ...]
    guard: Any
    resets: tuple[tuple[str, int, Any], ...]
    origin: Origin

    @property
    def told(self) -> str:
        """The variables in words."""
        return f"{', '.join(self.moved[:-1])} and {self.moved[-1]}"


def singular_groups(system: System, counts: list[int], states: list[int]) -> tuple[Group, ...]:
    """Find constraints whose chosen states become singular somewhere, unless `always` has chosen them.

    Args:
        system: with all levels that the differentiated equations need.
        counts: number of differentiations of each equation.
        states: chosen levels.
    """
    entries, groups = _entries(system, counts), list[Group]()
    for together in _connected(system, entries):
        count = max(counts[row] for row in together)
        part = {row: entries[row] for row in together if counts[row] == count}
        levels = {level for row in part.values() for level in row}
        chosen = levels & {*states}
        moves = any(moving for row in part.values() for level, moving in row.items() if level not in chosen)
        always = any(system.levels[level].preference == _ALWAYS for level in chosen)
        if moves and chosen and not always and _vanishes(system, [*part], sorted(levels - chosen)):
            groups.append(_group(system, part, count))
    return tuple(groups)


def moving_chains(system: System, counts: list[int]) -> set[int]:
    """Return the chains of constraints that share variables, where a slope moves: a ratio between them may vanish."""
    entries = _entries(system, counts)
    groups = [[pair for row in rows for pair in entries[row].items()] for rows in _connected(system, entries)]
    moving = [group for group in groups if any(moves for _, moves in group)]
    return {system.levels[level].chain for group in moving for level, _ in group}


def _entries(system: System, counts: list[int]) -> dict[int, dict[int, bool]]:
    """Variables of every constraint, and whether its slope by them moves; of highest derivatives after all only."""
    rows = [k for k, count in enumerate(counts) if count]
    entries: dict[int, dict[int, bool]] = {row: {} for row in rows}
    jacobian = ca.jacobian(system.residual[rows], system.everything)
    moving = ca.which_depends(jacobian.nz[:], system.volatile, 1, True)
    for place, column, moves in zip(*jacobian.sparsity().get_triplet(), moving, strict=True):
        level, row = system.levels[column], rows[place]
        if level.order + counts[row] == len(system.chains[level.chain]) - 1 and column not in system.inputs:
            entries[row][column] = moves
    return entries


def _connected(system: System, entries: dict[int, dict[int, bool]]) -> list[list[int]]:
    """Constraints that share chains."""
    chains = {row: {system.levels[level].chain for level in levels} for row, levels in entries.items()}
    users: dict[int, list[int]] = {}
    for row, chains_of in chains.items():
        for chain in chains_of:
            users.setdefault(chain, []).append(row)
    groups: list[list[int]] = []
    while chains:
        group = [next(iter(chains))]
        reached = [*chains.pop(group[0])]
        for chain in reached:  # grows
            near = [row for row in users.pop(chain, ()) if row in chains]
            for row in near:
                reached += chains.pop(row)
            group += near
        groups.append(sorted(group))
    return groups


def _vanishes(system: System, rows: list[int], dependent: list[int]) -> bool:
    """Whether the determinant of constraints by the variables that are no states changes its sign, or nearly vanishes.

    It is looked at in random points: whether they meet the constraints does not matter.
    """
    if len(rows) != len(dependent):
        return False
    model = system.model
    slopes = ca.densify(ca.jacobian(system.residual[rows], system.column(dependent)))
    function = ca.Function("slopes", [system.everything, model.p, model.d, model.time], [slopes])
    nominal = np.array([level.nominal for level in system.levels])[:, None]
    points = nominal * spread(-np.pi, np.pi, (len(nominal), _SAMPLES))
    times = np.logspace(*_TIMES, _SAMPLES)[None]
    values = function.map(_SAMPLES)(points, *system.constants, times).full().T.reshape(_SAMPLES, len(rows), -1)
    determinants = np.linalg.det(values[[bool(np.isfinite(value).all()) for value in values]])
    sizes = np.abs(determinants)
    return bool(
        len(determinants) and (determinants.min() < 0 < determinants.max() or sizes.min() < _VANISHES * sizes.max())
    )


def _group(system: System, part: dict[int, dict[int, bool]], count: int) -> Group:
    """Set aside constraints with a variable of their own, whose slope is constant; the others are the core."""
    rows, columns = dict(part), list[int]()
    while True:
        users = Counter(level for levels in rows.values() for level in levels)
        pairs = [(row, level) for row, levels in rows.items() for level in levels
                 if not levels[level] and users[level] == 1]  # fmt: skip
        if not pairs:
            return Group(tuple(rows), tuple(sorted(users)), count, tuple(columns))
        row, level = min(pairs, key=lambda pair: system.levels[pair[1]].preference)
        del rows[row]
        columns.append(level)


def follow(system: System, groups: tuple[Group, ...]) -> tuple[Following, ...]:
    """Add states s and their equations s = N'q for groups of constraints, and N to the discrete values.

    Args:
        system: before index reduction.
        groups: found after the index reduction of the same system.
    """
    numbers: Counter[str] = Counter()
    return tuple(_follow(system, group, numbers) for group in groups if 0 < len(group.rows) < len(group.levels))


def _follow(system: System, group: Group, numbers: Counter[str]) -> Following:
    """Add the states of one group."""
    model, origin = system.model, system.origins[group.rows[0]]
    prefix = f"{origin.path}." if origin.path else ""
    moved = tuple(system.levels[level].name for level in group.levels)
    nominal = ca.diag(ca.DM([system.levels[level].nominal for level in group.levels]))
    slopes = ca.mtimes(ca.jacobian(system.residual[list(group.rows)], system.column([*group.levels])), nominal)
    first = _first_weights(system, slopes)
    path, about = f"{prefix}state[{numbers[prefix] + 1}].choice", "choice of states that follow the motion"
    chains, discretes = list[int](), [FlatDiscrete(path, ONE, about, 0, ("chosen",), hidden=True)]
    for row in first:
        numbers[prefix] += 1
        name = f"{prefix}state[{numbers[prefix]}]"
        # A state has as many derivatives as the constraints have.
        added = len(system.chains)
        system.chains.append([len(system.levels)])
        system.levels.append(Level(added, 0, name, _ALWAYS, 1.0, 0.0))
        system.symbols.append(ca.SX.sym(name))
        for _ in range(group.count):
            system.add_level(added)
        chains.append(added)
        discretes += [FlatDiscrete(f"{name}.{of}", ONE, f"weight of {of} in {name}", float(weight), hidden=True)
                      for of, weight in zip(moved, row, strict=True)]  # fmt: skip
    symbols = ca.vertcat(*(ca.SX.sym(discrete.path) for discrete in discretes))
    system.model = replace(model, discretes=[*model.discretes, *discretes], d=ca.vertcat(model.d, symbols))
    weights = ca.reshape(symbols[1:], len(moved), -1)
    states = ca.vertcat(*(system.symbols[system.chains[chain][0]] for chain in chains))
    sums = ca.mtimes(weights.T, _measured(system, group, group.levels))
    system.residual = ca.vertcat(system.residual, states - sums)
    system.origins += [origin] * len(chains)
    return Following(group, moved, len(model.discretes), tuple(chains), slopes, origin)


def _measured(system: System, group: Group, levels: Sequence[int]) -> Any:
    """Variables, or their derivatives, over the nominal values of the variables."""
    return system.column(levels) / ca.DM([system.levels[level].nominal for level in group.levels])


def _first_weights(system: System, slopes: Any) -> Any:
    """Weights that fit the start values, as numbers; shape (states, variables)."""
    model = system.model
    values = np.array([level.guess for level in system.levels])
    for start in model.starts:
        placed = system.node_level[start.node]
        if placed is not None:
            p, d = system.constants
            values[placed[0]] = float(ca.Function("start", [model.p, model.d], [start.value])(p, d)) / placed[1]
    function = ca.Function("slopes", [system.everything, model.p, model.d, model.time], [ca.densify(slopes)])
    weights = function(values, *system.constants, 0.0).full()
    weights = np.where(np.isfinite(weights), weights, 0.0)
    sizes = np.linalg.norm(weights, axis=1, keepdims=True)
    weights += _OFF * np.where(sizes > 0, sizes, 1.0) * spread(-1.0, 1.0, weights.shape)
    return np.linalg.svd(weights)[2][len(weights) :]


def prefer(system: System, groups: tuple[Group, ...], following: tuple[Following, ...]) -> None:
    """Prefer the states that follow, and no variable that a constraint determines."""
    for choice in following:
        _set_preference(system, choice.chains, _ALWAYS + 1)
    for group in groups:
        _set_preference(system, [system.levels[level].chain for level in group.own], -1)


def _set_preference(system: System, chains: Sequence[int], preference: int) -> None:
    for level in (level for chain in chains for level in system.chains[chain]):
        system.levels[level].preference = preference


def write_choice(following: Following, system: System, states: list[int], level_values: Any) -> Choice:
    """Write a choice out, over states and implicit unknowns.

    Args:
        following: what is chosen.
        system: the equations.
        states: levels that are states; of the sums and their derivatives, further constraints may determine some.
        level_values: of all levels, over states and implicit unknowns.
    """
    model, levels, count = system.model, list(following.group.levels), len(following.group.rows)
    basis, upper = ca.qr(ca.horzcat(following.slopes.T, ca.reshape(model.d[following.weights], len(levels), -1)))
    left, weights = prod(ca.vertsplit(ca.diag(upper)[count:])), basis[:, count:]
    targets, values = [("discrete", k) for k in following.weights], [ca.vec(weights)]
    for order in range(following.group.count):
        sums = [system.chains[chain][order] for chain in following.chains]
        targets += [("state", states.index(level) if level in states else -1) for level in sums]
        values.append(ca.mtimes(weights.T, _measured(system, following.group, levels)))
        levels = [above for level in levels if (above := system.derivative(level)) is not None]
    arguments = [system.everything, model.p, model.d, model.time]
    written = ca.Function("choice", arguments, [_LEAST - left**2, ca.vertcat(*values)])
    guard, values = written(level_values, *arguments[1:])
    pairs = zip(targets, ca.vertsplit(values), strict=True)
    resets = tuple((kind, place, value) for (kind, place), value in pairs if place >= 0)
    return Choice(following.mode, following.moved, guard, resets, following.origin)
