"""Signals that are read where they have a kink in time, and clocks that tick at the start: sides differ."""

from typing import Any

import numpy as np
import pytest

from modelica_like import sensitivities
from modelica_like.errors import NoGradient
from modelica_like.netlist import loads
from tests.analyse.test_extremes_at_kinks import TABLE

RAMP = """
[parts]
ramp = { is = "Ramp", height = 60, duration = "1 s" }
drive = { is = "Torque" }
J = { is = "Inertia", J = 1, phi = 0, w = 0 }
[series]
a = ["drive", "J"]
[connect]
x = ["ramp.y", "drive.tau"]
[simulate]
until = "1 s"
"""
HELD = """
[parts]
signal = { is = "Constant", k = 5 }
hold = { is = "ZeroOrderHold", period = "0.3 s" }
drive = { is = "Torque" }
rotor = { is = "Inertia", J = 1, phi = 0, w = 0 }
[series]
drive = ["drive", "rotor"]
[connect]
q = ["signal.y", "hold.u"]
h = ["hold.y", "drive.tau"]
[simulate]
until = "1 s"
"""


@pytest.mark.parametrize(("of", "duration"), [("ramp.y", 1.0), ("at(ramp.y, 0.5 s)", 0.5)])
def test_the_end_of_a_ramp_has_a_slope_on_one_side_only(of: str, duration: float) -> None:
    """y is height t/duration for a longer one, and the height for a shorter one."""
    with pytest.raises(NoGradient, match=r"ramp\.stage becomes after exactly"):
        sensitivities(loads(RAMP), of, "ramp.duration", parameters={"ramp.duration": duration})
    height = sensitivities(loads(RAMP), of, "ramp.height", parameters={"ramp.duration": duration})
    np.testing.assert_allclose(height.derivatives, [[1.0]], rtol=1e-9)


def test_what_follows_from_a_ramp_has_one_slope_at_its_end() -> None:
    """w = height (1 - duration/2) for a shorter one, height/(2 duration) for a longer one."""
    found = sensitivities(loads(RAMP), "J.w", ["ramp.duration", "ramp.height"])
    np.testing.assert_allclose(found.derivatives, [[-30.0, 0.5]], rtol=1e-9)


def test_a_row_of_a_table_that_is_reached_when_it_is_read() -> None:
    """y = 10 w t before it, then 10 - 6 (w t - 1); the wheel has the integral of both."""
    with pytest.raises(NoGradient, match=r"at\(tab\.y, 0\.5 s\) is read exactly at a kink"):
        sensitivities(loads(TABLE), "at(tab.y, 0.5 s)", "m.w_fixed")
    of = ["at(tab.y, 0.49 s)", "at(tab.y, 0.51 s)", "at(wheel.w, 0.5 s)"]
    found = sensitivities(loads(TABLE), of, "m.w_fixed")
    np.testing.assert_allclose(found.derivatives[:, 0], [4.9, -3.06, 1.25], rtol=1e-8)


@pytest.mark.parametrize("other", [0.1, 0.25, 0.375, 0.4375, 0.46875, 0.484375, 0.4921875, 0.49609375])
def test_a_kink_that_a_step_ends_at_but_for_rounding(other: float) -> None:
    """The step there has no slope of what follows, however its end is rounded."""
    found = sensitivities(loads(TABLE), [f"at(tab.y, {other} s)", "at(wheel.w, 0.5 s)"], "m.w_fixed")
    np.testing.assert_allclose(found.derivatives[:, 0], [10.0 * other, 1.25], rtol=1e-8)


@pytest.mark.parametrize(
    ("parameters", "slope"), [({"hold.start_time": 0.1}, -5.0), ({"hold.start_time": -0.05}, 0.0), ({"signal.k": 0}, 0)]
)
def test_a_clock_beside_the_start_has_a_slope(parameters: dict[str, Any], slope: float) -> None:
    """The torque begins at the first tick, and not before the run."""
    found = sensitivities(loads(HELD), "rotor.w", "hold.start_time", parameters=parameters)
    assert found.derivatives[0, 0] == pytest.approx(slope, rel=1e-9, abs=1e-12)


def test_a_clock_that_ticks_at_the_start_has_two() -> None:
    with pytest.raises(NoGradient, match=r"hold\.clock\[1\] ticks exactly at the start of the run"):
        sensitivities(loads(HELD), "rotor.w", "hold.start_time")
    found = sensitivities(loads(HELD), "rotor.w")
    assert "ticks exactly at the start" in found.left_out["hold.start_time"]
    assert found["rotor.w", "signal.k"] == pytest.approx(1.0, rel=1e-9)
