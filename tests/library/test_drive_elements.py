"""Belts, screws with losses, flexible shafts, controllers and actuators."""

from itertools import pairwise
from math import exp, pi, sqrt
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from components import (
    PI,
    PID,
    BallScrew,
    BallScrewDrive,
    ClutchActuator,
    Constant,
    ConstantForce,
    ConstantSpeed,
    ConstantTorque,
    Feedback,
    FirstOrder,
    Fixed,
    FlexibleShaft,
    Gain,
    IdealGear,
    Inertia,
    Integrator,
    Mass,
    Pulse,
    SpeedSensor,
    Step,
    StribeckBearing,
    TimingBelt,
    Torque,
)
from modelica_like import Assembly, Component, build, simulate
from modelica_like.errors import LanguageError
from modelica_like.show.report.run import notices

TIGHT = {"rtol": 1e-10, "atol": 1e-12}


def shaft(**parts: Component) -> Assembly:
    return Assembly("drive", parts=parts, series={"shaft": list(parts)})


# -- belts -------------------------------------------------------------------------------------------------------------


def test_stiff_belt_is_a_gear() -> None:
    motor, rotor = ConstantTorque(tau_constant=2.0), Inertia(J=0.01)
    belt = TimingBelt(r_a=0.02, r_b=0.06, c=1e7, d=1e4)
    load = Inertia(J=0.5, phi=0.0, w=0.0)
    run = simulate(shaft(motor=motor, rotor=rotor, belt=belt, load=load).copy(), "1 s", parameters=None, start="rest")
    ideal = simulate(shaft(motor=motor, rotor=rotor, gear=IdealGear(ratio=3.0), load=load), "1 s")
    assert run.final["rotor.w"] == pytest.approx(ideal.final["rotor.w"], rel=1e-4)
    assert run.final["load.w"] == pytest.approx(ideal.final["load.w"], rel=1e-4)


def test_belt_oscillates_as_a_spring_of_two_strands() -> None:
    """Pulley fixed at one end: natural frequency sqrt(2·c·r²/J), decay 2·d·r²/(2·J)."""
    r, c, d, J = 0.05, 2e4, 4.0, 0.02
    belt = TimingBelt(r_a=0.1, r_b=r, c=c, d=d, F_0=100.0)
    run = simulate(shaft(wall=Fixed(), belt=belt, wheel=Inertia(J=J, phi=0.0, w=1.0)), "0.2 s", **TIGHT)
    decay, w0 = d * r**2 / J, sqrt(2 * c * r**2 / J)
    w = sqrt(w0**2 - decay**2)
    np.testing.assert_allclose(run["wheel.phi"], np.exp(-decay * run.time) * np.sin(w * run.time) / w, atol=1e-9)
    np.testing.assert_allclose(run["belt.F_1"] + run["belt.F_2"], 200.0, atol=1e-9)
    np.testing.assert_allclose(run["belt.F_1"] - run["belt.F_2"], run["belt.f"], atol=1e-9)
    assert run.energy().power_closure <= 1e-8


def test_a_belt_that_turns_with_its_housing_rests_in_it() -> None:
    parts = {
        "frame": ConstantSpeed(w_fixed=3.0), "belt": TimingBelt(r_a=0.1, r_b=0.05, c=2e4, d=50.0, F_0=100.0),
        "a": Inertia(J=0.02, phi=0.0, w=3.0), "b": Inertia(J=0.01, phi=0.0, w=3.0),
    }  # fmt: skip
    wires = {
        "frame": ("frame.flange", "belt.support"), "a": ("belt.flange_a", "a.flange_a"),
        "b": ("belt.flange_b", "b.flange_a"),
    }  # fmt: skip
    run = simulate(Assembly("turning", parts=parts, connect=wires), "0.2 s", **TIGHT)
    np.testing.assert_allclose([run["belt.f"], run["a.w"] - 3.0, run["b.w"] - 3.0], 0.0, atol=1e-9)


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_belt_slips_by_eytelwein(direction: float) -> None:
    """At the limit the strand forces have the ratio exp(mu·wrap_angle); the load turns with the force of the belt."""
    mu, wrap, F_0, r_b = 0.3, 2.5, 50.0, 0.1
    motor = ConstantSpeed(w_fixed=direction * 100.0)
    belt = TimingBelt(r_a=0.05, r_b=r_b, c=1e5, d=100.0, F_0=F_0, mu=mu, wrap_angle=wrap)
    run = simulate(shaft(motor=motor, belt=belt, load=Inertia(J=0.2, phi=0.0, w=0.0)), "4 s", rtol=1e-8)
    force = 2 * F_0 * (exp(mu * wrap) - 1) / (exp(mu * wrap) + 1)
    slipping = (run.time > 0.05) & (run["belt.grip"] != 0)
    np.testing.assert_allclose(run["belt.f"][slipping], direction * force, rtol=1e-9)
    strands = run["belt.F_1"][slipping], run["belt.F_2"][slipping]
    np.testing.assert_allclose(np.maximum(*strands) / np.minimum(*strands), exp(mu * wrap), rtol=1e-9)
    assert run.at(0.5)["load.w"] == pytest.approx(direction * force * r_b / 0.2 * 0.5, rel=1e-2)
    grips = next(event.time for event in run.events if event.after == "sticking")
    assert grips == pytest.approx(100.0 * 0.5 / (force * r_b / 0.2), rel=1e-2)
    assert np.all(run["belt.loss_power"] >= -1e-9)
    assert run.energy().power_closure <= 1e-8


@pytest.mark.parametrize(("torque", "slack"), [(4.0, False), (12.0, True), (-12.0, True)])
def test_a_strand_cannot_push(torque: float, slack: bool) -> None:
    """Pulley of 50 mm on strands of 20 kN/m with 100 N each: from 10 N.m on one is slack, the other carries alone."""
    belt = TimingBelt(r_a=0.05, r_b=0.1, c=2e4, d=50.0, F_0=100.0)
    push, wheel = ConstantTorque(tau_constant=torque), Inertia(J=1e-3, phi=0.0, w=0.0)
    run = simulate(shaft(push=push, wheel=wheel, belt=belt, wall=Fixed()), 2.0, rtol=1e-9)
    force = abs(torque) / 0.05
    strands = sorted([run.final["belt.F_1"], run.final["belt.F_2"]])
    assert strands == pytest.approx([0.0, force] if slack else [100 - force / 2, 100 + force / 2], abs=1e-6)
    assert abs(run.final["belt.x"]) == pytest.approx((force - 100) / 2e4 if slack else force / 4e4, rel=1e-6)
    stored = 0.5 * (strands[1] ** 2 + strands[0] ** 2 - 2 * 100**2) / 2e4
    assert run.energy()["belt"].stored == pytest.approx(stored, rel=1e-6)
    assert run.energy().imbalance == 0
    assert run.energy()["belt"].gain == 0
    told = [one for one in notices(run) if "slack strand" in one]
    assert len(told) == slack
    for event in (one for one in run.events if one.after == "slack"):
        then = run.at(event.time)
        assert abs(2e4 * then["belt.x"] + 50 * 0.05 * then["wheel.w"]) == pytest.approx(100, rel=1e-6)


def test_a_strand_that_is_damped_is_slack_before_it_is_stretched() -> None:
    """100 mm/s between the pulleys against 2 kN.s/m: 200 N of damping in strands that have 100 N."""
    belt = TimingBelt(r_a=0.05, r_b=0.1, c=10.0, d=2e3, F_0=100.0)
    run = simulate(shaft(wall=Fixed(), belt=belt, wheel=Inertia(J=1e-3, phi=0.0, w=1.0)), 0.1)
    assert run["belt.F_1"].min() == 0
    assert sum("slack strand" in one for one in notices(run)) == 1


def test_a_belt_without_pre_tension_pulls_with_one_strand() -> None:
    """Frequency sqrt(c·r²/J): half the stiffness, in both directions."""
    belt = TimingBelt(r_a=0.1, r_b=0.05, c=2e4, d=1e-9)
    run = simulate(shaft(wall=Fixed(), belt=belt, wheel=Inertia(J=0.02, phi=0.0, w=1.0)), "0.5 s", **TIGHT)
    w = sqrt(2e4 * 0.05**2 / 0.02)
    np.testing.assert_allclose(run["wheel.phi"], np.sin(w * run.time) / w, atol=1e-7)
    assert np.min([run["belt.F_1"], run["belt.F_2"]]) >= 0


# -- screws ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("efficiency", "holds"), [(0.9, False), (0.6, False), (0.45, True)])
def test_screw_by_direction_of_power(efficiency: float, holds: bool) -> None:
    """Lifting at constant speed takes the torque F·lead/(2·pi·eta), lowering F·lead·eta_back/(2·pi)."""
    lead, force = 0.01, -5000.0
    back = 2 - 1 / efficiency
    for speed, factor in ((50.0, 1 / efficiency), (-50.0, back)):
        screw = BallScrewDrive(lead=lead, J=1e-4, efficiency=efficiency, c=1e8, d=1e4)
        drive = shaft(
            motor=ConstantSpeed(w_fixed=speed), screw=screw, table=Mass(m=10.0), weight=ConstantForce(f_constant=force)
        )
        run = simulate(drive, "0.5 s", start="steady", points=5)
        assert run.final["screw.flange_r.tau"] == pytest.approx(-force * lead / (2 * pi) * factor, rel=1e-6)
    screw = BallScrewDrive(lead=lead, J=1e-4, efficiency=efficiency, c=1e8, d=1e4)
    rest = shaft(screw=screw, table=Mass(m=10.0, s=0.0, v=0.0), weight=ConstantForce(f_constant=force))
    rest.set("screw.nut.w_rel", 0.0)
    rest.set("screw.nut.phi_rel", force / (1e8 * lead / (2 * pi)))
    free = Assembly(
        "free",
        parts={"free": Inertia(J=1e-6), **{k: rest.find(k) for k in ("screw", "table", "weight")}},
        series={"shaft": ["free", "screw", "table", "weight"]},
    )
    run = simulate(free, "0.05 s", rtol=1e-8)
    assert (abs(run.final["table.v"]) < 1e-6) == holds
    assert run.energy().power_closure <= 1e-8


def test_backlash_of_a_screw_is_lost_motion() -> None:
    """Where the motor turns back, the table waits for 2·pi·backlash/lead of the spindle."""
    screw = BallScrewDrive(lead=0.01, J=1e-4, efficiency=0.95, c=1e8, d=2e4, backlash=2e-4, has_backlash=True)
    free = BallScrew(lead=0.01)
    run = simulate(
        shaft(motor=ConstantSpeed(w_fixed=10.0), screw=screw, table=Mass(m=5.0, s=0.0, v=0.0),
        drag=ConstantForce(f_constant=-200.0)),
        "0.5 s", rtol=1e-7,
    )  # fmt: skip
    wanted = 0.01 * 10.0 * 0.5 / (2 * pi)
    assert abs(wanted - run.final["table.s"]) == pytest.approx(1e-4, rel=0.05)
    assert free.value("lead") is not None
    assert run.energy().power_closure <= 1e-8
    with pytest.raises(LanguageError, match=r"^BallScrewDrive: backlash has a value, but the nut has none\.\nAdd has_"):
        build(shaft(screw=BallScrewDrive(lead=0.01, J=1e-4, c=1e8, backlash=2e-4), table=Mass(m=5.0)))


# -- shafts ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("n", [4, 8])
def test_flexible_shaft_has_the_frequencies_of_its_pieces(n: int) -> None:
    """Clamped at one end and twisted into its first mode, it swings with 2·n·sqrt(c/J)·sin(pi/(4·n))."""
    J, c = 0.02, 300.0
    drive = shaft(wall=Fixed(), rod=FlexibleShaft(n=n, J=J, c=c), tip=Inertia(J=1e-9))
    for k in range(1, n + 1):
        drive.set(f"rod.springs[{k}].phi_rel", np.sin(k * pi / (2 * n)) - np.sin((k - 1) * pi / (2 * n)))
        drive.set(f"rod.springs[{k}].w_rel", 0.0)
    run = simulate(drive, "0.05 s", **TIGHT)
    w = 2 * n * sqrt(c / J) * np.sin(pi / (4 * n))
    np.testing.assert_allclose(run["tip.phi"], np.cos(w * run.time), atol=1e-4)
    assert w == pytest.approx(pi / 2 * sqrt(c / J), rel=(pi / (2 * n)) ** 2 / 24 * 1.05)
    assert run.energy().power_closure <= 1e-8


def test_stribeck_bearing_slows_down_as_scipy_says() -> None:
    bearing = StribeckBearing(d=0.01, tau_Coulomb=0.4, tau_Stribeck=0.6, w_Stribeck=2.0)
    run = simulate(shaft(wheel=Inertia(J=0.5, phi=0.0, w=20.0), bearing=bearing), "25 s", **TIGHT)

    def rates(t: float, y: Any) -> list[float]:
        return [-(0.01 * y[0] + 0.4 + 0.6 * exp(-y[0] / 2.0)) / 0.5]

    def rest(t: float, y: Any) -> float:
        return y[0]

    rest.terminal = True  # type: ignore[attr-defined]
    reference = solve_ivp(rates, (0, 25), [20.0], rtol=1e-11, atol=1e-12, events=rest)
    assert run.events[0].time == pytest.approx(reference.t_events[0][0], rel=1e-7)
    assert run.final["wheel.w"] == 0.0
    assert run.energy().power_closure <= 1e-8


# -- control -----------------------------------------------------------------------------------------------------------


def signals(**parts: Component) -> Assembly:
    names = list(parts)
    return Assembly(
        "loop",
        parts=parts,
        connect={f"w{k}": [f"{a}.y", f"{b}.u"] for k, (a, b) in enumerate(pairwise(names))},
    )


def test_blocks() -> None:
    run = simulate(
        signals(one=Constant(k=2.0), gain=Gain(k=3.0), lag=FirstOrder(T=0.5, y=0.0), sum=Integrator(y=1.0)),
        "2 s",
        **TIGHT,
    )
    np.testing.assert_allclose(run["lag.y"], 6.0 * (1 - np.exp(-2 * run.time)), atol=1e-8)
    np.testing.assert_allclose(run["sum.y"], 1.0 + 6.0 * (run.time - 0.5 * (1 - np.exp(-2 * run.time))), atol=1e-8)


def speed_loop(controller: Component, until: str) -> Any:
    parts: dict[str, Component] = {
        "wanted": Step(height="10 rad/s", start_time=0.1), "controller": controller, "motor": Torque(),
        "rotor": Inertia(J=0.5, phi=0.0, w=0.0),
        "sensor": SpeedSensor(),
    }  # fmt: skip
    drive = Assembly(
        "loop", parts=parts, series={"shaft": ["motor", "rotor", "sensor"]},
        connect={"set": ["wanted.y", "controller.u_s"], "measured": ["sensor.w", "controller.u_m"],
        "out": ["controller.y", "motor.tau"]},
    )  # fmt: skip
    return simulate(drive, until, rtol=1e-9)


def test_speed_control_by_pi() -> None:
    """J·der(w) = k·(e + integral): the step response of the closed loop of second order."""
    run = speed_loop(PI(k="4 N.m.s/rad", Ti=0.5, integral=0.0), "3 s")
    t = np.maximum(run.time - 0.1, 0)
    decay = 4.0 / (2 * 0.5)
    assert decay**2 == 4.0 / (0.5 * 0.5)  # critically damped
    np.testing.assert_allclose(run["rotor.w"], 10 * (1 - np.exp(-decay * t) * (1 - decay * t)), atol=1e-6)


def test_limited_pi_does_not_wind_up() -> None:
    free, limited = PI(k="4 N.m.s/rad", Ti=0.5, integral=0.0), PI(k="4 N.m.s/rad", Ti=0.5, y_max="5 N.m", integral=0.0)
    run = speed_loop(limited, "4 s")
    assert np.max(np.abs(run["controller.y"])) <= 5.0 + 1e-9
    assert np.max(run["rotor.w"]) < 1.08 * 10.0
    assert run.final["rotor.w"] == pytest.approx(10.0, rel=2e-3)
    assert np.max(speed_loop(free, "4 s")["rotor.w"]) == pytest.approx(10 * (1 + exp(-2)), rel=1e-4)


def test_a_limited_integral_goes_back_with_its_time_constant() -> None:
    """At the limit Ni·Ti·der(I) = I_end - I with I_end = y_max/k - (1 - Ni)·e: back-calculation on paper."""
    k, Ti, Ni, e, y_max = 4.0, 0.5, 0.3, 2.0, 3.0
    parts: dict[str, Component] = {
        "error": Constant(k=e), "none": Constant(k=0.0),
        "part": PI(k=k, Ti=Ti, Ni=Ni, y_max=y_max, u_ff=0.0, integral=1.0),
    }  # fmt: skip
    wires = {"set": ["error.y", "part.u_s"], "measured": ["none.y", "part.u_m"]}
    run = simulate(Assembly("limited", parts=parts, connect=wires), 0.4, rtol=1e-9)
    end = y_max / k - (1 - Ni) * e
    np.testing.assert_allclose(run["part.integral"], end + (1.0 - end) * np.exp(-run.time / (Ni * Ti)), atol=1e-7)
    assert set(run["part.y"]) == {y_max}


def test_pid_against_scipy() -> None:
    run = speed_loop(PID(k="4 N.m.s/rad", Ti=0.5, Td=0.05, Nd=10.0, integral=0.0, smoothed=0.0), "2 s")

    def rates(t: float, y: Any) -> list[float]:
        error = 10.0 - y[0]
        return [4.0 * (error + y[1] + 10.0 * (error - y[2])) / 0.5, error / 0.5, (error - y[2]) / 0.005]

    reference = solve_ivp(rates, (0, 1.9), [0, 0, 0], "Radau", rtol=1e-9, atol=1e-11, t_eval=np.linspace(0, 1.9, 20))
    for t, w in zip(reference.t, reference.y[0], strict=True):
        assert run.at(t + 0.1)["rotor.w"] == pytest.approx(w, abs=1e-5)


def test_feedback() -> None:
    parts: dict[str, Component] = {"a": Constant(k="3 N"), "b": Constant(k="1 N"), "difference": Feedback()}
    loop = Assembly("loop", parts=parts, connect={"a": ["a.y", "difference.u1"], "b": ["b.y", "difference.u2"]})
    assert simulate(loop, "1 s", points=2).final["difference.y"] == 2.0


def test_clutch_actuator_follows_its_times() -> None:
    pulse = Pulse(start_time=0.1, period=1.0, width=0.5)
    actuator = ClutchActuator(t11=0.04, t12=0.1, t2=0.05)
    loop = Assembly("loop", parts={"pulse": pulse, "actuator": actuator}, connect={"on": ["pulse.y", "actuator.on"]})
    run = simulate(loop, "1.5 s", rtol=1e-9)
    on, full, off, none = 0.1 + 0.04, 0.1 + 0.04 + 0.1, 0.6, 0.65
    shape = np.interp(run.time, [0, on, full, off, none, 1.14, 1.24, 1.5], [0, 0, 1, 1, 0, 0, 1, 1])
    np.testing.assert_allclose(run["actuator.y"], shape, atol=1e-9)


def test_clutch_actuator_that_is_switched_on_again_rises_from_where_it_is() -> None:
    pulse = Pulse(start_time=0.1, period=0.2, width=0.9)
    actuator = ClutchActuator(t11=0.04, t12=0.1, t2=0.05)
    loop = Assembly("loop", parts={"pulse": pulse, "actuator": actuator}, connect={"on": ["pulse.y", "actuator.on"]})
    run = simulate(loop, "0.45 s", rtol=1e-9)
    shape = np.interp(run.time, [0, 0.14, 0.24, 0.28, 0.3, 0.34, 0.45], [0, 0, 1, 1, 0.6, 1, 1])
    np.testing.assert_allclose(run["actuator.y"], shape, atol=1e-9)


def test_clutch_actuator_that_is_switched_off_again_too_soon() -> None:
    pulse = Pulse(start_time=0.1, period=1.0, width=0.03)
    actuator = ClutchActuator(t11=0.04, t12=0.1, t2=0.05)
    loop = Assembly("loop", parts={"pulse": pulse, "actuator": actuator}, connect={"on": ["pulse.y", "actuator.on"]})
    run = simulate(loop, "0.5 s")
    assert np.all(run["actuator.y"] == 0.0)


def test_clutch_actuator_of_a_coil() -> None:
    """Exponential: 90 % after t12, 10 % after t2; switched off during the rise, it falls from where it is."""
    pulse = Pulse(start_time=0.1, period=2.0, width=0.085)
    actuator = ClutchActuator(t11=0.04, t12=0.1, t2=0.05, exponential=True)
    loop = Assembly("loop", parts={"pulse": pulse, "actuator": actuator}, connect={"on": ["pulse.y", "actuator.on"]})
    run = simulate(loop, "2.1 s", points=2100)
    begin, off, gone = 0.14, 0.27, 0.27 + 9 * 0.05
    assert run.at(begin + 0.1)["actuator.y"] == pytest.approx(0.9, rel=1e-12)
    reached = 1 - 10 ** (-(off - begin) / 0.1)
    rise = 1 - 10 ** (-(run.time - begin) / 0.1)
    fall = reached * 10 ** (-(run.time - off) / 0.05)
    shape = np.select([run.time < begin, run.time <= off, run.time <= gone], [0, rise, fall], 0)
    np.testing.assert_allclose(run["actuator.y"], shape, atol=2e-9)
    again = Pulse(start_time=0.1, period=0.15, width=0.9)
    retriggered = Assembly(
        "loop", parts={"pulse": again, "actuator": actuator}, connect={"on": ["pulse.y", "actuator.on"]}
    )
    run = simulate(retriggered, "0.3 s")
    fallen = (1 - 10 ** (-0.95)) * 10 ** (-0.015 / 0.05)
    assert run.at(0.25)["actuator.y"] == pytest.approx(fallen, rel=1e-9)
    assert run.at(0.3)["actuator.y"] == pytest.approx(1 - (1 - fallen) * 10 ** (-0.5), rel=1e-9)
