"""Edges: parameter values at which a run has other derivatives on one side than on the other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from modelica_like.analyse.replay.chain import Reading, Replay
from modelica_like.analyse.replay.jumps import Jump
from modelica_like.compile.buffers import Vector
from modelica_like.errors import NoGradient
from modelica_like.initialize.slopes import slopes
from modelica_like.solve.guards import Guards

_STILL = 1e-7
"""Values of a guard, relative to its largest one, that may be zero; and to what a parameter changes, that are."""
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Edge:
    """Where a run may be on an edge: it is, if the reading changes with a parameter.

    Attributes:
        reading: what is zero on the edge.
        least: change per relative change of a parameter up to which it is rounding.
        error: what to say.
    """

    reading: Reading
    least: float
    error: NoGradient

    def moved_by(self, changes: Vector) -> NDArray[np.bool_]:
        """Return which parameters lead away from the edge, so that there is no derivative by them.

        Args:
            changes: changes of the reading per relative change of each parameter, shape (parameters,).
        """
        return (changes > self.least) & (abs(self.reading.value) <= _STILL * changes)


def edges(chain: Replay, readings: Sequence[Reading]) -> list[Edge]:
    """Find where a run may be on an edge.

    Args:
        chain: the run.
        readings: what is asked for; it may depend on the times of jumps.
    """
    timed = {id(node) for one in readings for node, _ in one.parts}
    found = [
        Edge(Reading(0.0, ((jump.before, one.by),)), one.size, one.reason)
        for _, jump in chain.jumps
        for one in (jump.when.apart if jump.matters or id(jump.before) in timed else ())
    ]
    return found + _ties(chain)


def _ties(chain: Replay) -> list[Edge]:
    """Guards that are zero all along a segment, without firing: torque that is just what friction can bear."""
    model = chain.model
    guards, found = Guards(model), list[Edge]()
    if not guards.count:
        return found
    # Those that may not fire are -1.
    values, rates = np.array([guards.at(node)[:2] for node in chain.nodes]).transpose(1, 0, 2)
    near = _STILL * np.maximum(1.0, np.abs(values).max(axis=0))
    still_at = (np.abs(values) <= near) & (np.abs(rates) * (chain.nodes[-1].t - chain.nodes[0].t) <= near)
    first = 0
    for last in [*(k for k, _ in chain.jumps), len(chain.nodes) - 1]:
        lasts = chain.nodes[last].t > chain.nodes[first].t
        still = np.all(still_at[first : last + 1], axis=0)
        if isinstance(move := chain.moves[last] if last < len(chain.moves) else None, Jump):
            # What fires at the end of the segment was on its way.
            fired = [model.transitions[one.transition] for one in move.events if one.transition >= 0 and not one.round]
            still[[guards.positions[id(one)] for one in fired if not one.timed]] = False
        if lasts:
            found += [_tie(chain, guards, int(k), first, last) for k in np.flatnonzero(still)]
        first = last + 1
    # What fires just at the end of the run does so only on one side.
    last = len(chain.nodes) - 1
    fires = (np.abs(values[last]) <= near) & ~still_at[last] & (rates[last] > 0.0)
    return found + [_tie(chain, guards, int(k), last, last) for k in np.flatnonzero(fires)]


def _tie(chain: Replay, guards: Guards, guard: int, first: int, last: int) -> Edge:
    model, point, one = chain.model, chain.nodes[last], guards.state_events[guard]
    mode = model.flat_discretes[one.mode]
    part = slopes(model, point, "guards", [one.index])
    x = np.max([np.abs(node.x) for node in chain.nodes], axis=0) + model.nominals
    terms = np.abs(part.by[0]) @ np.abs(np.concatenate([x, model.p, model.u, point.d]))
    error = NoGradient(
        f"No gradient from t = {chain.nodes[first].t:.9g} s on: {mode.path} stays {mode.names[int(point.d[one.mode])]} "
        f"just at the limit at which it becomes {mode.names[one.target]}.",
        where=one.source,
        why="A small change of a parameter decides whether it does, so the derivatives of both sides differ.",
        advice="Move the parameters away from this limit.",
    )
    return Edge(Reading(float(part.value[0]), ((point, part.by[0]),)), _ROUNDING * float(terms), error)
