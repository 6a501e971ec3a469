"""Engines, drivers, tyres and axles: closed forms and an independent solver."""

from math import atan, exp, sin, sqrt, tan
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from components import (
    AxleLoads,
    CombustionEngine,
    Constant,
    ConstantForce,
    ConstantSpeed,
    ConstantTorque,
    ConstantVelocity,
    Driver,
    Fixed,
    Force,
    Gain,
    Inertia,
    Mass,
    RoadLoad,
    Spring,
    TorqueStep,
    Tyre,
    VelocitySensor,
)
from modelica_like import Assembly, Component, ModelicaLikeError, Solution, simulate
from modelica_like.show.report.run import notices

TIGHT: dict[str, Any] = {"rtol": 1e-9, "atol": 1e-11}
G = 9.80665
MAP: dict[str, Any] = {
    "speeds": (0.0, 200.0, 400.0), "pedals": (0.0, 0.5, 1.0), "J": 0.5,
    "torque": ((0.0, 60.0, 100.0), (0.0, 60.0, 100.0), (0.0, 30.0, 50.0)), "drag": ((0.0, 10.0), (400.0, 30.0)),
}  # fmt: skip


def alone(engine: Component, until: float, **parts: Component) -> Solution:
    series = {"shaft": ["engine", *parts]} if parts else {}
    return simulate(Assembly("d", parts={"engine": engine, **parts}, series=series), until, **TIGHT)


# -- engine ------------------------------------------------------------------------------------------------------------


def test_an_engine_accelerates_against_its_drag() -> None:
    """100 N·m less 10 N·m + 0.05 N·m·s·w: w = 1800 rad/s·(1 - exp(-t/10 s))."""
    run = alone(CombustionEngine(**MAP, pedal=1.0, w_0=1e-9, phi=0.0, w=0.0), 1.0)
    assert run.final["engine.w"] == pytest.approx(1800 * (1 - exp(-0.1)), rel=1e-7)
    energy = run.energy()
    assert energy.power_closure < 1e-8
    assert energy["engine"].source == pytest.approx(100 * run.final["engine.phi"], rel=1e-7)


def test_an_engine_idles() -> None:
    """At 80 rad/s the drag is 14 N·m; up to half a pedal the torque is 120 N·m times the pedal."""
    run = alone(CombustionEngine(**MAP, w_idle=80.0, phi=0.0, w=150.0), 30.0)
    assert run.final["engine.w"] == pytest.approx(80.0, rel=1e-6)
    assert run.final["engine.throttle"] == pytest.approx(14 / 120, rel=1e-5)
    assert min(run["engine.w"]) > 60.0


def test_the_fuel_is_cut_at_the_rev_limit() -> None:
    """Drag 20 N·m, torque 100 N·m: from 150 rad/s up with 160 rad/s², down by 10 rad/s with 40 rad/s²."""
    values = MAP | {"drag": ((0.0, 20.0),)}
    run = alone(CombustionEngine(**values, pedal=1.0, w_max=190.0, w_band=10.0, phi=0.0, w=150.0), 1.0)
    rise, fall = 10 / 160, 10 / 40
    moments = [40 / 160 + n * (rise + fall) + part for n in range(3) for part in (0, fall)][:5]
    assert [event.time for event in run.events] == pytest.approx(moments, rel=1e-8)


def test_an_engine_stalls_and_is_started_again() -> None:
    """50 N·m of load take 60 rad/s² more than half a pedal gives; a starter of 30 N·m turns it over 48 rad/s."""
    values = MAP | {"drag": ((0.0, 10.0),)}
    engine = CombustionEngine(**values, pedal=0.5, w_stall=40.0, phi=0.0, w=50.0)
    run = alone(engine, 10.0, load=TorqueStep(step_torque=150.0, offset_torque=-80.0, start_time=2.0))
    out = 10 / ((80 + 10 - 60) / 0.5)
    assert notices(run)[0] == f"At {out:.9g} s engine stalls."
    given = [event.time for event in run.events if event.after == "given"]
    assert len(given) == 1
    assert run.at(given[0])["engine.w"] == pytest.approx(48.0, rel=1e-7)
    slow = CombustionEngine(**values, pedal=0.5, w_stall=40.0, phi=0.0, w=30.0)
    assert notices(alone(slow, 0.1)) == ["At 0 s engine stalls."]


def test_an_engine_that_turns_back_goes_out_once() -> None:
    """w = 5·cos(20·t) on a spring: it turns back at pi/40 s, and 5 rad/s do not start it again."""
    parts = {
        "engine": CombustionEngine(**MAP | {"drag": ((0.0, 0.0),)}, phi=0.0, w=5.0),
        "spring": Spring(c=200.0),
        "wall": Fixed(),
    }
    for solver in ("native", "idas"):
        run = simulate(Assembly("d", parts=parts, series={"s": list(parts)}), 2.0, solver=solver, **TIGHT)
        ((time, before, after),) = ((event.time, event.before, event.after) for event in run.events)
        assert (time, before, after) == (pytest.approx(np.pi / 40, rel=1e-7), "given", "out")


def test_the_firing_orders() -> None:
    engine = CombustionEngine(**MAP, pedal=1.0, orders=((2.0, 0.6, 0.3), (4.0, 0.25, -1.0)))
    run = alone(engine, 0.1, load=ConstantSpeed(w_fixed=100.0))
    phi = 100 * run.time
    wanted = 100 * (1 + 0.6 * np.cos(2 * phi + 0.3) + 0.25 * np.cos(4 * phi - 1))
    np.testing.assert_allclose(run["engine.tau_combustion"], wanted, rtol=1e-6)


def test_a_map_of_another_size_is_refused() -> None:
    with pytest.raises(ModelicaLikeError, match="3 rows and 3 columns, but there are 2 values for rows"):
        alone(CombustionEngine(**(MAP | {"speeds": (0.0, 1.0)}), phi=0.0, w=0.0), 1.0)


# -- tyres -------------------------------------------------------------------------------------------------------------


def rolling(tyre: Tyre, w: float, v: float, until: float = 1.0) -> Solution:
    parts = {"hub": ConstantSpeed(w_fixed=w), "t": tyre, "car": ConstantVelocity(v_fixed=v)}
    return simulate(Assembly("d", parts=parts, series={"s": list(parts)}), until, **TIGHT)


@pytest.mark.parametrize(("w", "v"), [(70.0, 20.0), (60.0, 20.0), (200.0, 0.05), (0.0, -3.0), (-50.0, -10.0)])
def test_the_magic_formula(w: float, v: float) -> None:
    run = rolling(Tyre(F_z=4000.0, R=0.3, mu=0.9, B=12.0, C=1.6, E=0.5), w, v)
    slip = (0.3 * w - v) / max(abs(v), 0.1)
    x = 12 * slip
    force = 0.9 * 4000 * sin(1.6 * atan(x - 0.5 * (x - atan(x))))
    assert run.final["t.slip"] == pytest.approx(slip, rel=1e-9)
    assert [run.final["t.f"], run.final["t.flange_r.tau"]] == pytest.approx([force, 0.3 * force], rel=1e-9)
    assert run.final["t.loss_power"] == pytest.approx(force * (0.3 * w - v), rel=1e-9)
    assert run.final["t.loss_power"] >= 0
    assert run.energy().power_closure < 1e-8


@pytest.mark.parametrize(("slip", "force"), [(0.05, 0.5), (-0.05, -0.5), (0.3, 1.0), (-0.3, -1.0)])
def test_the_straight_line(slip: float, force: float) -> None:
    run = rolling(Tyre(law="linear", F_z=1000.0, R=0.5, mu=0.8, slip_max=0.1), 2 * 10 * (1 + slip), 10.0)
    assert run.final["t.f"] == pytest.approx(800 * force, rel=1e-9)


def test_the_relaxation_length() -> None:
    """4 % of slip come with the time constant sigma/v; what the spring stores is sigma·F·slip/2."""
    run = rolling(Tyre(law="linear", F_z=1000.0, R=0.5, mu=1.0, sigma=0.4), 2 * 8 * 1.04, 8.0, 0.1)
    slip = 0.04 * (1 - exp(-8 * 0.1 / 0.4))
    assert run.final["t.slip"] == pytest.approx(slip, rel=1e-8)
    assert run.final["t.stored_energy"] == pytest.approx(0.5 * 0.4 * 1e4 * slip**2, rel=1e-6)
    assert run.energy().power_closure < 1e-8


def test_a_wheel_brakes_a_car_against_an_independent_solver() -> None:
    def rates(t: float, y: Any) -> list[float]:
        w, v = y
        x = 10 * (0.3 * w - v) / max(abs(v), 0.1)
        f = 3000 * sin(1.65 * atan(x - 0.97 * (x - atan(x))))
        return [(-800 - 0.3 * f) / 1.2, f / 300]

    parts = {
        "brake": ConstantTorque(tau_constant=-800.0), "wheel": Inertia(J=1.2, phi=0.0, w=100.0),
        "t": Tyre(F_z=3000.0, R=0.3), "car": Mass(m=300.0, s=0.0, v=30.0),
    }  # fmt: skip
    run = simulate(Assembly("d", parts=parts, series={"s": list(parts)}), 1.0, **TIGHT)
    oracle = solve_ivp(rates, (0, 1), [100.0, 30.0], rtol=1e-10, atol=1e-10, dense_output=True)
    for t in (0.1, 0.5, 1.0):
        assert [run.at(t)["wheel.w"], run.at(t)["car.v"]] == pytest.approx(list(oracle.sol(t)), rel=1e-6)
    assert run.energy().power_closure < 1e-8


@pytest.mark.parametrize(("driven", "lag"), [("front", None), ("rear", None), ("rear", 0.1)])
def test_the_largest_acceleration_of_a_car(driven: str, lag: float | None) -> None:
    """All wheels of the driven axle slip: mu·g·l_rear/(L + mu·h) at the front, mu·g·l_front/(L - mu·h) at the rear."""
    mu, base, front, h, m = 0.8, 2.6, 1.2, 0.6, 1200.0
    more = {} if lag is None else {"T": lag, "F_rear": m * G * front / base}
    parts = {
        "motor": ConstantSpeed(w_fixed=200.0), "t": Tyre(law="linear", R=0.3, mu=mu), "car": Mass(m=m, s=0.0, v=1.0),
        "axles": AxleLoads(m=m, wheelbase=base, l_front=front, h=h, **more),
    }  # fmt: skip
    connect = {"load": [f"axles.F_{driven}", "t.F_z"], "body": ["car.flange_b", "axles.flange"]}
    run = simulate(Assembly("d", parts=parts, series={"s": ["motor", "t", "car"]}, connect=connect), 2.0, **TIGHT)
    a = mu * G * (base - front) / (base + mu * h) if driven == "front" else mu * G * front / (base - mu * h)
    late = run.at(2.0)["car.v"] - run.at(1.5)["car.v"]
    assert late / 0.5 == pytest.approx(a, rel=1e-5 if lag else 1e-8)
    assert run.final["axles.F_front"] + run.final["axles.F_rear"] == pytest.approx(m * G, rel=1e-9)
    assert notices(run) == []


@pytest.mark.parametrize(("force", "lifted", "front"), [(2000.0, "front", 0.0), (-2000.0, "rear", 200.0 * G)])
def test_a_motorcycle_lifts_a_wheel(force: float, lifted: str, front: float) -> None:
    """It lifts at g·(L - l_front)/h = 0.7·g/0.7, and backwards at g·l_front/h."""
    parts = {"pull": Force(), "bike": Mass(m=200.0, s=0.0, v=0.0), "f": Constant(k=force),
             "axles": AxleLoads(m=200.0, wheelbase=1.4, l_front=0.7, h=0.7)}  # fmt: skip
    connect = {"f": ["f.y", "pull.f"], "a": ["pull.flange", "bike.flange_a"], "b": ["bike.flange_b", "axles.flange"]}
    run = simulate(Assembly("d", parts=parts, connect=connect), 1.0, **TIGHT)
    assert notices(run) == [f"At 0 s axles lifts its {lifted} axle."]
    assert run.final["axles.F_front"] == pytest.approx(front, abs=1e-9)


def test_a_slope_loads_the_rear_axle() -> None:
    """Moments about the front contact at rest: F_rear·L = m·g·(l_front·cos + h·sin)."""
    parts = {"car": Mass(m=1000.0, s=0.0, v=0.0), "hold": ConstantVelocity(v_fixed=0.0), "rise": Constant(k=0.75),
             "axles": AxleLoads(m=1000.0, wheelbase=2.5, l_front=1.0, h=0.5)}  # fmt: skip
    connect = {"a": ["hold.flange", "car.flange_a"], "b": ["car.flange_b", "axles.flange"],
               "i": ["rise.y", "axles.inclination"]}  # fmt: skip
    run = simulate(Assembly("d", parts=parts, connect=connect), 0.1, **TIGHT)
    assert run.final["axles.F_rear"] == pytest.approx(1000.0 * G * (1.0 * 0.8 + 0.5 * 0.6) / 2.5, rel=1e-9)


# -- roads and drivers -------------------------------------------------------------------------------------------------


def test_a_coast_down() -> None:
    """m·v' = -F_0 - F_2·v²: v = sqrt(F_0/F_2)·tan(atan(v_0·sqrt(F_2/F_0)) - t·sqrt(F_0·F_2)/m)."""
    parts = {"car": Mass(m=1000.0, s=0.0, v=30.0), "road": RoadLoad(F_0=120.0, F_2=0.4)}
    run = simulate(Assembly("d", parts=parts, series={"s": list(parts)}), 40.0, **TIGHT)
    wanted = sqrt(300) * tan(atan(30 / sqrt(300)) - 40 * sqrt(48) / 1000)
    assert run.final["car.v"] == pytest.approx(wanted, rel=1e-7)
    both = simulate(
        Assembly("d", parts={"road": RoadLoad(F_0=10.0, F_1=4.0, F_2=0.5), "v": ConstantVelocity(v_fixed=-6.0)},
                 series={"s": ["road", "v"]}), 1.0,
    )  # fmt: skip
    assert both.final["road.f"] == pytest.approx(-(10 + 24 + 18), rel=1e-9)


def test_a_driver_follows_a_profile() -> None:
    """The loop by hand: 3 kN of drive and 6 kN of brake on 1000 kg against 100 N."""
    profile = ((0, 0), (2, 0), (12, 54), (20, 54), (26, 0), (30, 0))

    def rates(t: float, y: Any) -> list[float]:
        v, x = y
        e = np.interp(t, *zip(*profile, strict=True)) / 3.6 - v
        free = 0.5 * (e + x)
        u = min(max(free, -1), 1)
        return [(3000 * u if u > 0 else 6000 * u) / 1000 - 0.1, (e - (free - u) / (0.5 * 0.9)) / 5]

    parts = {
        "driver": Driver(profile=profile, v_scale="1 km/h"), "engine": Gain(k="3000 N"), "brakes": Gain(k="-6000 N"),
        "drive": Force(), "brake": Force(), "car": Mass(m=1000.0, s=0.0, v=0.0),
        "pull": ConstantForce(f_constant=-100.0), "speed": VelocitySensor(),
    }  # fmt: skip
    connect = {
        "a": ["driver.accelerator", "engine.u"], "b": ["driver.brake", "brakes.u"], "e": ["engine.y", "drive.f"],
        "f": ["brakes.y", "brake.f"], "v": ["speed.v", "driver.v"],
        "s": ["drive.flange", "brake.flange", "car.flange_a", "pull.flange", "speed.flange"],
    }  # fmt: skip
    run = simulate(Assembly("d", parts=parts, connect=connect), 30.0, **TIGHT)
    oracle = solve_ivp(rates, (0, 30), [0.0, 0.0], rtol=1e-9, atol=1e-9, dense_output=True, max_step=0.01)
    for t in (5.0, 15.0, 24.0, 30.0):
        assert [run.at(t)["car.v"], run.at(t)["driver.control.integral"]] == pytest.approx(
            list(oracle.sol(t)), rel=1e-5, abs=1e-6
        )
    assert {event.after for event in run.events if event.mode == "driver.foot"} == {"accelerator", "brake"}
    assert min(*run["driver.brake"], *run["driver.accelerator"]) >= -1e-9


@pytest.mark.parametrize(("v", "accelerator", "brake"), [(0.0, 1.0, 0.0), (100.0, 0.0, 1.0)])
def test_a_driver_presses_no_pedal_farther_than_it_goes(v: float, accelerator: float, brake: float) -> None:
    parts = {"car": Constant(k=v), "driver": Driver(profile=((0.0, 50.0), (10.0, 50.0)))}
    run = simulate(Assembly("d", parts=parts, connect={"v": ["car.y", "driver.v"]}), 5.0)
    assert (run.final["driver.accelerator"], run.final["driver.brake"]) == (accelerator, brake)
