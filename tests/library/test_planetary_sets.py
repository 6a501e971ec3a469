"""Planetary sets after R. Willis, with and without losses; shift schedules."""

from collections.abc import Callable
from math import pi

import numpy as np
import pytest

from components import (
    Clutch,
    ConstantSpeed,
    ConstantTorque,
    Damper,
    Fixed,
    FixedTemperature,
    IdealPlanetary,
    Inertia,
    LossyPlanetarySet,
    PlanetarySet,
    Ravigneaux,
    ShiftSchedule,
)
from modelica_like import Assembly, Component, Solution, simulate
from modelica_like.errors import LanguageError

SHAFTS = ("sun", "carrier", "ring")


def driven(gear: Component, held: str, driven: str, taken: str, speed: float = 10.0, load: float = 0.0) -> Solution:
    """One shaft held, one driven at a speed, one against oil and a torque."""
    parts = {
        "gear": gear, "motor": ConstantSpeed(w_fixed=speed), "brake": Fixed(), "mass": Inertia(J=0.1),
        "oil": Damper(d=2.0), "wall": Fixed(), "load": ConstantTorque(tau_constant=load),
    }  # fmt: skip
    wires = {
        "in": ["motor.flange", f"gear.{driven}"], "out": ["mass.flange_a", f"gear.{taken}", "load.flange"],
        "held": ["brake.flange", f"gear.{held}"],
    }  # fmt: skip
    return simulate(
        Assembly("drive", parts=parts, series={"load": ["mass", "oil", "wall"]}, connect=wires), "1 s", points=10
    )


# (held, driven, taken): speed ratio driven/taken with the fixed-carrier ratio i0 (Willis)
Ratio = Callable[[float], float]
RATIOS: list[tuple[str, str, str, Ratio]] = [
    ("ring", "sun", "carrier", lambda i: 1 - i), ("ring", "carrier", "sun", lambda i: 1 / (1 - i)),
    ("sun", "ring", "carrier", lambda i: (i - 1) / i), ("sun", "carrier", "ring", lambda i: i / (i - 1)),
    ("carrier", "sun", "ring", lambda i: i), ("carrier", "ring", "sun", lambda i: 1 / i),
]  # fmt: skip
EVERY_WAY = pytest.mark.parametrize(("held", "input_", "taken", "formula"), RATIOS)


@pytest.mark.parametrize("i0", [-1.917, -1.0, 2.74, 0.5])
@EVERY_WAY
def test_speeds_torques_and_power(held: str, input_: str, taken: str, formula: Ratio, i0: float) -> None:
    run = driven(PlanetarySet(i0=i0), held, input_, taken)
    assert 10.0 / run.final["mass.w"] == pytest.approx(formula(i0), rel=1e-12)
    sun, carrier, ring = (run.final[f"gear.{name}.tau"] for name in SHAFTS)
    assert ring == pytest.approx(-i0 * sun, rel=1e-12)
    assert carrier == pytest.approx((i0 - 1) * sun, rel=1e-12)
    speeds = {held: 0.0, input_: 10.0, taken: run.final["mass.w"]}
    assert run.final["gear.w_rel"] == pytest.approx(speeds["sun"] - speeds["carrier"], rel=1e-12)
    assert run.final["gear.rolling_power"] == pytest.approx(sun * run.final["gear.w_rel"], rel=1e-12)
    balance = run.energy()
    assert balance.power_closure < 1e-12
    assert balance["gear"].lost == 0.0


def test_minus_set_is_the_ideal_planetary() -> None:
    for held, input_, taken, _ in RATIOS:
        ours, theirs = (
            driven(gear, held, input_, taken).final for gear in (PlanetarySet(i0=-2.5), IdealPlanetary(ratio=2.5))
        )
        for name in SHAFTS:
            assert ours[f"gear.{name}.tau"] == pytest.approx(theirs[f"gear.{name}.tau"], rel=1e-12)


@pytest.mark.parametrize("load", [-50.0, 50.0, -1000.0, 1000.0])
@pytest.mark.parametrize("speed", [10.0, -10.0])
@pytest.mark.parametrize("i0", [-1.917, 2.74])
@EVERY_WAY
def test_losses_by_the_direction_of_the_rolling_power(
    held: str, input_: str, taken: str, formula: Ratio, i0: float, speed: float, load: float
) -> None:
    """VDI 2157: the torques are those of a set with i0·eta where rolling power enters at the sun, or i0/eta."""
    eta = 0.9
    run = driven(LossyPlanetarySet(i0=i0, efficiency=eta), held, input_, taken, speed, load)
    sun, carrier, ring = (run.final[f"gear.{name}.tau"] for name in SHAFTS)
    rolling = run.final["gear.rolling_power"]
    assert speed / run.final["mass.w"] == pytest.approx(formula(i0), rel=1e-12)
    assert ring == pytest.approx(-i0 * sun * (eta if rolling > 0 else 1 / eta), rel=1e-12)
    assert sun + carrier + ring == pytest.approx(0.0, abs=1e-12 * abs(carrier))
    speeds = {held: 0.0, input_: speed, taken: run.final["mass.w"]}
    passed_in = max(rolling, ring * (speeds["ring"] - speeds["carrier"]))
    assert run["gear.loss_power"][-1] == pytest.approx((1 - eta) * passed_in, rel=1e-12)
    assert run.energy().power_closure < 1e-12


def test_a_block_loses_nothing() -> None:
    parts = {
        "gear": LossyPlanetarySet(i0=-2.0, efficiency=0.9), "motor": ConstantTorque(tau_constant=30.0),
        "mass": Inertia(J=1.0, phi=0.0, w=5.0),
    }  # fmt: skip
    wires = {"in": ["motor.flange", "gear.sun", "gear.carrier"], "out": ["gear.ring", "mass.flange_a"]}
    run = simulate(Assembly("block", parts=parts, connect=wires), "1 s")
    assert run.final["mass.w"] == pytest.approx(35.0, rel=1e-9)
    assert run.energy()["gear"].lost == pytest.approx(0.0, abs=1e-9)


def test_reversal_passes_smoothly_and_always_loses() -> None:
    """The speed changes its direction under torque: no event, and no power from nothing."""
    parts = {
        "gear": LossyPlanetarySet(i0=-2.0, efficiency=0.8), "motor": ConstantTorque(tau_constant=-3.0),
        "rotor": Inertia(J=0.1, phi=0.0, w=20.0), "brake": Fixed(), "mass": Inertia(J=0.2),
    }  # fmt: skip
    run = simulate(
        Assembly("drive", parts=parts, series={"in": ["motor", "rotor"]}, connect={
            "sun": ["rotor.flange_b", "gear.sun"], "held": ["brake.flange", "gear.carrier"],
            "out": ["gear.ring", "mass.flange_a"],
        }), "2 s",
    )  # fmt: skip
    assert not run.events
    assert run["rotor.w"][0] > 0 > run.final["rotor.w"]
    assert np.all(run["gear.loss_power"] >= 0)
    # Before and after the reversal the mass behind the gear counts with i0²: driven by the motor with 1/eta, driving
    # with eta.
    slow = (-3.0) / (0.1 + 0.2 * 0.8 / 4)
    fast = (-3.0) / (0.1 + 0.2 / 0.8 / 4)
    before, after = run.time < 0.5, run.time > 1.5
    np.testing.assert_allclose(np.gradient(run["rotor.w"][before], run.time[before]), slow, rtol=1e-6)
    np.testing.assert_allclose(np.gradient(run["rotor.w"][after], run.time[after]), fast, rtol=1e-6)


def test_loss_leaves_as_heat() -> None:
    gear = LossyPlanetarySet(i0=-2.0, efficiency=0.8)
    parts = {
        "gear": gear, "motor": ConstantSpeed(w_fixed=10.0), "brake": Fixed(), "mass": Inertia(J=0.1),
        "oil": Damper(d=2.0), "wall": Fixed(), "air": FixedTemperature(),
    }  # fmt: skip
    wires = {
        "in": ["motor.flange", "gear.sun"], "held": ["brake.flange", "gear.ring"],
        "out": ["gear.carrier", "mass.flange_a"], "heat": ["gear.heat_port", "air.port"],
    }  # fmt: skip
    run = simulate(Assembly("hot", parts=parts, series={"load": ["mass", "oil", "wall"]}, connect=wires), "1 s")
    rolling = run.final["gear.rolling_power"]
    assert run.final["air.port.Q_flow"] == pytest.approx(0.2 * rolling, rel=1e-12)
    balance = run.energy()
    assert balance["gear"].lost == 0.0
    assert balance.power_closure < 1e-12


# -- Ravigneaux sets ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("losses", [False, True])
def test_ravigneaux_is_two_willis_sets(losses: bool) -> None:
    """Any two speeds determine the others; the torques follow from any two torques (document 001)."""
    small, large = 2.74, -2.24
    efficiency = {"mesh_efficiency": 1.0} if losses else {}
    parts = {
        "gears": Ravigneaux(small_ratio=small, large_ratio=large, losses=losses, **efficiency),
        "one": ConstantSpeed(w_fixed=30.0), "two": ConstantSpeed(w_fixed=-12.0),
        "ring": Inertia(J=0.1), "oil": Damper(d=0.7), "wall": Fixed(),
        "carrier": Inertia(J=0.2), "grease": Damper(d=0.3), "floor": Fixed(),
    }  # fmt: skip
    wires = {
        "a": ["one.flange", "gears.small_sun"], "b": ["two.flange", "gears.large_sun"],
        "h": ["gears.ring", "ring.flange_a"], "c": ["gears.carrier", "carrier.flange_a"],
    }  # fmt: skip
    chains = {"h": ["ring", "oil", "wall"], "c": ["carrier", "grease", "floor"]}
    final = simulate(Assembly("drive", parts=parts, connect=wires, series=chains), "1 s").final
    w_h, w_c = final["ring.w"], final["carrier.w"]
    assert w_c + small * (w_h - w_c) == pytest.approx(30.0, rel=1e-12)
    assert w_c + large * (w_h - w_c) == pytest.approx(-12.0, rel=1e-12)
    si, se, c, h = (final[f"gears.{name}.tau"] for name in ("small_sun", "large_sun", "carrier", "ring"))
    assert (h, c) == pytest.approx((-0.7 * w_h, -0.3 * w_c), rel=1e-12)
    assert h == pytest.approx(-(small * si + large * se), rel=1e-12)
    assert si + se + c + h == pytest.approx(0.0, abs=1e-12 * abs(h))


def test_efficiency_without_losses_is_refused() -> None:
    """It would count for nothing, silently."""
    gears = Ravigneaux(small_ratio=2.0, large_ratio=-2.0, mesh_efficiency=0.99)
    parts = {"gears": gears, "motor": ConstantSpeed(w_fixed=30.0)}
    with pytest.raises(LanguageError, match="has a mesh_efficiency, but no losses"):
        simulate(Assembly("drive", parts=parts, connect={"in": ["motor.flange", "gears.small_sun"]}), "1 s")


# -- shift schedules ---------------------------------------------------------------------------------------------------

SHIFTS = ((0.0, "N", 0.0), (1.0, "1", 0.5), (2.0, "2", 1.0))


def test_pressures_of_a_schedule() -> None:
    run = simulate(ShiftSchedule(shifts=SHIFTS), "4 s", points=400)
    ramp_1, ramp_2 = np.clip((run.time - 1.0) / 0.5, 0, 1), np.clip(run.time - 2.0, 0, 1)
    for name, expected in {"a": ramp_1, "b": 0, "c": ramp_2, "d": 1 - ramp_2, "e": 0}.items():
        np.testing.assert_allclose(run[name], expected + 0 * run.time, atol=1e-12)
    assert [(e.time, e.after) for e in run.events] == [
        (1.0, "shifting"), (1.5, "holding"), (2.0, "shifting"), (3.0, "holding"),
    ]  # fmt: skip
    assert [run.at(t)["gear"] for t in (0.5, 1.2, 2.5)] == [0.0, 1.0, 2.0]


def test_schedule_at_the_start_of_a_run() -> None:
    """Rows that are over before the run begins count at once; times count in time_scale."""
    run = simulate(ShiftSchedule(shifts=((0, "N", 0), (0, "R", 200)), time_scale="1 ms"), "1 s")
    np.testing.assert_allclose(run["b"], np.clip(run.time / 0.2, 0, 1), atol=1e-12)
    assert run.final["gear"] == -1.0
    late = simulate(ShiftSchedule(shifts=SHIFTS), "4 s", t0=3.5)
    assert [late[name][-1] for name in "abcde"] == [1.0, 0.0, 1.0, 0.0, 0.0]


def test_own_pattern() -> None:
    run = simulate(ShiftSchedule(shifts=((0, "1", 0), (1, "2", 0.1)), pattern=(("1", "ab"), ("2", "bc"))), "2 s")
    assert [run.final[name] for name in "abcde"] == [0.0, 1.0, 1.0, 0.0, 0.0]


def test_wrong_schedules() -> None:
    with pytest.raises(LanguageError, match="asks for the gear '7'; its pattern has N, 1, 2"):
        ShiftSchedule(shifts=((0.0, "7", 0.0),))
    with pytest.raises(LanguageError, match=r"The shift to gear 1 ends at 2\.5 s, after that to 2 has begun"):
        ShiftSchedule(shifts=((0.0, "N", 0.0), (1.0, "1", 1.5), (2.0, "2", 0.5)))

    with pytest.raises(LanguageError, match="has a gear 'low'"):
        ShiftSchedule(shifts=((0.0, "low", 0.0),), pattern=(("low", "a"),))


def test_clutch_pressed_from_zero() -> None:
    """It slides from the first moment of the ramp on, and does not chatter between open and pressed."""
    parts = {
        "one": Inertia(J=1.0, phi=0.0, w=10.0), "clutch": Clutch(capacity=8.0), "two": Inertia(J=1.0, phi=0.0, w=0.0),
        "selector": ShiftSchedule(shifts=((0, "N", 0), (1, "1", 2))),
    }  # fmt: skip
    wires = {"press": ["selector.a", "clutch.f_normalized"]}
    drive = Assembly("drive", parts=parts, series={"s": ["one", "clutch", "two"]}, connect=wires)
    run = simulate(drive, "4 s", rtol=1e-10, atol=1e-12)
    slides, sticks = (event for event in run.events if event.mode == "clutch.mode")
    assert (slides.time, slides.after, sticks.after) == (1.0, "backward", "stuck")
    # The torque 4 N.m/s·(t - 1 s) takes 2·4/2·(t - 1 s)² from the slip speed of 10 rad/s.
    assert sticks.time == pytest.approx(1 + 2.5**0.5, rel=1e-9)


def test_speed_unit_of_the_targets() -> None:
    """The document's front set: 1000/min at the ring, sun fixed."""
    run = driven(PlanetarySet(i0=-1.917), "sun", "ring", "carrier", speed=1000 * pi / 30)
    assert run.final["mass.w"] * 30 / pi == pytest.approx(657.182, rel=1e-6)
