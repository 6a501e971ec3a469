"""Between the looks of one IDAS call: states by interpolation through values and slopes, as precise as the call itself."""

from __future__ import annotations

from typing import Any

import numpy as np

from modelica_like.compile.buffers import buffered
from modelica_like.compile.compiled import Vector
from modelica_like.initialize import Point
from modelica_like.solve.idas import Integrator

_NODES = 4
"""Looks around an interval that its polynomial passes through, with their slopes: degree seven."""
PRECISE = 1.0
"""Difference of two degrees, in tolerances, up to which a polynomial counts as the solution."""
_BLOCK = 8
"""Slopes are evaluated for so many looks at a time."""


def _basis(nodes: list[int]) -> Vector:
    """Coefficients in powers of u = θ - 1.5 of the polynomials for values and slopes at nodes among 0 … 3.

    Shape (8 powers, 8 data): first the four values, then the four slopes; zero for nodes that are not used.
    """
    u = np.array(nodes) - 0.5 * (_NODES - 1)
    powers = np.arange(2 * len(nodes))
    values = u[:, None] ** powers
    slopes = powers * u[:, None] ** np.maximum(powers - 1, 0)
    inverse = np.linalg.inv(np.concatenate([values, slopes]))
    basis = np.zeros((2 * _NODES, 2 * _NODES))
    columns = [*nodes, *(node + _NODES for node in nodes)]
    basis[: len(powers), columns] = inverse
    return basis


_PRECISE = _basis([0, 1, 2, 3])
_COARSE = np.array([_basis([0, 1, 2]), _basis([0, 1, 2]), _basis([1, 2, 3])])
"""Degree five, through the three nodes nearest to each of the three intervals: tells how precise degree seven is."""
_POWERS = np.arange(2 * _NODES)


class Cell:
    """The interval between two looks.

    Args:
        t: time of its beginning in s.
        width: its length in s.
        number: its place among the three intervals of the polynomial.
        base: states at its beginning, shape (nx,).
        data: values relative to `base` and slopes times `width` at the four nodes, shape (8, nx).
        weights: tolerances of the states, shape (nx,).
    """

    def __init__(self, t: float, width: float, number: int, base: Vector, data: Vector, weights: Vector) -> None:
        self.t, self.width, self._base = t, width, base
        self._offset = number - 0.5 * (_NODES - 1)
        self._polynomials = _PRECISE @ data, _COARSE[number] @ data
        self._weights = weights

    def states(self, t: float, *, coarse: bool = False) -> Vector:
        """Return the states at a time in it, by the polynomial of degree seven or the coarser one; shape (nx,)."""
        if t <= self.t:
            return self._base.copy()
        return self._base + ((t - self.t) / self.width + self._offset) ** _POWERS @ self._polynomials[coarse]

    def precise(self, t: float) -> bool:
        """Whether the polynomials of both degrees agree within the tolerances."""
        difference = np.abs(self.states(t) - self.states(t, coarse=True))
        return bool(np.all(difference <= PRECISE * self._weights))


class Looks:
    """What one IDAS call computed: equidistant points of a smooth piece.

    Args:
        integrator: what computed them.
        times: shape (n + 1,) in s, beginning included.
        x: states, shape (nx, n + 1).
        z: implicit unknowns, shape (nz, n + 1).
        d: modes and discrete values.
    """

    def __init__(self, integrator: Integrator, times: Vector, x: Vector, z: Vector, d: Vector) -> None:
        self.integrator, self.times, self.x, self.z, self.d = integrator, times, x, z, d
        self.count = len(times) - 1
        self.width = float(times[-1] - times[0]) / self.count
        self._slopes = np.zeros((len(x), self.count + 1))
        self._known = np.zeros(self.count + 1, bool)
        self._cells: dict[int, Cell] = {}

    def point(self, k: int) -> Point:
        """Return one look."""
        return Point(float(self.times[k]), self.x[:, k].copy(), self.z[:, k].copy(), self.d)

    def interval(self, t: float) -> int:
        """Return the number of the interval in which a time lies."""
        return min(max(int(np.searchsorted(self.times, t)) - 1, 0), self.count - 1)

    def cell(self, k: int, last: int | None = None) -> Cell | None:
        """Return the interval from look k to the next, nothing if there are too few looks.

        Args:
            k: number.
            last: the last look that means something, because of an event before the next.
        """
        if self.count < _NODES - 1:
            return None
        if k not in self._cells:
            first = max(min(k - 1, (self.count if last is None else last) - _NODES + 1, self.count - _NODES + 1), 0)
            nodes = slice(first, first + _NODES)
            base = self.x[:, k].copy()
            data = np.concatenate([(self.x[:, nodes] - base[:, None]).T, self.width * self._slopes_at(nodes).T])
            weights = self.integrator.weights(base)
            self._cells[k] = Cell(float(self.times[k]), self.width, k - first, base, data, weights)
        return self._cells[k]

    def at(self, t: float, cell: Cell, *, coarse: bool = False) -> Point:
        """Return the point at a time in an interval; the implicit unknowns follow from its states."""
        times, x = np.array([t]), cell.states(t, coarse=coarse)
        z = self._implicit(times, np.array([self.interval(t)]), x[:, None])
        return Point(t, x, z[:, 0], self.d)

    def along(self, times: Vector, last: int) -> tuple[Vector, Vector, Any]:
        """Return states and implicit unknowns at times, and where they are precise; shapes (nx, n), (nz, n), (n,).

        Args:
            times: between the looks, shape (n,).
            last: the last look that means something.
        """
        if self.count < _NODES - 1:
            nothing = np.zeros((len(self.x), len(times)))
            return nothing, np.zeros((len(self.z), len(times))), np.zeros(len(times), bool)
        k = np.clip(np.searchsorted(self.times, times) - 1, 0, self.count - 1)
        first = np.clip(np.minimum(k - 1, max(last, _NODES - 1) - _NODES + 1), 0, self.count - _NODES + 1)
        self._slopes_at(slice(int(first.min()), int(first.max()) + _NODES))
        nodes = first[:, None] + np.arange(_NODES)
        base = self.x[:, k]
        data = np.concatenate([self.x[:, nodes] - base[:, :, None], self.width * self._slopes[:, nodes]], axis=2)
        powers = ((times - self.times[k]) / self.width + (k - first) - 0.5 * (_NODES - 1))[:, None] ** _POWERS
        precise = powers @ _PRECISE
        coarse = np.einsum("np,npk->nk", powers, _COARSE[k - first])
        x = base + np.einsum("ink,nk->in", data, precise)
        error = np.abs(np.einsum("ink,nk->in", data, precise - coarse)) / self.integrator.weights(base)
        return x, self._implicit(times, k, x), np.all(error <= PRECISE, axis=0)

    def _implicit(self, times: Vector, k: Any, x: Vector) -> Vector:
        if not len(self.z):
            return np.zeros((0, len(times)))
        share = (times - self.times[k]) / self.width
        guess = self.z[:, k] + share * (self.z[:, k + 1] - self.z[:, k])
        return self.integrator.polished(times, x, guess, self.d)

    def _slopes_at(self, nodes: slice) -> Vector:
        """Derivatives of the states at looks, in s⁻¹."""
        for first in range(nodes.start - nodes.start % _BLOCK, nodes.stop, _BLOCK):
            if not self._known[first]:
                block = np.minimum(np.arange(first, first + _BLOCK), self.count)
                self._slopes[:, block] = _rates(self.integrator, self.times[block], self.x[:, block], self.z[:, block], self.d)
                self._known[first] = True
        return self._slopes[:, nodes]


def _rates(integrator: Integrator, times: Vector, x: Vector, z: Vector, d: Vector) -> Vector:
    """Derivatives of the states at a block of points, shape (nx, block)."""
    model = integrator.model
    fast = buffered(model._cache, ("rates", _BLOCK), lambda: model.ode.map(_BLOCK))
    p, u, d = (np.tile(vector, _BLOCK) for vector in (model.p, model.u, d))
    return fast(times, x.ravel("F"), z.ravel("F"), p, u, d)[0].reshape(_BLOCK, -1).T
