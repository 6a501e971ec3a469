"""Between the looks of one IDAS call: states by interpolation through values and slopes, as precise as the call itself."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from modelica_like.compile.compiled import Vector
from modelica_like.initialize import Point
from modelica_like.solve.guards import Guards
from modelica_like.solve.idas import Integrator

_NODES = 4
"""Looks around an interval that its polynomial passes through, with their slopes: degree seven."""
PRECISE = 1.0
"""Difference of two degrees, in tolerances, up to which a polynomial counts as the solution."""


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
        guards: evaluates guards, their rates and slopes of states there.
        times: shape (n + 1,) in s, beginning included.
        x: states, shape (nx, n + 1).
        z: implicit unknowns, shape (nz, n + 1).
        d: modes and discrete values.
    """

    def __init__(
        self, integrator: Integrator, guards: Guards, times: Vector, x: Vector, z: Vector, d: Vector
    ) -> None:
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

    def cell(self, k: int, last: int | None = None) -> Cell | None:
        """Return the interval from look k to the next, nothing if there are too few looks.

        Args:
            k: number.
            last: the last look that means something, because of an event before the next.
        """
        if self.count < _NODES - 1:
            return None
        first = max(min(k - 1, (self.count if last is None else last) - _NODES + 1, self.count - _NODES + 1), 0)
        nodes = slice(first, first + _NODES)
        base = self.x[:, k].copy()
        data = np.concatenate([(self.x[:, nodes] - base[:, None]).T, self.width * self.seen[2][:, nodes].T])
        weights = self.integrator.weights(base)
        return Cell(float(self.times[k]), self.width, k - first, base, data, weights)

    def at(self, t: float, cell: Cell, *, coarse: bool = False) -> Point:
        """Return the point at a time in an interval; the implicit unknowns follow from its states."""
        times, x = np.array([t]), cell.states(t, coarse=coarse)
        z = self._implicit(times, self.intervals(times), x[:, None])
        return Point(t, x, z[:, 0], self.d)

    def along(self, times: Vector, last: int) -> tuple[Vector, Vector, Any]:
        """Return states and implicit unknowns at times, and the intervals in which they are not precise.

        Shapes (nx, n), (nz, n), (intervals,).

        Args:
            times: between the looks, shape (n,).
            last: the last look that means something.
        """
        if self.count < _NODES - 1:
            nothing = np.zeros((len(self.x), len(times)))
            return nothing, np.zeros((len(self.z), len(times))), self.intervals(times)
        k = self.intervals(times)
        first = np.clip(np.minimum(k - 1, max(last, _NODES - 1) - _NODES + 1), 0, self.count - _NODES + 1)
        nodes = first[:, None] + np.arange(_NODES)
        base = self.x[:, k]
        data = np.concatenate([self.x[:, nodes] - base[:, :, None], self.width * self.seen[2][:, nodes]], axis=2)
        powers = ((times - self.times[k]) / self.width + (k - first) - 0.5 * (_NODES - 1))[:, None] ** _POWERS
        precise = powers @ _PRECISE
        coarse = np.einsum("np,npk->nk", powers, _COARSE[k - first])
        x = base + np.einsum("ink,nk->in", data, precise)
        error = np.abs(np.einsum("ink,nk->in", data, precise - coarse)) / self.integrator.weights(base)
        return x, self._implicit(times, k, x), np.unique(k[~np.all(error <= PRECISE, axis=0)])

    def _implicit(self, times: Vector, k: Any, x: Vector) -> Vector:
        if not len(self.z):
            return np.zeros((0, len(times)))
        share = (times - self.times[k]) / self.width
        guess = self.z[:, k] + share * (self.z[:, k + 1] - self.z[:, k])
        return self.integrator.polished(times, x, guess, self.d)
