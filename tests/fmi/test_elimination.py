"""Pivots and their order for an LU without exchanges, against elimination with numbers."""

from itertools import pairwise

import numpy as np
import pytest

from components import Gearbox
from modelica_like import Assembly, simulate
from modelica_like.errors import SingularAtStart
from modelica_like.fmi.elimination import BY_MODES, BY_POINT, SURE, lu_pattern


def random_entries(random: np.random.Generator, states: int, size: int) -> list[tuple[int, int]]:
    """A pattern with the diagonals of states and a permutation of the rest."""
    entries = {(k, k) for k in range(states)}
    entries |= {(states + int(row), states + k) for k, row in enumerate(random.permutation(size - states))}
    entries |= {(int(a), int(b)) for a, b in random.integers(size, size=(size, 2))}
    return sorted(entries, key=lambda entry: (entry[1], entry[0]))


def factors(tables: dict[str, tuple[int, ...]]) -> tuple[list[set[int]], list[set[int]]]:
    """Columns of L and of U."""
    columns = [set(tables["rows"][a:b]) for a, b in pairwise(tables["ends"])]
    split = len(columns) - len(tables["column_order"])
    return columns[:split], columns[split:]


@pytest.mark.parametrize("seed", range(30))
def test_what_fills_in_is_in_the_pattern_and_pivots_are_entries(seed):
    random = np.random.default_rng(seed)
    size = int(random.integers(1, 25))
    states = int(random.integers(size + 1))
    entries = random_entries(random, states, size)
    doubts = random.choice([SURE, BY_POINT, BY_MODES], size=len(entries), p=[0.6, 0.3, 0.1])
    tables = lu_pattern(entries, list(map(int, doubts)), states)
    matrix = np.zeros((size, size))
    for row, column in entries:
        matrix[tables["row_place"][row], tables["column_order"].index(column)] = random.normal() + 3 * (row == column)
    lower, upper = factors(tables)
    assert sorted(tables["row_place"]) == sorted(tables["column_order"]) == list(range(size))
    assert np.all(np.diag(matrix) != 0)
    assert len(upper) == size
    assert all(max(rows, default=-1) < min(k, len(lower)) for k, rows in enumerate(upper))
    for k, rows in enumerate(lower):
        assert all(k < row < size for row in rows)
        assert set(k + 1 + np.flatnonzero(matrix[k + 1 :, k])) <= rows
        assert {j for j in range(k + 1, size) if matrix[k, j] != 0} <= {j for j in range(size) if k in upper[j]}
        matrix[k + 1 :] -= np.outer(matrix[k + 1 :, k] / matrix[k, k], matrix[k])


def test_states_keep_their_equations_and_constants_go_before_what_modes_decide():
    """x' = z1, with 0 = z2 - x and 0 = a(mode) z2 + b(mode) z1 + z3, 0 = z1 - z3: constants are the pivots."""
    entries = [(0, 0), (1, 0), (0, 1), (2, 1), (3, 1), (1, 2), (2, 2), (2, 3), (3, 3)]
    doubts = [SURE, SURE, SURE, BY_MODES, SURE, SURE, BY_MODES, SURE, SURE]
    tables = lu_pattern(entries, doubts, 1)
    matched = {tables["row_place"].index(k): column for k, column in enumerate(tables["column_order"])}
    assert matched == {0: 0, 3: 1, 1: 2, 2: 3}
    assert len(factors(tables)[0]) == 4


def test_what_modes_may_make_zero_comes_last():
    entries = [(0, 0), (1, 0), (0, 1), (1, 1), (2, 2)]
    tables = lu_pattern(entries, [SURE, SURE, SURE, BY_MODES, SURE], 1)
    assert tables["column_order"][-1] == 1
    assert len(factors(tables)[0]) == 2


def test_a_chain_fills_in_nothing():
    """Couplings of neighbours only: L and U have what the matrix has."""
    size = 200
    entries = [(row, column) for column in range(size) for row in range(size) if abs(row - column) <= 1]
    tables = lu_pattern(entries, [SURE] * len(entries), size)
    assert [sum(map(len, factor)) for factor in factors(tables)] == [size - 1, size - 1]


def test_equations_that_are_singular_anywhere_are_refused():
    """A gearbox with both shafts on its housing: its torques stand in fewer equations than there are of them."""
    box = Gearbox(ratio=3.0, loss_table=((0.0, 0.96, 0.95, 0.0, 0.0),), c=1e5, d=200.0, b=0.002)
    drive = Assembly("drive", parts={"box": box}, connect={"a": ["box.support", "box.flange_b", "box.flange_a"]})
    with pytest.raises(SingularAtStart, match=r"The Jacobian is singular .*box\.flange_a\.tau"):
        simulate(drive, 0.05, start="rest")
