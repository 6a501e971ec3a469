"""Slides: contacts, stops, friction and brakes against closed forms and against scipy."""

from math import exp, log, sqrt
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from components import (
    ConstantForce,
    ConstantVelocity,
    ElastoGap,
    Force2,
    ForceSensor,
    ForceStep,
    InverseSpeedDependentForce,
    LinearAccelerationSensor,
    LinearMultiSensor,
    LinearPowerSensor,
    LinearSpeedDependentForce,
    MachineTable,
    Mass,
    MassWithStopAndFriction,
    QuadraticSpeedDependentForce,
    RelativePositionSensor,
    RelativeVelocitySensor,
    Rod,
    SignForce,
    Sine,
    Step,
    StribeckFriction,
    SupportFriction,
    TranslationalBrake,
    TranslationalFixed,
    TranslationalPosition,
    TranslationalSpeed,
    TranslationalSpring,
    TranslationalSpringDamper,
    VelocitySensor,
)
from modelica_like import Assembly, Component, Solution, simulate

TIGHT = {"rtol": 1e-10, "atol": 1e-12}


def slide(**parts: Component) -> Assembly:
    return Assembly("slide", parts=parts, series={"slide": list(parts)})


def modes(run: Solution, name: str) -> list[str]:
    """Modes in their order, each once."""
    names = run.model.flat_discretes[run.model.discrete_position[name]].names
    values = [names[int(d)] for d in run[name]]
    return [value for k, value in enumerate(values) if k == 0 or value != values[k - 1]]


def test_ends_of_a_mass_and_a_rod_are_their_lengths_apart() -> None:
    push, mass, rod, far = ConstantForce(f_constant=2.0), Mass(m=4.0, L=0.6, s=1.0, v=0.0), Rod(L=0.25), Mass(m=1.0)
    run = simulate(slide(push=push, mass=mass, rod=rod, far=far), "1 s")
    np.testing.assert_allclose(run["mass.flange_b.s"] - run["mass.flange_a.s"], 0.6)
    np.testing.assert_allclose(run["far.s"], run["mass.s"] + 0.3 + 0.25)
    assert run.final["mass.v"] == pytest.approx(2.0 / 5.0, rel=1e-9)


# -- contacts ----------------------------------------------------------------------------------------------------------


def contact_force(c: float, d: float, n: float, s: float, v: float) -> float:
    """The law of contact at a wall at s = 0, written out by hand: force on a body at s."""
    if s >= 0:
        return 0.0
    spring = c * 0.01 * (-s / 0.01) ** n
    return spring + min(max(-d * v, -spring), spring)


@pytest.mark.parametrize("n", [None, 1.5])
@pytest.mark.parametrize("d", [0.0, 30.0, 800.0])
def test_bouncing_against_scipy(n: float | None, d: float) -> None:
    values: dict[str, Any] = {"c": 2e4, "d": d} | ({} if n is None else {"n": n, "s_ref": 0.01})
    wall, gap, wind = TranslationalFixed(), ElastoGap(**values), ConstantForce(f_constant=-20.0)
    drive = slide(wall=wall, gap=gap, mass=Mass(m=2.0, s=0.02, v=-0.5), wind=wind)
    run = simulate(drive, "0.4 s", **TIGHT)

    def rates(t: float, y: Any) -> list[float]:
        return [y[1], (contact_force(2e4, d, n or 1.0, *y) - 20.0) / 2.0]

    times = np.linspace(0, 0.4, 41)
    reference = solve_ivp(rates, (0, 0.4), [0.02, -0.5], "LSODA", rtol=1e-10, atol=1e-12, max_step=2e-4, t_eval=times)
    for t, s, v in zip(reference.t, *reference.y, strict=True):
        assert run.at(t)["mass.s"] == pytest.approx(s, abs=1e-6)
        assert run.at(t)["mass.v"] == pytest.approx(v, abs=1e-4)
    # Contact begins at 0.8 m/s, and is located to 1e-13 s.
    assert np.all(run["gap.f"] <= 2e4 * 0.8 * 1e-13)
    assert np.all(run["gap.loss_power"] >= -1e-6)
    assert run.energy().power_closure <= 1e-8


# -- stops -------------------------------------------------------------------------------------------------------------


def test_stop_catches_the_mass_and_lets_it_go() -> None:
    """Thrown at the right stop, held there by the force, released when the force pulls it back."""
    mass = MassWithStopAndFriction(m=2.0, L=0.2, smin=-1.0, smax=1.0, F_Coulomb=3.0, s=0.0, v=4.0)
    pull = ForceStep(step_force=-60.0, offset_force=40.0, start_time=0.5)
    run = simulate(slide(pull=pull, mass=mass), "1.5 s", rtol=1e-9)
    a = (40.0 - 3.0) / 2.0
    hit = (-4.0 + sqrt(16.0 + 2 * a * 0.9)) / a
    assert run.events[0].time == pytest.approx(hit, rel=1e-8)
    before = run.at(hit - 1e-9)["mass.v"]
    assert before == pytest.approx(4.0 + a * hit, rel=1e-6)
    held = (run.time > hit) & (run.time < 0.5)
    np.testing.assert_allclose(run["mass.s"][held], 0.9, atol=1e-12)
    np.testing.assert_allclose(run["mass.v"][held], 0.0, atol=1e-12)
    np.testing.assert_allclose(run["mass.f"][held], 40.0, atol=1e-9)
    there = 0.5 + sqrt(2 * 1.8 / ((20.0 - 3.0) / 2.0))
    assert run.at(there + 1e-6)["mass.s"] == pytest.approx(-0.9, abs=1e-9)
    assert modes(run, "mass.stop") == ["none", "right", "none", "left"]
    balance = run.energy()
    assert balance.power_closure <= 1e-8
    assert balance["mass"].at_events == pytest.approx(-0.5 * 2.0 * (before**2 + (8.5 * (there - 0.5)) ** 2), rel=1e-6)


@pytest.mark.parametrize("friction", [0.0, 2.0])
def test_mass_pressed_against_a_stop_starts_there(friction: float) -> None:
    mass = MassWithStopAndFriction(m=1.0, smin=0.0, smax=1.0, F_Coulomb=friction, s=1.0, v=0.0)
    push = ForceStep(offset_force=5.0, step_force=-10.0, start_time=0.5)
    run = simulate(slide(push=push, mass=mass), "0.6 s", rtol=1e-9)
    np.testing.assert_allclose(run["mass.s"][run.time < 0.5], 1.0, atol=1e-12)
    assert run.final["mass.v"] == pytest.approx(-0.1 * (5.0 - friction), rel=1e-8)


# -- friction ----------------------------------------------------------------------------------------------------------

FRICTIONS: dict[str, Component] = {
    "table": SupportFriction(f_pos=((0.0, 4.0), (5.0, 4.0))), "stribeck": StribeckFriction(F_Coulomb=4.0),
    "brake": TranslationalBrake(fn_max=8.0),
}  # fmt: skip


@pytest.mark.parametrize("name", FRICTIONS)
def test_sliding_to_a_stop(name: str) -> None:
    """A mass with v_0 slides for v_0·m/F, then it sticks exactly."""
    run = simulate(slide(mass=Mass(m=2.0, s=0.0, v=3.0), friction=FRICTIONS[name]), "2 s", rtol=1e-9)
    assert run.events[0].time == pytest.approx(1.5, rel=1e-9)
    assert run.final["mass.s"] == pytest.approx(9.0 * 2.0 / (2 * 4.0), rel=1e-8)
    assert run.final["mass.v"] == 0.0
    assert run.energy()["friction"].lost == pytest.approx(9.0, rel=1e-8)
    assert run.energy().power_closure <= 1e-8


@pytest.mark.parametrize("name", FRICTIONS)
@pytest.mark.parametrize(("force", "moves"), [(3.9, False), (4.1, True), (-3.9, False), (-4.1, True)])
def test_break_away(name: str, force: float, moves: bool) -> None:
    push, mass = ConstantForce(f_constant=force), Mass(m=2.0, s=0.0, v=0.0)
    run = simulate(slide(push=push, mass=mass, friction=FRICTIONS[name]), "1 s")
    expected = (abs(force) - 4.0) / 2.0 * np.sign(force) if moves else 0.0
    assert run.final["mass.v"] == pytest.approx(expected, abs=1e-9)


def test_stribeck_friction_slows_down_as_scipy_says() -> None:
    friction = StribeckFriction(F_prop=1.0, F_Coulomb=3.0, F_Stribeck=2.0, fexp=4.0)
    run = simulate(slide(mass=Mass(m=1.5, s=0.0, v=5.0), friction=friction), "3 s", **TIGHT)

    def rates(t: float, y: Any) -> list[float]:
        return [-(y[0] + 3.0 + 2.0 * exp(-4.0 * y[0])) / 1.5]

    def rest(t: float, y: Any) -> float:
        return y[0]

    rest.terminal = True  # type: ignore[attr-defined]
    reference = solve_ivp(rates, (0, 3), [5.0], rtol=1e-11, atol=1e-12, events=rest)
    assert run.events[0].time == pytest.approx(reference.t_events[0][0], rel=1e-7)


def test_stick_slip_on_a_belt() -> None:
    """A mass on a moving belt, held by a spring: it sticks until c·v·t reaches the static friction."""
    parts: dict[str, Component] = {
        "wall": TranslationalFixed(), "spring": TranslationalSpring(c=100.0), "mass": Mass(m=1.0, s=0.0),
        "friction": SupportFriction(f_pos=((0.0, 2.0),), peak=1.5, v=0.0), "belt": ConstantVelocity(v_fixed=0.1),
    }  # fmt: skip
    drive = Assembly(
        "slide", parts=parts, series={"slide": ["wall", "spring", "mass", "friction"]},
        connect={"belt": ["belt.flange", "friction.support"]},
    )  # fmt: skip
    run = simulate(drive, "3 s", rtol=1e-9)
    breaks = next(event.time for event in run.events if event.after == "start_backward")
    assert breaks == pytest.approx(1.5 * 2.0 / (100.0 * 0.1), rel=1e-6)
    assert run.energy().power_closure <= 1e-8


# -- sources and sensors -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("v", [2.0, -2.0])
@pytest.mark.parametrize(
    ("kind", "values", "reversing", "fixed"),
    [
        (LinearSpeedDependentForce, {}, lambda v: -3.0 * v / 5.0, lambda v: -3.0 * abs(v) / 5.0),
        (QuadraticSpeedDependentForce, {}, lambda v: -3.0 * v * abs(v) / 25.0, lambda v: -3.0 * v**2 / 25.0),
        (InverseSpeedDependentForce, {"v0": 0.5}, lambda v: -3.0 * 5.0 / v, lambda v: -3.0 * 5.0 / abs(v)),
    ],
)
def test_force_by_velocity(kind: Any, values: dict[str, float], reversing: Any, fixed: Any, v: float) -> None:
    for reverses, law in ((True, reversing), (False, fixed)):
        load = kind(f_nominal=-3.0, v_nominal=5.0, reverses=reverses, **values)
        run = simulate(slide(drive=ConstantVelocity(v_fixed=v), load=load), "1 s", points=5)
        assert -run.final["load.flange.f"] == pytest.approx(law(v), rel=1e-12)


def test_drag_has_the_closed_form_of_quadratic_braking() -> None:
    load = QuadraticSpeedDependentForce(f_nominal=-10.0, v_nominal=5.0)
    run = simulate(slide(mass=Mass(m=2.0, s=0.0, v=8.0), load=load), "3 s", **TIGHT)
    b = 10.0 / 25.0
    np.testing.assert_allclose(run["mass.v"], 8.0 / (1 + b * 8.0 / 2.0 * run.time), rtol=1e-8)
    np.testing.assert_allclose(run["mass.s"], 2.0 / b * np.log(1 + b * 8.0 / 2.0 * run.time), atol=1e-8)
    assert run.final["mass.s"] == pytest.approx(2.0 / b * log(1 + b * 4.0 * 3), rel=1e-8)


def test_sign_force_is_smooth_and_saturates() -> None:
    for reg, at_half in (("exp", np.tanh(25.0)), ("sine", np.sqrt(0.5)), ("linear", 0.5), ("cosine", 1 - np.sqrt(0.5))):
        for v, part in ((0.05, at_half), (-0.05, -at_half), (0.2, 1.0)):
            load = SignForce(f_nominal=-7.0, v0=0.1, reg=reg)
            run = simulate(slide(drive=ConstantVelocity(v_fixed=v), load=load), "1 s", points=5)
            assert -run.final["load.flange.f"] == pytest.approx(-7.0 * part, rel=1e-8)


@pytest.mark.parametrize("support", [False, True])
def test_a_filtered_velocity_rises_exponentially(support: bool) -> None:
    """A jump of 3 m/s at 10 ms through a filter of 20 Hz, relative to a bed that moves, too: it takes 2 kg along."""
    parts: dict[str, Component] = {
        "signal": Step(height="3 m/s", offset="1 m/s", start_time=0.01), "mass": Mass(m=2.0),
        "drive": TranslationalSpeed(exact=False, f_crit=20.0),
    }  # fmt: skip
    wires = {"signal": ["signal.y", "drive.v_ref"]}
    if support:
        parts["bed"] = ConstantVelocity(v_fixed=5.0)
        wires["bed"] = ["drive.support", "bed.flange"]
    run = simulate(Assembly("d", parts=parts, series={"s": ["drive", "mass"]}, connect=wires), 0.1, rtol=1e-9)
    late = np.maximum(run.time - 0.01, 0)
    np.testing.assert_allclose(run["drive.v"], 1 + 3 * (1 - np.exp(-40 * np.pi * late)), atol=1e-7)
    np.testing.assert_allclose(run["mass.v"], run["drive.v"] + 5.0 * support, atol=1e-9)
    assert run.energy().power_closure <= 1e-8


@pytest.mark.parametrize("exact", [True, False])
def test_position_source(exact: bool) -> None:
    source = TranslationalPosition() if exact else TranslationalPosition(exact=False, s=0.0, v=0.0)
    run = simulate(following(Sine(amplitude="0.1 m", f=0.5), source), "2 s", rtol=1e-8)
    wanted = 0.1 * np.sin(np.pi * run.time)
    np.testing.assert_allclose(run["mass.s"], wanted, atol=1e-9 if exact else 2e-3)
    assert run.energy().power_closure <= 1e-8


def test_position_source_filters_a_jump() -> None:
    source = TranslationalPosition(exact=False, s=0.0, v=0.0)
    run = simulate(following(Step(height="1 m", start_time=0.01), source), "0.1 s")
    assert run.final["mass.s"] == pytest.approx(1.0, abs=1e-6)
    assert np.max(run["mass.s"]) < 1.01  # a Bessel filter hardly overshoots


def test_sensors_measure_and_load_nothing() -> None:
    parts: dict[str, Component] = {
        "push": ConstantForce(f_constant=6.0), "multi": LinearMultiSensor(), "power": LinearPowerSensor(),
        "force": ForceSensor(), "left": Mass(m=2.0, s=0.0, v=1.0), "spring": TranslationalSpringDamper(c=50.0, d=2.0),
        "right": Mass(m=1.0, s=0.3, v=0.0), "speed": VelocitySensor(), "acceleration": LinearAccelerationSensor(),
        "distance": RelativePositionSensor(), "closing": RelativeVelocitySensor(),
    }  # fmt: skip
    left = ["left.flange_a", "speed.flange", "acceleration.flange", "distance.flange_a", "closing.flange_a"]
    drive = Assembly(
        "slide", parts=parts, series={"slide": ["push", "multi", "power", "force", "left", "spring", "right"]},
        connect={"l": left, "r": ["right.flange_b", "distance.flange_b", "closing.flange_b"]},
    )  # fmt: skip
    run = simulate(drive, "1 s", rtol=1e-9)
    np.testing.assert_allclose(run["speed.v"], run["left.v"], atol=1e-12)
    np.testing.assert_allclose(run["acceleration.a"], (6.0 + run["spring.f"]) / 2.0, atol=1e-9)
    np.testing.assert_allclose(run["distance.s_rel"], run["right.s"] - run["left.s"], atol=1e-12)
    np.testing.assert_allclose(run["closing.v_rel"], run["right.v"] - run["left.v"], atol=1e-12)
    np.testing.assert_allclose(run["power.power"], 6.0 * run["left.v"], atol=1e-9)
    np.testing.assert_allclose(run["multi.power"], 6.0 * run["left.v"], atol=1e-9)
    np.testing.assert_allclose(run["force.f"], 6.0, atol=1e-12)
    assert run.energy().power_closure <= 1e-8


def test_force_between_two_masses() -> None:
    left, jack, right = Mass(m=2.0, s=0.0, v=0.0), Force2(f=6.0), Mass(m=3.0, s=0.0, v=0.0)
    run = simulate(slide(left=left, jack=jack, right=right), "1 s")
    assert run.final["left.v"] == pytest.approx(-3.0, rel=1e-9)
    assert run.final["right.v"] == pytest.approx(2.0, rel=1e-9)
    assert run.energy()["jack"].source == pytest.approx(9.0 + 6.0, rel=1e-8)


def following(signal: Component, source: Component) -> Assembly:
    parts = {"signal": signal, "drive": source, "mass": Mass(m=2.0)}
    wires = {"signal": ["signal.y", "drive.s_ref"]}
    return Assembly("slide", parts=parts, series={"slide": ["drive", "mass"]}, connect=wires)


@pytest.mark.parametrize("kind", ["stop", "table"])
@pytest.mark.parametrize(("angle", "moves"), [(20.0, False), (40.0, True)])
def test_masses_stand_on_their_slope_or_slide(kind: str, angle: float, moves: bool) -> None:
    """8 kg and 40 N of friction: m·g·sin(angle) is 26.8 N or 50.4 N."""
    values: dict[str, Any] = {"m": 8.0, "angle": f"{angle} deg", "s": 2.0, "v": 0.0}
    stops = MassWithStopAndFriction(F_Coulomb=40.0, smin=-5.0, **values)
    mass = stops if kind == "stop" else MachineTable(f_friction=40.0, **values)
    run = simulate(Assembly("d", parts={"m": mass}), 1.0, rtol=1e-9)
    pull = 8 * 9.80665 * np.sin(np.radians(angle))
    assert run.final["m.v"] == pytest.approx(-(pull - 40) / 8 if moves else 0.0, rel=1e-8)
    assert run.final["m.f"] == pytest.approx(-40 if moves else -pull, rel=1e-8)
    assert run.energy().power_closure < 1e-8
    assert run.energy()["m"].lost == pytest.approx(0.5 * (pull - 40) / 8 * 40 if moves else 0.0, rel=1e-6, abs=1e-9)
