"""Independent rows against the rank of matrices."""

from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from modelica_like.structure.matching import Elimination, Matching


def rank(matrix: np.ndarray) -> int:
    return int(np.linalg.matrix_rank(matrix, tol=1e-9)) if matrix.size else 0


@st.composite
def matrices(draw: st.DrawFn) -> np.ndarray:
    """Random numbers at random places: their rank is that of the structure."""
    rows, columns = draw(st.integers(1, 8)), draw(st.integers(1, 7))
    chance = np.random.default_rng(draw(st.integers(0, 2**32)))
    share = draw(st.sampled_from([0.15, 0.25, 0.4, 0.7]))
    numbers = chance.uniform(0.5, 2.0, (rows, columns)) * chance.choice([-1.0, 1.0], (rows, columns))
    return np.where(chance.random((rows, columns)) < share, numbers, 0.0)


def assert_as_by_ranks(choice: Any, matrix: np.ndarray) -> list[int]:
    """Add all rows; return those that were accepted."""
    accepted: list[int] = []
    for number, row in enumerate(matrix):
        new = rank(matrix[[*accepted, number]]) > len(accepted)
        assert choice.add({int(k): float(row[k]) for k in np.flatnonzero(row)}) == new
        accepted += [number] if new else []
        assert choice.size == len(accepted)
    left = [k for k in range(matrix.shape[1]) if rank(np.delete(matrix[accepted], k, 1)) == len(accepted)]
    assert choice.undetermined() == left
    return accepted


@given(matrices())
@settings(deadline=None, max_examples=80)
def test_a_row_is_matched_if_it_raises_the_rank_of_the_structure(matrix: np.ndarray) -> None:
    assert_as_by_ranks(Matching(matrix.shape[1]), matrix)


@given(matrices())
@settings(deadline=None, max_examples=60)
def test_a_row_is_independent_if_it_raises_the_rank(matrix: np.ndarray) -> None:
    assert_as_by_ranks(Elimination(matrix.shape[1]), matrix)


@given(matrices(), st.integers(0, 2**32), st.sampled_from([1e-12, 1.0, 1e12]))
@settings(deadline=None, max_examples=60)
def test_sums_of_rows_depend_on_them_but_for_rounding(matrix: np.ndarray, seed: int, unit: float) -> None:
    """Shares like 0.1 and 0.3 leave rounding where terms cancel; the unit does not matter."""
    chance = np.random.default_rng(seed)
    choice, pivots, accepted = Elimination(matrix.shape[1]), list[int](), list[np.ndarray]()
    for row in matrix:
        if choice.add({int(k): unit * row[k] for k in np.flatnonzero(row)}):
            pivots.append(choice.pivot)
            accepted.append(row)
        for _ in range(2 if accepted else 0):
            shares = chance.choice([0.1, -0.3, 0.7, 1.0, 0.0], len(accepted))
            assert not choice.add({k: float(unit * one) for k, one in enumerate(shares @ np.array(accepted))})
    assert len(set(pivots)) == choice.size
    assert not accepted or rank(np.array(accepted)[:, pivots]) == len(pivots)


def test_a_row_determines_the_column_of_its_largest_entry() -> None:
    choice = Elimination(3)
    assert choice.add({0: 1.0, 1: -3.0, 2: 2.0})
    assert choice.pivot == 1
    assert choice.add({0: 1.0, 1: -3.0, 2: 2.1})
    assert choice.pivot == 2


def test_rounding_is_measured_by_all_terms_of_a_column() -> None:
    """0.5 - 3e8 + (3e8 - 0.1): what is left in the last column is as uncertain as both large terms."""
    choice = Elimination(3)
    assert choice.add({0: 1.0, 2: 0.3e9})
    assert choice.add({1: 1.0, 2: -0.3e9 + 0.1})
    assert not choice.add({0: 1.0, 1: 1.0, 2: 0.5})
    assert choice.add({0: 1.0, 1: 1.0, 2: 3.0})


def test_a_small_independent_row_is_not_rounding() -> None:
    choice = Elimination(2)
    assert choice.add({0: 1.0, 1: 1e-10})
    assert not choice.add({0: 1e-3, 1: 1e-13})
    assert choice.add({0: 1.0})
