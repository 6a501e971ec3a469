"""Rules of high order over the results of a run, for each interval between two of them."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from modelica_like.compile.compiled import Vector

Places = np.ndarray[Any, np.dtype[Any]]
"""Positions of results or intervals, or a mask."""
_WIDTH = 8
"""Results of the widest rule; its order."""
_MIDDLE = (_WIDTH - 1) // 2
"""Results before an interval in the middle of its rule."""
_ORDERS = np.array([0, 2, 4])
"""Reductions of the orders of the rules."""
_UNIFORM, _ROUNDING = 1e-9, 1e-15
_POINTS = 0.5 + np.sqrt((15 + np.array([2, -2, -2, 2]) * np.sqrt(30.0)) / 140) * [-1, -1, 1, 1]
_SHARES = 0.25 + np.sqrt(30.0) / 72 * np.array([-1, 1, 1, -1])
"""Gauss' rule in [0, 1]."""
_OTHERS = ~np.eye(_WIDTH, dtype=bool)[:, :, None, None]


def rules(times: Vector, first: Places, last: Places) -> tuple[Places, Places, Vector]:
    """Return three rules of decreasing order for each interval of nonzero length.

    Args:
        times: of results, in smooth pieces, shape (n,).
        first: the first result of the piece each one belongs to, shape (n,).
        last: its last result, shape (n,).

    Returns:
        The m intervals by the result before; the results for each, shape (m, 8); their weights, in s, shape (m, 3,
        8).
    """
    steps = _steps(times)
    k = ((np.arange(len(times)) < last) & (steps > 0)).nonzero()[0]
    return k, *_rules_of(k, times, steps, first, last, _uneven(times, steps))


def composite(times: Vector, first: Places, last: Places) -> Vector:
    """Return the weights of all results in the integral over all pieces by the rule of the highest order, in s.

    Args:
        times: of results, in smooth pieces, shape (n,).
        first: the first result of the piece each one belongs to, shape (n,).
        last: its last result, shape (n,).
    """
    count, steps = len(times), _steps(times)
    uneven, places, reach = _uneven(times, steps), np.arange(count), _WIDTH - 1 - _MIDDLE
    # In the middle of equal steps all intervals have one rule.
    inner = (places - _MIDDLE >= first) & (places + reach <= last)
    inner[_MIDDLE : count - reach] &= uneven[_WIDTH - 2 : -1] == uneven[: 1 - _WIDTH]
    weights = np.convolve(np.where(inner, steps, 0.0), _equidistant()[_WIDTH, _MIDDLE, 0])
    weights = weights[_MIDDLE : _MIDDLE + count]
    k = ((places < last) & (steps > 0) & ~inner).nonzero()[0]
    those, rest = _rules_of(k, times, steps, first, last, uneven)
    weights += np.bincount(those.ravel(), rest[:, 0].ravel(), count)
    return weights


def _steps(times: Vector) -> Vector:
    return np.append(times[1:] - times[:-1], 0.0)


def _uneven(times: Vector, steps: Vector) -> Places:
    """Return how many steps before each result differ from the step before them."""
    # Times have rounding errors.
    uneven = np.abs(steps[1:] - steps[:-1]) > _UNIFORM * steps[:-1] + _ROUNDING * np.abs(times[:-1])
    return np.concatenate([[0], uneven.cumsum()])


def _rules_of(
    k: Places, times: Vector, steps: Vector, first: Places, last: Places, uneven: Places
) -> tuple[Places, Vector]:
    """Return results and weights of the rules of some intervals, as `rules` does."""
    first, last = first[k], last[k]
    sizes = np.minimum(last - first + 1, _WIDTH)
    starts = np.clip(k - (sizes - 1) // 2, first, last + 1 - sizes)
    places = np.minimum(starts[:, None] + np.arange(_WIDTH), last[:, None])
    offsets = k - starts
    weights = _equidistant()[sizes, offsets]
    odd = (uneven[np.maximum(starts + sizes - 2, starts)] != uneven[starts]).nonzero()[0]
    now = (times[places[odd]] - times[k[odd]][:, None]) / steps[k[odd]][:, None]
    weights[odd] = _rules(now, sizes[odd], offsets[odd])
    return places, weights * steps[k][:, None, None]


@cache
def _equidistant() -> Vector:
    """Weights over equidistant results, by their number and the place of the interval among them."""
    sizes, offsets = (part.ravel() for part in np.indices((_WIDTH + 1, _WIDTH)))
    those = offsets < sizes - 1
    table = np.zeros((len(those), len(_ORDERS), _WIDTH))
    table[those] = _rules(np.arange(float(_WIDTH)) - offsets[those, None], sizes[those], offsets[those])
    return table.reshape(_WIDTH + 1, _WIDTH, len(_ORDERS), _WIDTH)


def _rules(places: Vector, sizes: Places, offsets: Places) -> Vector:
    """Weights of integrals from 0 to 1 over the first `sizes` places, of which `offsets` is 0; (m, 8), (m, 3, 8).

    They integrate Lagrange's polynomials by Gauss' rule, which is exact for them; its points are no places.
    """
    fewer = np.maximum(sizes - _ORDERS[:, None], 1)
    starts = np.clip(offsets - (fewer - 1) // 2, 0, sizes - fewer)
    # The longest axis is the last one.
    passed, places = np.arange(_WIDTH)[:, None, None] - starts, places.T.copy()
    used = (passed >= 0) & (passed < fewer)
    away = _POINTS[:, None] - places[:, None]
    products = np.where(used[:, :, None], away[:, None], 1.0).prod(axis=0)
    others = used[:, None] & used & _OTHERS
    scales = np.where(others, (places - places[:, None])[:, :, None], 1.0).prod(axis=0)
    integrals = (_SHARES[:, None] * products / away[:, None]).sum(axis=2)
    return np.where(used, integrals / scales, 0.0).transpose(2, 1, 0)
