"""Edges: parameter values at which the derivatives of a run differ on both sides."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby, product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from modelica_like.analyse.replay.chain import Reading, Replay
from modelica_like.analyse.replay.guards import Guards
from modelica_like.analyse.replay.holds import impact
from modelica_like.analyse.replay.jumps import Jump
from modelica_like.compile.buffers import Vector
from modelica_like.compile.cached import Cached
from modelica_like.compile.compiled import CompiledDae, CompiledTransition
from modelica_like.errors import NoGradient
from modelica_like.native.holds import share
from modelica_like.solve.initialize import Point, call, holding, solve_implicit, variable_slopes
from modelica_like.solve.initialize.slopes import Sizes, slopes

_STILL = 1e-7
"""A guard is possibly zero below this share of its largest value, and zero below this share of a parameter's effect."""
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Edge:
    """A possible edge of a run: it is one if the reading changes with a parameter.

    Attributes:
        reading: what is zero on the edge.
        least: change per relative change of a parameter that counts as rounding.
        error: the error for the user.
        matters: whether what is asked for is another one on the other side.
    """

    reading: Reading
    least: float
    error: NoGradient
    matters: Callable[[], bool] = lambda: True

    def moved_by(self, changes: Vector) -> NDArray[np.bool_]:
        """Return which parameters lead away from the edge; derivatives by these do not exist.

        Args:
            changes: changes of the reading per relative change of each parameter, shape (parameters,).
        """
        return (changes > self.least) & (abs(self.reading.value) <= _STILL * changes)


def edges(chain: Replay, readings: Sequence[Reading]) -> list[Edge]:
    """Find where a run may be on an edge.

    Args:
        chain: the run.
        readings: the requested ones, which may depend on the times of jumps.
    """
    timed = {id(node) for reading in readings for node, _ in reading.parts}
    chances = [*((chain.nodes[0], chance) for chance in chain.chances), *chain.silent]
    for _, jump in chain.jumps:
        apart = jump.when.apart if jump.matters or id(jump.before) in timed else ()
        chances += [(jump.before, chance) for chance in (*apart, *jump.chances)]
    result = [Edge(Reading(0.0, ((node, chance.by),)), chance.size, chance.reason) for node, chance in chances]
    return result + _ties(_Later(chain, readings))


@dataclass(frozen=True)
class _Later:
    """What is asked for, and how it depends on where the run is after each jump."""

    chain: Replay
    readings: Sequence[Reading]

    @cached_property
    def multipliers(self) -> dict[int, Vector]:
        """Derivatives of the readings by (x, theta) at the nodes after jumps; shapes (nx + ntheta, readings)."""
        multipliers = {k + 1: np.zeros(0) for k, _ in self.chain.jumps}
        self.chain.adjoint(self.readings, multipliers)
        return multipliers


def _ties(later: _Later) -> list[Edge]:
    """Guards that are zero all along a segment without firing: a torque that equals the friction limit."""
    chain, model = later.chain, later.chain.model
    guards, result = Guards(model), list[Edge]()
    if not guards.count:
        return result
    # Guards that cannot fire are -1.
    values, rates = np.array([guards.at(node)[:2] for node in chain.nodes]).transpose(1, 0, 2)
    near = _STILL * np.maximum(1.0, np.abs(values).max(axis=0))
    still_at = (np.abs(values) <= near) & (np.abs(rates) * (chain.nodes[-1].t - chain.nodes[0].t) <= near)
    first, segments = 0, list[tuple[int, int, Any]]()
    for last in [*(k for k, _ in chain.jumps), len(chain.nodes) - 1]:
        still = np.all(still_at[first : last + 1], axis=0)
        if isinstance(move := chain.moves[last] if last < len(chain.moves) else None, Jump):
            # A guard that fires at the end of the segment was approaching zero.
            fired = [model.events.transitions[e.transition] for e in move.events if e.transition >= 0 and not e.round]
            still[[guards.positions[id(transition)] for transition in fired if not transition.timed]] = False
        if chain.nodes[last].t > chain.nodes[first].t:
            segments.append((first, last, still))
        first = last + 1
    for k, event in enumerate(guards.state_events):
        for still, group in groupby(segments, lambda tie, k=k: bool(tie[2][k])):
            if still and (those := list(group)):
                result.append(_tie(later, event, those[0][0], those[-1][1]))
    # A guard that fires exactly at the end of the run fires on one side only.
    last = len(chain.nodes) - 1
    fires = (np.abs(values[last]) <= near) & ~still_at[last] & (rates[last] > 0.0)
    return result + [_tie(later, guards.state_events[k], last, last) for k in np.flatnonzero(fires)]


def _tie(later: _Later, transition: CompiledTransition, first: int, last: int) -> Edge:
    chain, model, point = later.chain, later.chain.model, later.chain.nodes[last]
    mode = model.flat_discretes[transition.mode]
    part = slopes(model, point, "guards", [transition.index])
    x = np.max([np.abs(node.x) for node in chain.nodes], axis=0) + model.equations.nominals
    terms = np.abs(part.by[0]) @ np.abs(np.concatenate([x, model.p, model.u, point.d]))
    # The slope of an acceleration that the others hold at zero is nothing but rounding, and so are its terms.
    begins = [chain.nodes[0], *(jump.after for _, jump in chain.jumps)]
    largest = max(abs(float(call(model, model.events.guards, node)[transition.index])) for node in begins)
    error = NoGradient(
        f"No gradient from t = {chain.nodes[first].t:.9g} s on: {mode.path} stays "
        f"{mode.names[int(point.d[transition.mode])]} exactly at the limit where it becomes "
        f"{mode.names[transition.target]}.",
        where=transition.source,
        why="A small change of a parameter decides whether it changes, so the derivatives on both sides differ.",
        advice="Move the parameters away from this limit.",
    )
    return Edge(
        Reading(float(part.value[0]), ((point, part.by[0]),)), _ROUNDING * max(float(terms), largest), error,
        lambda: _felt(later, first, last, transition.mode),
    )  # fmt: skip


def _felt(later: _Later, first: int, last: int, mode: int) -> bool:
    """Whether it is felt at all that a surface slides in a tie, or sticks: later friction may make up for it.

    On both sides of the limit accelerations differ by what the surface does when it slides, and by nothing else. Where
    it sticks after the tie, it stops at once.
    """
    chain, readings, model = later.chain, later.readings, later.chain.model
    size, end = Sizes.of(model), len(chain.moves)
    held = [k for k, h in enumerate(model.held.motions) if h.mode == mode]
    until = min(last + 1, end)
    for hold, begin in product(held, dict.fromkeys((last, first))):
        change = _sliding(model, chain.nodes[begin], hold)
        nominals = model.equations.nominals * np.max(np.abs(change) / model.equations.nominals)
        sizes = [sum(float(np.abs(row[: size.x]) @ nominals) for _, row in reading.parts) for reading in readings]
        read, whole = chain.carried(readings, np.pad(change, (0, size.theta))[:, None], begin, until)
        if until > last and hold in holding(model, chain.nodes[until]):
            stop = slopes(
                model, chain.nodes[until], (Cached.IMPACT, hold), None, lambda hold=hold: impact(model, [hold])
            )
            whole[: size.x] += stop.x @ whole[: size.x]
        behind = later.multipliers[until].T @ whole if until > last else 0.0
        if np.any(np.maximum(np.abs(read), np.abs(behind))[:, 0] > _ROUNDING * np.array(sizes)):
            return True
    return not held


def _sliding(model: CompiledDae, point: Point, hold: int) -> Vector:
    """Accelerations of all states for an acceleration of 1 of a motion that can be held; zeros where others hold it."""
    entry, others = model.held.motions[hold], [k for k in holding(model, point) if k != hold]
    motions = variable_slopes(model, point, [entry.motion, *(model.held.motions[k].motion for k in others)])
    left = (
        motions[0] - motions[1:].T @ np.linalg.lstsq(motions[1:].T, motions[0], rcond=None)[0] if others else motions[0]
    )
    if np.abs(left).max() <= _ROUNDING * np.abs(motions[0]).max():
        return np.zeros(len(point.x))
    held = point.copy()
    held.d[entry.mode] = entry.number
    share(model, held)
    solve_implicit(model, held)
    return slopes(model, held, "ode").theta[:, Sizes.of(model).fixed + entry.approach]
