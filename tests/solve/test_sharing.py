"""How elements that hold the same motion share what they hold."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from modelica_like.initialize.holds import Strike, _capacities
from modelica_like.language.hold import UNLIMITED


@pytest.mark.parametrize("unit", [1.0, 1e-3, 7.0])
def test_capacities_that_decide_the_split(unit: float) -> None:
    """The larger of both directions; what nothing limits takes nearly all, what bears nothing nearly nothing."""
    bearable = [[2.0, 5.0], [8.0, 0.0], [0.0, 0.0], [UNLIMITED / unit, 1.0]]
    np.testing.assert_allclose(_capacities(unit * np.array(bearable)), unit * np.array([5.0, 8.0, 8e-3, 8e3]))
    assert _capacities(np.array([[UNLIMITED, UNLIMITED], [0.0, 0.0]])).tolist() == [1e3, 1e-3]


@pytest.mark.parametrize(("t", "instant"), [(0.0, 1e-9), (-1e3, 1e-6)])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_impulse_is_unbearable_beyond_what_can_be_borne_for_an_instant(
    t: float, instant: float, sign: float
) -> None:
    """Ten time resolutions; a reaction in the same direction leaves less of the capacity, one against it more."""
    never = SimpleNamespace(loose=-1)
    model = SimpleNamespace(holds=[SimpleNamespace(loose=0), never, never])
    strike: Any = SimpleNamespace(point=SimpleNamespace(t=t), model=model)

    def unbearable(impulse: float, bears: float, reaction: float, k: int = 0, larger: float = 0.0) -> bool:
        table = np.full((3, 2), np.nan)
        table[:, 0 if sign > 0 else 1] = bears
        return k in Strike._unbearable(strike, table, {k: sign * impulse, 2: larger}, {k: sign * reaction})

    assert unbearable(5.001 * instant, 5.0, 0.0)
    assert not unbearable(4.999 * instant, 5.0, 0.0)
    assert unbearable(2.001 * instant, 5.0, 3.0)
    assert not unbearable(1.999 * instant, 5.0, 3.0)
    assert not unbearable(7.999 * instant, 5.0, -3.0)
    assert unbearable(1e-3 * instant, 5.0, 6.0)
    assert not unbearable(1.0, UNLIMITED, 0.0)
    assert not unbearable(1.0, 5.0, 0.0, k=1)  # it cannot be knocked loose
    assert unbearable(1e-3, 0.0, 0.0, larger=1.0)
    assert not unbearable(1e-15, 0.0, 0.0, larger=-1.0)  # nothing but rounding
