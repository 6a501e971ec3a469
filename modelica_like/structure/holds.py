"""Motions that modes hold, in the equations of the whole model: approaches, and sharing among several elements.

A mode that holds a motion has the equation der(motion) = 0. It gets two additions, as values that only events
change and that follow the modes and discrete values in d:

- an *approach* r: der(motion) = r. It is zero during the run. An impact sets r = -motion/tau; the difference of the
  accelerations from those with r = 0, times tau, is the jump of the speeds, in which finite forces cancel.
- a *circuit*: elements whose motions depend on each other, such as parallel clutches. If all of them hold, some
  equations are redundant, and the reactions are undetermined. A redundant equation is replaced by the sharing of the
  reactions: sum(share * reaction) = 0.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.flatten.holds import TERMS
from modelica_like.flatten.model import FlatModel, evaluate
from modelica_like.language.elements import inserted
from modelica_like.structure.discretes import Part
from modelica_like.structure.system import System

_DEPENDENT = 1e-9
_CLEAR = 1e-3
"""Slope of a row, over all its slopes, that rounding cannot have made."""
_YIELDING = 1e-10
"""In SI units: what passes a dead centre at 1e-3 m/s² meets 1e7 N. Blocks still count as regular, from 1e-12 on."""
_NEAR = 1e-6
"""Slope of a held motion, over that at another place, below which it counts as that of a dead centre."""


@dataclass(frozen=True)
class HeldMotion:
    """A motion that a mode of a component holds.

    Attributes:
        component: path of the component.
        mode: position of the mode in d.
        number: number of the mode that holds.
        loose: number of a mode that does not hold it, or -1.
        motion: held variable.
        reaction: variable that holds it, or -1.
        row: position of its equation in the residual.
        rigid: whether the equation is only der(motion) = 0.
        approach: position in d of the prescribed derivative of the motion; zero except in impacts.
        state: (state, factor) if the motion is one.
        position: state whose rate the motion is, up to a factor, or -1.
    """

    component: str
    mode: int
    number: int
    loose: int
    motion: int
    reaction: int
    row: int
    rigid: bool
    approach: int
    state: tuple[int, float] | None = None
    position: int = -1


@dataclass(frozen=True)
class Circuit:
    """Held motions that depend on each other.

    Attributes:
        members: positions of the held motions.
        first: position in d of the switches, behind which the shares stand.
    """

    members: tuple[int, ...]
    first: int

    @property
    def switches(self) -> Part:
        """Of each member, whether its equation is replaced by the sharing of reactions."""
        return Part(self.first, 1, len(self.members))

    @property
    def shares(self) -> Part:
        """Shares of the members in the equation of each."""
        return Part(self.switches.end, len(self.members), len(self.members))

    @property
    def entries(self) -> slice:
        """Positions in d of switches and shares."""
        return slice(self.first, self.shares.end)


def add_approaches(system: System) -> tuple[HeldMotion, ...]:
    """Add an approach to every equation that holds a motion."""
    holds = _find(system.model)
    if holds:
        approaches = ca.SX.sym("approach", len(holds))
        for hold, gain, approach in zip(holds, gains(system), ca.vertsplit(approaches), strict=True):
            system.residual[hold.row] -= gain * approach
        system.model = replace(system.model, d=ca.vertcat(system.model.d, approaches))
    return holds


def _find(model: FlatModel) -> tuple[HeldMotion, ...]:
    row_of = {pair: row for row, pair in enumerate(model.general)}
    holds: list[HeldMotion] = []
    for number, instance in enumerate(model.instances):
        template = instance.template
        if not template.holds:
            continue
        node = {slot.path: instance.nodes[k] for k, slot in enumerate(template.slots) if slot.order == 0}
        discrete = dict(zip(template.discretes, instance.discretes, strict=True))
        for form in template.holds:
            holds.append(
                HeldMotion(
                    instance.path, discrete[form.mode], form.number, form.loose, node[form.motion],
                    node.get(form.reaction, -1), row_of[number, form.row], form.rigid,
                    len(model.discretes) + len(holds),
                )
            )  # fmt: skip
    return tuple(holds)


def hold_terms(model: FlatModel, values: Any) -> Any:
    """Gain, capacities and restitution of every held motion, one row each; shape (holds, TERMS)."""
    if not any(instance.template.holds for instance in model.instances):
        return ca.SX(0, TERMS)
    columns = evaluate(model, "hold_terms", values)
    return ca.reshape(ca.vertcat(*(columns[k] for k in sorted(columns))), TERMS, -1).T


def gains(system: System) -> list[Any]:
    """Slope of the equation of every held motion by its derivative; zero where it is not held."""
    return ca.vertsplit(hold_terms(system.model, system.node_values)[:, 0])


def find_circuits(
    system: System, holds: tuple[HeldMotion, ...], order: list[tuple[Any, Any]], states: list[int]
) -> list[Circuit]:
    """Find held motions that depend on each other.

    Args:
        system: the equations.
        holds: the held motions.
        order: explicit unknowns (symbols) with their expressions in earlier ones.
        states: levels that are states.
    """
    rigid = [k for k, hold in enumerate(holds) if hold.rigid and hold.reaction >= 0]
    if len(rigid) < 2:
        return []
    slopes = system.generic(_slopes(system, [holds[k].motion for k in rigid], order, states))
    rows = [dict[int, float]() for _ in rigid]
    for row, column, slope in zip(*slopes.sparsity().get_triplet(), slopes.nonzeros(), strict=True):
        if slope != 0.0:
            rows[row][column] = slope
    first, circuits = system.model.d.numel(), list[Circuit]()
    for core in _cores(rows):
        for members in _dependent([rows[k] for k in core]):
            circuits.append(Circuit(tuple(rigid[core[k]] for k in members), first))
            first = circuits[-1].shares.end
    return circuits


def _cores(rows: list[dict[int, float]]) -> list[list[int]]:
    """Sets of rows that may depend on each other, in the order of their first ones.

    A row that has a column to itself depends on no other; of a tree of clutches, none is left.
    """
    sizes = [math.hypot(*row.values()) for row in rows]
    users: dict[int, set[int]] = {}
    for k, row in enumerate(rows):
        for column in row:
            users.setdefault(column, set()).add(k)
    alone = [column for column, using in users.items() if len(using) == 1]
    left = {k for k, row in enumerate(rows) if row}
    for column in alone:
        row = next(iter(users[column]), None)
        if row is None or abs(rows[row][column]) <= _CLEAR * sizes[row]:
            continue
        left.discard(row)
        for other in rows[row]:
            users[other].discard(row)
            if len(users[other]) == 1:
                alone.append(other)
    cores: list[list[int]] = []
    for k in sorted(left):
        if k in left:
            core = [k]
            left.discard(k)
            for row in core:
                more = {other for column in rows[row] for other in users[column]} & left
                core += sorted(more)
                left -= more
            cores.append(sorted(core))
    return cores


def _dependent(rows: list[dict[int, float]]) -> list[list[int]]:
    """Return sets of rows that depend on each other."""
    columns = {column: place for place, column in enumerate(dict.fromkeys(column for row in rows for column in row))}
    slopes = np.zeros((len(rows), len(columns)))
    for k, row in enumerate(rows):
        slopes[k, [columns[column] for column in row]] = list(row.values())
    left, values, _ = np.linalg.svd(slopes / np.linalg.norm(slopes, axis=1)[:, None])
    silent = left[:, np.sum(values > _DEPENDENT) :]
    return _groups(np.abs(silent @ silent.T) > _DEPENDENT)


def _slopes(system: System, nodes: list[int], order: list[tuple[Any, Any]], states: list[int]) -> Any:
    """Slopes of motions by the states that move them: not by positions, on which the slopes of a linkage hang."""
    motions = system.node_values[nodes]
    if order:
        (motions,) = inserted([s for s, _ in order], [e for _, e in order], [motions])
    among = {*states}
    return ca.jacobian(motions, system.column(level for level in states if system.derivative(level) not in among))


def _groups(together: Any) -> list[list[int]]:
    """Connected sets of at least two."""
    groups: list[list[int]] = []
    seen: set[int] = set()
    for k in range(len(together)):
        if k in seen:
            continue
        group = [k]
        for member in group:
            group += [int(n) for n in np.flatnonzero(together[member]) if n not in group]
        seen.update(group)
        groups += [sorted(group)] if len(group) > 1 else []
    return groups


def let_yield(
    system: System, holds: tuple[HeldMotion, ...], moving: set[int], order: list[tuple[Any, Any]], states: list[int],
    residual: Any,
) -> Any:  # fmt: skip
    """Let motions yield to what holds them where a linkage passes its dead centre.

    The speed of a ram vanishes there only for an instant, and no force on it changes that: none reaches the crank. With
    der(motion) = `_YIELDING` * reaction the reaction grows beyond any capacity instead of being undetermined, and the
    surfaces break away in the direction in which the motion goes on. Elsewhere they hold exactly.

    Args:
        system: the equations.
        holds: the held motions.
        moving: chains of constraints whose slopes move.
        order: explicit unknowns (symbols) with their expressions in earlier ones.
        states: levels that are states: they do not vanish by themselves.
        residual: column of all equations, differentiated ones included.

    Returns:
        The residual, the same one if no motion yields.
    """
    rows = ca.vertsplit(residual)
    for hold, gain in zip(holds, gains(system), strict=True):
        level = system.node_level[hold.motion]
        if not hold.rigid or hold.reaction < 0 or level is None or level[0] in states:
            continue
        if system.levels[level[0]].chain in moving:
            slopes = ca.sumsqr(_slopes(system, [hold.motion], order, states))
            near = 1 - slopes / (_NEAR**2 * system.generic(slopes))
            rows[hold.row] -= gain * _YIELDING * ca.fmax(near, 0) * system.node_values[hold.reaction]
            residual = ca.vertcat(*rows)
    return residual


def share_reactions(system: System, holds: tuple[HeldMotion, ...], circuits: list[Circuit], residual: Any) -> Any:
    """Make equations of circuits switchable to the sharing of the reactions.

    Args:
        system: the equations; its model gets the switches and shares.
        holds: the held motions.
        circuits: held motions that depend on each other.
        residual: column of all equations, differentiated ones included.

    Returns:
        The new residual, of the same size.
    """
    slope, rows = gains(system), ca.vertsplit(residual)
    for circuit in circuits:
        count = len(circuit.members)
        switches, shares = ca.SX.sym("switch", count), ca.SX.sym("share", count, count)
        system.model = replace(system.model, d=ca.vertcat(system.model.d, switches, ca.vec(shares.T)))
        reactions = system.node_values[[holds[k].reaction for k in circuit.members]]
        for place, k in enumerate(circuit.members):
            row = holds[k].row
            rows[row] = (1 - switches[place]) * rows[row] + slope[k] * ca.mtimes(shares[place, :], reactions)
    return ca.vertcat(*rows)


def held_rates(model: FlatModel, ode: Any, values: Any, holds: tuple[HeldMotion, ...], circuits: list[Circuit]) -> Any:
    """Let states that modes hold stay where they are, exactly, and those whose rates modes hold.

    What holds them would otherwise be solved for among accelerations that may be a million times as large, and in hours
    their rounding adds up: a state that drifts under a large reaction takes power. The slip of a stuck clutch would be
    the difference of other speeds: its rounding is far more than what an integrator allows for its angle.

    Args:
        model: the flat model, with approaches and circuits.
        ode: derivatives of the states.
        values: of all nodes, in terms of states and implicit unknowns.
        holds: the held motions, with their states.
        circuits: those that depend on each other.
    """
    switched = {k: circuit.switches.first + place for circuit in circuits for place, k in enumerate(circuit.members)}
    gain, rates, d = hold_terms(model, values)[:, 0], ca.SX(ode), model.d
    for k, hold in enumerate(holds):
        if not hold.rigid:
            continue
        holding = ca.logic_and(d[hold.mode] == hold.number, gain[k] != 0)
        if k in switched:
            holding = ca.logic_and(holding, d[switched[k]] == 0)
        if hold.state is not None:
            state, factor = hold.state
            rates[state] = ca.if_else(holding, d[hold.approach] / factor, rates[state])
        if hold.position >= 0:
            rates[hold.position] = ca.if_else(holding, 0, rates[hold.position])
    return rates
