"""Interpolation of states between the looks of one IDAS call, as precise as the call itself."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import Any

import numpy as np

from modelica_like.compile.compiled import Vector
from modelica_like.solve.guards import Ends, Guards
from modelica_like.solve.idas import POLISHED, Integrator
from modelica_like.solve.initialize import Point

PRECISE = 1.0
"""Difference of two degrees, in tolerances, below which a polynomial counts as the solution."""
_SHARP = 1e-4
"""Difference of a guard by two degrees, relative to its values at both looks, below which it is located."""
_TERMS = 8
_ROUNDING = 1e-12
_FEWEST = 4
"""Smallest useful number of looks between two others."""
EXPONENTS = np.arange(float(_TERMS))


class Scheme:
    """A polynomial of degree seven through looks around an interval, and one of degree five to estimate its precision.

    Args:
        nodes: number of looks.
        slopes: whether it also uses slopes. They make it much more precise, unless the equations are stiff: then
            slopes amplify errors of the states.
    """

    def __init__(self, nodes: int, *, slopes: bool) -> None:
        self.nodes, self.slopes = nodes, slopes
        fewer = nodes - (1 if slopes else 2)
        cells = range(nodes - 1)
        starts = [min(max(cell - (fewer - 1) // 2, 0), nodes - fewer) for cell in cells]
        self.precise = np.array([self._basis(0, nodes, cell) for cell in cells])
        self.coarse = np.array([self._basis(start, fewer, cell) for start, cell in zip(starts, cells, strict=True)])
        # The middle is representative of the interval: near a look both agree with it, even with a wrong slope.
        self.middle = 0.5**EXPONENTS @ np.stack([self.precise, self.coarse], axis=1)
        self.doubt = self.middle[:, 0] - self.middle[:, 1]

    def _basis(self, first: int, count: int, cell: int) -> Vector:
        """Coefficients of each datum, in powers of the passed share of a cell; (powers, data).

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

    def first(self, k: Any, last: Any) -> Any:
        """Return the first look of the polynomials for intervals k, if possible none behind look `last`."""
        return np.maximum(np.minimum(k - (self.nodes // 2 - 1), last - self.nodes + 1), 0)


SCHEMES = Scheme(4, slopes=True), Scheme(8, slopes=False)


class Cell:
    """The interval between two looks.

    Args:
        scheme: of the interpolation.
        t: time of its beginning in s.
        width: its length in s.
        k: its number among the looks.
        number: its place among the intervals of the polynomial.
        base: states at its beginning, shape (nx,).
        data: values relative to `base`, and perhaps slopes times `width`, shape (8, nx).

    Attributes:
        middle: weights of the data in the states in its middle by the polynomials of both degrees, shape (2, 8).
    """

    def __init__(self, scheme: Scheme, t: float, width: float, k: int, number: int, base: Vector, data: Vector) -> None:
        self.t, self.width, self.k, self.base, self.data = t, width, k, base, data
        self._precise, self.middle = scheme.precise[number] @ data, scheme.middle[number]

    def states(self, t: float) -> Vector:
        """Return the states at a time in it, by the polynomial of degree seven; shape (nx,)."""
        if t <= self.t:
            return self.base.copy()
        return self.base + ((t - self.t) / self.width) ** EXPONENTS @ self._precise


class Looks:
    """Results of one IDAS call: equidistant points of a smooth piece.

    Args:
        integrator: of these points.
        guards: evaluates guards, their rates and slopes of states there.
        times: shape (n + 1,) in s, beginning included.
        x: states, shape (nx, n + 1).
        z: implicit unknowns, shape (nz, n + 1).
        d: modes and discrete values.
        all: complete looks, of which these are a regular part.
    """

    def __init__(
        self, integrator: Integrator, guards: Guards, times: Vector, x: Vector, z: Vector, d: Vector,
        all: Looks | None = None,
    ) -> None:  # fmt: skip
        self.integrator, self.guards, self.times, self.x, self.z, self.d = integrator, guards, times, x, z, d
        self.count = len(times) - 1
        self.span = float(times[-1] - times[0])
        self.width = self.span / self.count
        self._all = all
        self.closer: dict[int, Looks] = {}

    def every(self, stride: int) -> Looks:
        """Return looks with a multiple of the distance and polished implicit unknowns."""
        if stride == 1 and not len(self.z):
            return self
        return self._some(slice(None, None, stride), self if stride >= _FEWEST else None)

    def within(self, k: int) -> Looks | None:
        """Return the skipped looks between look k and the next, if there are enough."""
        if self._all is None:
            return None
        stride = self._all.count // self.count
        return self._all._some(slice(k * stride, (k + 1) * stride + 1))

    def _some(self, which: slice, all: Looks | None = None) -> Looks:
        times, x, z = self.times[which].copy(), self.x[:, which], self.z[:, which]
        if len(z):
            z = np.concatenate([z[:, :1], self.integrator.polished(times[1:], x[:, 1:], z[:, 1:], self.d)], axis=1)
        return Looks(self.integrator, self.guards, times, x, z, self.d, all)

    @property
    def numbers(self) -> int:
        """Count of the states at all looks."""
        return (self._all or self).x.size

    @cached_property
    def seen(self) -> tuple[Vector, Vector, Vector]:
        """Guards, their rates and derivatives of the states at the looks; shapes (guards, n + 1), …, (nx, n + 1)."""
        return self.guards.along(self.times, self.x, self.z, self.d)

    def point(self, k: int) -> Point:
        """Return one look."""
        return Point(float(self.times[k]), self.x[:, k].copy(), self.z[:, k].copy(), self.d)

    def intervals(self, times: Vector) -> Any:
        """Return the numbers of the intervals of times."""
        return np.minimum(((times - self.times[0]) / self.width).astype(int), self.count - 1)

    def cells(self, k: int, last: int) -> Iterator[Cell]:
        """Yield the interval from look k to the next, interpolated in several ways; none if there are too few looks.

        Args:
            k: number.
            last: the last valid look, because of an event before the next.
        """
        base = self.x[:, k].copy()
        for scheme in SCHEMES:
            if scheme.nodes > self.count + 1:
                continue
            first = max(min(k - scheme.nodes // 2, max(last - scheme.nodes, -1)) + 1, 0)
            nodes = slice(first, first + scheme.nodes)
            data = (self.x[:, nodes] - base[:, None]).T
            if scheme.slopes:
                data = np.concatenate([data, self.width * self.seen[2][:, nodes].T])
            yield Cell(scheme, float(self.times[k]), self.width, k, k - first, base, data)

    def at(self, t: float, cell: Cell) -> tuple[Point, list[Vector]]:
        """Return the point at a time in an interval, and the guards there; implicit unknowns follow from the states."""
        x = cell.states(t)
        point = Point(t, x, self._guess(t, cell), self.d)
        if not len(self.z):
            return point, self.guards.at(point)
        *guards, before = self.guards.follow(point)
        if not (np.abs(point.z - before) <= POLISHED * (1.0 + np.abs(point.z))).all():
            point.z = self.integrator.polished(np.array([t]), x[:, None], before[:, None], self.d)[:, 0]
            guards = self.guards.at(point)
        return point, guards

    def _guess(self, t: float, cell: Cell) -> Vector:
        if not len(self.z):
            return self.z[:, 0]
        begin, end = self.z[:, cell.k], self.z[:, cell.k + 1]
        return begin + (t - cell.t) / cell.width * (end - begin)

    def is_precise(self, cell: Cell) -> bool:
        """Whether interpolated states in the middle of an interval are within the tolerances."""
        precise, coarse = cell.base + cell.middle @ cell.data
        return bool((np.abs(precise - coarse) <= PRECISE * self.integrator.weights(precise)).all())

    def is_sharp(self, cell: Cell, ends: Ends, *, fresh: bool) -> bool:
        """Whether interpolated states in the middle are precise, and precise enough for guards with these values.

        A guard may depend on states that are small compared with their tolerances: it is trusted only if the
        integrator has just started (`fresh`).
        """
        t, tolerances = cell.t + 0.5 * cell.width, self.integrator.tolerances
        guess = self._guess(t, cell)
        doubt, rough, moved = self.guards.near(t, cell.base, cell.data, cell.middle, tolerances, guess, self.d)
        if doubt > PRECISE:
            return False
        sizes = [(g, abs(g0) + abs(g1)) for g, (g0, g1, *_) in ends.items()]
        return all(rough[g] <= _SHARP * size and (fresh or moved[g] <= size) for g, size in sizes)
