"""How elements that hold the same motion share what they hold."""

import numpy as np
import pytest

from modelica_like.initialize.holds import _capacities
from modelica_like.language.hold import UNLIMITED


@pytest.mark.parametrize("unit", [1.0, 1e-3, 7.0])
def test_capacities_that_decide_the_split(unit: float) -> None:
    """The larger of both directions; what nothing limits takes nearly all, what bears nothing nearly nothing."""
    bearable = [[2.0, 5.0], [8.0, 0.0], [0.0, 0.0], [UNLIMITED / unit, 1.0]]
    np.testing.assert_allclose(_capacities(unit * np.array(bearable)), unit * np.array([5.0, 8.0, 8e-3, 8e3]))
    assert _capacities(np.array([[UNLIMITED, UNLIMITED], [0.0, 0.0]])).tolist() == [1e3, 1e-3]
