"""Freewheels, stops, clutches and brakes that change in one instant, exactly or within a picosecond."""

from typing import Any

import numpy as np
import pytest

from components import (
    Brake,
    Clutch,
    ConstantForce,
    ConstantTorque,
    Freewheel,
    IdealRollingWheel,
    Inertia,
    MassWithStopAndFriction,
    Step,
    TorqueStep,
)
from modelica_like import Assembly, Component, Solution, simulate

OFFSETS = [(0.0, 0.0), (1e-12, 0.0), (-1e-12, 1e-12), (0.0, -1e-12), (1e-9, -1e-9)]
"""By how much the clutch closes and the stop stands off the common instant, in s."""


def in_one_instant(clutch: float, stop: float) -> Solution:
    """At 1 s the freewheel catches, the clutch closes and the mass meets its stop."""
    parts: dict[str, Component] = {
        "pull": ConstantTorque(tau_constant=-2.0), "fast": Inertia(J=1.0, phi=0.0, w=2.0), "wheel": Freewheel(),
        "slow": Inertia(J=1.0, phi=0.0, w=0.0), "close": Step(start_time=1.0 + clutch), "clutch": Clutch(capacity=3.0),
        "third": Inertia(J=1.0, phi=0.0, w=-1.0), "push": ConstantForce(f_constant=1.0),
        "mass": MassWithStopAndFriction(m=1.0, smin=-5.0, smax=1.5 + 2.0 * stop, s=0.0, v=1.0),
    }  # fmt: skip
    drive = Assembly(
        "drive", parts=parts, series={"slide": ["push", "mass"]},
        connect={
            "over": ["fast.flange_a", "wheel.flange_b", "pull.flange"], "under": ["slow.flange_a", "wheel.flange_a"],
            "plates": ["slow.flange_b", "clutch.flange_a"], "driven": ["clutch.flange_b", "third.flange_a"],
            "close": ["close.y", "clutch.f_normalized"],
        },
    )  # fmt: skip
    return simulate(drive, "3 s", rtol=1e-9)


@pytest.mark.parametrize(("clutch", "stop"), OFFSETS)
def test_a_freewheel_a_stop_and_a_clutch(clutch: float, stop: float) -> None:
    """Momentum and energy before and after.

    At 1 s both left shafts rest and the third turns at -1 rad/s. The clutch pulls the left ones with -3 N.m, more than
    the -2 N.m of the engine can follow: der(fast.w) = -2, der(slow.w) = -3; so the freewheel overruns until the clutch
    locks at slow.w = third.w, -3·s = -1 + 3·s, s = 1/6 s after, at -0.5 rad/s. From then on slow and third turn on
    at -0.5 rad/s until fast has come down to it, at 1.25 s, and all three have der(w) = -2/3.
    """
    run = in_one_instant(clutch, stop)
    at_once = {event.mode for event in run.events if abs(event.time - 1.0) < 1e-8}
    assert at_once >= {"wheel.mode", "clutch.mode", "mass.stop"}
    assert run.at(1.1)["wheel.w_rel"] == pytest.approx(0.1, abs=1e-8)
    assert run.at(1.1)["slow.w"] == pytest.approx(-0.3, abs=1e-8)
    locked = [event.time for event in run.events if event.mode == "clutch.mode" and event.after == "stuck"]
    assert locked[-1] == pytest.approx(7 / 6, abs=1e-8)
    assert run.at(1.2)["third.w"] == pytest.approx(-0.5, abs=1e-8)
    assert run.at(1.2)["fast.w"] == pytest.approx(-0.4, abs=1e-8)
    caught = [event.time for event in run.events if event.mode == "wheel.mode" and event.after == "locked"]
    assert caught[-1] == pytest.approx(1.25, abs=1e-8)
    for shaft in ("fast", "slow", "third"):
        assert run.final[f"{shaft}.w"] == pytest.approx(-0.5 - 2 / 3 * 1.75, rel=1e-7)
    # The clutch loses the energy of the relative motion, 3 N.m times the way of slip, 1/12 rad; the stop m·v²/2.
    assert run.energy()["clutch"].lost == pytest.approx(3.0 / 12, rel=1e-6)
    assert run.energy()["mass"].at_events == pytest.approx(-2.0, rel=1e-7)
    assert run.final["mass.s"] == pytest.approx(1.5, abs=1e-8)
    assert run.final["mass.v"] == 0.0
    assert run.energy().power_closure <= 1e-8


@pytest.mark.parametrize("offset", [0.0, 1e-12, -1e-12])
def test_mirrored_freewheels_catch_together(offset: float) -> None:
    """Two engines left and right are faster than the middle and are braked alike; at 1 s both are caught."""
    parts: dict[str, Any] = {
        "pull1": ConstantTorque(tau_constant=-2.0), "engine1": Inertia(J=1.0, phi=0.0, w=2.0), "wheel1": Freewheel(),
        "pull2": ConstantTorque(tau_constant=-2.0), "engine2": Inertia(J=1.0, phi=0.0, w=2.0 + 2 * offset),
        "wheel2": Freewheel(), "middle": Inertia(J=2.0, phi=0.0, w=0.0),
    }  # fmt: skip
    drive = Assembly(
        "drive", parts=parts, series={"left": ["pull1", "engine1"], "right": ["pull2", "engine2"]},
        connect={
            "one": ["wheel1.flange_b", "engine1.flange_b"], "two": ["wheel2.flange_b", "engine2.flange_b"],
            "middle": ["middle.flange_a", "wheel1.flange_a", "wheel2.flange_a"],
        },
    )  # fmt: skip
    run = simulate(drive, "2 s", rtol=1e-9)
    caught = [event.time for event in run.events if event.after == "locked"]
    np.testing.assert_allclose(caught, 1.0, atol=1e-9)
    assert len(caught) == 2
    # 4 kg.m2 together under -4 N.m; nothing is lost, the speeds were equal.
    assert run.final["middle.w"] == pytest.approx(-1.0, rel=1e-9)
    assert run.final["engine1.w"] == pytest.approx(-1.0, rel=1e-9)
    assert run.energy()["wheel1"].lost == pytest.approx(0.0, abs=1e-9)
    assert run.energy().power_closure <= 1e-8


@pytest.mark.parametrize("offset", [0.0, 1e-12, -1e-12])
def test_friction_stops_a_mass_just_where_its_stop_is(offset: float) -> None:
    """v² / (2·a) is the distance: the mass comes to rest by friction and at the stop in the same instant."""
    mass = MassWithStopAndFriction(m=2.0, F_Coulomb=4.0, smax=1.0 + offset, s=0.0, v=2.0)
    run = simulate(
        Assembly("drive", parts={"push": ConstantForce(f_constant=0.0), "mass": mass}, series={"x": ["push", "mass"]}),
        "2 s",
        rtol=1e-10,
        atol=1e-12,
    )
    np.testing.assert_allclose([event.time for event in run.events], 1.0, atol=2e-6)
    assert run.final["mass.s"] == pytest.approx(1.0, abs=1e-9)
    assert run.final["mass.v"] == 0.0
    assert run.energy()["mass"].lost == pytest.approx(4.0, rel=1e-8)


@pytest.mark.parametrize("offset", [0.0, 1e-12, -1e-12])
def test_a_clutch_opens_just_when_it_locks(offset: float) -> None:
    """Slip 3 - 3·t: zero at 1 s, when the normal force goes; both shafts turn on at 1 rad/s."""
    parts: dict[str, Component] = {
        "fast": Inertia(J=1.0, phi=0.0, w=3.0), "clutch": Clutch(capacity=2.0), "slow": Inertia(J=2.0, w=0.0),
        "open": Step(offset=1.0, height=-1.0, start_time=1.0 + offset),
    }  # fmt: skip
    drive = Assembly(
        "drive", parts=parts, series={"shaft": ["fast", "clutch", "slow"]},
        connect={"s": ["open.y", "clutch.f_normalized"]},
    )  # fmt: skip
    run = simulate(drive, "2 s", rtol=1e-9)
    np.testing.assert_allclose([event.time for event in run.events], 1.0, atol=1e-9)
    assert run.events[-1].after == "free"
    for shaft in ("fast", "slow"):
        assert run.final[f"{shaft}.w"] == pytest.approx(1.0, rel=1e-9)
    assert run.energy()["clutch"].lost == pytest.approx(0.5 * (1.0 * 2.0 / 3.0) * 9.0, rel=1e-8)


@pytest.mark.parametrize("offset", [0.0, 1e-12, -1e-12])
def test_a_freewheel_catches_just_when_the_torque_turns(offset: float) -> None:
    """Braked, it would lock at 1 s; from 1 s on it is driven and goes on overrunning."""
    parts: dict[str, Component] = {
        "torque": TorqueStep(offset_torque=-2.0, step_torque=6.0, start_time=1.0 + offset),
        "fast": Inertia(J=1.0, phi=0.0, w=2.0),
        "wheel": Freewheel(), "slow": Inertia(J=3.0, w=0.0, phi=0.0),
    }  # fmt: skip
    drive = Assembly(
        "drive", parts=parts, series={"left": ["torque", "fast"]},
        connect={"over": ["fast.flange_b", "wheel.flange_b"], "under": ["wheel.flange_a", "slow.flange_a"]},
    )  # fmt: skip
    run = simulate(drive, "2 s", rtol=1e-9)
    assert run.final["fast.w"] == pytest.approx(4.0, rel=1e-8)
    assert run.final["slow.w"] == pytest.approx(0.0, abs=1e-9)
    assert run.final["wheel.mode"] == 0


@pytest.mark.parametrize("offset", [0.0, 1e-12, -1e-12])
def test_a_stop_behind_a_wheel_and_a_brake(offset: float) -> None:
    """A shaft drives a slide by a wheel of 0.5 m; at 1 s the slide meets its stop and the brake closes.

    Before, 4 N.m move 1.5 kg.m2 + 2 kg·(0.5 m)² = 2 kg.m2; afterwards the stop alone holds the slide, and so the shaft.
    A brake that closes then holds the same motion, which only a creep can decide.
    """
    parts: dict[str, Component] = {
        "torque": ConstantTorque(tau_constant=4.0), "shaft": Inertia(J=1.5, phi=0.0, w=0.0),
        "brake": Brake(capacity=1.0, creep=1e-9), "wheel": IdealRollingWheel(radius=0.5),
        "mass": MassWithStopAndFriction(m=2.0, smin=-5.0, smax=0.5), "close": Step(start_time=1.0 + offset),
    }  # fmt: skip
    drive = Assembly(
        "drive", parts=parts, series={"shaft": ["torque", "shaft", "brake", "wheel", "mass"]},
        connect={"s": ["close.y", "brake.f_normalized"]},
    )  # fmt: skip
    run = simulate(drive, "2 s", rtol=1e-9)
    assert {event.mode for event in run.events if abs(event.time - 1.0) < 1e-8} >= {"brake.mode", "mass.stop"}
    assert run.at(0.999999)["shaft.w"] == pytest.approx(2.0, rel=1e-5)
    assert run.final["mass.s"] == pytest.approx(0.5, abs=1e-9)
    assert abs(run.final["shaft.w"]) < 1e-8
    assert run.final["brake.tau"] + run.final["mass.f"] / 2.0 == pytest.approx(4.0, rel=1e-6)
