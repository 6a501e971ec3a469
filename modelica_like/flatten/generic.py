"""Generic points: numbers for what no graph shows, such as a rank or whether two branches meet.

Whether an expression is linear, or constant, is read off its graph. What is left takes points from here, the same ones
in every run: from one generator with one seed, so that no two values are equal and none is special.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

Matrix = NDArray[np.float64]

_DECADES = 5.0
_PAIRS = 240
_HALVINGS = 45
_MEETS = 1e-6
"""Gap of branches that meet, over their gap away from the border; that of a root is 2e-7 at 2^-45 of the way."""

_ROUNDING = 1e-13


def spread(low: float, high: float, shape: int | tuple[int, ...]) -> Matrix:
    """Return numbers between two bounds, no two of them equal."""
    return np.random.default_rng(1).uniform(low, high, shape)


def pairs(variables: int, constants: int, modes: Sequence[int]) -> tuple[Matrix, Matrix]:
    """Return points of columns (variables, constants, modes), and a second point for each of them.

    Variables have both signs and sizes over ten decades, most of them near one, but alike in one point: a law may
    change at any size, and no sum may lose its smaller terms. In the second point all of them are others, or a single
    one is zero, or opposite: what happens beside zero is between the two. Constants are near one, because most are
    positive. Modes are whole numbers, of which `modes` says how many there are.
    """
    count = _PAIRS * max(modes, default=1)
    step = np.repeat(np.linspace(-1.0, 1.0, count // 3), 3)
    sizes = 10.0 ** (_DECADES * step * abs(step))
    chance = spread(-1.0, 1.0, (2 * variables + constants + len(modes), count))
    first, second = chance[:variables] * sizes, chance[variables : 2 * variables] * sizes
    columns = np.arange(count)
    kinds, single = columns % 3, columns[columns % 3 > 0] if variables else columns[:0]
    second[:, single] = first[:, single]
    second[single // 3 % max(variables, 1), single] *= 1 - kinds[single]
    fixed = 1.25 + 0.75 * chance[2 * variables : 2 * variables + constants]
    numbers = np.floor(0.5 * (1.0 + chance[2 * variables + constants :]) * np.reshape(modes, (-1, 1)))
    return np.vstack([first, fixed, numbers]), np.vstack([second, fixed, numbers])


def meets(
    step: Callable[[Matrix], tuple[Matrix, Matrix]],
    gap: Callable[[Matrix, Matrix, Matrix], tuple[Matrix, Matrix]],
    between: tuple[Matrix, Matrix],
) -> bool:
    """Return whether an expression goes on without a jump where a step changes its value; false if no point shows it.

    Args:
        step: value of the step in every column of a matrix of points, and what it is taken of.
        gap: amount by which the expression differs, in every column, between two values of the step, and its own one.
        between: as of `pairs`; the border is looked for between the points of every pair.
    """
    low, high = between
    (below, first), (above, last) = step(low), step(high)
    crossed = np.isfinite(first) & np.isfinite(last) & (below != above)
    if not crossed.any():
        return False
    low, high, below, first, last = (point[..., crossed] for point in (low, high, below, first, last))
    ends = low, high
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        stays = step(middle)[0] == below
        low, high = np.where(stays, middle, low), np.where(stays, high, middle)
    (_, before), (above, after) = step(low), step(high)
    # Where a branch is undefined beyond its border, the other end tells its size.
    sizes = np.fmax(*(gap(end, below, above)[0] for end in ends))
    gaps, amounts = (np.fmin(*both) for both in zip(gap(low, below, above), gap(high, below, above), strict=True))
    # Where what it is taken of jumps itself, the other step decides.
    reached = abs(after - before) <= _MEETS * np.fmax(abs(first), abs(last))
    shown = reached & np.isfinite(gaps) & np.isfinite(sizes)
    return bool((sizes[shown] > 0.0).any() and (gaps <= _MEETS * sizes + _ROUNDING * amounts)[shown].all())
