"""Vehicles, rolling, racks and wheels in movable housings, eddy current brakes on slides."""

from math import sqrt
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from components import (
    ConstantForce,
    ConstantTorque,
    ConstantVelocity,
    EddyCurrentForce,
    FixedTemperature,
    IdealGearR2T,
    IdealRollingWheel,
    Inertia,
    Mass,
    RollingResistance,
    Sine,
    ThermalConductor,
    ThermalMass,
    Vehicle,
)
from modelica_like import Assembly, Component, simulate

TIGHT: dict[str, Any] = {"rtol": 1e-9, "atol": 1e-11}
G = 9.80665


def test_vehicle_in_wind_on_a_slope_against_an_independent_solver() -> None:
    """A hill, head wind, a drive: equations written by hand."""

    def rates(t: float, y: Any) -> list[float]:
        slope = 0.05 * np.sin(2 * np.pi * 0.1 * t)
        weight, wind = 1000 * G / sqrt(1 + slope**2), y[1] + 8
        force = 500 / 0.3 - 0.5 * 0.4 * 2 * 1.2 * wind * abs(wind) - weight * (slope + 0.012)
        return [y[1], force / (1000 + 9 / 0.3**2)]

    parts: dict[str, Component] = {
        "hill": Sine(amplitude=0.05, f=0.1), "motor": ConstantTorque(tau_constant=500.0),
        "car": Vehicle(m=1000.0, J=9.0, R=0.3, A=2.0, Cd=0.4, Cr=0.012, v_wind=-8.0, s=0.0, v=2.0),
    }  # fmt: skip
    connect = {"h": ["hill.y", "car.inclination"], "m": ["motor.flange", "car.flange_r"]}
    run = simulate(Assembly("d", parts=parts, connect=connect), 20.0, **TIGHT)
    oracle = solve_ivp(rates, (0, 20), [0.0, 2.0], rtol=1e-10, atol=1e-10, dense_output=True)
    for t in (5.0, 12.0, 20.0):
        assert [run.at(t)["car.s"], run.at(t)["car.v"]] == pytest.approx(list(oracle.sol(t)), rel=1e-6)
    assert run.energy().power_closure <= 1e-8
    assert np.min(run["car.loss_power"]) >= 0


@pytest.mark.parametrize("v", [-3.0, 0.05, 4.0])
def test_rolling_resistance(v: float) -> None:
    wheels = RollingResistance(weight=500.0, Cr=0.02, inclination=0.3, v0=0.1)
    parts: dict[str, Component] = {"drive": ConstantVelocity(v_fixed=v), "wheels": wheels}
    run = simulate(Assembly("d", parts=parts, series={"s": list(parts)}), 1.0)
    wanted = 0.02 * 500 / sqrt(1 + 0.3**2) * np.tanh(50 * v / 0.1)
    assert run.final["wheels.f"] == pytest.approx(wanted, rel=1e-9)
    assert run["wheels.loss_power"][-1] == pytest.approx(wanted * v, rel=1e-9)


@pytest.mark.parametrize("part", [IdealGearR2T(ratio=10.0), IdealRollingWheel(radius=0.1)], ids=["gear", "wheel"])
def test_housings_feel_the_reaction(part: Component) -> None:
    """Free housings of shaft and slide: all momenta and angular momenta stay zero but for the motor's impulse."""
    parts: dict[str, Component] = {
        "motor": ConstantTorque(tau_constant=2.0), "J": Inertia(J=0.05, phi=0.0, w=0.0), "part": part,
        "m": Mass(m=2.0), "stator": Inertia(J=0.1, phi=0.0, w=0.0), "bed": Mass(m=5.0, s=0.0, v=0.0),
    }  # fmt: skip
    connect = {"r": ["part.support_r", "stator.flange_a"], "t": ["part.support_t", "bed.flange_a"]}
    drive = Assembly("d", parts=parts, series={"s": ["motor", "J", "part", "m"]}, connect=connect)
    run = simulate(drive, 1.0, **TIGHT)
    final = run.final
    assert 2.0 * final["m.v"] + 5.0 * final["bed.v"] == pytest.approx(0.0, abs=1e-9)
    assert 0.05 * final["J.w"] + 0.1 * final["stator.w"] == pytest.approx(2.0 * 1.0, rel=1e-9)
    assert final["m.v"] - final["bed.v"] == pytest.approx(0.1 * (final["J.w"] - final["stator.w"]), rel=1e-9)
    # The rolling force F: der(v_rel) = F·(1/2 + 1/5) = 0.1·(40 - 0.1·F·(1/0.05 + 1/0.1))
    force = 4.0 / (0.7 + 0.01 * 30)
    assert final["m.v"] == pytest.approx(force / 2.0, rel=1e-9)
    assert run.energy().power_closure <= 1e-8


def test_eddy_current_brake_on_a_slide() -> None:
    """Largest force at v_nominal; coasting: ln(v) + v²/(2·v_n²) falls by 2·f_n/(m·v_n) a second."""
    parts: dict[str, Component] = {
        "m": Mass(m=2.0, s=0.0, v=8.0),
        "brake": EddyCurrentForce(f_nominal=30.0, v_nominal=3.0),
    }
    run = simulate(Assembly("d", parts=parts, series={"s": list(parts)}), 1.0, **TIGHT)
    v = run["m.v"]
    np.testing.assert_allclose(np.log(v) + v**2 / 18, np.log(8) + 64 / 18 - 2 * 30 / (2 * 3) * run.time, atol=1e-7)
    assert np.max(run["brake.f"]) == pytest.approx(30.0, rel=1e-4)
    assert run.energy().power_closure <= 1e-8


def test_warm_brake_has_its_peak_at_a_higher_velocity() -> None:
    """At 100 K above T_ref the resistance is 1.4 times as high."""
    parts: dict[str, Component] = {
        "drive": ConstantForce(f_constant=30.0), "m": Mass(m=2.0, s=0.0, v=3.0 * 1.4),
        "brake": EddyCurrentForce(f_nominal=30.0, v_nominal=3.0, alpha20=4e-3),
        "rail": ThermalMass(C=1e9, T=393.15), "air": FixedTemperature(), "cooling": ThermalConductor(G=1.0),
    }  # fmt: skip
    connect = {"h": ["brake.heat_port", "rail.port", "cooling.port_a"], "c": ["cooling.port_b", "air.port"]}
    run = simulate(Assembly("d", parts=parts, series={"s": ["drive", "m", "brake"]}, connect=connect), 1.0)
    assert run.final["brake.f"] == pytest.approx(30.0, rel=1e-6)
    assert run.final["m.v"] == pytest.approx(4.2, rel=1e-6)
    assert run.energy().power_closure <= 1e-8
