"""Fast calls of CasADi functions: numbers go through fixed buffers instead of being converted argument by argument."""

from __future__ import annotations

from threading import get_ident
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
        self._results = [np.zeros(function.nnz_out(k)) for k in wanted]
        self._buffer, self._evaluate = function.buffer()
        for k, array in enumerate(self._arguments):
            self._buffer.set_arg(k, memoryview(cast(Any, array)))
        for k, array in zip(wanted, self._results, strict=True):
            self._buffer.set_res(k, memoryview(cast(Any, array)))

    def __call__(self, *arguments: Any) -> list[Vector]:
        """Evaluate; arguments and results are flat (columns one after the other)."""
        for array, value in zip(self._arguments, arguments, strict=False):
            array[:] = value
        self._evaluate()
        return [array.copy() for array in self._results]

    def statistics(self) -> dict[str, Any]:
        """Return the statistics of the last call, of a function that keeps some."""
        return dict(self._buffer.stats())


def buffered(cache: dict[Any, Any], key: Any, make: Any, results: tuple[int, ...] | None = None) -> BufferedFunction:
    """Return this thread's buffered function for a key, made from `make()` on first use."""
    own = "buffer", get_ident(), key
    if own not in cache:
        cache[own] = BufferedFunction(make(), results)
    return cache[own]
