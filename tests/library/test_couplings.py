"""Universal joints, torque converters, bristle friction: closed forms, and an independent solver."""

from math import cos, exp, pi
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from components import (
    CentrifugalClutch,
    ConstantSpeed,
    ConstantTorque,
    Damper,
    Fixed,
    Inertia,
    LuGreFriction,
    Ramp,
    Spring,
    Torque,
    TorqueConverter,
    UniversalJoint,
)
from modelica_like import Assembly, Component, Solution, simulate

TIGHT: dict[str, Any] = {"rtol": 1e-9, "atol": 1e-11}
CAPACITY = ((0.0, 2e-3), (0.8, 1.5e-3), (1.0, 0.0))
RATIO = ((0.0, 2.0), (0.85, 1.0))


def shaft(until: float = 1.0, **parts: Component) -> Solution:
    return simulate(Assembly("drive", parts=parts, series={"shaft": list(parts)}), until, **TIGHT)


def test_universal_joint_after_hooke() -> None:
    """tan(phi_b)·cos(beta) = tan(phi_a) over several turns; the speeds as their derivatives."""
    beta = 0.6
    run = shaft(2.0, motor=ConstantSpeed(w_fixed=7.0), part=UniversalJoint(beta=beta), J=Inertia(J=0.3))
    a, b = run["motor.phi"], run["J.phi"]
    np.testing.assert_allclose(np.sin(a) * np.cos(b), np.cos(a) * np.sin(b) * cos(beta), atol=1e-9)
    assert np.max(np.abs(b - a)) < pi / 4
    np.testing.assert_allclose(run["J.w"], 7 * cos(beta) / (1 - (np.sin(beta) * np.cos(a)) ** 2), rtol=1e-7)
    assert run.energy().power_closure <= 1e-8


def test_universal_joint_in_a_free_shaft_keeps_the_energy() -> None:
    """No torque: J1·w1²/2 + J2·w2²/2 stays, and w1 follows as a function of the angle."""
    # The drift is that of the run itself: its local errors add up to a hundred times the tolerance.
    parts = {"J1": Inertia(J=0.4, phi=0.0, w=5.0), "part": UniversalJoint(beta="40 deg"), "J2": Inertia(J=0.7)}
    drive = Assembly("drive", parts=parts, series={"shaft": list(parts)})
    run = simulate(drive, 3.0, rtol=1e-12, atol=1e-14)
    bent = cos(40 / 180 * pi)
    ratio = bent / (bent**2 * np.cos(run["J1.phi"]) ** 2 + np.sin(run["J1.phi"]) ** 2)
    energy = 0.4 * 5**2 + 0.7 * (5 / bent) ** 2
    np.testing.assert_allclose(run["J1.w"], np.sqrt(energy / (0.4 + 0.7 * ratio**2)), rtol=1e-6)
    assert run.energy().drift <= 1e-8


def test_housing_of_a_universal_joint_carries_the_difference() -> None:
    parts = {
        "motor": ConstantSpeed(w_fixed=7.0),
        "part": UniversalJoint(beta=0.5),
        "load": Damper(d=0.2, phi_rel=0.0),
        "wall": Fixed(),
    }
    mount: dict[str, Component] = {"frame": Inertia(J=1.0, phi=0.0, w=0.0), "arm": Spring(c=1e3), "ground": Fixed()}
    series = {"s": list(parts), "m": list(mount)}
    drive = Assembly("d", parts={**parts, **mount}, series=series, connect={"h": ["part.support", "frame.flange_a"]})
    run = simulate(drive, 1.0)
    both = run["part.flange_a.tau"] + run["part.flange_b.tau"]
    assert np.ptp(both) > 0.1
    np.testing.assert_allclose(run["part.support.tau"], -both, atol=1e-9)
    assert run.energy().power_closure <= 1e-8


@pytest.mark.parametrize(
    ("pump", "turbine", "tau_pump", "tau_turbine"),
    [
        (100.0, 0.0, 2e-3 * 1e4, -2 * 2e-3 * 1e4),
        (100.0, 40.0, 1.75e-3 * 1e4, -(2 - 0.4 / 0.85) * 1.75e-3 * 1e4),
        (100.0, 90.0, 0.75e-3 * 1e4, -0.75e-3 * 1e4),
        (100.0, 100.0, 0.0, 0.0),
        (80.0, 100.0, -1.5e-3 * 1e4, 1.5e-3 * 1e4),
        (100.0, -30.0, 2e-3 * 1e4, -2 * 2e-3 * 1e4),
        (0.0, 0.0, 0.0, 0.0),
    ],
)
def test_torque_converter(pump: float, turbine: float, tau_pump: float, tau_turbine: float) -> None:
    """Stall, conversion, coupling, no slip, overrun, reversed turbine, standstill."""
    converter = TorqueConverter(capacity=CAPACITY, torque_ratio=RATIO)
    run = shaft(motor=ConstantSpeed(w_fixed=pump), part=converter, load=ConstantSpeed(w_fixed=turbine))
    ours = run.final["part.flange_a.tau"], run.final["part.flange_b.tau"]
    assert ours == pytest.approx((tau_pump, tau_turbine), rel=1e-9, abs=1e-9)
    assert run["part.loss_power"][-1] == pytest.approx(tau_pump * pump + tau_turbine * turbine, rel=1e-9, abs=1e-9)
    assert run["part.loss_power"][-1] >= 0


def test_torque_converter_starts_a_vehicle() -> None:
    """Engine and vehicle inertia, against a solution of the equations written by hand."""

    def rates(t: float, w: Any) -> list[float]:
        x = w[1] / w[0]
        torque = np.interp(x, [0, 0.8, 1], [2e-3, 1.5e-3, 0]) * w[0] ** 2
        return [(60 - torque) / 0.2, (np.interp(x, [0, 0.85], [2, 1]) * torque - 0.1 * w[1]) / 3.0]

    run = shaft(
        4.0, engine=ConstantTorque(tau_constant=60.0), J1=Inertia(J=0.2, phi=0.0, w=80.0),
        part=TorqueConverter(capacity=CAPACITY, torque_ratio=RATIO), J2=Inertia(J=3.0, phi=0.0, w=0.0),
        drag=Damper(d=0.1), road=Fixed(),
    )  # fmt: skip
    oracle = solve_ivp(
        rates, (0, 4), [80.0, 0.0], method="LSODA", rtol=1e-10, atol=1e-10, dense_output=True, max_step=0.01
    )
    for t in (0.2, 1.0, 2.5, 4.0):
        assert [run.at(t)["J1.w"], run.at(t)["J2.w"]] == pytest.approx(list(oracle.sol(t)), rel=1e-5)
    assert run.energy().power_closure <= 1e-8


def bristles(**more: float) -> LuGreFriction:
    values = {
        "sigma_0": 1e4,
        "sigma_1": 20.0,
        "sigma_2": 0.4,
        "tau_Coulomb": 1.0,
        "tau_Stribeck": 0.5,
        "w_Stribeck": 0.1,
    }
    return LuGreFriction(**{**values, **more})


@pytest.mark.parametrize("w", [-2.0, -0.05, 0.1, 3.0])
def test_steady_sliding_with_bristles(w: float) -> None:
    run = shaft(1.0, motor=ConstantSpeed(w_fixed=w), part=bristles())
    wanted = np.sign(w) * (1 + 0.5 * exp(-((w / 0.1) ** 2))) + 0.4 * w
    assert run.final["part.tau"] == pytest.approx(wanted, rel=1e-6)


def test_break_away_with_bristles_against_an_independent_solver() -> None:
    """A torque that rises through the break-away torque: presliding, break-away, sliding."""

    def rates(t: float, y: Any) -> list[float]:
        _, w, z = y
        dz = w - 1e4 * abs(w) / (1 + 0.5 * exp(-((w / 0.1) ** 2))) * z
        friction = 1e4 * z + 20 * exp(-((w / 0.05) ** 2)) * dz + 0.4 * w
        return [w, (min(t, 1.0) * 2.5 - friction) / 0.1, dz]

    parts: dict[str, Component] = {
        "ramp": Ramp(height="2.5 N.m", duration="1 s"), "torque": Torque(), "J": Inertia(J=0.1, phi=0.0, w=0.0),
        "part": bristles(w_damping=0.05),
    }  # fmt: skip
    drive = Assembly("d", parts=parts, series={"s": ["torque", "J", "part"]}, connect={"t": ["ramp.y", "torque.tau"]})
    run = simulate(drive, 1.5, points=10000, **TIGHT)
    oracle = solve_ivp(rates, (0, 1.5), [0, 0, 0], method="Radau", rtol=1e-9, atol=1e-13, dense_output=True)
    for name, row in (("J.phi", 0), ("J.w", 1), ("part.z", 2)):
        theirs = oracle.sol(run.time)[row]
        assert np.max(np.abs(run[name] - theirs)) <= 1e-5 * np.ptp(theirs)
    assert np.min(run["part.loss_power"]) >= -1e-9
    assert run.energy().power_closure <= 1e-8


def test_a_centrifugal_clutch_without_springs_starts_softly() -> None:
    """The torque grows with the fourth power of the time. Of the momentum 1/2·100·t² all is in the two wheels."""
    parts = {
        "ramp": Ramp(height="100 N.m", duration="1 s"), "motor": Torque(), "J1": Inertia(J=0.1),
        "clutch": CentrifugalClutch(m=0.05, r_m=0.05, R=0.1), "J2": Inertia(J=0.3),
    }  # fmt: skip
    shaft = {"shaft": ["motor", "J1", "clutch", "J2"]}
    run = simulate(Assembly("d", parts=parts, series=shaft, connect={"c": ["ramp.y", "motor.tau"]}), 1.0, start="rest")
    assert [event.after for event in run.events if event.mode == "clutch.mode"] == ["backward"]
    assert 0.1 * run.final["J1.w"] + 0.3 * run.final["J2.w"] == pytest.approx(50.0, rel=1e-7)
    # J2 follows the torque n·mu·R·m·r_m·w².
    work = np.trapezoid(0.6 * 0.1 * 0.05 * 0.05 * run["J1.w"] ** 2, run.time)
    assert 0.3 * run.final["J2.w"] == pytest.approx(work, rel=1e-5)
