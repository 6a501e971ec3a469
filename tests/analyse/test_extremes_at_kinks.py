"""Extremes at kinks without an event: the kink moves, and the rate beside it is not zero."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from components import ConstantSpeed, ConstantTorque, Damper, Fixed, Inertia
from modelica_like import Assembly, build, load, sensitivities, simulate
from modelica_like.errors import NoGradient
from modelica_like.netlist import loads

PRESS = Path(__file__).parents[2] / "examples/elements/press.toml"
RUN: dict[str, Any] = {"until": 0.25, "solver": "native", "start": "rest"}
METHODS = ("forward", "adjoint")
ANGLE, SIZE = "J.phi/(1 rad)", "J.J/(1 kg.m2)"
TABLE = """
[parts]
m = { is = "ConstantSpeed", w_fixed = 2, phi = 0 }
J = { is = "Inertia", J = 1 }
angle = { is = "AngleSensor" }
tab = { is = "Table1D", table = [[0, 0], [1, 10], [2, 4]] }
drive = { is = "Torque" }
wheel = { is = "Inertia", J = 1, phi = 0, w = 0 }
[series]
a = ["m", "J", "angle"]
b = ["drive", "wheel"]
[connect]
q = ["angle.phi", "tab.u"]
r = ["tab.y", "drive.tau"]
[simulate]
until = "0.9 s"
"""


def turning() -> Assembly:
    parts = {"motor": ConstantSpeed(w_fixed=2.0, phi=0.0), "J": Inertia(J=1.1)}
    return Assembly("turning", parts=parts, series={"shaft": [*parts]})


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("of", ["max(tab.y)", f"max(tab.y + {ANGLE})", "min(-tab.y)", "peak(drive.flange.tau)"])
def test_the_top_of_a_table_does_not_depend_on_how_fast_it_is_passed(of: str, method: Any) -> None:
    found = sensitivities(loads(TABLE), of, "m.w_fixed", method=method)
    assert abs(found.derivatives[0, 0]) < 1e-8


@pytest.mark.parametrize("method", METHODS)
def test_kinks_of_what_is_read(method: Any) -> None:
    """At the angle J: y = J (1 + w/4), (1 - w²) J and J, so rates of the angle before it are no part of these."""
    of = [
        f"max({ANGLE} + {SIZE}*motor.w_fixed/(4 rad/s) - 2*abs({ANGLE} - {SIZE}))",
        f"min(3*abs({ANGLE} - {SIZE}) + {ANGLE} - {SIZE}*(motor.w_fixed/(1 rad/s))**2)",
        f"peak(3*abs({ANGLE} - {SIZE}) + {ANGLE} - {SIZE}*(motor.w_fixed/(1 rad/s))**2)",
    ]
    found = sensitivities(turning(), of, ["J.J", "motor.w_fixed"], until=0.9, method=method)
    np.testing.assert_allclose(found.derivatives, [[1.5, 1.1 / 4], [-3.0, -4.4], [3.0, 4.4]], rtol=1e-7)


def test_kinks_that_meet_and_move_differently_are_refused() -> None:
    """It is 1 - J/2 for a larger J, and J - 1/2 for a smaller one."""
    of = f"max({ANGLE}/2 - abs({ANGLE} - {SIZE}) - abs({ANGLE} - 1))"
    drive = {"until": 0.9, "parameters": {"J.J": 1.0}}
    with pytest.raises(NoGradient, match=r"at t = 0\.5 s.*\n.*Kinks that move differently"):
        sensitivities(turning(), of, "J.J", **drive)  # type: ignore[arg-type]


def test_a_press_that_reaches_a_breakpoint_of_its_force() -> None:
    """By differences of runs a hundred times as precise as they are wide."""
    of, by, width = "peak(crank.flange_t.f)", "workpiece.s_scale", 1e-4
    press = build(load(str(PRESS)))
    sides = [
        float(simulate(press, rtol=1e-11, parameters={by: 1.0 + change}, readings=[of], **RUN).readings[of])
        for change in (-width, width)
    ]
    found = sensitivities(str(PRESS), of, by)
    assert found[of, by] == pytest.approx((sides[1] - sides[0]) / (2 * width), rel=2e-4)


def test_a_value_that_comes_to_rest_has_its_largest_node_anywhere() -> None:
    """w = tau/d (1 - exp(-d t/J)): after a hundred time constants nothing but errors tells the nodes apart."""
    parts = {
        "motor": ConstantTorque(tau_constant=6.0),
        "J": Inertia(J=1.0, phi=0.0, w=0.0),
        "d": Damper(d=2.0),
        "wall": Fixed(),
    }
    drive = Assembly("settling", parts=parts, series={"shaft": [*parts]})
    found = sensitivities(drive, ["max(J.w)", "peak(d.tau)"], ["motor.tau_constant", "d.d"], until=50.0)
    np.testing.assert_allclose(found.derivatives, [[0.5, -1.5], [1.0, 0.0]], rtol=1e-7, atol=1e-7)
