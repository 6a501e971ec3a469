"""Examples of the Modelica Standard Library without a reference: closed forms and independent solvers."""

from functools import cache
from itertools import pairwise
from math import exp, pi, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from modelica_like import Solution, simulate

ROOT = Path(__file__).parents[2]
MSL = ROOT / "examples" / "msl"
RPM = pi / 30


@cache
def run(example: str) -> Solution:
    return simulate(MSL / f"{example}.toml", rtol=1e-9)


def close(value: Any) -> Any:
    return pytest.approx(value, rel=1e-6, abs=1e-9)


def integrate(rates: Any, start: list[float], times: tuple[float, ...], **options: Any) -> Any:
    """Solve equations written by hand, piece by piece, and give the states at the end of each piece."""
    ends = []
    for t0, t1 in pairwise(times):
        piece = solve_ivp(rates, (t0, t1), start, rtol=1e-10, atol=1e-12, **options)
        start = list(piece.y[:, -1])
        ends.append(start)
    return ends


# -- rotational --------------------------------------------------------------------------------------------------------


def test_simple_gear_shift() -> None:
    """First gear 1/(1 + 1.5), direct drive after the shift, both against the fan's v²."""
    shift = run("rotational/SimpleGearShift")
    ring_held = 20 * 2.5 / (10 + 2.5**2)

    def first(t: float, w: Any) -> list[float]:
        return [(20 * 2.5 - 20 * (w[0] / 10.471975511966) ** 2) / (10 + 2.5**2)]

    def direct(t: float, w: Any) -> list[float]:
        return [(20 - 20 * (w[0] / 10.471975511966) ** 2) / 11]

    assert shift.at(0.5001)["load.w"] == pytest.approx(ring_held * 1e-4, rel=1e-4)
    (at_two,) = integrate(first, [0.0], (0.5, 2.0))
    assert [shift.at(2.0)["load.w"], shift.at(2.0)["engine.w"]] == close([at_two[0], 2.5 * at_two[0]])
    locked = next(e.time for e in shift.events if e.mode == "clutch.mode" and e.after == "stuck" and e.time > 2)
    (at_end,) = integrate(direct, [shift.at(locked)["load.w"]], (locked, 5.0))
    assert [shift.final["load.w"], shift.final["engine.w"]] == close([at_end[0]] * 2)


def test_lossy_gear_whose_driving_side_is_not_obvious() -> None:
    """Unloaded, x = loss/2: both lines of losses, 0.75·x + 0.625 and 2.5 - 3·x, meet at a loss of 1 N.m.

    That stops both masses of 0.001 kg.m2 with 500 rad/s²; at rest it takes 2.5 N.m, not 1 N.m, to drive flange_b.
    """
    demo = run("rotational/LossyGearDemo3")
    assert demo.at(0.01)["Inertia1.w"] == close(10 - 500 * 0.01)
    assert next(event.time for event in demo.events if event.after == "stuck") == close(10 / 500)
    assert [demo.final["Inertia1.w"], demo.final["Inertia2.w"], demo.final["gear.tau_loss"]] == close([0, 0, 1])


def test_disengaged_one_way_clutch() -> None:
    """Only the freewheel acts: the faster side is driven alone, or both together by their torques."""
    clutch = run("rotational/OneWayClutchDisengaged")
    inner, outer = clutch["inertiaIn.w"], clutch["inertiaOut.w"]
    assert np.min(outer - inner) >= -1e-9
    sliding = outer - inner > 1e-6
    assert np.max(np.abs(clutch["oneWayClutch.tau"][sliding])) <= 1e-12
    # All impulses: 0.3·t + 10·(1 - cos(4·pi·t))/(4·pi) - 0.3·t, and the start of -0.5 kg.m2/s
    np.testing.assert_allclose(inner + outer, -0.5 + 10 * (1 - np.cos(4 * pi * clutch.time)) / (4 * pi), atol=1e-6)


def test_freewheel() -> None:
    """Driven while the shaft is faster than the rotor, which its load brakes with exp(-5·t) in between."""
    wheel = run("rotational/DemoFreeWheel")
    w, shaft = wheel["inertia2.w"], wheel["inertia1.w"]
    np.testing.assert_allclose(shaft, 5 * np.sin(10 * pi * wheel.time), atol=1e-7)
    assert np.min(w - shaft) >= -1e-8
    # It is released where the shaft slows down by more than the load: 10·pi·cos = -5·sin.
    released = (pi - np.arctan(2 * pi)) / (10 * pi)
    times = [event.time for event in wheel.events if event.after == "overrunning"]
    assert times[:4] == pytest.approx([released + 0.2 * k for k in range(4)], rel=1e-6)
    assert wheel.at(released + 0.02)["inertia2.w"] == close(5 * np.sin(10 * pi * released) * exp(-5 * 0.02))


def test_losses_of_a_drive_heat_one_port() -> None:
    """What convection takes is the sum of all losses, at each instant; the brake and the gear stick at first."""
    drive = simulate(ROOT / "tests" / "data" / "msl" / "RotationalHeatLosses.toml")
    slips = {"damper": "w_rel", "springDamper": "w_rel", "clutch": "w_rel", "oneWayClutch": "w_rel", "brake": "w"}
    work = drive["bearingFriction.tau"] * drive["bearingFriction.w"] + drive["brake.tau"] * drive["brake.w"]
    work = work + drive["damper.tau"] * drive["damper.w_rel"] + 20 * drive["springDamper.w_rel"] ** 2
    parts = [f"{name}.heat_port.Q_flow" for name in (*slips, "elastoBacklash", "bearingFriction", "lossyGear")]
    heat = -sum(drive[name] for name in parts)
    np.testing.assert_allclose(20 * (drive["convection.port_a.T"] - 298.15), heat, atol=1e-6 * np.max(heat))
    assert np.all(heat >= work - 1e-6 * np.max(heat))
    assert np.min(drive["convection.port_a.T"]) >= 298.15 - 1e-9


# -- translational -----------------------------------------------------------------------------------------------------


def test_initial_conditions() -> None:
    """The upper slides rest where they are; the lower ones swing as a matrix exponential says."""
    slides = run("translational/InitialConditions")
    assert [np.ptp(slides["m3.s"]), np.ptp(slides["m4.s"])] == pytest.approx([0, 0], abs=1e-9)
    c1, c, d = 1000.0, 111.0, 1.0
    # x1 = stretch of s1, x2 = stretch of sd1
    A = np.array([[0, 0, 1, 0], [0, 0, 0, 1], [-c1, c, 0, d], [c1, -2 * c, 0, -2 * d]])
    state = expm(A * 2.0) @ np.array([-0.5, 0.0, 0.0, 0.0])
    assert [slides.at(2)["s1.s_rel"] - 1, slides.at(2)["sd1.s_rel"] - 1] == pytest.approx(list(state[:2]), rel=1e-5)


def test_sensors() -> None:
    sensors = run("translational/Sensors")
    t, w = sensors.time, 8 * pi
    position = 10 / w * t - 10 / w**2 * np.sin(w * t)
    np.testing.assert_allclose(sensors["positionSensor1.s"], position - 0.5, atol=1e-7)
    np.testing.assert_allclose(sensors["positionSensor2.s"], position + 0.5, atol=1e-7)
    np.testing.assert_allclose(sensors["speedSensor1.v"], 10 / w * (1 - np.cos(w * t)), atol=1e-7)
    np.testing.assert_allclose(sensors["accSensor1.a"], 10 * np.sin(w * t), atol=1e-9)
    np.testing.assert_allclose(sensors["forceSensor.f"], 10 * np.sin(w * t), atol=1e-9)
    np.testing.assert_allclose(sensors["multiSensor.f"], 10 * np.sin(w * t), atol=1e-9)


def test_brakes() -> None:
    """µ·fn = 0.5·2 N on 1 kg: at rest after 1 s more; both supports alike."""
    brakes = run("translational/Brake")
    for mass in ("mass1", "mass2"):
        assert [brakes.final[f"{mass}.s"], brakes.final[f"{mass}.v"]] == close([0.1 + 0.5, 0.0])
    assert [event.time for event in brakes.events if event.after == "stuck"] == close([1.1, 1.1])


def test_warm_rail_brakes_less() -> None:
    """All the kinetic energy becomes heat; against equations written by hand."""
    brake = run("translational/EddyCurrentBrake")

    def rates(t: float, y: Any) -> list[float]:
        v, temperature = y
        x = v / (10 * (1 + 3.92e-3 * temperature))
        force = 200 * min(max(t - 0.1, 0) / 0.1, 1) ** 2 * x / (1 + x**2)
        return [-force, force * v]

    ends = integrate(rates, [20.0, 0.0], (0.1, 0.2, 1.0))
    assert [brake.final["mass.v"], brake.final["heatCapacitor.T"] - 293.15] == pytest.approx(ends[-1], rel=1e-6)
    assert brake.final["heatCapacitor.T"] - 293.15 == close((20**2 - brake.final["mass.v"] ** 2) / 2)


def test_why_arrows() -> None:
    """A rod has a direction; a mass joined by its other end swings all the same about its own rest."""
    arrows = run("translational/WhyArrows")
    assert [arrows.final[f"positionSensor{k}.s"] for k in (1, 2, 3)] == close([-1, 1, 1])
    for mass in ("mass1", "inertia2"):
        # flange_b is half a length to the right of the middle: spring length 1 + 1.9 = 2.9 at the start
        np.testing.assert_allclose(arrows[f"{mass}.s"], -0.9 + 0.9 * np.cos(sqrt(11) * arrows.time), atol=1e-7)


def test_losses_of_slides_heat_one_port() -> None:
    """All the work of the force that is not stored is taken by convection, or lost at the stop."""
    slides = run("translational/HeatLosses")
    parts = (
        "elastoGap",
        "damper",
        "springDamper",
        "supportFriction",
        "brake",
        "massWithStopAndFriction",
        "springDamper1",
    )
    heat = -sum(slides[f"{part}.heat_port.Q_flow"] for part in parts)
    np.testing.assert_allclose(20 * (slides["convection.port_a.T"] - 298.15), heat, atol=1e-6 * np.max(heat))
    work = 20 * np.sin(2 * pi * slides.time) * slides["mass1.v"]
    done = np.sum(0.5 * (work[1:] + work[:-1]) * np.diff(slides.time))
    assert -slides.energy()["force"].inflow == pytest.approx(done, rel=1e-3)


def test_vehicle() -> None:
    """The table of torques and the slope, against equations written by hand; the train with twice the torque alike."""
    vehicles = run("translational/Vehicle")
    nominal, weight = 0.5 * 1.18 * (25 / 3.5) ** 2 / 2 + 0.01 * 100 * 9.80665, 100 * 9.80665

    def rates(t: float, y: Any) -> list[float]:
        times = [5, 10.8, 20, 25, 50, 55]
        k = int(np.searchsorted(times, t - 1e-9 if t > 5 else t, side="right"))
        factor, tangent = [(0, 0), (5.6, 0), (1, 0), (2.8, 0.05), (1, 0), (-5, 0), (0, 0)][k]
        slant = sqrt(1 + tangent**2)
        against = 0.5 * 0.5 * 1.2 * y[1] * abs(y[1]) + weight / slant * (tangent + 0.01 * np.tanh(2646.7 * y[1]))
        return [y[1], (factor * nominal - against) / 100]

    ends = integrate(rates, [0.0, 0.0], (5.0, 10.8, 20.0, 25.0, 50.0), method="LSODA")
    for t, (s, v) in zip((10.8, 20.0, 25.0, 50.0), ends, strict=True):
        assert [vehicles.at(t)["vehicle.s"], vehicles.at(t)["vehicle.v"]] == pytest.approx([s, v], rel=1e-5)
    np.testing.assert_allclose(vehicles["vehicle1.v"], vehicles["vehicle.v"], atol=1e-6)
    # While the train cruises, the hook pulls against the resistances of the trailer.
    v = vehicles.at(49.0)["trailer.v"]
    assert abs(vehicles.at(49.0)["multiSensor.f"]) == pytest.approx(0.3 * v**2 + 0.01 * weight, rel=1e-2)


# -- DC machines -------------------------------------------------------------------------------------------------------


def test_current_control() -> None:
    """Absolute optimum: with the back-EMF fed forward the current follows 1/(2·Ts²·s² + 2·Ts·s + 1).

    What is left of the back-EMF, because the inverter delays it, is less than half a percent. Then the whole start
    against equations written by hand.
    """
    machine = run("dcmachines/DCPM_CurrentControlled")
    t = np.array([0.0005, 0.001, 0.002, 0.003, 0.005])
    law = 1 - np.exp(-t / 2e-3) * (np.cos(t / 2e-3) + np.sin(t / 2e-3))
    ours = np.array([machine.at(0.1 + time)["dcpm.ia"] / 100 for time in t])
    np.testing.assert_allclose(ours, law, atol=4e-3)
    assert machine.final["dcpm.ia"] == pytest.approx(100, rel=1e-4)

    def rates(time: float, y: Any) -> list[float]:
        w, i, u, integral = y
        k, ramp = 0.6366197723675814, 100.0
        error = ramp - i
        free = 0.75 * (error + integral) + k * w
        excess = free - min(max(free, -100), 100)
        load = 63.66197723675814 * (w / (1425 * RPM)) ** 2
        return [(k * i - load) / 0.3, (u - 0.05 * i - k * w) / 1.5e-3, (free - excess - u) / 1e-3,
                (error - excess / (0.75 * 0.9)) / 0.03]  # fmt: skip

    ends = integrate(rates, [0.0] * 4, (0.1, 0.12, 0.5, 2.0), method="Radau")
    for time, (w, i, u, _) in zip((0.12, 0.5, 2.0), ends, strict=True):
        ours = [machine.at(time)[name] for name in ("dcpm.w", "dcpm.ia", "firstOrder.y")]
        assert ours == pytest.approx([w, i, u], rel=1e-6)


@pytest.mark.slow
def test_series_machine_at_single_phase() -> None:
    """An AC machine of 50 Hz: against equations written by hand; the torque never changes its sign."""
    machine = run("dcmachines/DCSE_SinglePhase")
    k = (100 - 0.06 * 100) / (1410 * RPM)

    def rates(t: float, y: Any) -> list[float]:
        w, i = y
        R = min(max(1 - (t - 0.1) / 0.9, 0), 1) + 0.05 + 0.01
        u = sqrt(2) * 100 * np.sin(100 * pi * t)
        load = 63.66 * (w / (1410 * RPM)) ** 2
        return [(k * i**2 / 100 - load) / 0.3, (u - R * i - k * i / 100 * w) / 2e-3]

    ends = integrate(rates, [0.0, 0.0], (0.0, 0.1, 0.5, 1.0, 2.0))
    for t, (w, i) in zip((0.1, 0.5, 1.0, 2.0), ends, strict=True):
        assert [machine.at(t)["dcse.w"], machine.at(t)["dcse.ia"]] == pytest.approx([w, i], rel=2e-5, abs=1e-5)
    assert np.min(machine["dcse.tau_electrical"]) >= -1e-9


def test_warm_winding() -> None:
    """Cold at first, warm in the end: the nominal resistance, 100 A, and 1425/min."""
    machine = run("dcmachines/DCPM_Temperature")
    rise = 60 * (1 - exp(-(3 - 0.1) / 0.5))
    R = 0.05 * (1 + 0.00392 / (1 + 0.00392 * 60) * (rise - 60))
    k = 95 / (1425 * RPM)
    current = 63.66 / k
    assert machine.final["dcpm.ia"] == pytest.approx(current, rel=1e-4)
    assert machine.final["dcpm.w"] == pytest.approx((100 - R * current) / k, rel=1e-4)
    cold = 0.05 * (1 - 0.00392 / (1 + 0.00392 * 60) * 60)
    assert machine.at(0.0)["dcpm.heat_port.T"] == close(293.15)
    assert cold == pytest.approx(0.05 / (1 + 0.00392 * 60), rel=1e-9)


def test_cooling() -> None:
    """Against equations written by hand: two capacities, losses of the mean of the load pulses."""
    machine = run("dcmachines/DCPM_Cooling")
    k, G = 95 / (1425 * RPM), 1000 / 55

    def rates(t: float, y: Any) -> list[float]:
        w, i, armature, core = y
        R = 0.05 * (1 + 0.00392 / (1 + 0.00392 * 60) * (armature - 353.15))
        load = 1.5 * 63.66 if t % 1 < 0.5 else 0.0
        out = (core - 293.15) / (1 / G + 1 / 100)
        through = G * (armature - core)
        return [(k * i - load) / 0.3, (100 - R * i - k * w) / 1.5e-3, (R * i**2 - through) / 20, (through - out) / 50]

    times = tuple(0.5 * n for n in range(11))
    state = [1500 * RPM, 0.0, 293.15, 293.15]
    for t0, t1 in pairwise(times):
        piece = solve_ivp(
            lambda t, y, t0=t0: rates(t0 + 0.25, y), (t0, t1), state, method="LSODA", rtol=1e-9, atol=1e-9
        )
        state = list(piece.y[:, -1])
        ours = [machine.at(t1)[name] for name in ("armature.T", "core.T")]
        assert ours == pytest.approx(state[2:], rel=1e-6)
    assert machine.final["armature.T"] < 370


def test_quasi_static_machine() -> None:
    """Without the inductance the speed is exponential, with the time constant R·J/k²."""
    machine = run("dcmachines/DCPM_QuasiStatic")
    k = 95 / (1425 * RPM)
    T, idle, loaded = 0.05 * 0.3 / k**2, 100 / k, (100 - 0.05 * 95.49 / k) / k
    assert machine.at(0.3)["dcpm2.w"] == close(loaded + (1500 * RPM - loaded) * exp(-0.3 / T))
    low = loaded + (1500 * RPM - loaded) * exp(-0.5 / T)
    assert machine.at(0.9)["dcpm2.w"] == close(idle + (low - idle) * exp(-0.4 / T))
    # The one with inductance, T_a = 30 ms, follows as the matrix exponential of both.
    A = np.array([[0, k / 0.3], [-k / 1.5e-3, -0.05 / 1.5e-3]])
    rest = np.array([loaded, 95.49 / k])
    state = rest + expm(A * 0.3) @ (np.array([1500 * RPM, 0.0]) - rest)
    assert [machine.at(0.3)["dcpm1.w"], machine.at(0.3)["dcpm1.ia"]] == pytest.approx(list(state), rel=1e-6)


def test_losses_of_a_machine() -> None:
    """The table of the example's documentation: 100 A, 1417.5/min, and each loss."""
    machine = run("dcmachines/DCPM_withLosses")
    final = machine.final
    assert final["dcpm2.ia"] == pytest.approx(100, rel=1e-3)
    assert final["dcpm2.w"] == pytest.approx(1417.5 * RPM, rel=1e-3)
    assert final["dcpm1.w"] == pytest.approx(1425 * RPM, rel=1e-3)
    assert machine["dcpm2.loss_power"][-1] == pytest.approx(500 + 200 + 50 + 100 + 50, rel=2e-3)
    assert machine["dcpm1.loss_power"][-1] == pytest.approx(500, rel=2e-3)
