"""Power electronics, electronic loads, and controllers with limits."""

from math import exp
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from components import (
    PI,
    Capacitor,
    ConstantTorque,
    ConstantVoltage,
    CurrentSink,
    Ground,
    HBridge,
    Inductor,
    Inertia,
    Limiter,
    P,
    PermanentMagnetDCMachine,
    Resistor,
    Sine,
    SpeedSensor,
    Torque,
)
from modelica_like import Assembly, Component, Solution, simulate

CASCADE = Path(__file__).parents[2] / "examples" / "components" / "cascade_control.toml"
TIGHT: dict[str, Any] = {"rtol": 1e-9, "atol": 1e-11}


def bridge(part: HBridge, until: float = 0.1) -> Solution:
    parts = {
        "U": ConstantVoltage(V=24.0),
        "part": part,
        "L": Inductor(L=0.05, i=0.0),
        "R": Resistor(R=2.0),
        "g": Ground(),
    }
    connect = {
        "p": ["U.p", "part.p"], "n": ["U.n", "part.n", "g.p"], "1": ["part.p_out", "L.p"], "2": ["L.n", "R.p"],
        "3": ["R.n", "part.n_out"],
    }  # fmt: skip
    return simulate(Assembly("d", parts=parts, connect=connect), until, **TIGHT)


@pytest.mark.parametrize("u", [-1.0, -0.4, 0.0, 0.3, 1.0])
@pytest.mark.parametrize("unipolar", [False, True])
def test_mean_voltage_and_switching_times(u: float, unipolar: bool) -> None:
    run = bridge(HBridge(f=100.0, u=u, unipolar=unipolar))
    share, high, low = (abs(u), np.sign(u), 0.0) if unipolar else ((1 + u) / 2, 1.0, -1.0)
    offs = [event.time for event in run.events if event.after == "off"]
    assert offs == pytest.approx([0.01 * (k + share) for k in range(len(offs))], abs=1e-12)
    assert len(offs) >= 10
    # The current follows the voltage of each part of a period exponentially.
    current, wanted = 0.0, []
    for _ in range(10):
        for level, part in ((high, share), (low, 1 - share)):
            current = 12 * level + (current - 12 * level) * exp(-part * 0.01 / 0.025)
        wanted.append(current)
    ours = [run.at(0.01 * (k + 1))["L.i"] for k in range(10)]
    assert ours == pytest.approx(wanted, rel=1e-6, abs=1e-8)
    assert run.energy().power_closure <= 1e-8


def test_bridge_without_switching_gives_the_mean() -> None:
    run = bridge(HBridge(switching=False, R=0.4, u=2.0), 1.0)
    assert run.final["L.i"] == pytest.approx(24 / 2.4, rel=1e-6)
    assert run.final["U.i"] == pytest.approx(-24 / 2.4, rel=1e-6)
    assert run["part.loss_power"][-1] == pytest.approx(0.4 * 10**2, rel=1e-6)
    assert run.energy().power_closure <= 1e-8


def test_the_outputs_of_a_bridge_lie_around_the_middle_of_its_supply() -> None:
    parts: dict[str, Component] = {
        "U": ConstantVoltage(V=24.0), "part": HBridge(switching=False, u=0.5), "R": Resistor(R=2.0), "below": Ground(),
        "V": ConstantVoltage(V=6.0),
    }  # fmt: skip
    connect = {
        "p": ["U.p", "part.p"], "n": ["U.n", "part.n", "V.p"], "g": ["V.n", "below.p"], "1": ["part.p_out", "R.p"],
        "2": ["R.n", "part.n_out"],
    }  # fmt: skip
    run = simulate(Assembly("d", parts=parts, connect=connect), 0.1)
    assert (run.final["part.p_out.v"], run.final["part.n_out.v"]) == pytest.approx((18.0 + 6.0, 18.0 - 6.0))


def test_fast_switching_drives_a_motor_like_the_mean() -> None:
    """The ripple of the current shakes the speed by no more than the theory of small ripples: V·k/(32·f²·L·J)."""
    finals = []
    for switching in (False, True):
        parts: dict[str, Component] = {
            "U": ConstantVoltage(V=100.0), "part": HBridge(f=500.0, u=0.5, switching=switching),
            "motor": PermanentMagnetDCMachine(k=0.6, ia=0.0, w=80.0, phi=0.0), "g": Ground(),
            "load": ConstantTorque(tau_constant=-5.0),
        }  # fmt: skip
        connect = {
            "p": ["U.p", "part.p"], "n": ["U.n", "part.n", "g.p"], "1": ["part.p_out", "motor.ap"],
            "2": ["part.n_out", "motor.an"], "3": ["motor.flange", "load.flange"],
        }  # fmt: skip
        run = simulate(Assembly("d", parts=parts, connect=connect), 0.4, **TIGHT)
        finals.append(run.final["motor.w"])
        assert run.energy().power_closure <= 1e-8
    ripple = 100 * 0.6 / (32 * 500**2 * 1.5e-3 * 0.15)
    assert abs(finals[1] - finals[0]) <= 4 * ripple


def test_electronic_load_stops_at_zero_voltage() -> None:
    """A capacitor is emptied linearly, and stays empty."""
    parts: dict[str, Component] = {"C": Capacitor(C=1e-3, v=10.0), "sink": CurrentSink(i_ref=0.1), "g": Ground()}
    connect = {"p": ["C.p", "sink.p"], "n": ["C.n", "sink.n", "g.p"]}
    run = simulate(Assembly("d", parts=parts, connect=connect), 0.3, **TIGHT)
    assert run.at(0.05)["C.v"] == pytest.approx(5.0, rel=1e-9)
    assert run.events[0].time == pytest.approx((10 - 0.1 * 1e-3) / 100, rel=1e-9)
    assert np.min(run["C.v"]) >= -1e-8
    assert (run.final["C.v"], run.final["sink.i"]) == pytest.approx((0.0, 0.0), abs=1e-7)
    assert run.energy().power_closure <= 1e-8


def test_electronic_load_on_a_generator_that_is_stopped_and_started_again() -> None:
    """It draws 2 A where k·w - R·2 A suffices, k·w/(R + R_min) below that, and nothing in reverse."""
    k, R, R_min = 0.05, 0.5, 1e-3
    parts: dict[str, Component] = {
        "generator": PermanentMagnetDCMachine(k=k, Ra=R, La=0.0, Jr=1.0, quasi_static=True, w=100.0, phi=0.0),
        "sink": CurrentSink(i_ref=2.0), "wave": Sine(amplitude="400 N.m", f=1.0, phase="180 deg"), "drive": Torque(),
        "g": Ground(),
    }  # fmt: skip
    connect = {
        "p": ["generator.ap", "sink.p"], "n": ["generator.an", "sink.n", "g.p"],
        "s": ["drive.flange", "generator.flange"], "w": ["wave.y", "drive.tau"],
    }  # fmt: skip
    run = simulate(Assembly("d", parts=parts, connect=connect), 1.0, rtol=1e-7)
    w = run["generator.w"]
    assert np.min(w) < -5
    wanted = np.minimum(2.0, np.maximum(k * w, 0) / (R + R_min))
    np.testing.assert_allclose(run["sink.i"], wanted, atol=1e-8)
    assert [event.after for event in run.events if event.mode == "sink.load"] == [
        "empty",
        "reversed",
        "empty",
        "sinking",
    ]
    assert np.min(run["sink.v"] * run["sink.i"]) >= 0
    assert run.energy().power_closure <= 1e-8


def test_limiter() -> None:
    parts: dict[str, Component] = {
        "wave": Sine(amplitude="4 N.m", f=1.0), "part": Limiter(y_max="2 N.m", y_min="-1 N.m"), "torque": Torque(),
        "J": Inertia(J=1.0, phi=0.0, w=0.0),
    }  # fmt: skip
    connect = {"u": ["wave.y", "part.u"], "y": ["part.y", "torque.tau"]}
    run = simulate(Assembly("d", parts=parts, series={"s": ["torque", "J"]}, connect=connect), 1.0, **TIGHT)
    np.testing.assert_allclose(run["part.y"], np.clip(4 * np.sin(2 * np.pi * run.time), -1, 2), atol=1e-9)
    kinks = [np.arcsin(0.5), np.pi - np.arcsin(0.5), np.pi + np.arcsin(0.25), 2 * np.pi - np.arcsin(0.25)]
    assert [event.time for event in run.events] == pytest.approx(np.array(kinks) / (2 * np.pi), rel=1e-9)


def test_proportional_controller_with_limit() -> None:
    """Full torque until the error is y_max/k, from there exponentially to the set value."""
    parts: dict[str, Component] = {
        "part": P(k="2 N.m.s/rad", y_max="6 N.m", u_s="10 rad/s"), "torque": Torque(),
        "J": Inertia(J=0.5, phi=0.0, w=0.0), "speed": SpeedSensor(),
    }  # fmt: skip
    connect = {"u": ["speed.w", "part.u_m"], "y": ["part.y", "torque.tau"]}
    run = simulate(Assembly("d", parts=parts, series={"s": ["torque", "J", "speed"]}, connect=connect), 1.0, **TIGHT)
    assert run.events[0].time == pytest.approx(7 / 12, rel=1e-9)
    assert run.final["J.w"] == pytest.approx(10 - 3 * exp(-4 * (1 - 7 / 12)), rel=1e-8)


@pytest.mark.parametrize("error", [5.0, -5.0])
def test_integral_at_a_limit(error: float) -> None:
    """Back-calculation: the integral nears sign(e)·y_max/k - e·(1 - Ni) with the time constant Ni·Ti."""
    parts: dict[str, Component] = {
        "part": PI(k="2 N.m", Ti=0.4, y_max="4 N.m", Ni=0.5, u_s=error, u_m=0.0, integral=0.0), "torque": Torque(),
        "J": Inertia(J=0.5, phi=0.0, w=0.0),
    }  # fmt: skip
    drive = Assembly("d", parts=parts, series={"s": ["torque", "J"]}, connect={"y": ["part.y", "torque.tau"]})
    run = simulate(drive, 1.0, **TIGHT)
    limit = np.copysign(4.0, error)
    final = limit / 2 - error * (1 - 0.5)
    np.testing.assert_allclose(run["part.integral"], final * (1 - np.exp(-run.time / (0.5 * 0.4))), atol=1e-8)
    np.testing.assert_allclose(run["part.y"], limit, atol=1e-9)


def test_cascade_at_its_limits() -> None:
    """A long way: full current, then the largest speed, then an arrival without overshoot: no integral winds up."""
    values = {"target": 1.0, "load": 0.0, "position_loop.y_max": 4.0}
    run = simulate(CASCADE, parameters=values, until="0.5 s", points=2000)
    assert np.max(np.abs(run["speed_loop.y"])) == pytest.approx(150.0)
    assert run.at(0.15)["machine.w"] == pytest.approx(4.0, rel=1e-4)
    assert np.max(run["machine.phi"]) <= 1.0 + 1e-4
    assert run.final["machine.phi"] == pytest.approx(1.0, rel=1e-6)
    assert run.energy().power_closure <= 1e-8


def test_full_current_of_the_cascade() -> None:
    """The back-EMF, which rises with the speed, costs the PI controller of the current k·a·2T/Ra of its 150 A."""
    run = simulate(CASCADE, parameters={"target": 20.0, "load": 0.0}, until="0.2 s")
    acceleration = 0.6366 * 150 / (0.3 + 0.6366**2 * 2 * 0.5e-3 / 0.05)
    assert run.at(0.2)["machine.w"] - run.at(0.15)["machine.w"] == pytest.approx(acceleration * 0.05, rel=1e-4)
