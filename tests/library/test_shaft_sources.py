"""Torques by speed, prescribed motions, sensors of accelerations, gearboxes, and drives cut into parts."""

from math import pi
from typing import Any

import numpy as np
import pytest

from components import (
    Accelerate,
    AccelerationSensor,
    AngleToTorqueAdaptor,
    Constant,
    ConstantSpeed,
    ConstantTorque,
    Fixed,
    Gearbox,
    Inertia,
    InverseSpeedDependentTorque,
    LinearSpeedDependentTorque,
    Position,
    QuadraticSpeedDependentTorque,
    RelativeAccelerationSensor,
    SignTorque,
    Sine,
    Speed,
    SpringDamper,
    Step,
    Torque,
    Torque2,
    TorqueToAngleAdaptor,
)
from modelica_like import Assembly, Component, simulate


def shaft(**parts: Component) -> Assembly:
    return Assembly("drive", parts=parts, series={"shaft": list(parts)})


@pytest.mark.parametrize("w", [20.0, -20.0])
@pytest.mark.parametrize(
    ("kind", "values", "reversing", "fixed"),
    [
        (LinearSpeedDependentTorque, {}, lambda x: x, abs),
        (QuadraticSpeedDependentTorque, {}, lambda x: x * abs(x), lambda x: x**2),
        (InverseSpeedDependentTorque, {"w0": 1.0}, lambda x: 1 / x, lambda x: 1 / abs(x)),
    ],
)
def test_torque_by_speed(kind: Any, values: dict[str, float], reversing: Any, fixed: Any, w: float) -> None:
    for reverses, law in ((True, reversing), (False, fixed)):
        load = kind(tau_nominal=-3.0, w_nominal=50.0, reverses=reverses, **values)
        run = simulate(shaft(drive=ConstantSpeed(w_fixed=w), load=load), "1 s", points=5)
        assert -run.final["load.flange.tau"] == pytest.approx(-3.0 * law(w / 50.0), rel=1e-12)


def test_a_torque_by_speed_brakes_both_ways_if_nothing_else_is_said() -> None:
    load = LinearSpeedDependentTorque(tau_nominal=-3.0, w_nominal=50.0)
    run = simulate(shaft(drive=ConstantSpeed(w_fixed=-20.0), load=load), "1 s", points=2)
    assert -run.final["load.flange.tau"] == pytest.approx(3.0 * 20.0 / 50.0, rel=1e-12)


def test_inverse_torque_stays_finite_at_standstill() -> None:
    for reverses, wanted in ((True, 0.0), (False, 6.0 * 50.0 / 2.0)):
        load = InverseSpeedDependentTorque(tau_nominal=6.0, w_nominal=50.0, w0=2.0, reverses=reverses)
        run = simulate(shaft(drive=ConstantSpeed(w_fixed=0.0), load=load), "1 s", points=2)
        assert -run.final["load.flange.tau"] == pytest.approx(wanted, abs=1e-12)


def test_sign_torque_and_torque_between_shafts() -> None:
    signed = simulate(shaft(drive=ConstantSpeed(w_fixed=-5.0), load=SignTorque(tau_nominal=-7.0)), "1 s", points=2)
    assert -signed.final["load.flange.tau"] == pytest.approx(7.0, rel=1e-6)
    slow = simulate(
        shaft(drive=ConstantSpeed(w_fixed=1e-3), load=SignTorque(tau_nominal=-7.0, w0=0.1)), "1 s", points=2
    )
    # 2/(1 + exp(-x)) - 1 with x = w/(0.01·w0), as the Modelica Standard Library writes it.
    assert -slow.final["load.flange.tau"] == pytest.approx(-7.0 * (2 / (1 + np.exp(-1.0)) - 1), rel=1e-9)
    left, motor, right = Inertia(J=2.0, phi=0.0, w=0.0), Torque2(tau=6.0), Inertia(J=3.0, phi=0.0, w=0.0)
    run = simulate(shaft(left=left, motor=motor, right=right), "1 s")
    assert (run.final["left.w"], run.final["right.w"]) == pytest.approx((-3.0, 2.0), rel=1e-9)
    assert run.energy().power_closure <= 1e-8


def test_a_filtered_speed_rises_exponentially() -> None:
    parts = {"signal": Step(height="30 rad/s", start_time=0.01), "drive": Speed(exact=False), "mass": Inertia(J=0.2)}
    wires = {"c": ["signal.y", "drive.w_ref"]}
    run = simulate(Assembly("d", parts=parts, series={"s": ["drive", "mass"]}, connect=wires), 0.05, rtol=1e-9)
    rises = 1 - np.exp(-100 * np.pi * np.maximum(run.time - 0.01, 0))
    np.testing.assert_allclose(run["mass.w"], 30 * rises, atol=1e-7)
    assert run.energy().power_closure <= 1e-8


@pytest.mark.parametrize("exact", [True, False])
def test_position_source(exact: bool) -> None:
    source = Position() if exact else Position(exact=False, phi=0.0, w=0.0)
    parts = {
        "signal": Sine(amplitude="0.5 rad", f=1.0),
        "drive": source,
        "mass": Inertia(J=0.2),
        "meter": AccelerationSensor(),
    }
    drive = Assembly(
        "drive", parts=parts, series={"shaft": ["drive", "mass", "meter"]}, connect={"s": ["signal.y", "drive.phi_ref"]}
    )
    run = simulate(drive, "1 s", rtol=1e-8)
    np.testing.assert_allclose(run["mass.phi"], 0.5 * np.sin(2 * pi * run.time), atol=1e-9 if exact else 2.5e-2)
    np.testing.assert_allclose(run["drive.flange.tau"], -0.2 * run["meter.a"], atol=1e-9)
    assert run.energy().power_closure <= 1e-8


def test_prescribed_acceleration_and_relative_sensor() -> None:
    parts: dict[str, Component] = {
        "signal": Constant(k="3 rad/s2"), "drive": Accelerate(phi=0.0, w=1.0), "mass": Inertia(J=2.0),
        "meter": RelativeAccelerationSensor(), "wall": Fixed(),
    }  # fmt: skip
    drive = Assembly(
        "drive", parts=parts, series={"shaft": ["drive", "mass"]},
        connect={"s": ["signal.y", "drive.a_ref"], "a": ["wall.flange", "meter.flange_a"],
        "b": ["mass.flange_b", "meter.flange_b"]},
    )  # fmt: skip
    run = simulate(drive, "1 s")
    np.testing.assert_allclose(run["mass.phi"], run.time + 1.5 * run.time**2, atol=1e-7)
    assert run.final["meter.a_rel"] == pytest.approx(3.0, rel=1e-12)


def test_gearbox_turns_after_its_backlash() -> None:
    """Driven slowly against a load: flange_b lags by half the backlash and the twist of the flanks."""
    box = Gearbox(ratio=4.0, loss_table=((0.0, 0.9, 0.9, 0.0, 0.0),), c=1e5, d=300.0, b=0.02)
    load, friction = Inertia(J=0.5, phi=0.0, w=0.0), ConstantTorque(tau_constant=-50.0)
    run = simulate(shaft(motor=ConstantSpeed(w_fixed=4.0), box=box, load=load, friction=friction), "1 s", rtol=1e-8)
    lag = run.final["box.gear.flange_b.phi"] - run.final["load.phi"]
    assert lag == pytest.approx(0.01 + 50.0 / 1e5, rel=1e-3)
    assert run.final["box.flange_a.tau"] == pytest.approx(50.0 / 4.0 / 0.9, rel=1e-3)
    assert run.energy().power_closure <= 1e-8


@pytest.mark.parametrize("has_backlash", [True, False])
def test_gearbox_on_an_elastic_stand(has_backlash: bool) -> None:
    parts: dict[str, Component] = {
        "motor": ConstantTorque(tau_constant=2.0), "rotor": Inertia(J=0.1, phi=0.0, w=0.0),
        "box": Gearbox(ratio=4.0, c=1e4, d=10.0, has_backlash=has_backlash), "load": Inertia(J=0.5, phi=0.0, w=0.0),
        "mount": SpringDamper(c=1e3, d=5.0), "housing": Inertia(J=1.0, phi=0.0, w=0.0), "floor": Fixed(),
    }  # fmt: skip
    drive = Assembly(
        "drive", parts=parts,
        series={"shaft": ["motor", "rotor", "box", "load"], "stand": ["floor", "mount", "housing"]},
        connect={"support": ["box.support", "housing.flange_b"]},
    )  # fmt: skip
    run = simulate(drive, "0.5 s", rtol=1e-8)
    assert np.max(np.abs(run["housing.phi"])) > 1e-3
    assert run.energy().power_closure <= 1e-8


def test_drive_cut_into_parts_that_exchange_signals() -> None:
    whole: dict[str, Component] = {
        "signal": Sine(amplitude="3 N.m", f=2.0), "motor": Torque(), "left": Inertia(J=0.4, phi=0.0, w=0.0),
        "coupling": SpringDamper(c=200.0, d=1.0), "right": Inertia(J=0.7, phi=0.0, w=0.0),
    }  # fmt: skip
    one = Assembly(
        "one", parts=whole, series={"shaft": ["motor", "left", "coupling", "right"]},
        connect={"s": ["signal.y", "motor.tau"]}
    )  # fmt: skip
    ends = {
        "a1": TorqueToAngleAdaptor(use_a=False),
        "b1": AngleToTorqueAdaptor(),
        "b2": AngleToTorqueAdaptor(),
        "a2": TorqueToAngleAdaptor(use_a=False),
    }
    wires = {"s": ["signal.y", "motor.tau"]}
    for k in (1, 2):
        wires |= {
            f"phi{k}": [f"a{k}.phi", f"b{k}.phi"],
            f"w{k}": [f"a{k}.w", f"b{k}.w"],
            f"tau{k}": [f"b{k}.tau", f"a{k}.tau"],
        }
    series = {"l": ["motor", "left", "a1"], "m": ["b1", "coupling", "b2"], "r": ["a2", "right"]}
    cut = Assembly("cut", parts={**whole, **ends}, series=series, connect=wires)
    together, apart = simulate(one, "1 s", rtol=1e-9), simulate(cut, "1 s", rtol=1e-9)
    np.testing.assert_allclose(apart["right.w"], together["right.w"], atol=1e-6)
    assert apart.energy().power_closure <= 1e-8
