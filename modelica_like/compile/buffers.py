"""Fast calls of CasADi functions: numbers go through fixed buffers instead of being converted argument by argument."""

from __future__ import annotations

from typing import Any, cast

import casadi as ca
import numpy as np

Vector = np.ndarray[Any, np.dtype[np.float64]]


class BufferedFunction:
    """A CasADi function with dense arguments and results, called through memory that is allocated once.

    Args:
        function: the function.
        results: which results to compute; all by default.

    One call takes a few microseconds where the ordinary one takes a hundred. Not to be shared between threads.
    """

    def __init__(self, function: ca.Function, results: tuple[int, ...] | None = None) -> None:
        self.function = function
        wanted = range(function.n_out()) if results is None else results
        self._arguments = [np.zeros(function.nnz_in(k)) for k in range(function.n_in())]
        self._filled = [(k, array) for k, array in enumerate(self._arguments) if array.size]
        self._results = [np.zeros(function.nnz_out(k)) for k in wanted]
        self._buffer, self._evaluate = function.buffer()
        self._everywhere: dict[int, Any] = {}
        for k, array in enumerate(self._arguments):
            self._buffer.set_arg(k, memoryview(cast(Any, array)))
        for k, array in zip(wanted, self._results, strict=True):
            self._buffer.set_res(k, memoryview(cast(Any, array)))

    def __call__(self, *arguments: Any) -> list[Vector]:
        """Evaluate; arguments and results are flat (columns one after the other)."""
        for k, array in self._filled:
            array[:] = arguments[k]
        self._evaluate()
        return [array.copy() for array in self._results]

    def latest(self) -> list[Vector]:
        """Return the results of the last call, even if it failed."""
        return [array.copy() for array in self._results]

    def forget(self) -> None:
        """Set all results to nan, to mark those that are never computed."""
        for array in self._results:
            array.fill(np.nan)

    def along(self, points: list[Vector], p: Vector, u: Vector) -> list[Vector]:
        """Evaluate a mapped function at all given points; the rest of the buffer is unused.

        Args:
            points: t, x, z and d of all points, each flat.
            p: parameters, the same at all points.
            u: inputs, likewise.

        Returns:
            Flat results, valid until the next call.
        """
        for k, part in zip((0, 1, 2, 5), points, strict=True):
            self._arguments[k][: len(part)] = part
        for k, part in ((3, p), (4, u)):
            if not np.array_equal(self._everywhere.get(k, ()), part):
                self._arguments[k][:] = np.resize(part, self._arguments[k].shape)
                self._everywhere[k] = part.copy()
        self._evaluate()
        return self._results

    def statistics(self) -> dict[str, Any]:
        """Return the statistics of the last call, if the function has them."""
        return self._buffer.stats()


_BLOCKS = 4096, 512, 64, 8
"""Points per call: many, about as many as a run has results, and the rest."""
_MOST = 2**20
"""Largest count of arguments and results in a block, unless it is of the smallest size: beyond, memory costs time."""
_GROUP, _SMALL = 8, 2000
"""Points whose operations are unrolled, and largest number of operations of one point for this."""


class Along:
    """A CasADi function of (t, x, z, p, u, d) at many points, in blocks of bounded size through fixed buffers.

    Args:
        function: with dense results; arguments without entries are left out.
    """

    def __init__(self, function: ca.Function) -> None:
        # A call costs as much as fifty operations.
        group = _GROUP if function.is_a("SXFunction") and function.n_instructions() <= _SMALL else 1
        self._function = function.map("group", "serial", group, [3, 4], []).expand() if group > 1 else function
        self._group = group
        self.rows = [function.numel_out(k) for k in range(function.n_out())]
        entries = sum(function.nnz_in(k) for k in range(function.n_in())) + sum(self.rows)
        self._blocks = [size for size in _BLOCKS if size * entries <= _MOST or size == _BLOCKS[-1]]
        self._made: dict[int, BufferedFunction] = {}

    def __call__(self, times: Vector, x: Vector, z: Vector, p: Vector, u: Vector, d: Vector) -> list[Vector]:
        """Evaluate at n points; shapes (n,), (nx, n), (nz, n), (np,), (nu,), (nd, n), results (rows, n)."""
        results = [np.empty((rows, len(times))) for rows in self.rows]
        self.into(results, times, x, z, p, u, d)
        return results

    def into(self, results: list[Vector], times: Vector, x: Vector, z: Vector, p: Vector, u: Vector, d: Vector) -> None:
        """Evaluate like a call, into given arrays of shape (rows, n).

        Args:
            results: one array per result.
            times: shape (n,).
            x: shape (nx, n).
            z: shape (nz, n).
            p: shape (np,).
            u: shape (nu,).
            d: shape (nd, n).
        """
        total, first = results[0].shape[1], 0
        for size in self._blocks:
            while total - first > (0.75 * size if size > _BLOCKS[-1] else 0):
                last = min(first + size, total)
                if size not in self._made:
                    self._made[size] = BufferedFunction(self._function.map(size // self._group))
                now = [part[..., first:last].ravel("F") for part in (times, x, z, d)]
                block = self._made[size].along(now, p, u)
                for whole, part in zip(results, block, strict=True):
                    whole[:, first:last] = part.reshape(size, -1).T[:, : last - first]
                first = last
