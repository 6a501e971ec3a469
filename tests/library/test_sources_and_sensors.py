"""Sources prescribe, sensors measure without load."""

from typing import Any

import numpy as np
import pytest

from components import (
    AngleSensor,
    Constant,
    ConstantForce,
    ConstantSpeed,
    ConstantTorque,
    Damper,
    Fixed,
    Force,
    ForceSensor,
    ForceToPositionAdaptor,
    Inertia,
    Mass,
    MultiSensor,
    PositionSensor,
    PowerSensor,
    RelativeAngleSensor,
    RelativeSpeedSensor,
    Sine,
    Speed,
    SpeedSensor,
    SpringDamper,
    Torque,
    TorqueSensor,
    TranslationalDamper,
    TranslationalFixed,
    TranslationalSpeed,
)
from modelica_like import Assembly, Component, simulate

TIGHT = {"rtol": 1e-10, "atol": 1e-12}


def drive(
    series: dict[str, list[str]], connect: dict[str, tuple[str, ...]] | None = None, **parts: Component
) -> Assembly:
    return Assembly("drive", parts=parts, series=series, connect=connect or {})


# -- sources -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("kind", "mass", "value"),
    [(ConstantTorque, Inertia(J=2.0, phi=0.0, w=0.0), "w"), (ConstantForce, Mass(m=2.0, s=0.0, v=0.0), "v")],
)
def test_constant_torque_and_force_drive_forward(kind: Any, mass: Component, value: str) -> None:
    source = kind(**{"tau_constant" if kind is ConstantTorque else "f_constant": 3.0})
    run = simulate(drive({"s": ["source", "mass"]}, source=source, mass=mass), 1.0)
    assert run.final[f"mass.{value}"] == pytest.approx(1.5, rel=1e-9)
    balance = run.energy()
    assert balance["source"].source == pytest.approx(0.5 * 2.0 * 1.5**2, rel=1e-9)
    assert balance["source"].inflow == pytest.approx(-balance["source"].source, rel=1e-9)


def test_torque_and_force_by_signal() -> None:
    wave = Sine(amplitude="3 N.m", f=0.5)
    push = Sine(amplitude="3 N", f=0.5)
    turning = drive(
        {"s": ["source", "mass"]},
        {"c": ("signal.y", "source.tau")},
        signal=wave,
        source=Torque(),
        mass=Inertia(J=2.0, phi=0.0, w=0.0),
    )
    sliding = drive(
        {"s": ["source", "mass"]},
        {"c": ("signal.y", "source.f")},
        signal=push,
        source=Force(),
        mass=Mass(m=2.0, s=0.0, v=0.0),
    )
    for run, speed in ((simulate(turning, 2.0, **TIGHT), "mass.w"), (simulate(sliding, 2.0, **TIGHT), "mass.v")):
        np.testing.assert_allclose(run[speed], 1.5 / np.pi * (1 - np.cos(np.pi * run.time)), atol=1e-8)


def test_a_signal_may_be_a_constant_value() -> None:
    run = simulate(
        drive({"s": ["source", "mass"]}, source=Torque(tau="3 N.m"), mass=Inertia(J=2.0, phi=0.0, w=0.0)), 1.0
    )
    assert run.final["mass.w"] == pytest.approx(1.5, rel=1e-9)
    faster = simulate(run.model, 1.0, parameters={"source.tau": 6.0})
    assert faster.final["mass.w"] == pytest.approx(3.0, rel=1e-9)


def test_speed_sources_take_whatever_torque_is_needed() -> None:
    constant = drive(
        {"s": ["motor", "oil", "wall"]},
        motor=ConstantSpeed(w_fixed="60 rpm"),
        oil=Damper(d=3.0, phi_rel=0.0),
        wall=Fixed(),
    )
    run = simulate(constant, 1.0)
    np.testing.assert_allclose(run["motor.flange.tau"], -6 * np.pi, rtol=1e-9)
    np.testing.assert_allclose(run["motor.phi"], 2 * np.pi * run.time, atol=1e-9)
    wave = Sine(amplitude="2 rad/s", f=0.5)
    accelerated = drive(
        {"s": ["motor", "mass"]}, {"c": ("signal.y", "motor.w_ref")}, signal=wave, motor=Speed(), mass=Inertia(J=0.5)
    )
    run = simulate(accelerated, 2.0)
    np.testing.assert_allclose(run["mass.w"], 2 * np.sin(np.pi * run.time), atol=1e-9)
    np.testing.assert_allclose(-run["motor.flange.tau"], np.pi * np.cos(np.pi * run.time), atol=1e-9)


def test_prescribed_velocity_of_a_slide() -> None:
    wave = Sine(amplitude="2 m/s", f=0.5)
    sliding = drive(
        {"s": ["oil", "bed"]},
        {"c": ("signal.y", "source.v_ref"), "m": ("source.flange", "mass.flange_a", "oil.flange_a")},
        signal=wave,
        source=TranslationalSpeed(s=0.0),
        mass=Mass(m=0.5),
        oil=TranslationalDamper(d=3.0),
        bed=TranslationalFixed(),
    )
    run = simulate(sliding, 2.0)
    np.testing.assert_allclose(run["mass.v"], 2 * np.sin(np.pi * run.time), atol=1e-9)
    np.testing.assert_allclose(
        -run["source.flange.f"], np.pi * np.cos(np.pi * run.time) + 6 * np.sin(np.pi * run.time), atol=1e-8
    )
    assert run.energy().power_closure < 1e-8


def test_the_housing_of_a_source_feels_the_reaction() -> None:
    """Motor on an elastic mount: what drives the rotor turns the stator backwards."""
    parts = {
        "motor": ConstantTorque(tau_constant=3.0),
        "rotor": Inertia(J=1.0, phi=0.0, w=0.0),
        "stator": Inertia(J=2.0, phi=0.0, w=0.0),
    }
    run = simulate(drive({"s": ["motor", "rotor"]}, {"m": ("motor.support", "stator.flange_a")}, **parts), 1.0)
    assert run.final["rotor.w"] == pytest.approx(3.0, rel=1e-9)
    assert run.final["stator.w"] == pytest.approx(-1.5, rel=1e-9)
    assert run.final["motor.phi"] == pytest.approx(1.5 + 0.75, rel=1e-7)
    assert run.energy().power_closure < 1e-8


# -- sensors -----------------------------------------------------------------------------------------------------------


def test_sensors_of_a_shaft() -> None:
    parts = {
        "torque": ConstantTorque(tau_constant=4.0),
        "J1": Inertia(J=1.0, phi=0.0, w=0.0),
        "tau": TorqueSensor(),
        "power": PowerSensor(),
        "multi": MultiSensor(),
        "coupling": SpringDamper(c=50.0, d=1.0, phi_rel=0.0),
        "J2": Inertia(J=2.0, w=0.0),
        "oil": Damper(d=0.3),
        "wall": Fixed(),
        "angle": AngleSensor(),
        "speed": SpeedSensor(),
        "twist": RelativeAngleSensor(),
        "slip": RelativeSpeedSensor(),
    }
    connect = {
        "one": ("angle.flange", "speed.flange", "J2.flange_b"),
        "left": ("twist.flange_a", "slip.flange_a", "J1.flange_a"),
        "right": ("twist.flange_b", "slip.flange_b", "J2.flange_a"),
    }
    shaft = ["torque", "J1", "tau", "power", "multi", "coupling", "J2", "oil", "wall"]
    run = simulate(drive({"shaft": shaft}, connect, **parts), 1.0)
    bare = [name for name in shaft if name not in ("tau", "power", "multi")]
    without = simulate(drive({"shaft": bare}, **{name: parts[name] for name in bare}), 1.0)
    for name in ("J1.w", "J2.w", "J2.phi", "coupling.tau"):
        np.testing.assert_allclose(run[name], without[name], atol=1e-6)
    for measured, expected in {
        "angle.phi": run["J2.phi"],
        "speed.w": run["J2.w"],
        "twist.phi_rel": run["coupling.phi_rel"],
        "slip.w_rel": run["coupling.w_rel"],
        "tau.tau": run["coupling.flange_a.tau"],
        "power.power": run["coupling.flange_a.tau"] * run["J1.w"],
        "multi.w": run["J1.w"],
        "multi.tau": run["tau.tau"],
        "multi.power": run["power.power"],
    }.items():
        np.testing.assert_allclose(run[measured], expected, atol=1e-9, err_msg=measured)
    assert np.all(run["tau.tau"][1:] > 0), "power flows from flange_a to flange_b"
    assert run.energy().power_closure < 1e-8


def test_sensors_of_a_slide() -> None:
    parts = {
        "force": ConstantForce(f_constant=4.0),
        "gauge": ForceSensor(),
        "mass": Mass(m=2.0, s=0.0, v=0.0),
        "place": PositionSensor(),
    }
    run = simulate(drive({"s": ["force", "gauge", "mass"]}, {"p": ("place.flange", "mass.flange_b")}, **parts), 1.0)
    np.testing.assert_allclose(run["gauge.f"], 4.0, rtol=1e-12)
    np.testing.assert_allclose(run["place.s"], run.time**2, atol=1e-8)


@pytest.mark.parametrize(("v", "a"), [(True, True), (True, False), (False, False)])
def test_an_adaptor_tells_zero_for_what_it_does_not_tell(v: bool, a: bool) -> None:
    """6 N move 2 kg by 1.5·t²."""
    end, force = ForceToPositionAdaptor(use_v=v, use_a=a), Constant(k=6.0)
    drive = Assembly(
        "slide", parts={"force": force, "end": end, "mass": Mass(m=2.0, s=0.0, v=0.0)},
        series={"way": ["end", "mass"]}, connect={"f": ["force.y", "end.f"]},
    )  # fmt: skip
    run = simulate(drive, 2.0)
    told = [run.final[f"end.{one}"] for one in "sva"]
    assert told == pytest.approx([6.0, 6.0 if v else 0.0, 3.0 if a else 0.0], rel=1e-7)
