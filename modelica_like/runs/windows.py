"""Pieces of a run between the edges of what is read.

The integrator lands on edges of the equations, as far as the states feel them. What is only read (a torque at a shaft
whose speed is prescribed, a sensor, a formula) may be narrower than its steps, and the nodes of a polynomial may miss
it. Its edges are known from its graph (`compile/edges.py`), so the pieces are cut there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.compile.buffers import Along, Vector
from modelica_like.compile.cached import Cached
from modelica_like.compile.compiled import CompiledDae
from modelica_like.compile.edges import edges_of
from modelica_like.runs.powers import POWERS
from modelica_like.solve.dense import Dense
from modelica_like.solve.recorder import Segment

_ROUNDS = 8
"""A cut shows edges beside it: the top of a pulse its flanks. These nest no deeper than formulas of users."""
_PARTS = np.arange(1, 16) / 16
"""In which the time of an edge is looked for at once."""
_DEEPEST = 16
"""Such divisions, to neighbouring times."""
_AT_EDGE, _ROUNDING = 1e-12, 1e-14
"""Of the largest amount of an edge, and of one: what stays within is there all the time, and its sign is rounding."""
_TOPS, _NEAR, _NARROWER = 2, 0.1, 0.025
"""Parabolas; the part of its middle value to which the top of one comes; width of the second one beside the first."""
_MOST = 200
"""Cuts for each piece of the run: more are noise beside an edge."""


class Windows:
    """Cuts pieces of runs where something read has an edge.

    Args:
        model: the compiled model.
        column: what is read, an SX column in the model's arguments.
        unfelt: leave out edges of the equations: the integrator minds them, as far as its tolerance asks for it.
    """

    def __init__(self, model: CompiledDae, column: Any, *, unfelt: bool = False) -> None:
        given = [*model.arguments.values()]
        rates = model.equations.ode(*given) if isinstance(model, CompiledDae) else ca.SX.zeros(given[1].numel())
        edges = edges_of(model.arguments, rates, column)
        if unfelt and edges:
            felt = edges_of(model.arguments, rates, ca.vertcat(rates, model.equations.alg(*given)))
            both = ca.vertsplit(ca.cse(ca.vertcat(*felt, *edges)))
            known = {edge.element_hash() for edge in both[: len(felt)]}
            edges = [edge for edge in both[len(felt) :] if edge.element_hash() not in known]
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
            real = np.abs(found).max(axis=2) > np.maximum(_AT_EDGE * most, _ROUNDING)
            above = found > 0.0
            passed = ((above[..., 1:] != above[..., :-1]) & real[..., None]).any(axis=0)
            few = (np.bincount(owner, minlength=len(dense.begins)) <= _MOST)[owner]
            passed &= few[:, None]
            tops, at = self._tops(values, owner, times, found, real & few & ~passed.any(axis=1))
            pieces, gaps = np.nonzero(passed)
            if not len(pieces) + len(tops):
                break
            lows, highs = self._located(
                values, owner[pieces], times[pieces, gaps], times[pieces, gaps + 1], real[:, pieces]
            )
            pieces = np.concatenate([pieces, tops])
            whole = np.bincount(pieces, minlength=len(owner)) == 0
            kept.append((owner[whole], begins[whole], ends[whole]))
            lows, highs = np.concatenate([lows, at]), np.concatenate([highs, at])
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
    def _tops(
        values: Callable[[Any, Vector], Vector], owner: Any, times: Vector, found: Vector, quiet: Any
    ) -> tuple[Any, Vector]:
        """Return pieces, and times in them at which an edge has another sign than at all nodes.

        That is at the top of the parabola through three nodes, of which the middle one is nearest to zero, or of a
        second one about that.
        """
        size = np.abs(found)
        inner = (size[..., 1:-1] <= size[..., :-2]) & (size[..., 1:-1] <= size[..., 2:]) & quiet[..., None]
        rows, pieces, nodes = np.nonzero(inner)
        order = np.lexsort((nodes, pieces))
        rows, pieces, nodes = rows[order], pieces[order], nodes[order][:, None] + np.arange(3)
        at, of, results = times[pieces[:, None], nodes], found[rows[:, None], pieces[:, None], nodes], []
        signs = np.sign(of[:, 1])
        for _ in range(_TOPS):
            a, b, c = at.T
            with np.errstate(divide="ignore", invalid="ignore"):  # constants have no top
                slopes = np.diff(of) / np.diff(at)
                bends = (slopes[:, 1] - slopes[:, 0]) / (c - a)
                tops = 0.5 * (a + b) - 0.5 * slopes[:, 0] / bends
                least = of[:, 0] + slopes[:, 0] * (tops - a) + bends * (tops - a) * (tops - b)
                near = (tops > a) & (tops < c) & (signs * least < _NEAR * np.abs(of[:, 1]))
            if not near.any():
                break
            rows, pieces, signs, half = rows[near], pieces[near], signs[near], _NARROWER * (c - a)[near]
            tops = np.clip(tops[near], a[near] + half, c[near] - half)
            at = tops[:, None] + half[:, None] * np.array([-1.0, 0.0, 1.0])
            of = values(np.repeat(owner[pieces], 3), at.ravel())[np.repeat(rows, 3), np.arange(at.size)].reshape(
                at.shape
            )
            other = np.sign(of) * signs[:, None] < 0
            seen = other.any(axis=1)
            results.append((pieces[seen], at[seen, other[seen].argmax(axis=1)]))
        found_in, times_of = ([part[k] for part in results] for k in (0, 1))
        return np.concatenate([rows[:0], *found_in]), np.concatenate([times[:0, 0], *times_of])

    @staticmethod
    def _located(
        values: Callable[[Any, Vector], Vector], owner: Any, lows: Vector, highs: Vector, real: Any
    ) -> tuple[Vector, Vector]:
        """Return neighbouring times before and behind the first edge between some times."""
        before, rows = (values(owner, lows) > 0.0)[..., None], np.arange(len(lows))
        several = np.repeat(owner, len(_PARTS))
        for _ in range(_DEEPEST):
            times = lows[:, None] + _PARTS * (highs - lows)[:, None]
            if not ((lows < times[:, 7]) & (times[:, 7] < highs)).any():
                break
            found = values(several, times.ravel()).reshape(len(before), *times.shape)
            same = (((found > 0.0) == before) | ~real[..., None]).all(axis=0)
            first = np.where(same.all(axis=1), len(_PARTS), same.argmin(axis=1))  # of the part with the edge
            ends = np.column_stack([lows, times, highs])
            lows, highs = ends[rows, first], ends[rows, first + 1]
        return lows, highs


def cut_segments(model: CompiledDae, segments: Sequence[Segment], dense: Dense, nodes: Vector) -> tuple[Segment, ...]:
    """Return smooth pieces of a run that end where a power has an edge that no state feels.

    Args:
        model: the compiled model.
        segments: smooth pieces.
        dense: dense output of the run.
        nodes: as in `Windows.cut`.
    """
    windows = model.once(Cached.POWER_WINDOWS, lambda: _of_powers(model))
    owner, begins, ends = windows.cut(model, dense, nodes)
    inner = np.flatnonzero(begins[1:] > dense.begins[owner[1:]])
    if not len(inner):
        return tuple(segments)
    low, high = (dense.points(owner[inner], times) for times in (ends[inner], begins[1:][inner]))
    result: list[Segment] = []
    for segment in segments:
        some = np.flatnonzero((ends[inner] > segment.times[0]) & (begins[1:][inner] < segment.times[-1]))
        places = [0, *segment.times.searchsorted(ends[inner[some]]).tolist(), len(segment.times)]
        for k, (first, last) in enumerate(pairwise(places)):
            part = Segment(segment.times[first:last], segment.x[:, first:last], segment.z[:, first:last], segment.d)
            part = _with(part, 0, float(begins[1 + inner[some[k - 1]]]), high, some[k - 1]) if k else part
            result.append(
                _with(part, len(part.times), float(ends[inner[some[k]]]), low, some[k]) if k < len(some) else part
            )
    return tuple(result)


def _with(segment: Segment, at: int, time: float, points: tuple[Vector, Vector], k: int) -> Segment:
    """Return a segment with one more result, unless it has that."""
    if at and segment.times[-1] == time:
        return segment
    if not at and len(segment.times) and segment.times[0] <= time:
        rest = slice(int(segment.times.searchsorted(time, "right")), None)
        segment = Segment(segment.times[rest], segment.x[:, rest], segment.z[:, rest], segment.d)
    x, z = (np.insert(old, at, new[:, k], axis=1) for old, new in zip((segment.x, segment.z), points, strict=True))
    return Segment(np.insert(segment.times, at, time), x, z, segment.d)


def _of_powers(model: CompiledDae) -> Windows:
    terms = model.energy(*model.arguments.values())
    # The rate of the stored energy, the last one, needs none: how much is stored is known at every result.
    return Windows(model, ca.vec(terms[:, 1:POWERS]), unfelt=True)


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
