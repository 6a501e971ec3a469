"""States of a handle, read and set during a run; expected values are closed forms of two inertias and a clutch."""

import numpy as np
import pytest

from modelica_like import Native, build
from modelica_like.errors import NoGradient, ValueOutOfRange
from modelica_like.netlist import loads

J1, J2, TORQUE = 2.0, 3.0, 50.0
CLUTCH = f"""
[parts]
a = {{ is = "Inertia", J = {J1}, phi = 0, w = 10 }}
k = {{ is = "Clutch", capacity = {TORQUE} }}
b = {{ is = "Inertia", J = {J2}, phi = 0, w = 0 }}
[series]
s = ["a", "k", "b"]
"""
SLIDING, STUCK = 5.0, 1.0


@pytest.fixture
def handle() -> Native:
    model = build(loads(CLUTCH))
    assert model.states == ("a.phi", "a.w", "k.phi_rel", "k.w_rel")
    return model.native(outputs=["a.w", "b.w", "k.mode"])


def test_the_same_states_change_nothing(handle: Native) -> None:
    handle.step(0.1)
    expected = [10.0 - TORQUE / J1 * 0.1, TORQUE / J2 * 0.1, SLIDING]
    assert handle.outputs == pytest.approx(expected, rel=1e-9)
    before = handle.states
    handle.states = before
    np.testing.assert_array_equal(handle.states, before)
    assert handle.outputs == pytest.approx(expected, rel=1e-9)
    handle.step(0.15)
    assert handle.outputs == pytest.approx([10.0 - TORQUE / J1 * 0.15, TORQUE / J2 * 0.15, SLIDING], rel=1e-9)


def test_a_run_goes_on_from_states_that_are_set(handle: Native) -> None:
    """It slides on, and sticks when the slip of 20 rad/s is used up; copies are not affected."""
    handle.step(0.1)
    copy = handle.copy()
    handle.states = [0.0, 21.0, 0.0, -20.0]
    assert handle.outputs == pytest.approx([21.0, 1.0, SLIDING])
    stuck = 20.0 / (TORQUE / J1 + TORQUE / J2)
    handle.step(0.1 + 0.5 * stuck)
    assert handle.outputs == pytest.approx(
        [21.0 - TORQUE / J1 * 0.5 * stuck, 1.0 + TORQUE / J2 * 0.5 * stuck, SLIDING], rel=1e-9
    )
    handle.step(0.1 + 2.0 * stuck)
    assert handle.outputs == pytest.approx([(J1 * 21.0 + J2 * 1.0) / (J1 + J2)] * 2 + [STUCK], rel=1e-9)
    handle.restore(copy)
    assert handle.outputs[0] == pytest.approx(10.0 - TORQUE / J1 * 0.1, rel=1e-9)


def test_what_a_mode_holds_is_stopped_with_its_momentum_kept(handle: Native) -> None:
    handle.step(1.0)
    assert handle.outputs == pytest.approx([10.0 * J1 / (J1 + J2)] * 2 + [STUCK], rel=1e-9)
    handle.states = [0.0, 9.0, 0.0, 2.0]
    assert handle.outputs == pytest.approx([(J1 * 9.0 + J2 * 11.0) / (J1 + J2)] * 2 + [STUCK], rel=1e-12)
    assert handle.states[3] == 0.0


def test_wrong_states_are_refused(handle: Native) -> None:
    before = handle.states
    with pytest.raises(ValueOutOfRange, match=r"^There are 4 states, not 3\.$"):
        handle.states = [1.0, 2.0, 3.0]
    with pytest.raises(ValueOutOfRange, match=r"^a\.w cannot be set: the value is not a finite number\.$"):
        handle.states = [0.0, np.nan, 0.0, 0.0]
    np.testing.assert_array_equal(handle.states, before)


def test_a_gradient_ends_where_states_are_set() -> None:
    handle = build(loads(CLUTCH)).native(outputs=["a.w"], by=["a.J"])
    handle.step(0.1)
    assert handle.gradient() == pytest.approx(TORQUE / J1**2 * 0.1, rel=1e-6)
    handle.states = handle.states
    with pytest.raises(NoGradient, match="the states were set"):
        handle.gradient()
