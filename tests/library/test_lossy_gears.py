"""Gears with losses: the loss table in all quadrants, self-locking, differentials, wheels."""

import numpy as np
import pytest

from components import (
    ConstantEfficiencyGear,
    ConstantForce,
    ConstantSpeed,
    ConstantTorque,
    Differential,
    Fixed,
    IdealGear,
    IdealRollingWheel,
    Inertia,
    LossyGear,
    Mass,
    Sine,
    SpringDamper,
    ThermalMass,
    Torque,
    TorqueStep,
)
from modelica_like import Assembly, Component, simulate
from modelica_like.netlist import loads

TABLE = ((0.0, 0.9, 0.8, 0.1, 0.2), (10.0, 0.8, 0.6, 0.3, 0.5))


def shaft(**parts: Component) -> Assembly:
    return Assembly("drive", parts=parts, series={"shaft": list(parts)})


@pytest.mark.parametrize("ratio", [3.0, -2.0])
@pytest.mark.parametrize("speed", [5.0, -5.0])
@pytest.mark.parametrize("load", [40.0, 0.5, -0.5, -40.0])
def test_loss_table_in_all_quadrants(ratio: float, speed: float, load: float) -> None:
    """-tau_b = ratio·(eta·tau_a - tau_bf) with the values at 5 rad/s, half way between the rows (MSL's definition)."""
    gear = LossyGear(ratio=ratio, loss_table=TABLE)
    run = simulate(shaft(motor=ConstantSpeed(w_fixed=speed), gear=gear, load=ConstantTorque(tau_constant=load)), "1 s")
    tau_a, passed = run.final["gear.flange_a.tau"], -run.final["gear.flange_b.tau"] / ratio
    eta1, eta2, bf1, bf2 = 0.85, 0.7, 0.2, 0.35
    sign = np.sign(speed)
    bearing = (bf1 - bf2) / (eta1 - 1 / eta2)
    a_drives = (tau_a - sign * bearing) * sign > 0
    expected = eta1 * tau_a - sign * bf1 if a_drives else tau_a / eta2 - sign * bf2
    assert passed == pytest.approx(expected, rel=1e-9)
    assert run.final["gear.loss_power"] > 0
    assert run.energy().power_closure <= 1e-8


@pytest.mark.parametrize(("efficiency", "back"), [(0.9, None), (0.8, 0.6), (0.45, None), (0.3, -0.4)])
def test_start_against_and_with_a_load(efficiency: float, back: float | None) -> None:
    """A worm gear lifts and lowers: the acceleration in closed form; it holds the load alone only if self-locking."""
    J_a, J_b, ratio, weight = 0.02, 1.5, 20.0, -30.0
    reverse = 2 - 1 / efficiency if back is None else back
    values = {} if back is None else {"efficiency_back": back}
    for tau in (12.0, 0.0, -4.0):
        parts: dict[str, Component] = {
            "motor": ConstantTorque(tau_constant=tau), "rotor": Inertia(J=J_a),
            "gear": ConstantEfficiencyGear(ratio=ratio, efficiency=efficiency, **values),
            "drum": Inertia(J=J_b, phi=0.0, w=0.0), "weight": ConstantTorque(tau_constant=weight),
        }  # fmt: skip
        run = simulate(shaft(**parts), "0.5 s")
        lifting = (tau + weight / ratio / efficiency) / (J_a + J_b / ratio**2 / efficiency)
        lowering = (tau + weight / ratio * reverse) / (J_a + J_b / ratio**2 * reverse)
        expected = max(lifting, 0.0) + min(lowering, 0.0)
        assert run.final["rotor.w"] == pytest.approx(0.5 * expected, rel=1e-8, abs=1e-9)
        assert run.final["gear.self_locking"] == (reverse <= 0)
        if tau == 0.0:
            assert (run.final["rotor.w"] == 0.0) == (reverse <= 0)
        assert run.energy().power_closure <= 1e-8


def test_gear_without_loss_is_ideal() -> None:
    common = {"motor": ConstantTorque(tau_constant=2.0), "rotor": Inertia(J=0.1)}
    load = Inertia(J=3.0, phi=0.0, w=0.1)
    lossy = simulate(shaft(**common, gear=LossyGear(ratio=4, loss_table=((0, 1, 1, 0, 0),)), load=load), "1 s")
    ideal = simulate(shaft(**common, gear=IdealGear(ratio=4), load=load), "1 s")
    np.testing.assert_allclose(lossy["load.w"], ideal["load.w"], rtol=1e-6)


def test_bearing_friction_holds_up_to_its_torque() -> None:
    gear = ConstantEfficiencyGear(ratio=2.0, efficiency=0.9, tau_friction=1.0)
    for tau, moves in ((0.99, False), (1.01, True)):
        parts = {"motor": ConstantTorque(tau_constant=tau), "rotor": Inertia(J=0.1), "gear": gear}
        run = simulate(shaft(**parts, load=Inertia(J=0.1, phi=0.0, w=0.0)), "0.2 s")
        assert (run.final["rotor.w"] > 0) == moves


def test_loss_of_a_gear_heats_its_oil() -> None:
    parts: dict[str, Component] = {
        "motor": ConstantSpeed(w_fixed=100.0), "gear": ConstantEfficiencyGear(ratio=5.0, efficiency=0.95),
        "load": ConstantTorque(tau_constant=-50.0), "oil": ThermalMass(C=2000.0, T=293.15),
    }  # fmt: skip
    drive = Assembly(
        "drive", parts=parts, series={"shaft": ["motor", "gear", "load"]},
        connect={"heat": ["gear.heat_port", "oil.port"]}
    )  # fmt: skip
    run = simulate(drive, "20 s", points=20)
    lost = 50.0 * 20.0 * (1 / 0.95 - 1)
    np.testing.assert_allclose(run["oil.T"], 293.15 + lost / 2000.0 * run.time, rtol=1e-9)
    assert run.energy()["gear"].lost == 0.0
    assert run.energy().power_closure <= 1e-8


def test_gear_carried_by_a_moving_housing() -> None:
    parts: dict[str, Component] = {
        "motor": TorqueStep(step_torque=3.0, start_time=0.1), "rotor": Inertia(J=0.1),
        "gear": LossyGear(ratio=3.0, loss_table=TABLE),
        "load": Inertia(J=2.0, w=0.0), "mount": SpringDamper(c=1e3, d=5.0, phi_rel=0.0, w_rel=0.0),
        "housing": Inertia(J=1.0),
        "ground": Fixed(),
    }  # fmt: skip
    drive = Assembly(
        "drive", parts=parts,
        series={"shaft": ["motor", "rotor", "gear", "load"], "stand": ["ground", "mount", "housing"]},
        connect={"support": ["gear.support", "housing.flange_b"]},
    )  # fmt: skip
    drive.set("load.phi", 0.0)
    run = simulate(drive, "1 s", rtol=1e-8)
    np.testing.assert_allclose(run["gear.phi_a"], 3.0 * (run["load.phi"] - run["housing.phi"]), atol=1e-9)
    assert run.energy().power_closure <= 1e-8


# -- differential, wheel -----------------------------------------------------------------------------------------------


def test_differential_splits_the_torque_in_halves() -> None:
    parts: dict[str, Component] = {
        "engine": ConstantTorque(tau_constant=5.0), "axle": Differential(ratio=4.0),
        "left": Inertia(J=1.0, phi=0.0, w=0.0), "right": Inertia(J=3.0, phi=0.0, w=0.0),
    }  # fmt: skip
    wires = {
        "in": ["engine.flange", "axle.flange"],
        "l": ["axle.left", "left.flange_a"],
        "r": ["axle.right", "right.flange_a"],
    }
    run = simulate(Assembly("car", parts=parts, connect=wires), "1 s")
    assert run.final["left.w"] == pytest.approx(10.0, rel=1e-9)
    assert run.final["right.w"] == pytest.approx(10.0 / 3, rel=1e-9)
    assert run.final["engine.phi"] == pytest.approx(2 * (run.final["left.phi"] + run.final["right.phi"]), rel=1e-9)
    assert run.energy().power_closure <= 1e-8


@pytest.mark.parametrize("radius", [0.3, -0.3])
def test_rolling_wheel(radius: float) -> None:
    motor, wheel, car = ConstantTorque(tau_constant=6.0), Inertia(J=0.9), Mass(m=20.0, s=0.0, v=0.0)
    drive = shaft(
        motor=motor, wheel=wheel, tyre=IdealRollingWheel(radius=radius), car=car, hill=ConstantForce(f_constant=-2.0)
    )
    run = simulate(drive, "1 s")
    assert run.final["car.v"] == pytest.approx((6.0 / radius - 2.0) / (20.0 + 0.9 / radius**2), rel=1e-9)
    assert run.energy().power_closure <= 1e-8


def test_a_gear_without_losses_is_free() -> None:
    """The table [0, 1, 1, 0, 0] of the Modelica Standard Library: no mode changes, and no event at any standstill."""
    gear = LossyGear(ratio=2.0, loss_table=((0, 1, 1, 0, 0),))
    parts = {
        "sine": Sine(amplitude="3 N.m", f=1.0), "motor": Torque(), "J1": Inertia(J=1.0, phi=0.0, w=0.0), "gear": gear,
        "J2": Inertia(J=4.0),
    }  # fmt: skip
    shaft = ["motor", "J1", "gear", "J2"]
    drive = Assembly("d", parts=parts, series={"s": shaft}, connect={"c": ["sine.y", "motor.tau"]})
    run = simulate(drive, 3.0, rtol=1e-10, atol=1e-12)
    assert run.events == ()
    # 2 kg.m2 at flange_a: w = 3/2·(1 - cos(2π t))/(2π)
    np.testing.assert_allclose(run["J1.w"], 1.5 * (1 - np.cos(2 * np.pi * run.time)) / (2 * np.pi), atol=1e-8)
    assert run.energy()["gear"].lost == 0.0


def test_one_row_with_a_loss_is_not_free() -> None:
    gear = LossyGear(ratio=1.0, loss_table=((0, 1, 1, 0, 0), (10, 0.9, 0.9, 0, 0)))
    parts = {"motor": ConstantSpeed(w_fixed=10.0), "gear": gear, "load": ConstantTorque(tau_constant=-9.0)}
    run = simulate(Assembly("d", parts=parts, series={"s": list(parts)}), 1.0)
    assert run.final["gear.flange_a.tau"] == pytest.approx(10.0, rel=1e-12)


@pytest.mark.parametrize(("slope", "rolls"), [("0 deg", False), ("3 deg", True)])
def test_gears_without_bearing_friction_rest_without_torque(slope: str, rolls: bool) -> None:
    """A car stands, and the torque in its gears is zero but for rounding; each could bear none at all and toggled."""
    car = f"""
    [parts]
    clutch = {{ is = "Clutch", capacity = 1400, f_normalized = 0 }}
    input = {{ is = "Inertia", J = 0.05 }}
    box = {{ is = "ConstantEfficiencyGear", ratio = 6, efficiency = 0.96 }}
    final = {{ is = "ConstantEfficiencyGear", ratio = 3.9, efficiency = 0.95 }}
    shaft = {{ is = "SpringDamper", c = "40 kN.m/rad", d = 300 }}
    wheels = {{ is = "Inertia", J = 20 }}
    tyre = {{ is = "Tyre", R = 0.42, F_z = "40 kN", sigma = 0.3 }}
    car = {{ is = "Mass", m = 7500, angle = "{slope}" }}
    road = {{ is = "RoadLoad", F_0 = 500, F_2 = 3 }}
    [parts.engine]
    is = "CombustionEngine"
    pedal = 0
    speeds = [0, 300]
    pedals = [0, 1]
    torque = [[0, 450], [0, 500]]
    drag = [[0, 40], [300, 120]]
    J = 0.9
    w_idle = 70
    w_max = 260
    w_stall = 30
    [series]
    drive = ["engine", "clutch", "input", "box", "final", "shaft", "wheels", "tyre", "car", "road"]
    [start]
    "engine.w" = 70
    [simulate]
    start = "rest"
    """
    run = simulate(loads(car), 8.0)
    modes = [event.after for event in run.events]
    assert sorted(modes) == (["backward", "backward", "start_backward", "start_backward"] if rolls else [])
    # What the gears turn, each with the efficiency 2 - 1/eta against its drive: this mass at the tyre.
    turned = 7500 + (20 + 0.05 * (6 * 3.9) ** 2 / ((2 - 1 / 0.96) * (2 - 1 / 0.95))) / 0.42**2
    pull = 7500 * 9.80665 * np.sin(np.radians(3)) - 500 if rolls else 0.0
    v = np.sqrt(pull / 3) * np.tanh(np.sqrt(3 * pull) / turned * 8) if rolls else 0.0
    assert run.final["car.v"] == pytest.approx(-v, rel=2e-3, abs=1e-9)
