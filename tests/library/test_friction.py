"""Dry friction against closed forms: sliding, sticking, breaking away."""

from math import atan, log, pi, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from components import (
    BearingFriction,
    Brake,
    Clutch,
    Constant,
    ConstantSpeed,
    ConstantTorque,
    IdealGear,
    Inertia,
    Pulse,
    Ramp,
    Sine,
    Speed,
    Spring,
    Torque,
)
from modelica_like import Assembly, Component, Solution, simulate
from modelica_like.simulation import Solver

TIGHT = {"rtol": 1e-10, "atol": 1e-12}


def shaft(signal: Component | None = None, to: str = "", **parts: Component) -> Assembly:
    """Parts in series, and perhaps a signal that drives one of them."""
    wires = {"signal": ("signal.y", to)} if signal else {}
    return Assembly(
        "drive", parts={**parts, "signal": signal} if signal else parts, series={"shaft": list(parts)}, connect=wires
    )


def changes(run: Solution, mode: str) -> list[str]:
    return [event.after for event in run.events if event.mode == mode]


def still(w: float = 0.0, J: float = 1.0) -> Inertia:
    return Inertia(J=J, phi=0.0, w=w)


# -- sliding until locked ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("speeds", [(10.0, 0.0), (-10.0, 0.0), (0.0, 10.0), (3.0, -4.0), (-8.0, -2.0)])
@pytest.mark.parametrize("turned", [False, True])
def test_clutch_brings_two_masses_together(speeds: tuple[float, float], turned: bool) -> None:
    J1, J2, M = 0.5, 2.0, 7.0
    masses = {"one": Inertia(J=J1, phi=0.0, w=speeds[0]), "two": Inertia(J=J2, phi=0.0, w=speeds[1])}
    clutch = Clutch(capacity=M)
    parts = (
        {"two": masses["two"], "clutch": clutch, "one": masses["one"]}
        if turned
        else {"one": masses["one"], "clutch": clutch, "two": masses["two"]}
    )
    run = simulate(shaft(**parts), "3 s")
    slip = abs(speeds[1] - speeds[0])
    (lock,) = run.events
    assert lock.after == "stuck"
    assert lock.time == pytest.approx(slip / (M / J1 + M / J2), abs=1e-9)
    together = (J1 * speeds[0] + J2 * speeds[1]) / (J1 + J2)
    assert run.final["one.w"] == pytest.approx(together, abs=1e-9)
    assert run.final["two.w"] == pytest.approx(together, abs=1e-9)
    assert run.final["clutch.w_rel"] == 0.0
    assert run.energy()["clutch"].lost == pytest.approx(0.5 * J1 * J2 / (J1 + J2) * slip**2, rel=1e-9)


def test_torque_follows_normal_force_radius_and_coefficient() -> None:
    run = simulate(
        shaft(
            Ramp(duration="1 s"),
            "clutch.f_normalized",
            motor=ConstantSpeed(w_fixed=10.0),
            clutch=Clutch(fn_max=50.0, cgeo=0.3, mu_pos=((0, 0.2),), tau_drag=0.1),
            wall=ConstantSpeed(w_fixed=0.0),
        ),
        "1 s",
        points=10,
    )
    np.testing.assert_allclose(run["clutch.tau"], -(0.1 + 0.2 * 0.3 * 50.0 * run.time), rtol=1e-12)


# -- sticking and breaking away ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("peak", [1.0, 1.5])
def test_breaks_away_when_the_torque_exceeds_the_static_friction(sign: int, peak: float) -> None:
    M, rate = 3.0, 10.0
    run = simulate(
        shaft(
            Ramp(height=sign * rate, duration="1 s"),
            "torque.tau",
            torque=Torque(),
            mass=still(),
            brake=Brake(capacity=M, peak=peak),
        ),
        "1 s",
        **TIGHT,
    )
    way = "forward" if sign > 0 else "backward"
    assert changes(run, "brake.mode") == [f"start_{way}", way]
    start = peak * M / rate
    assert run.events[0].time == pytest.approx(start, abs=1e-10)
    t = run.time[run.time >= start]
    np.testing.assert_allclose(
        run["mass.w"][run.time >= start], sign * (0.5 * rate * (t**2 - start**2) - M * (t - start)), atol=1e-7
    )
    assert np.all(run["mass.w"][run.time < start] == 0.0)


@pytest.mark.parametrize("torque", [2.0, -2.0, 3.0, -3.0])
def test_holds_as_long_as_the_torque_is_not_larger(torque: float) -> None:
    run = simulate(shaft(torque=ConstantTorque(tau_constant=torque), mass=still(), brake=Brake(capacity=3.0)), "1 s")
    assert run.events == ()
    assert np.all(run["mass.w"] == 0.0)
    np.testing.assert_allclose(run["brake.tau"], torque, rtol=1e-12)


@pytest.mark.parametrize("torque", [4.0, -4.0])
def test_breaks_away_at_the_very_start(torque: float) -> None:
    run = simulate(shaft(torque=ConstantTorque(tau_constant=torque), mass=still(), brake=Brake(capacity=3.0)), "1 s")
    assert run.final["mass.w"] == pytest.approx(np.sign(torque) * 1.0, rel=1e-9)
    assert [event.time for event in run.events] == [0.0, 0.0]


def test_peak_keeps_the_stick_slip_of_a_belt_alive() -> None:
    """A mass on a brake, pulled by a spring at constant speed, sticks and slips; both times have a closed form."""
    c, J, v, kinetic, peak = 50.0, 0.1, 1.0, 3.0, 1.5
    static = peak * kinetic
    run = simulate(
        shaft(
            belt=ConstantSpeed(w_fixed=v),
            spring=Spring(c=c, phi_rel=0.0),
            mass=Inertia(J=J, w=0.0),
            brake=Brake(capacity=kinetic, peak=peak),
        ),
        "3 s",
        **TIGHT,
    )
    w = sqrt(c / J)
    slip = 2 / w * (pi - atan(w * (static - kinetic) / (c * v)))
    stick = 2 * (static - kinetic) / (c * v)
    away = [event.time for event in run.events if event.before == "stuck"]
    back = [event.time for event in run.events if event.after == "stuck"]
    np.testing.assert_allclose(away, static / (c * v) + (slip + stick) * np.arange(len(away)), atol=1e-7)
    np.testing.assert_allclose(back, static / (c * v) + slip + (slip + stick) * np.arange(len(back)), atol=1e-7)
    assert len(away) == 11


def test_a_sliding_reversal_without_sticking() -> None:
    """At the turning point the driving torque exceeds the friction: the mass does not rest."""
    run = simulate(shaft(torque=ConstantTorque(tau_constant=-5.0), mass=still(4.0), brake=Brake(capacity=3.0)), "2 s")
    turn = 4.0 / 8.0
    np.testing.assert_allclose([event.time for event in run.events], turn, atol=1e-9)
    assert changes(run, "brake.mode")[-1] == "backward"
    assert run.final["mass.w"] == pytest.approx(-2.0 * (2.0 - turn), rel=1e-9)


def test_normal_force_that_jumps_to_zero_and_back() -> None:
    """A pulsed brake: pressed for 0.1 s, free for 0.1 s; the mass under constant torque."""
    run = simulate(
        shaft(
            Pulse(period="0.2 s"),
            "brake.f_normalized",
            torque=ConstantTorque(tau_constant=2.0),
            mass=still(),
            brake=Brake(capacity=3.0),
        ),
        "1 s",
    )
    speed = {0.1: 0.0, 0.2: 0.2, 0.3: 0.1, 0.4: 0.3, 0.5: 0.2, 0.6: 0.4, 0.7: 0.3, 0.8: 0.5, 0.9: 0.4, 1.0: 0.6}
    for t, w in speed.items():
        assert run.at(t)["mass.w"] == pytest.approx(w, abs=1e-9)
    assert run.energy()["brake"].lost == pytest.approx(
        sum(3.0 * 0.1 * (2 * w - 0.1) / 2 for w in (0.2, 0.3, 0.4, 0.5)), rel=1e-9
    )


def test_a_brake_that_is_pressed_at_rest_sticks_at_once() -> None:
    press = Pulse(period="0.4 s", start_time="0.1 s")
    run = simulate(shaft(press, "brake.f_normalized", mass=still(), brake=Brake(capacity=3.0)), "0.2 s")
    assert changes(run, "brake.mode") == ["stuck"]


def test_free_surfaces_carry_no_torque() -> None:
    run = simulate(shaft(mass=still(5.0), clutch=Clutch(capacity=3.0, f_normalized=0.0), other=still()), "1 s")
    assert np.all(run["clutch.tau"] == 0.0)
    assert np.all(run["mass.w"] == 5.0)


def test_residual_drag_of_an_open_clutch() -> None:
    run = simulate(
        shaft(
            mass=still(5.0),
            clutch=Clutch(capacity=3.0, f_normalized=0.0, tau_drag=0.5),
            wall=ConstantSpeed(w_fixed=0.0),
        ),
        "20 s",
    )
    assert run.at(2.0)["mass.w"] == pytest.approx(4.0, rel=1e-9)
    assert run.events[-1].time == pytest.approx(10.0, abs=1e-9)


def test_two_brakes_on_one_shaft_share_the_torque() -> None:
    """What they hold together follows from the balance; each takes a part in proportion to what it can bear."""
    for w, rest in ((0.0, 0.0), (5.0, 2.5)):
        parts = {"mass": still(w), "one": Brake(capacity=3.0), "two": Brake(capacity=1.0)}
        run = simulate(shaft(**parts, motor=ConstantTorque(tau_constant=2.0)), "4 s")
        held = run.time > rest + 1e-9
        np.testing.assert_allclose(run["one.tau"][held], 1.5, rtol=1e-9)
        np.testing.assert_allclose(run["two.tau"][held], 0.5, rtol=1e-9)
        assert np.all(run["mass.w"][held] == 0.0)
        assert run.energy().power_closure < 1e-12


def test_two_brakes_give_way_where_both_can_bear_no_more() -> None:
    """3 + 1 N.m hold until the ramp 5 t has risen above their sum; then 0.5 kg.m2 are accelerated by the excess."""
    parts = {
        "motor": Torque(),
        "mass": Inertia(J=0.5, phi=0, w=0),
        "one": Brake(capacity=3.0),
        "two": Brake(capacity=1.0),
    }
    run = simulate(shaft(Ramp(height=10, duration=2), "motor.tau", **parts), "2 s", **TIGHT)
    assert run.events[0].time == pytest.approx(0.8, abs=1e-9)
    assert run.final["mass.w"] == pytest.approx(0.5 * 5 * 1.2**2 / 0.5, rel=1e-8)


def test_a_brake_and_a_clutch_to_a_shaft_that_is_turned() -> None:
    """Nobody can hold a motion that is prescribed: the weaker one slides at once."""
    for clutch, brake, w in ((1.0, 3.0, 0.0), (3.0, 1.0, 1.0)):
        parts = {
            "motor": Speed(phi=0), "clutch": Clutch(capacity=clutch), "mass": Inertia(J=0.5, phi=0, w=0),
            "brake": Brake(capacity=brake),
        }  # fmt: skip
        run = simulate(shaft(Ramp(height=1, duration=1), "motor.w_ref", **parts), "1 s")
        assert run.final["mass.w"] == pytest.approx(w, abs=1e-6)
        assert run.energy()["clutch" if clutch < brake else "brake"].lost == pytest.approx(0.5, rel=1e-6)


def test_friction_under_prescribed_motion() -> None:
    """While it slides, the torque is determined (passing through standstill: test_prescribed_friction)."""
    run = simulate(shaft(motor=ConstantSpeed(w_fixed=5.0), brake=Brake(capacity=3.0)), "1 s")
    np.testing.assert_allclose(run["motor.flange.tau"], -3.0, rtol=1e-12)
    between = simulate(
        shaft(fast=ConstantSpeed(w_fixed=5.0), clutch=Clutch(capacity=3.0), slow=ConstantSpeed(w_fixed=2.0)), "1 s"
    )
    assert between.energy()["clutch"].lost == pytest.approx(9.0, rel=1e-9)


@pytest.mark.parametrize("kind", [Brake, BearingFriction])
def test_housing_feels_the_friction(kind: type[Component]) -> None:
    """A shaft in a housing that turns itself: like a clutch between the two."""
    parts = {
        "shaft": still(6.0, J=0.5),
        "brake": Brake(capacity=4.0) if kind is Brake else BearingFriction(tau_pos=((0, 4),)),
        "housing": still(J=1.0),
    }
    drive = Assembly(
        "drive",
        parts=parts,
        series={"shaft": ["shaft", "brake"]},
        connect={"support": ["brake.support", "housing.flange_a"]},
    )
    run = simulate(drive, "1 s")
    assert run.events[-1].time == pytest.approx(0.5, abs=1e-9)
    assert run.final["housing.w"] == pytest.approx(2.0, rel=1e-9)
    np.testing.assert_allclose(run["brake.support.tau"], -run["brake.tau"], rtol=1e-12)


def test_bearing_with_viscous_part() -> None:
    bearing = BearingFriction(tau_pos=((0, 1), (1, 2)), extrapolate="linear")
    run = simulate(shaft(mass=still(5.0, J=2.0), bearing=bearing), "5 s", **TIGHT)
    stop = 2.0 * log(6.0)
    assert run.events[-1].time == pytest.approx(stop, abs=1e-8)
    slides = run.time < stop
    np.testing.assert_allclose(run["mass.w"][slides], 6.0 * np.exp(-run.time[slides] / 2) - 1.0, atol=1e-8)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("kind", [BearingFriction, Brake])
def test_friction_that_vanishes_at_standstill(kind: type[Component], sign: int) -> None:
    """Without static friction the mass never sticks: a purely viscous bearing, or plates with mu(0) = 0."""
    viscous = BearingFriction(tau_pos=((0, 0), (1, 2)), extrapolate="linear")
    plates = Brake(fn_max=4.0, mu_pos=((0, 0), (1, 0.5)), extrapolate="linear")
    friction = viscous if kind is BearingFriction else plates
    run = simulate(shaft(mass=still(sign * 5.0), friction=friction), "1 s", **TIGHT)
    np.testing.assert_allclose(run["mass.w"], sign * 5.0 * np.exp(-2.0 * run.time), rtol=1e-8)
    assert run.events == ()


# -- properties --------------------------------------------------------------------------------------------------------


@settings(max_examples=15, deadline=None)
@given(
    amplitude=st.floats(0.5, 20),
    frequency=st.floats(0.3, 5),
    capacity=st.floats(0.1, 10),
    peak=st.floats(1, 2),
    w=st.floats(-5, 5),
    drag=st.floats(0, 1),
)
def test_friction_only_ever_dissipates_and_stays_below_its_limit(
    amplitude: float, frequency: float, capacity: float, peak: float, w: float, drag: float
) -> None:
    sine = Sine(amplitude=amplitude, f=frequency)
    brake = Brake(capacity=capacity, peak=peak, tau_drag=drag)
    run = simulate(shaft(sine, "torque.tau", torque=Torque(), mass=still(w), brake=brake), "2 s", points=200)
    limit = capacity + drag
    names = run.model.flat_discretes[run.model.discrete_position["brake.mode"]].names
    for mode, tau, speed in zip(run["brake.mode"], run["brake.tau"], run["mass.w"], strict=True):
        match names[int(mode)]:
            case "stuck":
                assert abs(tau) <= peak * limit * (1 + 1e-9)
                assert speed == pytest.approx(0.0, abs=1e-12)
            case "forward":
                assert tau == pytest.approx(limit, rel=1e-9)
                assert speed >= -1e-9
            case "backward":
                assert tau == pytest.approx(-limit, rel=1e-9)
                assert speed <= 1e-9
            case _:
                assert abs(tau) == pytest.approx(limit, rel=1e-9)
    balance = run.energy()
    assert balance["brake"].lost >= -1e-9
    assert balance.power_closure < 1e-8


@pytest.mark.parametrize("load", [3.6, -3.6])
def test_brakes_side_by_side_share_a_load_by_their_capacities(load: float) -> None:
    """The least norm weighted by the inverse capacities: 1 and 3 of 4 parts, in either direction."""
    parts = {
        "push": ConstantTorque(tau_constant=load), "rotor": Inertia(J=1.0, phi=0.0, w=0.0),
        "small": Brake(capacity=1.0), "large": Brake(capacity=3.0),
    }  # fmt: skip
    ends = ("push.flange", "rotor.flange_a", "small.flange_a", "large.flange_a")
    run = simulate(Assembly("shared", parts=parts, connect={"shaft": ends}), 1.0, points=4)
    assert not run.events
    np.testing.assert_allclose(run["small.tau"], 0.25 * load, rtol=1e-12)
    np.testing.assert_allclose(run["large.tau"], 0.75 * load, rtol=1e-12)
    assert [one.partition(" hold the same motion")[0] for one in run.notices] == ["small and large"]


@pytest.mark.parametrize("load", [3.2, -3.2])
def test_brakes_hold_what_they_can_hold_together(load: float) -> None:
    """2 N.m near and twice 0.75 N.m far bear 3.2 N.m; by the least norm the far one would bear 0.96 N.m."""
    parts = {
        "push": ConstantTorque(tau_constant=load), "rotor": Inertia(J=1.0, phi=0.0, w=0.0), "near": Brake(capacity=2.0),
        "gear": IdealGear(ratio=0.5), "far": Brake(capacity=0.75),
    }  # fmt: skip
    wires = {
        "shaft": ("push.flange", "rotor.flange_a", "near.flange_a", "gear.flange_a"),
        "fast": ("gear.flange_b", "far.flange_a"),
    }
    run = simulate(Assembly("shared", parts=parts, connect=wires), 1.0, points=4)
    assert not run.events
    near, far = run["near.tau"], run["far.tau"]
    np.testing.assert_allclose(near + 2 * far, load, rtol=1e-12)
    assert np.abs(near).max() <= 2.0 * (1 + 1e-9)
    assert np.abs(far).max() <= 0.75 * (1 + 1e-9)
    assert np.array_equal(run["rotor.w"], np.zeros(len(run.time)))


def test_brakes_share_anew_while_others_slip() -> None:
    """As before, but the load grows, and another shaft with two brakes turns meanwhile."""
    parts = {
        "growth": Ramp(height="3.2 N.m", duration="1 s"), "push": Torque(), "rotor": Inertia(J=1.0, phi=0.0, w=0.0),
        "near": Brake(capacity=2.0), "gear": IdealGear(ratio=0.5), "far": Brake(capacity=0.75),
        "flywheel": Inertia(J=10.0, phi=0.0, w=100.0), "one": Brake(capacity=1.0), "other": Brake(capacity=1.0),
    }  # fmt: skip
    wires = {
        "load": ("growth.y", "push.tau"),
        "shaft": ("push.flange", "rotor.flange_a", "near.flange_a", "gear.flange_a"),
        "fast": ("gear.flange_b", "far.flange_a"),
        "apart": ("flywheel.flange_a", "one.flange_a", "other.flange_a"),
    }
    run = simulate(Assembly("shared", parts=parts, connect=wires), 1.0, points=4)
    assert not [event for event in run.events if event.mode.endswith(".mode")]
    assert run.final["near.tau"] + 2 * run.final["far.tau"] == pytest.approx(3.2, rel=1e-12)


@pytest.mark.parametrize("solver", ["idas", "native"])
def test_a_clutch_that_sticks_in_fast_shafts_does_not_move_at_all(solver: Solver) -> None:
    """Its slip is the difference of speeds of 1e6 rad/s: their rounding is no motion, and asks for no steps."""
    presses = {"one": Constant(k=1.0), "two": Constant(k=1.0)}
    parts = {
        "motor": ConstantTorque(tau_constant=7.0),
        "left": still(1e6, J=2.0),
        "stuck": Clutch(fn_max=1000.0, cgeo=1.0, mu_pos=[[0.0, 0.3]]),
        "right": still(1e6, J=3.0),
        "slipping": Clutch(fn_max=1e-3, cgeo=1.0, mu_pos=[[0.0, 0.3]]),
        "gear": IdealGear(ratio=2.0),
        "slow": still(-3e6, J=0.5),
    }
    wires = {"one": ("one.y", "stuck.f_normalized"), "two": ("two.y", "slipping.f_normalized")}
    drive = Assembly("drive", parts={**parts, **presses}, series={"shaft": list(parts)}, connect=wires)
    run = simulate(drive, 1e5, solver=solver)
    assert np.ptp(run["stuck.phi_rel"]) == 0.0
    assert run.final["left.w"] == pytest.approx(1e6 + (7.0 - 3e-4) / 5.0 * 1e5, rel=1e-12)
    assert run.statistics.steps < 200
