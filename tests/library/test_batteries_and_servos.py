"""Batteries, servo motors and electrical sources by signals, against closed forms and an independent solver."""

from math import exp
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from components import (
    Battery,
    Constant,
    ElectricalPowerSensor,
    Fixed,
    Ground,
    Inertia,
    PositionServo,
    PrescribedHeatFlow,
    PrescribedTemperature,
    Ramp,
    Resistor,
    ServoMotor,
    SignalCurrent,
    Step,
    ThermalConductor,
    ThermalMass,
)
from modelica_like import Assembly, Component, Solution, simulate
from modelica_like.show.report.run import notices

TIGHT: dict[str, Any] = {"rtol": 1e-9, "atol": 1e-11}
CELL: dict[str, Any] = {"ocv": ((0.0, 3.0), (0.5, 3.5), (1.0, 4.2)), "Q": "2 A.h", "R_i": 0.02}


def discharged(battery: Battery, current: float, until: float) -> Solution:
    """Take a current out of a battery."""
    parts = {"b": battery, "load": SignalCurrent(i_ref=current), "earth": Ground()}
    connect = {"plus": ["b.p", "load.p"], "minus": ["b.n", "load.n", "earth.p"]}
    return simulate(Assembly("d", parts=parts, connect=connect), until, **TIGHT)


def test_a_battery_is_discharged() -> None:
    """10 × 2 cells give 4 A: 2 A each, a quarter of their charge in 900 s."""
    run = discharged(Battery(**CELL, R_1=0.01, C_1=2000.0, N_s=10, N_p=2), 4.0, 900.0)
    assert run.final["b.soc"] == pytest.approx(0.75, rel=1e-9)
    assert run.final["b.v_cell"] == pytest.approx(3.85, rel=1e-9)
    assert run.at(10)["b.v_1"] == pytest.approx(-0.02 * (1 - exp(-0.5)), rel=1e-7)
    assert run.final["b.v"] == pytest.approx(10 * (3.85 - 0.04 - 0.02), rel=1e-8)
    energy = run.energy()
    assert energy.power_closure < 1e-8
    slow = 0.01 * 4 * (900 - 2 * 20 + 20 / 2)  # of R_1·i²·(1 - exp(-t/T))²
    assert energy["b"].lost == pytest.approx(20 * (0.02 * 4 * 900 + slow), rel=1e-6)
    given = 20 * 7200 * 0.25 * (4.2 + 3.85) / 2
    assert energy["b"].stored == pytest.approx(-given + 20 * 0.5 * 2000 * 0.02**2, rel=1e-6)
    assert notices(run) == []


def test_a_battery_tells_that_it_is_empty_or_full() -> None:
    empty = discharged(Battery(**CELL, soc=0.1), 2.0, 400.0)
    assert notices(empty) == ["At 360 s b is empty: it gives more than it had."]
    full = discharged(Battery(**CELL, soc=0.9), -2.0, 400.0)
    assert notices(full) == ["At 360 s b is overcharged."]
    partly = discharged(Battery(ocv=((0.2, 3.0), (0.9, 4.0)), Q="2 A.h", soc=0.4), 2.0, 800.0)
    assert notices(partly) == ["At 720 s b leaves the rows of ocv: its last value holds."]


def test_a_wattmeter_and_heat_by_signals() -> None:
    parts: dict[str, Component] = {
        "source": SignalCurrent(), "signal": Ramp(height=-4.0, duration=2.0), "meter": ElectricalPowerSensor(),
        "R": Resistor(R=3.0), "earth": Ground(), "heat": PrescribedHeatFlow(), "power": Constant(k="50 W"),
        "body": ThermalMass(C=200.0, T=300.0), "wall": ThermalConductor(G=4.0), "air": PrescribedTemperature(),
        "weather": Constant(k="290 K"),
    }  # fmt: skip
    connect = {
        "u": ["signal.y", "source.i_ref"], "a": ["source.p", "meter.pc", "meter.pv"], "b": ["meter.nc", "R.p"],
        "c": ["R.n", "source.n", "meter.nv", "earth.p"], "q": ["power.y", "heat.Q_flow"],
        "h": ["heat.port", "body.port", "wall.port_a"], "w": ["wall.port_b", "air.port"], "t": ["weather.y", "air.T"],
    }  # fmt: skip
    run = simulate(Assembly("d", parts=parts, connect=connect), 2.0, **TIGHT)
    assert run.final["meter.power"] == pytest.approx(3 * 4**2, rel=1e-8)
    settled = 290 + 50 / 4
    assert run.final["body.T"] == pytest.approx(settled + (300 - settled) * exp(-4 * 2 / 200), rel=1e-9)
    assert run.energy().power_closure < 1e-8


MOTOR: dict[str, Any] = {"k": 0.5, "R": 0.8, "L": 4e-3, "J": 1e-3, "J_total": 3e-3, "I_max": 30.0, "V_max": 150.0}


def servo(motor: Component, name: str, wanted: Component, load: Component, until: float) -> Solution:
    parts = {"w": wanted, "m": motor, "load": load}
    end = "flange_a" if isinstance(load, Inertia) else "flange"
    connect = {"a": ["w.y", f"m.{name}"], "b": ["m.flange", f"load.{end}"]}
    return simulate(Assembly("d", parts=parts, connect=connect), until, **TIGHT)


def test_the_current_follows_with_its_time_constant() -> None:
    """A blocked shaft: the speed controller is a gain and an integral, both known."""
    run = servo(ServoMotor(**MOTOR), "w_ref", Constant(k="0.01 rad/s"), Fixed(), 0.01)
    k, Ti = 3e-3 / 0.5 / 4e-3, 16e-3
    t = run.time
    wanted = 0.01 * k * ((1 + t / Ti) - 1e-3 / Ti - (1 - 1e-3 / Ti) * np.exp(-t / 1e-3))
    np.testing.assert_allclose(run["m.motor.ia"], wanted, atol=1e-10)


def test_a_servo_against_an_independent_solver() -> None:
    """Position, speed and current, with the limits of speed and current; the voltage keeps within its own."""
    Kv, w_max, J, T = 40.0, 60.0, 3e-3, 1e-3
    k, R, L = 0.5, 0.8, 4e-3

    def rates(t: float, y: Any) -> list[float]:
        phi, w, i, speed, current = y
        w_ref = min(max(Kv * (3.0 - phi), -w_max), w_max)
        gain = J / k / (4 * T)
        free = gain * (w_ref - w + speed)
        i_ref = min(max(free, -30.0), 30.0)
        v = L / T * (i_ref - i + current) + k * w
        return [
            w, k * i / J, (v - R * i - k * w) / L, (w_ref - w - (free - i_ref) / (gain * 0.9)) / (16 * T),
            (i_ref - i) * R / L,
        ]  # fmt: skip

    drive = PositionServo(Kv=Kv, w_max=w_max, **MOTOR)
    run = servo(drive, "phi_ref", Step(height="3 rad"), Inertia(J=2e-3, phi=0.0, w=0.0), 0.3)
    oracle = solve_ivp(rates, (0, 0.3), [0.0] * 5, rtol=1e-10, atol=1e-12, dense_output=True, max_step=1e-4)
    for t in (0.005, 0.02, 0.08, 0.15, 0.3):
        wanted = list(oracle.sol(t)[:3])
        got = [run.at(t)[n] for n in ("load.phi", "load.w", "m.motor.ia")]
        assert got == pytest.approx(wanted, rel=1e-6, abs=1e-6)
    assert 29.99 < max(run["m.motor.ia"]) < 30.0
    assert run.energy().power_closure < 1e-8
