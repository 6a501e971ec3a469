"""Systems of equations of the sizing functions: numbers without a unique solution are refused in one sentence."""

import math

import pytest

from components.sizing.maths import solve


@pytest.mark.parametrize("other", [1e-9, 1.0, 1e9])
@pytest.mark.parametrize("size", [1e-150, 1e-9, 1.0, 1e150])
def test_units_of_the_equations_do_not_matter(size: float, other: float) -> None:
    """2·x + y = 5, x - y = 1, each times any size."""
    second = size * other
    assert solve([[2 * size, size], [second, -second]], [5 * size, second]) == pytest.approx([2.0, 1.0])


@pytest.mark.parametrize("rows", [
    [[0.0, 0.0], [0.0, 0.0]], [[1.0, 2.0], [2.0, 4.0]], [[math.nan, 1.0], [1.0, 2.0]], [[math.inf, 1.0], [1.0, 2.0]],
])  # fmt: skip
def test_without_a_unique_solution(rows: list[list[float]]) -> None:
    with pytest.raises(ValueError, match=r"^The equations have no unique solution\.$"):
        solve(rows, [1.0, 1.0])
