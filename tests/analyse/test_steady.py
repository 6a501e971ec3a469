"""Operating points and characteristic curves against closed forms."""

from pathlib import Path

import numpy as np
import pytest

from components import (
    BearingFriction,
    Clutch,
    ConstantTorque,
    Freewheel,
    Inertia,
    LossyGear,
    SpeedDependentLoad,
    SpringDamper,
)
from modelica_like import Assembly, build, simulate
from modelica_like.analyse.operating.curves import characteristic
from modelica_like.analyse.operating.steady import steady
from modelica_like.errors import InitializationError, UnknownName, ValueOutOfRange
from modelica_like.language import Component, Equations, Parameter, Variable, der, guess, param, series, var

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


def test_an_implicit_unknown_without_a_steady_value_is_named():
    class Open(Component):
        x: Variable = var("1", "state")
        y: Variable = var("1", "implicit")
        T: Parameter = param("s", "time constant", default=1.0)

        def equations(self) -> Equations:
            yield self.T * der(self.x) == -self.x
            yield self.y**2 + self.y + 1 + self.x == 0

    with pytest.raises(InitializationError, match="y keeps changing"):
        simulate(Open(), 1.0, start="steady")


def test_characteristic_curves_of_the_motor(motor):
    torques = np.linspace(0.0, 0.25, 6)
    curves = characteristic(motor, {"first_load": torques})
    np.testing.assert_allclose(curves["motor.ia"], current(torques), rtol=1e-9)
    np.testing.assert_allclose(curves["motor.w"], speed(torques), rtol=1e-9)
    efficiency = torques * speed(torques) / (SUPPLY * current(torques))
    np.testing.assert_allclose(curves["efficiency"], efficiency, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(curves["loss"], (1 - efficiency) * SUPPLY * current(torques), rtol=1e-9)
    assert curves.unit("motor.w") == "rad/s"
    above, below = curves.plot("motor.w", "efficiency").axes
    assert (above.get_ylabel(), below.get_ylabel()) == ("motor.w in rad/s", "efficiency")
    np.testing.assert_array_equal(below.lines[0].get_ydata(), curves["efficiency"])
    with pytest.raises(UnknownName, match=r"There is no 'motor\.speed' in these curves"):
        curves.unit("motor.speed")


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
    with pytest.raises(ValueOutOfRange, match="each held variable needs one parameter"):
        steady(motor, {"motor.w": 400.0})
    with pytest.raises(UnknownName, match=r"no variable 'motor.speed'"):
        steady(motor, {"motor.speed": 400.0}, by="first_load")
    with pytest.raises(UnknownName, match="no input or parameter 'load'"):
        steady(motor, {"motor.w": 400.0}, by="load")
    with pytest.raises(InitializationError, match="cannot be held by last_load"):
        steady(motor, {"motor.w": 400.0}, by="last_load")
    with pytest.raises(ValueOutOfRange, match="varies one quantity, not 2"):
        characteristic(motor, {"first_load": [0.1], "supply": [24.0]})


def test_a_gearbox_begins_from_a_run_that_has_closed_its_clutches():
    """Document 001, first gear: ratio (1 + 1/1.917)·2.74, efficiency 0.96368 with 0.99 in every mesh."""
    gears = EXAMPLES / "lepelletier_gears.toml"
    point = steady(gears, near=simulate(gears, "2 s"))
    assert point["motor.w"] / point["load.w"] == pytest.approx((1 + 1 / 1.917) * 2.74, rel=1e-9)
    assert point.efficiency == pytest.approx(0.96368, abs=5e-6)
    assert point.stuck == ("box.clutch_a", "box.brake_d")


def test_a_gearbox_finds_what_sticks_without_a_run():
    """Sliding either way, the brake would pull the carrier through standstill; in between it holds it."""
    point = steady(EXAMPLES / "lepelletier_gears.toml")
    assert point["motor.w"] / point["load.w"] == pytest.approx((1 + 1 / 1.917) * 2.74, rel=1e-9)
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


class TwoFans(Component):
    """A torque T turns two fans, one behind a clutch: T = 3 N.m w/(100 rad/s) + 5 N.m (w/(100 rad/s))²."""

    motor = ConstantTorque(tau_constant=10.0)
    rotor = Inertia(J=0.1, w=guess(100.0), phi=0)
    first = SpeedDependentLoad(b=3.0, p=1.0, w_ref=100.0)
    coupling = Clutch(capacity=100.0)
    wheel = Inertia(J=0.2, w=guess(100.0))
    second = SpeedDependentLoad(b=5.0, p=2.0, w_ref=100.0)

    def equations(self) -> Equations:
        yield from series(self.motor, self.rotor, self.coupling, self.wheel, self.second)
        yield from series(self.rotor, self.first)


def speed_of_fans(torque):
    return 10.0 * (np.sqrt(9.0 + 20.0 * torque) - 3.0)


@pytest.fixture(scope="module")
def fans():
    return build(TwoFans())


@pytest.mark.parametrize("torque", [10.0, 20.0, 30.0])
def test_a_clutch_that_sticks_turns_as_one(fans, torque):
    near = steady(fans)
    for begin in (None, near, simulate(fans, "20 s", start="rest")):
        point = steady(fans, parameters={"motor.tau_constant": torque}, near=begin)
        assert (point["rotor.w"], point["wheel.w"]) == pytest.approx([speed_of_fans(torque)] * 2, rel=1e-12)
        assert point.stuck == ("coupling",)
        assert sum(point.losses.values()) == pytest.approx(torque * point["rotor.w"], rel=1e-12)


def test_a_torque_that_holds_a_speed_through_a_clutch(fans):
    point = steady(fans, {"wheel.w": 150.0}, by="motor.tau_constant")
    assert point["motor.tau_constant"] == pytest.approx(3.0 * 1.5 + 5.0 * 1.5**2, rel=1e-11)


def test_a_freewheel_that_drives_turns_as_one():
    """5 N.m against 1 N.m + 1 N.m s/rad w: 4 rad/s, before and behind the freewheel."""

    class Driven(Component):
        motor, rotor, freewheel = ConstantTorque(tau_constant=5.0), Inertia(J=0.1, phi=0), Freewheel()
        wheel = Inertia(J=0.2, w=guess(1.0))
        bearing = BearingFriction(tau_pos=((0, 1), (1, 2)), extrapolate="linear")

        def equations(self) -> Equations:
            yield from series(self.motor, self.rotor, self.freewheel, self.wheel, self.bearing)

    point = steady(Driven())
    assert (point["rotor.w"], point["wheel.w"]) == pytest.approx((4.0, 4.0), rel=1e-12)
    assert point["freewheel.tau"] == pytest.approx(-5.0, rel=1e-12)


@pytest.mark.parametrize(("name", "value"), [("box.front_ratio", -2.0), ("box.small_ratio", 3.0)])
def test_other_ratios_keep_clutches_closed(name, value):
    """The slip of the brake that holds the carrier depends on the ratios, and stays zero: (1 - 1/front)·small."""
    model = build(EXAMPLES / "lepelletier_gears.toml", free=["box.front_ratio", "box.small_ratio"])
    near = simulate(model, "2 s")
    point = steady(model, parameters={name: value}, near=near)
    ratio = (1 - 1 / point["box.front_ratio"]) * point["box.small_ratio"]
    assert point["motor.w"] / point["load.w"] == pytest.approx(ratio, rel=1e-12)
    assert point["box.brake_d.w"] == pytest.approx(0.0, abs=1e-12)
    held = steady(model, {"load.w": 1.01 * point["load.w"]}, "box.small_ratio", parameters={name: value}, near=point)
    assert held["box.small_ratio"] == pytest.approx(point["box.small_ratio"] / 1.01, rel=1e-9)


@pytest.mark.parametrize(
    "drive",
    [
        "dc_bench_motor", "dc_machines/series", "fan", "lepelletier_gears", "machine_tool_startup", "stick_slip",
        "msl/dcmachines/DCPM_withLosses", "msl/translational/Friction",
    ],
)  # fmt: skip
def test_powers_are_in_balance(drive):
    model = build(EXAMPLES / f"{drive}.toml")
    powers = steady(model, near=simulate(model, model.settings.get("until", 1.0))).powers.values()
    brought = sum(source for source, _ in powers)
    assert brought > 0.1
    assert sum(loss for _, loss in powers) == pytest.approx(brought, rel=1e-9)


class Stateless(Component):
    """Its unknown has the closed form p = z + z³."""

    p: Parameter = param("1", "load", default=10.0)
    z: Variable = var("1", "unknown", guess=1.0)

    def equations(self) -> Equations:
        yield self.z + self.z**3 == self.p


def test_a_model_without_states_is_steady():
    found = steady(Stateless())
    assert found["z"] == pytest.approx(2.0)
    assert steady(Stateless(), near=found, parameters={"p": 68.0})["z"] == pytest.approx(4.0)
    assert steady(Stateless(), hold={"z": 3.0}, by=["p"])["p"] == pytest.approx(30.0)


@pytest.mark.parametrize("line", [["rotor", "gear", "shaft", "table"], ["rotor", "shaft", "gear", "table"]])
def test_drives_with_friction_at_both_ends_turn_steadily(line):
    """In either order: gear and load have speeds that are states, but a drive has one absolute angle."""
    parts = {
        "motor": ConstantTorque(tau_constant=10.0), "rotor": Inertia(J=0.1),
        "gear": LossyGear(ratio=2.0, loss_table=[(0.0, 0.9, 0.8, 0.1, 0.1)]), "shaft": SpringDamper(c=400.0, d=0.2),
        "table": Inertia(J=0.8), "load": SpeedDependentLoad(a=0.0, b=10.0, w_ref=10.0, p=1.0),
    }  # fmt: skip
    found = steady(Assembly("drive", parts=parts, series={"line": ("motor", *line, "load")}))
    assert found["table.w"] == pytest.approx(2.0 * (0.9 * 10.0 - 0.1))
    assert found["rotor.w"] == pytest.approx(2.0 * found["table.w"])
