"""Points along a run between which powers are integrated, with rules of high order over them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any, cast

import numpy as np

from modelica_like.compile.compiled import Vector

Places = np.ndarray[Any, np.dtype[Any]]
"""Positions of points or intervals, or which of them are meant."""
_WIDTH = 8
"""Points of the widest rule; its order."""
_UNIFORM, _ROUNDING = 1e-9, 1e-15
LOBATTO = np.array([0.0, 0.5 - np.sqrt(21.0) / 14.0, 0.5, 0.5 + np.sqrt(21.0) / 14.0, 1.0])
"""Points of the rule of order eight that has both ends among them."""
LOBATTO_WEIGHTS = np.array([[9, 49, 64, 49, 9], [30, 0, 120, 0, 30], [90, 0, 0, 0, 90]]) / 180.0
"""Weights of this rule, of Simpson's and of the trapezoid."""


@dataclass
class Nodes:
    """Points of a run in blocks; a block is a smooth piece that is followed without a gap.

    Attributes:
        times: shape (n,), in s.
        x: states, shape (nx, n).
        z: implicit unknowns, shape (nz, n).
        segment: number of the segment of the run each point belongs to, shape (n,).
        first: the first point of the block each point belongs to, shape (n,).
        last: its last point, shape (n,).
        made: whether each block has the points of Lobatto's rule, those inside interpolated.
    """

    times: Vector
    x: Vector
    z: Vector
    segment: Places
    first: Places
    last: Places
    made: bool = False

    @property
    def intervals(self) -> Places:
        """Points with another one of the same block behind them."""
        return np.flatnonzero(np.arange(len(self.times)) < self.last)


@dataclass
class Rule:
    """Integrals over intervals as weighted sums of values at some points around, shapes (intervals, width)."""

    places: Places
    weights: Vector

    def apply(self, values: Vector) -> Vector:
        """Integrate; shapes (rows, n), (rows, intervals)."""
        return np.einsum("rjw,jw->rj", values[:, self.places], self.weights)

    def totals(self, count: int, wanted: Places | slice) -> Vector:
        """Return the weight of each of `count` points in the sum of the integrals over the wanted intervals."""
        return np.asarray(np.bincount(self.places[wanted].ravel(), self.weights[wanted].ravel(), count), float)


def rules(nodes: Nodes, intervals: Places) -> tuple[Rule, Rule, Rule]:
    """Return three rules of falling order, as high as the blocks allow."""
    each = len(LOBATTO) - 1
    if nodes.made and len(intervals) == each * (len(nodes.times) // (each + 1)):
        blocks = nodes.first[:: each + 1]
        spans = nodes.times[blocks + each] - nodes.times[blocks]
        found = [
            Rule(
                (blocks[:, None, None] + rule.places).reshape(len(intervals), -1),
                (spans[:, None, None] * rule.weights).reshape(len(intervals), -1),
            )
            for rule in _lobatto_rules()
        ]
    else:
        sizes = np.minimum(nodes.last[intervals] - nodes.first[intervals] + 1, _WIDTH)
        regular = _equidistant(nodes, intervals, sizes)
        found = [_rule(nodes, intervals, np.maximum(sizes - less, 1), regular) for less in (0, 2, 4)]
    return cast("tuple[Rule, Rule, Rule]", tuple(found))


@cache
def _lobatto_rules() -> tuple[Rule, Rule, Rule]:
    """Return the rules of one block of length one."""
    count, none = len(LOBATTO), np.zeros((0, len(LOBATTO)))
    ends = np.zeros(count, int)
    return rules(Nodes(LOBATTO, none, none, ends, ends, ends + count - 1), np.arange(count - 1))


def windows(nodes: Nodes, intervals: Places, sizes: Places) -> Places:
    """Return the first of `sizes` points around each interval, as far in the middle as its block allows."""
    first = intervals - (sizes - 1) // 2
    return np.clip(first, nodes.first[intervals], nodes.last[intervals] + 1 - sizes)


def _equidistant(nodes: Nodes, intervals: Places, sizes: Places) -> Places:
    """Tell which windows of the given sizes have equidistant points."""
    steps = np.append(np.diff(nodes.times), 0.0)
    # Times are rounded themselves.
    uneven = np.abs(np.diff(steps)) > _UNIFORM * steps[:-1] + _ROUNDING * np.abs(nodes.times[:-1])
    before = np.append(0, np.cumsum(uneven))
    starts = windows(nodes, intervals, sizes)
    return before[np.maximum(starts + sizes - 2, starts)] == before[starts]


def _rule(nodes: Nodes, intervals: Places, sizes: Places, regular: Places) -> Rule:
    starts = windows(nodes, intervals, sizes)
    width = int(sizes.max(initial=1))
    # Narrower windows are filled up with weights of zero.
    places = np.minimum(starts[:, None] + np.arange(width), nodes.last[intervals][:, None])
    weights = np.zeros(places.shape)
    offsets = intervals - starts
    spans = nodes.times[intervals + 1] - nodes.times[intervals]
    for size in np.flatnonzero(np.bincount(sizes)):
        some = sizes == size
        alike = np.flatnonzero(some & regular)
        weights[alike, :size] = _regular(int(size))[offsets[alike]]
        odd = np.flatnonzero(some & ~regular)
        if len(odd):
            now = nodes.times[places[odd, :size]] - nodes.times[intervals[odd]][:, None]
            weights[odd, :size] = _weights(now / spans[odd][:, None])
    return Rule(places, weights * spans[:, None])


@cache
def _regular(size: int) -> Vector:
    """Weights over equidistant points, one row for each place of the interval among them."""
    return _weights(np.arange(size)[None, :] - np.arange(float(size))[:, None])


def _weights(places: Vector) -> Vector:
    """Weights of the integral from 0 to 1 of the polynomials through values at some places; shapes (n, width)."""
    size = places.shape[1]
    scale = np.max(np.abs(places), axis=1, keepdims=True)
    scale = np.maximum(scale, 1.0)
    powers = (places / scale)[:, None, :] ** np.arange(size)[None, :, None]
    moments = scale ** -np.arange(size) / np.arange(1, size + 1)
    return np.linalg.solve(powers, moments[:, :, None])[:, :, 0]


def between(nodes: Nodes, rates: Vector, intervals: Places, shares: Vector) -> tuple[Vector, Vector, Vector]:
    """Interpolate inside of intervals: states by values and rates at up to four points around, the rest by values.

    Args:
        nodes: where to interpolate.
        rates: derivatives of the states there, shape (nx, n).
        intervals: in which.
        shares: places within an interval, between 0 and 1.

    Returns:
        Times (m, k), states (nx, m, k) and implicit unknowns (nz, m, k) of m intervals and k shares.
    """
    times = nodes.times[intervals][:, None] + np.diff(nodes.times)[intervals][:, None] * shares
    x = np.empty((len(nodes.x), *times.shape))
    z = np.empty((len(nodes.z), *times.shape))
    sizes = np.minimum(nodes.last[intervals] - nodes.first[intervals] + 1, 4)
    for size in np.flatnonzero(np.bincount(sizes)):
        some = np.flatnonzero(sizes == size)
        places = windows(nodes, intervals[some], sizes[some])[:, None] + np.arange(size)
        known = nodes.times[places]
        lagrange, slopes = _lagrange(known, times[some])
        apart = times[some][:, :, None] - known[:, None, :]
        squares = lagrange**2
        by_value, by_rate = (1.0 - 2.0 * apart * slopes[:, None, :]) * squares, apart * squares
        x[:, some] = np.einsum("rjw,jkw->rjk", nodes.x[:, places], by_value)
        x[:, some] += np.einsum("rjw,jkw->rjk", rates[:, places], by_rate)
        z[:, some] = np.einsum("rjw,jkw->rjk", nodes.z[:, places], lagrange)
    return times, x, z


def _lagrange(known: Vector, times: Vector) -> tuple[Vector, Vector]:
    """Lagrange polynomials over (m, w) points at (m, k) times, shape (m, k, w), and their slopes at the points."""
    count = known.shape[1]
    values = np.ones((*times.shape, count))
    slopes = np.zeros(known.shape)
    for i in range(count):
        for j in range(count):
            if i != j:
                gap = known[:, i] - known[:, j]
                values[:, :, i] *= (times - known[:, j, None]) / gap[:, None]
                slopes[:, i] += 1.0 / gap
    return values, slopes
