"""Which motions depend on each other: sought in parts of the drive, found as from all slopes at once."""

import numpy as np
import pytest

from modelica_like.structure.holds import _cores, _dependent


def _sought(rows: list[dict[int, float]]) -> list[list[int]]:
    """Return the circuits, each as its sorted rows."""
    cores = _cores(rows)
    return sorted([core[k] for k in members] for core in cores for members in _dependent([rows[k] for k in core]))


def test_a_tree_of_clutches_has_no_circuit() -> None:
    rows = [{k // 2: 1.0, k + 1: -1.0} for k in range(200)]
    assert _cores(rows) == []


def test_a_loop_in_a_tree_is_one_circuit() -> None:
    tree = [{k // 2: 1.0, k + 1: -1.0} for k in range(30)]
    assert _sought([*tree, {7: 1.0, 8: -1.0}]) == [[6, 7, 30]]


def test_a_slope_that_rounding_made_keeps_no_motion_apart() -> None:
    assert _sought([{0: 1.0, 1: 1.0}, {0: 2.0, 1: 2.0, 2: 1e-15}]) == [[0, 1]]


@pytest.mark.parametrize("seed", range(20))
def test_parts_give_what_all_slopes_at_once_give(seed: int) -> None:
    random = np.random.default_rng(seed)
    slopes = random.integers(-2, 3, (12, 16)) * (random.random((12, 16)) < 0.2)
    slopes = np.vstack([slopes, slopes[0] + 2 * slopes[1], slopes[4] - slopes[5], 3 * slopes[8]]).astype(float)
    slopes = slopes[np.abs(slopes).sum(axis=1) > 0]
    rows = [{int(k): float(row[k]) for k in np.flatnonzero(row)} for row in slopes]
    assert _sought(rows) == sorted(_dependent(rows))
