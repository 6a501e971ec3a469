"""Rules of high order over the results of a run, for each interval between two of them."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from modelica_like.compile.compiled import Vector

Places = np.ndarray[Any, np.dtype[Any]]
"""Positions of results or intervals, or which of them are meant."""
_WIDTH = 8
"""Results of the widest rule; its order."""
_ORDERS = 0, 2, 4
"""By how much the orders of the rules are lower."""
_UNIFORM, _ROUNDING = 1e-9, 1e-15


def rules(times: Vector, first: Places, last: Places) -> tuple[Places, Places, Vector]:
    """Return three rules of falling order for each interval that takes time.

    Args:
        times: of results, in smooth pieces, shape (n,).
        first: the first result of the piece each one belongs to, shape (n,).
        last: its last result, shape (n,).

    Returns:
        The m intervals by the result before; the results that count for each, shape (m, 8); their weights, in s, shape
        (m, 3, 8).
    """
    steps = np.diff(times, append=times[-1])
    k = np.flatnonzero((np.arange(len(times)) < last) & (steps > 0))
    first, last = first[k], last[k]
    sizes = np.minimum(last - first + 1, _WIDTH)
    starts = np.clip(k - (sizes - 1) // 2, first, last + 1 - sizes)
    places = np.minimum(starts[:, None] + np.arange(_WIDTH), last[:, None])
    offsets = k - starts
    weights = _equidistant()[sizes, offsets]
    # Times are rounded themselves.
    uneven = np.abs(np.diff(steps)) > _UNIFORM * steps[:-1] + _ROUNDING * np.abs(times[:-1])
    before = np.append(0, np.cumsum(uneven))
    odd = np.flatnonzero(before[np.maximum(starts + sizes - 2, starts)] != before[starts])
    kinds = sizes[odd] * _WIDTH + offsets[odd]
    for kind in np.flatnonzero(np.bincount(kinds)):
        those = odd[kinds == kind]
        size, offset = divmod(int(kind), _WIDTH)
        now = times[places[those, :size]] - times[k[those]][:, None]
        weights[those] = _rules(now / steps[k[those]][:, None], offset)
    return k, places, weights * steps[k][:, None, None]


@cache
def _equidistant() -> Vector:
    """Weights over equidistant results, by their number and the place of the interval among them."""
    table = np.zeros((_WIDTH + 1, _WIDTH, len(_ORDERS), _WIDTH))
    for size in range(2, _WIDTH + 1):
        for offset in range(size - 1):
            table[size, offset] = _rules(np.arange(float(size))[None, :] - offset, offset)[0]
    return table


def _rules(places: Vector, offset: int) -> Vector:
    """Weights of integrals from 0 to 1, which lies behind place `offset`; shapes (m, size), (m, 3, 8)."""
    size = places.shape[1]
    found = np.zeros((len(places), len(_ORDERS), _WIDTH))
    for k, less in enumerate(_ORDERS):
        fewer = max(size - less, 1)
        start = min(max(offset - (fewer - 1) // 2, 0), size - fewer)
        found[:, k, start : start + fewer] = _weights(places[:, start : start + fewer])
    return found


def _weights(places: Vector) -> Vector:
    """Weights of the integral from 0 to 1 of the polynomials through values at some places; shapes (m, size)."""
    powers = np.arange(places.shape[1])
    scale = np.maximum(np.max(np.abs(places), axis=1, keepdims=True), 1.0)
    moments = scale**-powers / (powers + 1.0)
    return np.linalg.solve((places / scale)[:, None, :] ** powers[None, :, None], moments[:, :, None])[:, :, 0]
