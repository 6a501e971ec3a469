"""How elements that hold the same motion share what they hold."""

from typing import Any

import pytest

from components import Clutch, ConstantTorque, Fixed, Inertia
from modelica_like import Assembly, build
from modelica_like.native.start import initialize


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
