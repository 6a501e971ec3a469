"""Between the looks of one IDAS call: states by interpolation, as precise as the call itself."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import Any

import numpy as np

from modelica_like.compile.compiled import Vector
from modelica_like.initialize import Point
from modelica_like.solve.guards import Guards
from modelica_like.solve.idas import Integrator

PRECISE = 1.0
"""Difference of two degrees, in tolerances, up to which a polynomial counts as the solution."""
_SHARP = 1e-4
"""Difference of a guard by two degrees, relative to its values at both looks, up to which it is located."""
_TERMS = 8
_ROUNDING = 1e-12
_EXPONENTS = np.arange(float(_TERMS))


class _Scheme:
    """A polynomial of degree seven through looks around an interval, and one of degree five that tells its precision.

    Args:
        nodes: number of looks.
        slopes: whether it takes slopes there, too. They make it much more precise, unless the equations are stiff:
            then slopes are what errors of the states make of them.
    """

    def __init__(self, nodes: int, *, slopes: bool) -> None:
        self.nodes, self.slopes = nodes, slopes
        fewer = nodes - (1 if slopes else 2)
        cells = range(nodes - 1)
        starts = [min(max(cell - (fewer - 1) // 2, 0), nodes - fewer) for cell in cells]
        self.precise = np.array([self._basis(0, nodes, cell) for cell in cells])
        self.coarse = np.array([self._basis(start, fewer, cell) for start, cell in zip(starts, cells, strict=True)])
        # The middle tells for the whole interval: near a look both agree with it, however wrong its slope is.
        self.doubt = 0.5**_EXPONENTS @ (self.precise - self.coarse)

    def _basis(self, first: int, count: int, cell: int) -> Vector:
        """Coefficients, in powers of the share of a cell that has passed, of what each datum adds; (powers, data).

        In these powers, states near the beginning of the cell are as precise as their slopes there.
        """
        nodes = np.arange(first, first + count)
        u, powers = (nodes - float(cell))[:, None], np.arange(count * (2 if self.slopes else 1))
        columns, rows = [*nodes], [u**powers]
        if self.slopes:
            columns += [*(nodes + self.nodes)]
            rows += [powers * u ** np.maximum(powers - 1, 0)]
        basis = np.zeros((_TERMS, _TERMS))
        basis[: len(powers), columns] = np.linalg.inv(np.concatenate(rows))
        return np.where(np.abs(basis) < _ROUNDING, 0.0, basis)

    def first(self, k: Any, last: int) -> Any:
        """Return the first look of the polynomials for intervals k, if possible none behind look `last`."""
        return np.maximum(np.minimum(k - (self.nodes // 2 - 1), last - self.nodes + 1), 0)


_SCHEMES = _Scheme(4, slopes=True), _Scheme(8, slopes=False)


class Cell:
    """The interval between two looks.

    Args:
        scheme: how it is interpolated.
        t: time of its beginning in s.
        width: its length in s.
        k: its number among the looks.
        number: its place among the intervals of the polynomial.
        base: states at its beginning, shape (nx,).
        data: values relative to `base`, and perhaps slopes times `width`, shape (8, nx).
    """

    def __init__(
        self, scheme: _Scheme, t: float, width: float, k: int, number: int, base: Vector, data: Vector
    ) -> None:
        self.t, self.width, self.k, self._base = t, width, k, base
        self._precise, self._coarse = scheme.precise[number] @ data, scheme.coarse[number] @ data

    def _powers(self, t: float) -> Vector:
        return ((t - self.t) / self.width) ** _EXPONENTS

    def states(self, t: float) -> Vector:
        """Return the states at a time in it, by the polynomial of degree seven; shape (nx,)."""
        return self._base + self._powers(t) @ self._precise if t > self.t else self._base.copy()

    def both(self, t: float) -> Vector:
        """Return the states at a time in it by the polynomials of both degrees, shape (nx, 2)."""
        powers = self._powers(t)
        return np.array([self._base + powers @ self._precise, self._base + powers @ self._coarse]).T


class Looks:
    """What one IDAS call computed: equidistant points of a smooth piece.

    Args:
        integrator: what computed them.
        guards: evaluates guards, their rates and slopes of states there.
        times: shape (n + 1,) in s, beginning included.
        x: states, shape (nx, n + 1).
        z: implicit unknowns, shape (nz, n + 1).
        d: modes and discrete values.
    """

    def __init__(self, integrator: Integrator, guards: Guards, times: Vector, x: Vector, z: Vector, d: Vector) -> None:
        self.integrator, self.guards, self.times, self.x, self.z, self.d = integrator, guards, times, x, z, d
        self.count = len(times) - 1
        self.width = float(times[-1] - times[0]) / self.count

    @cached_property
    def seen(self) -> tuple[Vector, Vector, Vector]:
        """Guards, their rates and derivatives of the states at the looks; shapes (guards, n + 1), …, (nx, n + 1)."""
        return self.guards.along(self.times, self.x, self.z, self.d)

    def point(self, k: int) -> Point:
        """Return one look."""
        return Point(float(self.times[k]), self.x[:, k].copy(), self.z[:, k].copy(), self.d)

    def intervals(self, times: Vector) -> Any:
        """Return the numbers of the intervals in which times lie."""
        return np.clip(np.searchsorted(self.times, times) - 1, 0, self.count - 1)

    def cells(self, k: int, last: int) -> Iterator[Cell]:
        """Give the interval from look k to the next, interpolated in several ways; nothing if there are too few looks.

        Args:
            k: number.
            last: the last look that means something, because of an event before the next.
        """
        base = self.x[:, k].copy()
        for scheme in _SCHEMES:
            if scheme.nodes > self.count + 1:
                continue
            first = int(scheme.first(k, max(last, scheme.nodes - 1)))
            nodes = slice(first, first + scheme.nodes)
            data = (self.x[:, nodes] - base[:, None]).T
            if scheme.slopes:
                data = np.concatenate([data, self.width * self.seen[2][:, nodes].T])
            yield Cell(scheme, float(self.times[k]), self.width, k, k - first, base, data)

    def at(self, t: float, cell: Cell) -> Point:
        """Return the point at a time in an interval; the implicit unknowns follow from its states."""
        x = cell.states(t)
        if not len(self.z):
            return Point(t, x, self.z[:, 0], self.d)
        return Point(t, x, self._implicit(np.array([t]), np.array([cell.k]), x[:, None])[:, 0], self.d)

    def is_sharp(self, cell: Cell, guards: list[int], sizes: Vector) -> bool:
        """Whether interpolated states are precise, and precise enough for guards of given sizes, in the middle.

        A state may be small compared with its tolerance, and a guard live on such values all the same.
        """
        times = np.full(2, cell.t + 0.5 * cell.width)
        x = cell.both(float(times[0]))
        if not (np.abs(x[:, 0] - x[:, 1]) <= PRECISE * self.integrator.weights(x[:, 0])).all():
            return False
        values = self.guards.along(times, x, self._implicit(times, np.full(2, cell.k), x), self.d)[0][guards]
        return bool((np.abs(values[:, 0] - values[:, 1]) <= _SHARP * sizes).all())

    def along(self, times: Vector, last: int) -> tuple[Vector, Vector, Any]:
        """Return states and implicit unknowns at times, and the intervals in which they are not precise.

        Shapes (nx, n), (nz, n), (intervals,).

        Args:
            times: between the looks, shape (n,).
            last: the last look that means something.
        """
        k = self.intervals(times)
        x, left = np.zeros((len(self.x), len(times))), np.ones(len(times), bool)
        for scheme in _SCHEMES:
            if left.any() and scheme.nodes <= self.count + 1:
                those = np.flatnonzero(left)
                x[:, those], left[those] = self._by(scheme, times[those], k[those], last)
        return x, self._implicit(times, k, x), np.unique(k[left])

    def _by(self, scheme: _Scheme, times: Vector, k: Any, last: int) -> tuple[Vector, Any]:
        """Return states at times in intervals k, and where they are not precise."""
        first = scheme.first(k, max(last, scheme.nodes - 1))
        nodes = first[:, None] + np.arange(scheme.nodes)
        base = self.x[:, k]
        data = self.x[:, nodes] - base[:, :, None]
        if scheme.slopes:
            data = np.concatenate([data, self.width * self.seen[2][:, nodes]], axis=2)
        powers = ((times - self.times[k]) / self.width)[:, None] ** _EXPONENTS
        precise = np.einsum("np,npk->nk", powers, scheme.precise[k - first])
        error = np.abs(np.einsum("ink,nk->in", data, scheme.doubt[k - first]))
        x = base + np.einsum("ink,nk->in", data, precise)
        return x, ~np.all(error <= PRECISE * self.integrator.weights(base), axis=0)

    def _implicit(self, times: Vector, k: Any, x: Vector) -> Vector:
        if not len(self.z):
            return np.zeros((0, len(times)))
        share = (times - self.times[k]) / self.width
        guess = self.z[:, k] + share * (self.z[:, k + 1] - self.z[:, k])
        return self.integrator.polished(times, x, guess, self.d)
