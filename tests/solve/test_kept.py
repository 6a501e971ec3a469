"""Quantities that equilibrium leaves open, against null spaces and ranks."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from fakes import fake_model
from numpy.linalg import matrix_rank
from scipy.linalg import null_space

from modelica_like.solve.initialize import kept
from modelica_like.solve.initialize.kept import Kept, find_kept, solve_kept

MOTIONS = (5, 2, 7, 0, 3, 6, 1, 4)
"""The variable of every held motion."""
POINT: Any = SimpleNamespace()
SCALES = [1.0, 1e-14, 1e14]


@pytest.fixture
def find(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Find what is kept where the held motions, all but the first one, have given slopes and values."""
    model: Any = fake_model(motions=[SimpleNamespace(motion=one) for one in MOTIONS], variables=SimpleNamespace())

    def found(slopes: np.ndarray, values: np.ndarray, states: list[int], jacobian: np.ndarray) -> Kept:
        def holding(*given: Any) -> list[int]:
            assert given == (model, POINT)
            return list(range(1, len(MOTIONS)))

        def variable_slopes(owner: Any, point: Any, nodes: list[int]) -> np.ndarray:
            assert (owner, point) == (model, POINT)
            return slopes[nodes]

        def call(*given: Any) -> np.ndarray:
            assert given == (model, model.equations.variables, POINT)
            return values

        for one in (holding, variable_slopes, call):
            monkeypatch.setattr(kept, one.__name__, one)
        return find_kept(model, POINT, states, jacobian)

    return found


def singular(r: np.random.Generator, size: int) -> np.ndarray:
    """A square matrix of small numbers, of any rank."""
    rank = int(r.integers(0, size + 1))
    return (r.integers(-3, 4, (size, rank)) @ r.integers(-3, 4, (rank, size))).astype(float)


@pytest.mark.parametrize("scale", SCALES)
def test_a_held_motion_is_kept_if_it_is_conserved_and_no_combination_of_earlier_ones(find: Any, scale: float) -> None:
    r = np.random.default_rng(1)
    for _ in range(60):
        count = int(r.integers(1, 6))
        jacobian = singular(r, count + int(r.integers(0, 3)))
        states = r.permutation(8)[:count].tolist()
        conserved = null_space(jacobian.T).T[:, :count]
        slopes, values = r.integers(-1, 2, (8, 8)).astype(float), r.normal(size=8)
        for k in r.permutation(8)[:5]:  # zero where nothing is conserved
            slopes[k, states] = r.integers(-1, 2, len(conserved)) @ conserved
        rows: list[np.ndarray] = []
        held: list[int] = []
        for k in MOTIONS[1:]:
            row = slopes[k, states]
            inside = matrix_rank([*conserved, row], 1e-9) == matrix_rank(conserved, 1e-9) if len(conserved) else False
            if inside and matrix_rank([*rows, row], 1e-9) > len(rows):
                rows.append(row)
                held.append(k)
        found = find(slopes, values, states, scale * jacobian)
        assert found.held == tuple(held)
        np.testing.assert_array_equal(found.missing, -values[held])
        np.testing.assert_array_equal(found.rows[: len(held)], np.reshape(rows, (-1, count)))
        others = found.rows[len(held) :]
        np.testing.assert_allclose(others @ np.vstack([found.rows[: len(held)], others]).T,
                                   np.eye(len(others), len(found.rows), len(held)), atol=1e-9)  # fmt: skip
        rank = matrix_rank(conserved, 1e-9) if len(conserved) else 0
        assert len(found.rows) == rank
        assert matrix_rank(np.vstack([found.rows, conserved]), 1e-9) == rank if rank else True


@pytest.mark.parametrize("columns", [(), (2,)])
@pytest.mark.parametrize("scale", SCALES)
def test_held_motions_change_as_asked_and_other_conserved_quantities_do_not(scale: float, columns: Any) -> None:
    r = np.random.default_rng(2)
    for _ in range(40):
        count, other = int(r.integers(1, 6)), int(r.integers(0, 3))
        size = count + other
        rank = int(r.integers(other, size + 1))
        conserved = r.normal(size=(size - rank, count))
        jacobian = r.normal(size=(size, rank)) @ r.normal(size=(rank, size))
        held = int(r.integers(0, len(conserved) + 1))
        wanted = r.normal(size=(size, *columns))
        moved = np.linalg.lstsq(conserved[held:], conserved[held:] @ wanted[:count], rcond=None)[0]
        wanted[:count] -= moved
        given = Kept(tuple(range(held)), np.zeros(held), conserved)
        found = solve_kept(given, scale * jacobian, scale * (jacobian @ wanted), conserved[:held] @ wanted[:count])
        np.testing.assert_allclose(found, wanted, rtol=1e-6, atol=1e-8)


def test_without_equations_only_what_is_held_changes() -> None:
    given = Kept((0,), np.zeros(1), np.array([[1.0, 1.0], [1.0, -1.0]]))
    np.testing.assert_allclose(solve_kept(given, np.zeros((2, 2)), np.zeros(2), np.array([3.0])), [1.5, 1.5])
