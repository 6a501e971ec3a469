"""Freewheels, one-way clutches, torque limiters, and what happens in one instant."""

from math import pi, sin

import numpy as np
import pytest

from components import (
    BearingFriction,
    Brake,
    Clutch,
    ConstantForce,
    ConstantTorque,
    Damper,
    Fixed,
    FixedTemperature,
    ForceStep,
    Freewheel,
    HeatSource,
    Inertia,
    LossyGear,
    MachineTable,
    MassWithStopAndFriction,
    OneWayClutch,
    Sine,
    Speed,
    SpeedDependentLoad,
    Step,
    ThermalConductor,
    ThermalMass,
    Torque,
    TorqueLimiter,
    TorqueStep,
    TranslationalBrake,
)
from modelica_like import Assembly, Component, Solution, simulate


def driven(coupling: Component, rtol: float = 1e-8) -> Solution:
    parts: dict[str, Component] = {
        "signal": Sine(amplitude="8 N.m", f=1.0), "torque": Torque(), "engine": Inertia(J=0.5, phi=0.0, w=0.0),
        "coupling": coupling,
        "load": Inertia(J=1.0, w=0.0), "oil": Damper(d=0.6), "wall": Fixed(),
    }  # fmt: skip
    drive = Assembly(
        "drive", parts=parts, series={"shaft": ["torque", "engine", "coupling", "load", "oil", "wall"]},
        connect={"drive": ["signal.y", "torque.tau"]},
    )  # fmt: skip
    return simulate(drive, "3 s", rtol=rtol, points=600)


def test_freewheel_is_complementary() -> None:
    """Overrunning speed and driving torque: neither is negative, and one of them is zero."""
    run = driven(Freewheel())
    speed, torque = run["coupling.w_rel"], -run["coupling.tau"]
    assert np.min(speed) >= -1e-9
    assert np.min(torque) >= -1e-6
    assert np.max(np.abs(speed * torque)) <= 1e-6
    assert np.max(speed) > 1
    assert np.max(torque) > 1
    assert run.energy()["coupling"].lost == 0.0
    assert run.energy().power_closure <= 1e-8


def test_freewheel_releases_and_catches_when_the_closed_form_says() -> None:
    """No damper: together until the torque changes its sign; then the engine swings alone until it is as fast again."""
    parts: dict[str, Component] = {
        "signal": Sine(amplitude="8 N.m", f=1.0), "torque": Torque(), "engine": Inertia(J=0.5, phi=0.0, w=0.0),
        "wheel": Freewheel(), "load": Inertia(J=1.5, w=0.0),
    }  # fmt: skip
    drive = Assembly(
        "drive", parts=parts, series={"shaft": ["torque", "engine", "wheel", "load"]},
        connect={"drive": ["signal.y", "torque.tau"]}
    )  # fmt: skip
    run = simulate(drive, "1.2 s", rtol=1e-9)
    release = next(event.time for event in run.events if event.after == "overrunning" and event.time > 0.1)
    assert release == pytest.approx(0.5, abs=1e-9)
    top = 8.0 / 2.0 / (2 * pi) * 2.0
    # From 0.5 s on the engine has der(w) = 16·sin(2·pi·t): it is as fast again at 1 s, never faster before.
    assert run.at(0.9)["engine.w"] == pytest.approx(top - 16 / (2 * pi) * (1 + np.cos(2 * pi * 0.9)), rel=1e-6)
    assert run.at(1.1)["engine.w"] == pytest.approx(run.at(1.1)["load.w"], abs=1e-9) or sin(2 * pi * 1.1) > 0
    assert run.energy().power_closure <= 1e-8


def test_two_freewheels_in_series() -> None:
    parts: dict[str, Component] = {
        "signal": Sine(amplitude="10 N.m", f=1.0), "torque": Torque(), "a": Inertia(J=0.5, phi=0.0, w=0.0),
        "first": Freewheel(), "b": Inertia(J=1.0, w=0.0), "second": Freewheel(), "c": Inertia(J=1.0, w=0.0),
        "oil": Damper(d=0.5), "wall": Fixed(),
    }  # fmt: skip
    chain = ["torque", "a", "first", "b", "second", "c", "oil", "wall"]
    drive = Assembly("drive", parts=parts, series={"shaft": chain}, connect={"drive": ["signal.y", "torque.tau"]})
    run = simulate(drive, "4 s")
    for wheel in ("first", "second"):
        assert np.min(run[f"{wheel}.w_rel"]) >= -1e-9
        assert np.max(run[f"{wheel}.tau"]) <= 1e-6
    assert run.energy().power_closure <= 1e-8


def test_unpressed_one_way_clutch_is_a_freewheel() -> None:
    ideal, clutch = driven(Freewheel()), driven(OneWayClutch(fn_max=10.0, f_normalized=0.0))
    for t in np.linspace(0.0, ideal.time[-1], 100):
        assert clutch.at(t)["load.w"] == pytest.approx(ideal.at(t)["load.w"], abs=1e-5)


def test_pressed_one_way_clutch_brakes_overrunning() -> None:
    run = driven(OneWayClutch(fn_max=4.0))
    slipping = run["coupling.w_rel"] > 1e-6
    np.testing.assert_allclose(run["coupling.tau"][slipping], 0.5 * 4.0, atol=1e-9)
    assert np.min(run["coupling.w_rel"]) >= -1e-9
    assert run.energy().power_closure <= 1e-8


def test_a_one_way_clutch_that_is_pushed_from_rest_holds_from_the_start() -> None:
    parts: dict[str, Component] = {
        "push": ConstantTorque(tau_constant=3.0), "engine": Inertia(J=1.0, phi=0.0, w=0.0),
        "coupling": OneWayClutch(fn_max=1.0), "load": Inertia(J=2.0, w=0.0),
    }  # fmt: skip
    run = simulate(Assembly("drive", parts=parts, series={"shaft": list(parts)}), "1 s")
    assert [(one.time, one.after) for one in run.events] == []
    assert run.final["load.w"] == pytest.approx(1.0, rel=1e-9)


def test_torque_limiter_slips_at_its_torque() -> None:
    parts: dict[str, Component] = {
        "engine": ConstantTorque(tau_constant=30.0), "motor": Inertia(J=1.0, phi=0.0, w=0.0),
        "limiter": TorqueLimiter(tau_max=5.0, w_rel=0.0),
        "load": Inertia(J=2.0),
    }  # fmt: skip
    run = simulate(Assembly("drive", parts=parts, series={"shaft": list(parts)}), "1 s")
    assert run.final["motor.w"] == pytest.approx(25.0, rel=1e-9)
    assert run.final["load.w"] == pytest.approx(2.5, rel=1e-9)
    assert run.energy()["limiter"].lost == pytest.approx(5.0 * 22.5 / 2, rel=1e-8)


def test_freewheel_stop_and_clutch_in_one_instant() -> None:
    """At 1 s the freewheel catches, the mass meets its stop and the clutch closes."""
    parts: dict[str, Component] = {
        "brake": ConstantTorque(tau_constant=-2.0), "fast": Inertia(J=1.0, phi=0.0, w=2.0), "wheel": Freewheel(),
        "slow": Inertia(J=1.0, phi=0.0, w=0.0),
        "signal": Step(start_time=1.0), "clutch": Clutch(capacity=3.0), "third": Inertia(J=1.0, phi=0.0, w=-1.0),
        "mass": MassWithStopAndFriction(m=1.0, smin=-5.0, smax=1.5, s=0.0, v=1.0),
        "push": ConstantForce(f_constant=1.0),
    }  # fmt: skip
    drive = Assembly(
        "drive", parts=parts, series={"slide": ["push", "mass"]},
        connect={
            "over": ["fast.flange_a", "wheel.flange_b", "brake.flange"], "under": ["slow.flange_a", "wheel.flange_a"],
            "plates": ["slow.flange_b", "clutch.flange_a"], "driven": ["clutch.flange_b", "third.flange_a"],
            "close": ["signal.y", "clutch.f_normalized"],
        },
    )  # fmt: skip
    run = simulate(drive, "3 s", rtol=1e-9)
    together = [event for event in run.events if abs(event.time - 1.0) < 1e-8]
    assert {event.mode for event in together} >= {"wheel.mode", "clutch.mode", "mass.stop"}
    assert run.final["mass.s"] == pytest.approx(1.5, abs=1e-12)
    assert run.final["wheel.w_rel"] >= -1e-9
    # After the lock-up all three turn together: momentum -1 at 1 s, then -2 N.m on 3 kg.m2.
    assert run.final["third.w"] == pytest.approx((2.0 - 1.0 - 2.0 * 3.0) / 3.0, rel=1e-6)
    assert run.energy().power_closure <= 1e-8


# -- where sticking alone leaves the torque open -----------------------------------------------------------------------

CREEPING: dict[str, Component] = {
    "bearing": BearingFriction(tau_pos=((0.0, 2.0),), creep=1e-9), "brake": Brake(capacity=2.0, creep=1e-9),
    "gear": LossyGear(ratio=1.0, loss_table=((0.0, 1.0, 1.0, 2.0, 2.0),), creep=1e-9),
}  # fmt: skip


@pytest.mark.parametrize("name", CREEPING)
def test_prescribed_motion_passes_through_zero(name: str) -> None:
    parts: dict[str, Component] = {
        "signal": Sine(amplitude="10 rad/s", f=1.0, phase=0.3), "motor": Speed(), "friction": CREEPING[name],
        "mass": Inertia(J=0.1),
    }  # fmt: skip
    wires = {"s": ["signal.y", "motor.w_ref"]}
    drive = Assembly("drive", parts=parts, series={"shaft": ["motor", "friction", "mass"]}, connect=wires)
    run = simulate(drive, "2 s", rtol=1e-8)
    torque = run["friction.flange_a.tau"] + run["friction.flange_b.tau"]
    moving = np.abs(run["mass.w"]) > 1e-3
    np.testing.assert_allclose(torque[moving], 2.0 * np.sign(run["mass.w"][moving]), atol=1e-9)
    assert run.energy()["friction"].lost == pytest.approx(2.0 * 10.0 * 4 / pi, rel=1e-5)
    assert run.energy().power_closure <= 1e-8


def test_two_brakes_on_one_shaft() -> None:
    """Together they hold 5 N.m; the one that creeps takes what the other cannot."""
    parts: dict[str, Component] = {
        "motor": TorqueStep(offset_torque=4.5, step_torque=1.5, start_time=1.0),
        "shaft": Inertia(J=0.5, phi=0.0, w=3.0),
        "one": Brake(capacity=2.0), "two": Brake(capacity=3.0, creep=1e-9),
    }  # fmt: skip
    run = simulate(Assembly("drive", parts=parts, series={"shaft": list(parts)}), "8 s", rtol=1e-8)
    assert run.at(0.9)["shaft.w"] == pytest.approx(3.0 - 0.9, rel=1e-6)
    assert run.final["shaft.w"] == pytest.approx(3.0 - 1.0 + 2.0 * 7.0, rel=1e-6)
    parts["motor"] = TorqueStep(offset_torque=4.5, step_torque=0.4, start_time=1.0)
    held = simulate(Assembly("drive", parts=parts, series={"shaft": list(parts)}), "20 s", rtol=1e-8)
    assert abs(held.final["shaft.w"]) < 1e-10
    assert held.final["one.tau"] + held.final["two.tau"] == pytest.approx(4.9, rel=1e-6)


SLIDES: dict[str, Component] = {
    "table": MachineTable(m=2.0, f_friction=3.0, s=0.0, v=2.0, creep=1e-9),
    "mass": MassWithStopAndFriction(m=2.0, F_Coulomb=3.0, s=0.0, v=2.0, creep=1e-9),
}


@pytest.mark.parametrize("name", SLIDES)
def test_a_slide_and_its_brake(name: str) -> None:
    """5 N stop 2 kg from 2 m/s within 0.8 s; then both hold 4 N."""
    parts: dict[str, Component] = {
        "push": ForceStep(step_force=4.0, start_time=1.0), "slide": SLIDES[name],
        "brake": TranslationalBrake(fn_max=4.0),
    }  # fmt: skip
    run = simulate(Assembly("drive", parts=parts, series={"slide": list(parts)}), "10 s", rtol=1e-8)
    assert run.at(0.5)["slide.v"] == pytest.approx(2.0 - 2.5 * 0.5, rel=1e-7)
    assert abs(run.final["slide.v"]) < 1e-10
    assert run.final["slide.f"] + run.final["brake.f"] == pytest.approx(4.0, rel=1e-6)


def test_a_load_and_a_brake() -> None:
    """5 N.m stop 0.5 kg.m2 from 5 rad/s within 0.5 s."""
    parts: dict[str, Component] = {
        "shaft": Inertia(J=0.5, phi=0.0, w=5.0), "brake": Brake(capacity=2.0),
        "load": SpeedDependentLoad(a=3.0, creep=1e-9),
    }  # fmt: skip
    run = simulate(Assembly("drive", parts=parts, series={"shaft": list(parts)}), "1 s", rtol=1e-8)
    assert run.at(0.25)["shaft.w"] == pytest.approx(2.5, rel=1e-7)
    assert abs(run.final["shaft.w"]) < 1e-12


# -- heat --------------------------------------------------------------------------------------------------------------


def test_friction_work_heats_the_lining() -> None:
    parts: dict[str, Component] = {
        "a": Inertia(J=1.0, phi=0.0, w=30.0), "clutch": Clutch(capacity=10.0), "b": Inertia(J=2.0, w=0.0),
        "lining": ThermalMass(C=50.0, T=300.0),
    }  # fmt: skip
    drive = Assembly(
        "drive", parts=parts, series={"shaft": ["a", "clutch", "b"]},
        connect={"heat": ["clutch.heat_port", "lining.port"]}
    )  # fmt: skip
    run = simulate(drive, "3 s", rtol=1e-9)
    work = 0.5 * (1.0 * 2.0 / 3.0) * 30.0**2
    assert run.final["lining.T"] == pytest.approx(300.0 + work / 50.0, rel=1e-9)
    assert run["clutch.loss_power"].max() == 0.0
    assert run.energy()["lining"].stored == pytest.approx(work, rel=1e-8)
    assert run.energy().power_closure <= 1e-8


def test_body_cools_down_exponentially() -> None:
    parts: dict[str, Component] = {
        "heater": HeatSource(Q_flow=5.0), "body": ThermalMass(C=40.0, T=350.0), "air": ThermalConductor(G=2.0),
        "room": FixedTemperature(T=290.0)
    }  # fmt: skip
    drive = Assembly(
        "body",
        parts=parts,
        connect={"hot": ["heater.port", "body.port", "air.port_a"], "cold": ["air.port_b", "room.port"]},
    )
    run = simulate(drive, "60 s", rtol=1e-9)
    steady = 290.0 + 5.0 / 2.0
    np.testing.assert_allclose(run["body.T"], steady + (350.0 - steady) * np.exp(-run.time / 20.0), rtol=1e-8)
    assert run.energy().power_closure <= 1e-8
