"""Whether the equations of a start are far from singular, by condition or, where there are many, by factors."""

import casadi as ca
import numpy as np
import pytest

from modelica_like.solve.initialize.plan import _DENSE, _regular


def regular(matrix: np.ndarray) -> bool:
    sparse = ca.sparsify(ca.DM(matrix))
    return _regular(sparse, np.array(sparse.nonzeros()))


@pytest.mark.parametrize("size", [4, _DENSE + 20])
def test_what_is_far_from_singular(size: int) -> None:
    chain = 2 * np.eye(size) - np.eye(size, k=1) - np.eye(size, k=-1)
    last = np.eye(size)[-1]
    assert regular(np.eye(size))
    assert regular(-np.eye(size))
    assert regular(np.diag((-1.0) ** np.arange(size)))
    assert regular(chain)
    assert regular(10.0 ** np.linspace(-9, 9, size)[:, None] * chain)  # rows have units of their own
    loop = chain.copy()
    loop[0, 0] = loop[-1, -1] = 1.0  # what all unknowns have in common is open
    assert not regular(loop)
    assert not regular(loop + 1e-13 * np.outer(last, last))
    assert regular(loop + 1e-2 * np.outer(last, last))
    assert not regular(chain * (1 - np.outer(last, np.ones(size))))  # an equation without unknowns
    assert not regular(chain * (1 - np.outer(np.ones(size), last)))  # an unknown without equations
    assert not regular(np.where(np.eye(size) > 0, np.inf, chain))


def test_a_row_of_stored_zeros_has_no_unknowns() -> None:
    stored = ca.DM(ca.Sparsity.dense(4, 4), np.diag([1.0, 1.0, 1.0, 0.0]).ravel())
    assert not _regular(stored, np.array(stored.nonzeros()))


def test_few_equations_are_judged_by_their_condition() -> None:
    """Ones on the diagonal of the factor, and yet 2^n of the last unknown make no difference to the equations."""
    assert not regular(np.eye(60) - np.triu(np.ones((60, 60)), 1))
    assert regular(np.eye(8) - np.triu(np.ones((8, 8)), 1))
