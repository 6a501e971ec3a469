"""Expressions along a run as polynomials, refined until they fit: extremes, integrals and crossings."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.polynomial import legendre

from modelica_like.compile.buffers import Along
from modelica_like.compile.cached import Cached
from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.errors import MissingValue
from modelica_like.runs.windows import Windows
from modelica_like.solve.dense import MOST_KEPT, Dense

_DEGREE = 6
_INNER: Any = legendre.legroots(legendre.legder([0.0] * _DEGREE + [1.0]))
NODES: Any = np.concatenate([[-1.0], _INNER, [1.0]])
"""Of Lobatto's rule of order twelve, in [-1, 1]."""
_TO_SERIES: Any = np.linalg.inv(legendre.legvander(NODES, _DEGREE))
WEIGHTS: Any = _TO_SERIES[0]
"""Of the mean over [-1, 1]: that of Legendre's series is its first term."""
_GRID: Any = np.cos(np.linspace(np.pi, 0.0, 4 * _DEGREE + 1))
_TO_GRID: Any = legendre.legvander(_GRID, _DEGREE) @ _TO_SERIES
_FIT = 1e-9
"""Last terms of a series, relative to the largest amount in the run, below which it counts as the value."""
_DEEPEST = 30
"""Halvings, after which it is known where a value jumps. Edges are cut before: what is left is the beginning of a decay
that is short beside its piece, or in an implicit unknown."""
_STUBBORN = 0.8
_NOISE, _LESS = 1e3, 3
"""Last terms, relative to what is allowed, below which they are noise after some halvings that lower those of one half
only, and by less than a fifth."""
_CROWD = 5000
"""Pieces with so small last terms are noise at once if they are more than this and four times those of the run."""
_NEWTON, _BISECTIONS = 20, 54
"""To the last digit of a place."""
_RISE = 0.1
"""Of the range in a piece: at most 1 - cos(degree/2 times the distance of places)."""
SAME = 1e-12
"""Of a value: others are as large up to rounding, and the first of them counts."""
_CANDIDATES = 50
"""Others are as large up to rounding."""
_TOGETHER = 2**16
"""Values that are read together."""


@dataclass(frozen=True)
class Fitted:
    """Values of expressions along smooth pieces, as polynomials.

    Attributes:
        begins: of the pieces in s, in order, shape (m,).
        ends: shape (m,).
        values: at the nodes, shape (expressions, m, nodes).
    """

    begins: Vector
    ends: Vector
    values: Vector

    def _grid(self, row: int) -> Vector:
        """Values of an expression at the grid of every piece, exact at both ends; shape (m, places)."""
        grid = self.values[row] @ _TO_GRID.T
        grid[:, [0, -1]] = self.values[row][:, [0, -1]]
        return grid

    def integrals(self) -> Vector:
        """Return the integrals over all pieces, shape (expressions,)."""
        return (self.values @ WEIGHTS) @ (self.ends - self.begins)

    def largest(self, row: int) -> tuple[float, float]:
        """Return the largest value of an expression and its time, or -inf."""
        if not len(self.begins):
            return -np.inf, np.nan
        grid = self._grid(row)
        tops, best = grid.max(axis=1), float(grid.max())
        # Between two places of the grid a polynomial of this degree rises no further.
        near = np.flatnonzero(tops + _RISE * np.ptp(grid, axis=1) >= best)
        same = best - SAME * abs(best)
        near = near[np.argsort(-np.minimum(tops[near], same), kind="stable")][:_CANDIDATES]
        peaks = [self._top(row, piece, grid[piece]) for piece in near.tolist()]
        best = max(value for value, _ in peaks)
        return best, min(time for value, time in peaks if value >= best - SAME * abs(best))

    def _top(self, row: int, piece: int, grid: Vector) -> tuple[float, float]:
        same = SAME * float(np.abs(grid).max())
        k = int(np.argmax(grid >= grid.max() - same))
        series = _TO_SERIES @ self.values[row, piece]
        place = _climbed(series, _GRID[max(k - 1, 0)], _GRID[k], _GRID[min(k + 1, len(_GRID) - 1)])
        value = float(legendre.legval(place, series))
        value, place = (value, place) if value > grid[k] + same else (float(grid[k]), _GRID[k])
        return value, float(self.times(piece, place))

    def turning(self, row: int) -> Vector:
        """Return the values of an expression at its turning points and at the ends of pieces, in order."""
        grid = self._grid(row)
        places: list[float] = []
        for piece, line in enumerate(grid):
            rises = np.diff(line)
            places.append(float(line[0]))
            for k in np.flatnonzero(rises[:-1] * rises[1:] < 0) + 1:
                series = _TO_SERIES @ self.values[row, piece] * np.sign(rises[k - 1])
                place = _climbed(series, _GRID[k - 1], _GRID[k], _GRID[k + 1])
                places.append(float(np.sign(rises[k - 1]) * legendre.legval(place, series)))
            places.append(float(line[-1]))
        return np.array(places)

    def within(self, begin: float, end: float) -> Fitted:
        """Return what lies between two times in s."""
        kept = (self.ends > begin) & (self.begins < end)
        begins, ends, values = self.begins[kept], self.ends[kept], self.values[:, kept]
        for k in np.flatnonzero((begins < begin) | (ends > end)):
            low, high = max(begin, begins[k]), min(end, ends[k])
            times = low + 0.5 * (1.0 + NODES) * (high - low)
            places = 2.0 * (times - begins[k]) / (ends[k] - begins[k]) - 1.0
            values[:, k] = values[:, k] @ _TO_SERIES.T @ legendre.legvander(places, _DEGREE).T
            begins[k], ends[k] = low, high
        return Fitted(begins, ends, values)

    def cut(self, limits: Mapping[int, Vector]) -> tuple[Fitted, Any]:
        """Return pieces in which expressions pass no limits: cut where they do.

        Args:
            limits: by the row of an expression.

        Returns:
            The pieces, and the position of that of which each is a part, shape (pieces,).
        """
        passes = [self._passes(row, level) for row, levels in limits.items() for level in levels]
        count = len(self.begins)
        owners = np.concatenate([np.arange(count), *(pieces for pieces, _ in passes)])
        lows = np.concatenate([np.full(count, -1.0), *(places for _, places in passes)])
        order = np.lexsort((lows, owners))
        owners, lows = owners[order], lows[order]
        highs = np.where(np.diff(owners, append=count) == 0, np.append(lows[1:], 1.0), 1.0)
        values, parts = self.values[:, owners], np.flatnonzero((lows > -1.0) | (highs < 1.0))
        places = lows[parts, None] + 0.5 * (1.0 + NODES) * (highs - lows)[parts, None]
        values[:, parts] = np.einsum("nij,enj->eni", legendre.legvander(places, _DEGREE) @ _TO_SERIES, values[:, parts])
        ends = np.where(highs < 1.0, self.times(owners, highs), self.ends[owners])
        return Fitted(self.times(owners, lows), ends, values), owners

    def _passes(self, row: int, level: float) -> tuple[Any, Vector]:
        """Pieces and places in [-1, 1] where an expression passes a value."""
        below = self._grid(row) < level
        pieces, k = np.nonzero(below[:, 1:] != below[:, :-1])
        low, high, rises = _GRID[k], _GRID[k + 1], below[pieces, k]
        for _ in range(_BISECTIONS if len(pieces) else 0):
            middle = 0.5 * (low + high)
            before = (self.at(row, pieces, middle) < level) == rises
            low, high = np.where(before, middle, low), np.where(before, high, middle)
        return pieces, high

    def places(self, row: int, levels: Vector) -> tuple[Any, Vector]:
        """Return the pieces and the places in [-1, 1] where a rising expression has values, both as the levels.

        Args:
            row: of the expression, which must not fall.
            levels: rising values between its first and its last one, shape (n,).
        """
        pieces = np.clip(np.searchsorted(self.values[row, :, -1], levels), 0, len(self.ends) - 1)
        low, high = np.full((2, len(levels)), [[-1.0], [1.0]])
        for _ in range(_BISECTIONS):
            middle = 0.5 * (low + high)
            below = self.at(row, pieces, middle) < levels
            low, high = np.where(below, middle, low), np.where(below, high, middle)
        return pieces, high

    def times(self, pieces: Any, places: Any) -> Vector:
        """Return the times of places in [-1, 1] of pieces."""
        return self.begins[pieces] + 0.5 * (1.0 + places) * (self.ends - self.begins)[pieces]

    def at(self, row: int, pieces: Any, places: Vector) -> Vector:
        """Return the values of an expression at places in [-1, 1] of pieces."""
        series = self.values[row] @ _TO_SERIES.T
        return np.einsum("nk,nk->n", legendre.legvander(places, _DEGREE), series[pieces])

    def last(self, row: int) -> float:
        """Return the last time at which an expression is above zero; nan if it never is."""
        return -Fitted(-self.ends[::-1], -self.begins[::-1], self.values[:, ::-1, ::-1]).first(row)

    def first(self, row: int, *, reached: bool = False) -> float:
        """Return the first time at which an expression is above zero, or `reached` it; nan if it never is."""
        least = 0.0 if reached else np.nextafter(0.0, 1.0)
        above = self._grid(row) >= least
        if not above.any():
            return np.nan
        piece = int(np.argmax(above.any(axis=1)))
        k, series = int(np.argmax(above[piece])), _TO_SERIES @ self.values[row, piece]
        low, high = _GRID[max(k - 1, 0)], _GRID[k]
        while low < (middle := 0.5 * (low + high)) < high:
            low, high = (low, middle) if legendre.legval(middle, series) >= least else (middle, high)
        return float(self.times(piece, high))


def _climbed(series: Vector, low: float, place: float, high: float) -> float:
    """Return where the slope of a series is zero near its largest value on a grid, by safeguarded Newton iterations."""
    slope = legendre.legder(series)
    bend = legendre.legder(slope)
    for _ in range(_NEWTON):
        s = legendre.legval(place, slope)
        low, high = (place, high) if s > 0 else (low, place)
        step = -s / (legendre.legval(place, bend) or 1.0)
        new = place + step if low <= place + step <= high else 0.5 * (low + high)
        if new == place:
            break
        place = float(new)
    return float(place)


class Curves:
    """Expressions along a run.

    Args:
        model: the compiled model.
        expressions: SX columns in the model's arguments; `key` identifies them in the model's cache.
        noise: amount below which a value is noise.
        names: of the expressions, for errors.
    """

    def __init__(self, model: CompiledDae, key: Hashable, expressions: Any, noise: float, names: Sequence[str]) -> None:
        self._model, self._noise, self._names = model, noise, names

        def make() -> tuple[Along, Windows]:
            column = ca.densify(ca.vertcat(*expressions()))
            function = ca.Function("read", list(model.arguments.values()), [column], {"cse": True})
            return Along(function), Windows(model, column)

        self._function, self._windows = model.once((Cached.CURVES, key), make)
        self.sizes = np.zeros(self._function.rows[0])

    def at(self, times: Vector, x: Vector, z: Vector, d: Vector) -> Vector:
        """Return values at points, shape (expressions, n)."""
        values = self._function(times, x, z, self._model.p, self._model.u, d)[0]
        self.sizes = np.maximum(self.sizes, np.abs(values).max(axis=1, initial=0.0))
        return values

    def fitted(self, dense: Dense) -> Fitted:
        """Return them as polynomials; pieces are halved until each is one.

        Raises:
            MissingValue: that would take more pieces than there is room for.
        """
        owner, begins, ends = self._windows.cut(self._model, dense, NODES)
        before, stuck, kept = np.full(len(owner), np.inf), np.zeros(len(owner), int), []
        for depth in range(_DEEPEST + 1):
            values, excesses = self._read(dense, owner, begins, ends)
            excess = excesses.max(axis=0, initial=0.0)
            bad, noise = excess > 1, excess <= _NOISE
            # Where both halves of a piece are bad, the value does not just jump at a place.
            alone = ~np.repeat(bad.reshape(-1, 2).all(axis=1), 2) if depth else True
            stuck = np.where((excess > _STUBBORN * before) & (alone | noise), stuck + 1, 0)
            crowd = np.count_nonzero(bad) > _CROWD + 4 * len(dense.begins)
            patience = np.where(noise, 1 if crowd else _LESS, _DEEPEST)
            rough = bad & (stuck < patience) & (depth < _DEEPEST)
            kept.append((begins[~rough], ends[~rough], values[:, ~rough]))
            if not rough.any():
                break
            if np.count_nonzero(rough) > self._room(dense):
                raise self._too_fast(excesses, begins)
            middles = 0.5 * (begins + ends)[rough]
            begins, ends = _mixed(begins[rough], middles), _mixed(middles, ends[rough])
            owner, before, stuck = (np.repeat(x[rough], 2) for x in (owner, excess, stuck))
        begins, ends = (np.concatenate([x[k] for x in kept]) for k in (0, 1))
        order = np.argsort(begins, kind="stable")
        return Fitted(begins[order], ends[order], np.concatenate([k[2] for k in kept], axis=1)[:, order])

    def _read(self, dense: Dense, owner: Any, begins: Vector, ends: Vector) -> tuple[Vector, Vector]:
        """Return values at the nodes of pieces, and their last terms over what is allowed, shape (expressions, m)."""
        count, size = len(self.sizes), max(_TOGETHER // (max(len(self.sizes), 1) * len(NODES)), 1)
        parts = [
            self._values(dense, owner[k : k + size], begins[k : k + size], ends[k : k + size])
            for k in range(0, len(owner), size)
        ]
        values = np.concatenate([np.zeros((count, 0, len(NODES))), *parts], axis=1)
        tails = np.abs(values @ _TO_SERIES[-2:].T) @ [0.1, 1.0]
        return values, tails / np.maximum(_FIT * self.sizes, self._noise)[:, None]

    def _room(self, dense: Dense) -> int:
        """Pieces that there is room for: as many numbers as a run keeps, or four times the pieces of the run."""
        return max(4 * len(dense.begins), MOST_KEPT // (len(self.sizes) * len(NODES)))

    def _too_fast(self, excesses: Vector, begins: Vector) -> MissingValue:
        row = int(np.argmax(np.count_nonzero(excesses > 1, axis=1)))
        first = float(begins[int(np.argmax(excesses[row] > 1))])
        return MissingValue(
            f"{self._names[row]} cannot be read off {self._model.name}: from t = {first:.6g} s on it changes so "
            f"often that {excesses.shape[1]} polynomials do not show it.",
            advice="Read it off a shorter run, or look for noise in it.",
        )

    def _values(self, dense: Dense, owner: Any, begins: Vector, ends: Vector) -> Vector:
        times = begins[:, None] + 0.5 * (1.0 + NODES) * (ends - begins)[:, None]
        times[:, -1] = ends
        pieces = np.repeat(owner, len(NODES))
        x, z = dense.points(pieces, times.ravel())
        return self.at(times.ravel(), x, z, dense.d[:, pieces]).reshape(len(self.sizes), *times.shape)


def _mixed(first: Vector, second: Vector) -> Vector:
    return np.stack([first, second], axis=1).ravel()
