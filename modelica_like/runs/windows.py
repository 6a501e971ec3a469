"""Pieces of a run between the edges of what is read.

The integrator lands on edges of the equations, as far as the states feel them. What is only read (a torque at a shaft
whose speed is prescribed, a sensor, a formula) may be narrower than its steps, and the nodes of a polynomial may miss
it. Its edges are known from its graph (`compile/edges.py`), so the pieces are cut there.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.compile.buffers import Along, Vector
from modelica_like.compile.compiled import CompiledDae
from modelica_like.compile.edges import edges_of
from modelica_like.solve.dense import Dense

_ROUNDS = 8
"""A cut shows edges beside it: the top of a pulse its flanks. These nest no deeper than formulas of users."""
_HALVINGS = 60
"""To neighbouring times."""
_AT_EDGE = 1e-12
"""Of the largest amount of an edge: what stays within is there all the time, and its sign is rounding."""
_MOST = 200
"""Cuts for each piece of the run: more are noise beside an edge."""


class Windows:
    """Cuts pieces of runs where something read has an edge.

    Args:
        model: the compiled model.
        column: what is read, an SX column in the model's arguments.
    """

    def __init__(self, model: CompiledDae, column: Any) -> None:
        given = [*model.arguments.values()]
        rates = model.equations.ode(*given) if isinstance(model, CompiledDae) else ca.SX.zeros(given[1].numel())
        edges = edges_of(model.arguments, rates, column)
        self._edges = (
            Along(ca.Function("edges", given, [ca.densify(ca.vertcat(*edges))], {"cse": True})) if edges else None
        )

    def cut(self, model: CompiledDae, dense: Dense, nodes: Vector) -> tuple[Any, Vector, Vector]:
        """Return pieces: the one of the dense output to which each belongs, their begins and their ends in s.

        Args:
            model: with the values of parameters.
            dense: dense output of a run.
            nodes: places in [-1, 1] between which signs of edges are compared, with both ends.
        """
        owner, begins, ends = np.arange(len(dense.begins)), dense.begins, dense.ends
        if self._edges is None or not len(owner):
            return owner, begins, ends
        values = self._values(model, dense)
        kept, most = [(owner[:0], begins[:0], ends[:0])], np.zeros((self._edges.rows[0], 1))
        for _ in range(_ROUNDS):
            times = begins[:, None] + 0.5 * (1.0 + nodes) * (ends - begins)[:, None]
            times[:, -1] = ends
            found = values(np.repeat(owner, len(nodes)), times.ravel())
            most = np.maximum(most, np.abs(found).max(axis=1, keepdims=True))
            found = found.reshape(len(found), *times.shape)
            real = np.abs(found).max(axis=2) > _AT_EDGE * most
            above = found > 0.0
            passed = ((above[..., 1:] != above[..., :-1]) & real[..., None]).any(axis=0)
            passed &= (np.bincount(owner, minlength=len(dense.begins)) <= _MOST)[owner][:, None]
            pieces, gaps = np.nonzero(passed)
            if not len(pieces):
                break
            lows, highs = self._located(
                values, owner[pieces], times[pieces, gaps], times[pieces, gaps + 1], real[:, pieces]
            )
            whole = ~passed.any(axis=1)
            kept.append((owner[whole], begins[whole], ends[whole]))
            owner, begins, ends = _split(owner, begins, ends, pieces, lows, highs)
        kept.append((owner, begins, ends))
        owner, begins, ends = (np.concatenate(parts) for parts in zip(*kept, strict=True))
        order = np.argsort(begins, kind="stable")
        return owner[order], begins[order], ends[order]

    def _values(self, model: CompiledDae, dense: Dense) -> Callable[[Any, Vector], Vector]:
        edges = self._edges
        assert edges is not None

        def values(pieces: Any, times: Vector) -> Vector:
            x, z = dense.points(pieces, times)
            return edges(times, x, z, model.p, model.u, dense.d[:, pieces])[0]

        return values

    @staticmethod
    def _located(
        values: Callable[[Any, Vector], Vector], owner: Any, lows: Vector, highs: Vector, real: Any
    ) -> tuple[Vector, Vector]:
        """Return neighbouring times before and behind the first edge between some times."""
        before = values(owner, lows) > 0.0
        for _ in range(_HALVINGS):
            middle = 0.5 * (lows + highs)
            if not ((lows < middle) & (middle < highs)).any():
                break
            same = (((values(owner, middle) > 0.0) == before) | ~real).all(axis=0)
            lows, highs = np.where(same, middle, lows), np.where(same, highs, middle)
        return lows, highs


def _split(
    owner: Any, begins: Vector, ends: Vector, pieces: Any, lows: Vector, highs: Vector
) -> tuple[Any, Vector, Vector]:
    """Return the parts of the pieces that have edges, which are between neighbouring times; without empty ones."""
    some = np.unique(pieces)
    owners = np.concatenate([owner[some], owner[pieces]])
    first = np.concatenate([begins[some], highs])
    order = np.argsort(first, kind="stable")
    last = np.sort(np.concatenate([lows, ends[some]]), kind="stable")
    owners, first = owners[order], first[order]
    longer = first < last
    return owners[longer], first[longer], last[longer]
