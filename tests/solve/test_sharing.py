"""How elements that hold the same motion share what they hold."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from components import Clutch, ConstantTorque, Fixed, Inertia
from modelica_like import Assembly, build
from modelica_like.language.holding import UNLIMITED
from modelica_like.native.start import initialize
from modelica_like.solve.initialize.holds import Strike, _capacities, rest


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


@pytest.mark.parametrize("speed", [1000.0, -1000.0])
@pytest.mark.parametrize(("slip", "left"), [(0.9e-7, 0.0), (-0.9e-7, 0.0), (1.1e-7, 1.1e-7), (-1.1e-7, -1.1e-7)])
def test_what_is_held_rests_exactly_where_it_moves_by_rounding_of_the_largest_speed(
    slip: float, left: float, speed: float
) -> None:
    """1e-10 of 1000 rad/s."""
    parts = {
        "a": Inertia(J=1.0, phi=0.0, w=speed),
        "c": Clutch(capacity=5.0, phi_rel=0.0, w_rel=0.0),
        "b": Inertia(J=1.0),
    }
    model = build(Assembly("d", parts=parts, series={"s": list(parts)}))
    point = initialize(model, 0.0, "given")
    state = model.states.index("c.w_rel")
    assert point.x[state] == 0.0
    point.x[state] = slip
    rest(model, point)
    assert point.x[state] == left


def test_what_sticks_in_a_steady_start_shares_by_capacities(start: Any) -> None:
    parts = {"T": ConstantTorque(tau_constant=3.0), "J": Inertia(J=1.0), "g": Fixed()}
    parts |= {"c": Clutch(capacity=5.0), "e": Clutch(capacity=10.0)}
    connect = {"a": ["T.flange", "J.flange_a"], "b": ["J.flange_b", "c.flange_a", "e.flange_a"]}
    connect["h"] = ["c.flange_b", "e.flange_b", "g.flange"]
    found = start(Assembly("held", parts=parts, connect=connect), "steady")
    assert (found["c.mode"], found["e.mode"], found["J.w"]) == ("stuck", "stuck", 0.0)
    assert (found["c.tau"], found["e.tau"]) == pytest.approx((-1.0, -2.0))


def test_speeds_that_are_the_same_but_for_rounding_start_without_slip() -> None:
    assert 0.3 - 3 * 0.1 < 0.0
    parts = {
        "a": Inertia(J=1.0, phi=0.0, w=3 * 0.1),
        "c": Clutch(capacity=5.0, phi_rel=0.0),
        "b": Inertia(J=1.0, w=0.3),
    }
    model = build(Assembly("d", parts=parts, series={"s": list(parts)}))
    assert initialize(model).x[model.states.index("c.w_rel")] == 0.0
