"""Dry friction against closed forms: sliding, sticking, breaking away."""

from math import atan, log, pi, sqrt
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from components import (
    BearingFriction,
    Brake,
    Clutch,
    ConstantForce,
    ConstantSpeed,
    ConstantTorque,
    Inertia,
    MachineTable,
    MultiPlateClutch,
    Pulse,
    Ramp,
    Sine,
    SpeedDependentLoad,
    Spring,
    Torque,
)
from modelica_like import Assembly, Component, Solution, simulate
from modelica_like.errors import SingularAtStart

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


MU = ((0.0, 0.5), (5.0, 0.3), (20.0, 0.4))


def mu_linear(v: float) -> float:
    return 0.5 - 0.04 * v if v < 5 else 0.3 + 0.1 * (v - 5) / 15


@pytest.mark.parametrize("kind", [Clutch, Brake])
def test_coefficient_from_a_table(kind: type[Component]) -> None:
    """Beyond the last row the last slope goes on."""
    brake = kind(fn_max=2.0, cgeo=1.5, mu_pos=MU)
    parts = {"mass": still(30.0), "brake": brake}
    run = simulate(shaft(**parts, **({"wall": ConstantSpeed(w_fixed=0.0)} if kind is Clutch else {})), "40 s", **TIGHT)
    stop = run.events[-1].time
    reference = solve_ivp(
        lambda t, w: [-3.0 * mu_linear(w[0])],
        (0, stop),
        [30.0],
        rtol=1e-11,
        atol=1e-12,
        max_step=0.01,
        t_eval=[0.3 * stop, 0.9 * stop],
    )
    for t, w in zip(reference.t, reference.y[0], strict=True):
        assert run.at(t)["mass.w"] == pytest.approx(w, abs=1e-6)
    # Both pieces are exponentials: from 30 to 5 rad/s, and from 5 to 0.
    assert stop == pytest.approx(50 * log(mu_linear(30.0) / 0.3) + log(0.5 / 0.3) / 0.12, abs=1e-6)


def test_smooth_table_meets_its_rows_without_overshoot() -> None:
    for speed, mu in MU:
        run = simulate(
            shaft(motor=ConstantSpeed(w_fixed=speed + 1e-12), brake=Brake(fn_max=1.0, mu_pos=MU, smooth=True)), "1 ms"
        )
        assert run["brake.tau"][0] == pytest.approx(mu, abs=1e-9)
    between = simulate(shaft(motor=ConstantSpeed(w_fixed=4.0), brake=Brake(fn_max=1.0, mu_pos=MU, smooth=True)), "1 ms")
    assert 0.3 < between["brake.tau"][0] < 0.5


def test_scales_of_tables() -> None:
    run = simulate(
        shaft(
            motor=ConstantSpeed(w_fixed="500 rpm"),
            bearing=BearingFriction(tau_pos=((0, 10), (1000, 30)), w_scale="1 rpm", tau_scale="0.01 N.m"),
        ),
        "1 ms",
    )
    assert run["bearing.tau"][0] == pytest.approx(0.2, rel=1e-12)


def test_law_of_the_multi_plate_clutch() -> None:
    clutch = {
        "mu_min": 0.04,
        "w_min": 12.57,
        "curvature": 3.023e-5,
        "slope": 1.55e-4,
        "mu_static": 0.133,
        "fn_max": 1000.0,
        "cgeo": 2.0,
    }
    for slip, mu in ((1.0, 3.023e-5 * 11.57**3 + 0.04), (12.57, 0.04), (32.57, 0.04 + 1.55e-4 * 20)):
        run = simulate(
            shaft(
                motor=ConstantSpeed(w_fixed=slip),
                clutch=MultiPlateClutch(**clutch, tau_drag=2.5),
                wall=ConstantSpeed(w_fixed=0.0),
            ),
            "1 ms",
        )
        assert -run["clutch.tau"][0] == pytest.approx(2000.0 * mu + 2.5, rel=1e-12)
    hold = 2000.0 * 0.133
    for factor, moves in ((0.999, False), (1.001, True)):
        run = simulate(
            shaft(
                torque=ConstantTorque(tau_constant=factor * hold),
                mass=still(),
                clutch=MultiPlateClutch(**clutch),
                wall=ConstantSpeed(w_fixed=0.0),
            ),
            "1 ms",
        )
        assert (run.final["mass.w"] > 0) == moves


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


def test_two_brakes_on_one_shaft_cannot_both_stick() -> None:
    for w, when in ((0.0, "t = 0 s"), (5.0, "t = 1.25 s")):
        with pytest.raises(SingularAtStart) as caught:
            simulate(shaft(mass=still(w), brake1=Brake(capacity=3.0), brake2=Brake(capacity=1.0)), "3 s")
        message = str(caught.value)
        assert when in message
        assert "brake1 and brake2 stick" in message
        assert "Give one of them a small creep, put a spring between them, or let one start open." in message


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
    run = simulate(shaft(mass=still(5.0, J=2.0), bearing=BearingFriction(tau_pos=((0, 1), (1, 2)))), "5 s", **TIGHT)
    stop = 2.0 * log(6.0)
    assert run.events[-1].time == pytest.approx(stop, abs=1e-8)
    slides = run.time < stop
    np.testing.assert_allclose(run["mass.w"][slides], 6.0 * np.exp(-run.time[slides] / 2) - 1.0, atol=1e-8)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("kind", [BearingFriction, Brake])
def test_friction_that_vanishes_at_standstill(kind: type[Component], sign: int) -> None:
    """Without static friction the mass never sticks: a purely viscous bearing, or plates with mu(0) = 0."""
    viscous = BearingFriction(tau_pos=((0, 0), (1, 2)))
    plates = Brake(fn_max=4.0, mu_pos=((0, 0), (1, 0.5)))
    friction = viscous if kind is BearingFriction else plates
    run = simulate(shaft(mass=still(sign * 5.0), friction=friction), "1 s", **TIGHT)
    np.testing.assert_allclose(run["mass.w"], sign * 5.0 * np.exp(-2.0 * run.time), rtol=1e-8)
    assert run.events == ()


# -- tables and loads --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("force", [150.0, 60.0, -150.0])
def test_machine_table_on_its_slideway(force: float) -> None:
    table = MachineTable(m=20.0, f_friction=50.0, f_load=30.0, s=0.0, v=0.0)
    run = simulate(shaft(push=ConstantForce(f_constant=force), table=table), "0.5 s", **TIGHT)
    net = force - 30.0
    acceleration = 0.0 if abs(net) <= 50.0 else (net - np.sign(net) * 50.0) / 20.0
    np.testing.assert_allclose(run["table.v"], acceleration * run.time, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(run["table.s"], acceleration * run.time**2 / 2, atol=1e-9)


@pytest.mark.parametrize("sign", [1, -1])
def test_load_with_exponent_one_and_two(sign: int) -> None:
    """Coasting: J w' = -(a + b·w), and J w' = -(a + b·w²)."""
    linear = simulate(shaft(mass=still(sign * 4.0), load=SpeedDependentLoad(a=1.0, b=2.0)), "3 s", **TIGHT)
    assert linear.events[-1].time == pytest.approx(log(9.0) / 2, abs=1e-8)
    square = simulate(shaft(mass=still(sign * 4.0), load=SpeedDependentLoad(a=1.0, b=2.0, p=2)), "3 s", **TIGHT)
    assert square.events[-1].time == pytest.approx(atan(4.0 * sqrt(2.0)) / sqrt(2.0), abs=1e-8)
    for run in (linear, square):
        assert run.final["mass.w"] == 0.0
        assert np.all(run["load.loss_power"] >= -1e-12)


@pytest.mark.parametrize("p", [2 / 3, 0.5, 1.5])
def test_load_with_any_exponent(p: float) -> None:
    run = simulate(
        shaft(
            torque=ConstantTorque(tau_constant=20.0),
            mass=still(),
            load=SpeedDependentLoad(a=9.0, b=2.0, p=p, w_ref=2.0),
        ),
        "3 s",
        **TIGHT,
    )

    def rates(t: float, w: Any) -> list[float]:
        return [20.0 - 9.0 - 2.0 * (max(w[0], 0.0) / 2.0) ** p]

    reference = solve_ivp(rates, (0, 3), [0.0], "DOP853", rtol=1e-11, atol=1e-12, t_eval=[0.1, 1.0, 3.0])
    for t, w in zip(reference.t, reference.y[0], strict=True):
        assert run.at(t)["mass.w"] == pytest.approx(w, rel=1e-7)


def test_load_holds_at_standstill_and_is_free_without_a_constant_part() -> None:
    held = simulate(shaft(torque=ConstantTorque(tau_constant=8.9), mass=still(), load=SpeedDependentLoad(a=9.0)), "1 s")
    assert np.all(held["mass.w"] == 0.0)
    free = simulate(
        shaft(torque=ConstantTorque(tau_constant=1.0), mass=still(), load=SpeedDependentLoad(b=2.0)), "1 s", **TIGHT
    )
    assert free.final["mass.w"] == pytest.approx(0.5 * (1 - np.exp(-2.0)), rel=1e-8)


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
    assert balance.closure < 1e-8
