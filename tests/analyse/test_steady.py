"""Operating points and characteristic curves against closed forms."""

from pathlib import Path

import numpy as np
import pytest

from components import ConstantTorque, Inertia
from modelica_like import build, simulate
from modelica_like.analyse.operating.curves import characteristic
from modelica_like.analyse.operating.steady import steady
from modelica_like.errors import InitializationError, UnknownName, ValueOutOfRange
from modelica_like.language import Component, Equations, series

EXAMPLES = Path(__file__).parents[2] / "examples"
# Document 002, set A: the measured speed line and the no-load current exactly.
K, R, FRICTION, SUPPLY = 0.04668892, 0.7943932, 0.04949025, 24.0


@pytest.fixture(scope="module")
def motor():
    return build(EXAMPLES / "dc_bench_motor.toml", free=["first_load"])


def current(torque):
    return (torque + FRICTION) / K


def speed(torque):
    return (SUPPLY - R * current(torque)) / K


def test_characteristic_curves_of_the_motor(motor):
    torques = np.linspace(0.0, 0.25, 6)
    curves = characteristic(motor, {"first_load": torques})
    np.testing.assert_allclose(curves["motor.ia"], current(torques), rtol=1e-9)
    np.testing.assert_allclose(curves["motor.w"], speed(torques), rtol=1e-9)
    efficiency = torques * speed(torques) / (SUPPLY * current(torques))
    np.testing.assert_allclose(curves["efficiency"], efficiency, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(curves["loss"], (1 - efficiency) * SUPPLY * current(torques), rtol=1e-9)
    assert curves.unit("motor.w") == "rad/s"


def test_the_load_that_holds_a_speed(motor):
    """TARGETS of document 002: 0.2116379 N.m at 4000/min."""
    point = steady(motor, {"motor.w": "4000 rpm"}, by="first_load")
    assert point["motor.w"] == pytest.approx(4000 * np.pi / 30, rel=1e-11)
    assert point["first_load"] == pytest.approx(0.2116379, abs=1e-7)
    assert point["first_load"] == pytest.approx(K * (SUPPLY - K * point["motor.w"]) / R - FRICTION, rel=1e-9)
    assert point.losses == pytest.approx({"motor": R * point["motor.ia"] ** 2, "bearing": FRICTION * point["motor.w"]})
    assert str(point).splitlines()[0] == "Operating point of dc_bench_motor"


def test_curve_over_a_held_variable(motor):
    speeds = np.array([4000.0, 4500.0]) * np.pi / 30
    curves = characteristic(motor, {"motor.w": speeds}, by="first_load")
    np.testing.assert_allclose(curves["first_load"], K * (SUPPLY - K * speeds) / R - FRICTION, rtol=1e-9)


def test_two_held_by_two(motor):
    model = build(EXAMPLES / "dc_bench_motor.toml", free=["first_load", "supply"])
    point = steady(model, {"motor.w": 400.0, "motor.ia": 4.0}, by=["first_load", "supply"])
    assert point["supply"] == pytest.approx(K * 400.0 + R * 4.0, rel=1e-9)
    assert point["first_load"] == pytest.approx(K * 4.0 - FRICTION, rel=1e-9)


def test_wrong_calls(motor):
    with pytest.raises(ValueOutOfRange, match="each held variable takes one parameter"):
        steady(motor, {"motor.w": 400.0})
    with pytest.raises(UnknownName, match=r"no variable 'motor.speed'"):
        steady(motor, {"motor.speed": 400.0}, by="first_load")
    with pytest.raises(UnknownName, match="no input or parameter 'load'"):
        steady(motor, {"motor.w": 400.0}, by="load")
    with pytest.raises(InitializationError, match="cannot be held by last_load"):
        steady(motor, {"motor.w": 400.0}, by="last_load")
    with pytest.raises(ValueOutOfRange, match="over one quantity, not 2"):
        characteristic(motor, {"first_load": [0.1], "supply": [24.0]})


def test_a_gearbox_begins_from_a_run_that_has_closed_its_clutches():
    """Document 001, first gear: ratio (1 + 1/1.917)·2.74, efficiency 0.96368 with 0.99 in every mesh."""
    gears = EXAMPLES / "lepelletier_gears.toml"
    point = steady(gears, near=simulate(gears, "2 s"))
    assert point["motor.w"] / point["load.w"] == pytest.approx((1 + 1 / 1.917) * 2.74, rel=1e-9)
    assert point.efficiency == pytest.approx(0.96368, abs=5e-6)
    assert point.stuck == ("box.clutch_a", "box.brake_d")


def test_a_gear_that_locks_itself_is_told():
    """A worm of efficiency 0.4 is not turned by its load."""
    point = steady(EXAMPLES / "components" / "self_locking_worm.toml")
    assert point.stuck == ("worm",)
    assert point["worm.w_a"] == 0.0


class Accelerated(Component):
    def build(self) -> None:
        self.torque = ConstantTorque(tau_constant=0.0)
        self.mass = Inertia(J=1.0, w=0.0, phi=0.0)

    def equations(self) -> Equations:
        yield from series(self.torque, self.mass)


def test_a_point_without_steady_state_is_named():
    """Without friction, only no torque at all keeps a speed."""
    with pytest.raises(InitializationError, match=r"At torque.tau_constant = 5.0: No steady state"):
        characteristic(Accelerated(), {"torque.tau_constant": [0.0, 5.0]})
