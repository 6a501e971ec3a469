"""Couplings with hysteresis, breaking points, absorbers and clutches by speed, against closed forms."""

from math import atan, exp, pi, sqrt, tan, tanh

import numpy as np
import pytest

from components import (
    CentrifugalPendulum,
    ConstantSpeed,
    ConstantTorque,
    ConstantVelocity,
    ElasticCoupling,
    Fixed,
    FixedTemperature,
    HystereticCoupling,
    Inertia,
    Mass,
    OldhamCoupling,
    OpenPlates,
    Position,
    Rope,
    RuptureCoupling,
    Sine,
    Step,
    Synchroniser,
    Torque,
    TranslationalFixed,
    ViscousClutch,
)
from modelica_like import Assembly, Component, simulate
from modelica_like.show.report.run import notices

TIGHT = {"rtol": 1e-10, "atol": 1e-12}


@pytest.mark.parametrize("frequency", [0.5, 5.0])
def test_loop_of_hysteresis_costs_the_same_at_every_frequency(frequency: float) -> None:
    """A closed loop of Dahl's law between ±A costs 4·tau_h·(A - x_0·tanh(A/x_0)) with x_0 = tau_h/c_h."""
    parts: dict[str, Component] = {
        "wall": Fixed(), "rubber": HystereticCoupling(stages=((0.0, 50.0),), tau_h=4.0, c_h=80.0),
        "shaker": Position(exact=True), "angle": Sine(amplitude="0.1 rad", f=frequency),
    }  # fmt: skip
    drive = Assembly(
        "drive", parts=parts, series={"s": ["wall", "rubber", "shaker"]}, connect={"a": ["angle.y", "shaker.phi_ref"]}
    )
    run = simulate(drive, 3 / frequency, **TIGHT)
    loop, turned = 4.0 * 4 * (0.1 - 0.05 * tanh(0.1 / 0.05)), 2.25 / frequency
    # The second whole loop from one end to the same end.
    assert run.energy(turned - 1 / frequency, turned)["rubber"].lost == pytest.approx(loop, rel=1e-6)


def test_breaking_point_passes_on_what_it_bears_and_breaks_by_more() -> None:
    parts: dict[str, Component] = {
        "shaft": Inertia(J=1.0, w=0.0, phi=0.0), "pin": RuptureCoupling(tau_break=10.0), "load": Inertia(J=2.0),
        "torque": ConstantTorque(tau_constant=-12.0),
    }  # fmt: skip
    run = simulate(Assembly("drive", parts=parts, series={"s": list(parts)}), 1.0, **TIGHT)
    assert run.final["pin.tau"] == pytest.approx(-12 / 3 * 1.0)
    parts["torque"] = ConstantTorque(tau_constant=-36.0)
    run = simulate(Assembly("drive", parts=parts, series={"s": list(parts)}), 1.0, **TIGHT)
    assert run.final["load.w"] == pytest.approx(-18.0)
    assert run.final["shaft.w"] == pytest.approx(0.0)
    assert any("breaks at 10 N.m" in notice for notice in notices(run))


@pytest.mark.parametrize("order", [2.0, 3.0])
def test_pendulum_takes_the_order_to_which_it_is_tuned(order: float) -> None:
    """Small swings: the rotor feels the mass at R + l, and a torque of the order n = sqrt(R/l) does not shake it.

    The pendulum has to balance the torque: m·l·(R + l)·Omega²·n²·theta_0 = M in opposite phase.
    """
    Omega, R, torque = 100.0, 0.09, 1e-4
    length = R / order**2
    swing = torque / (0.5 * (R + length) * length * (order * Omega) ** 2)
    parts: dict[str, Component] = {
        "shake": Sine(amplitude=f"{torque} N.m", f=order * Omega / (2 * pi)), "torque": Torque(),
        "rotor": Inertia(J=0.05, phi=0.0, w=Omega),
        "pendulum": CentrifugalPendulum(m=0.5, R=R, l=length, theta=0.0, w_theta=-swing * order * Omega),
    }  # fmt: skip
    drive = Assembly(
        "drive", parts=parts, series={"s": ["torque", "rotor", "pendulum"]}, connect={"a": ["shake.y", "torque.tau"]}
    )
    run = simulate(drive, 0.2, **TIGHT)
    shaken = torque / 0.05 / (order * Omega)
    assert np.ptp(run["pendulum.theta"]) == pytest.approx(2 * swing, rel=1e-3)
    assert np.ptp(run["rotor.w"]) < 2e-3 * shaken


def test_viscous_clutch_over_slip_and_temperature() -> None:
    viscous = ViscousClutch(tau_nominal=10.0, w_nominal=50.0, p=0.5, beta=0.02, T_nominal=300.0, w_smooth=1e-3)
    parts: dict[str, Component] = {
        "motor": ConstantSpeed(w_fixed=200.0),
        "clutch": viscous,
        "wall": Fixed(),
        "oil": FixedTemperature(T=350.0),
    }
    drive = Assembly(
        "drive", parts=parts, series={"s": ["motor", "clutch", "wall"]}, connect={"h": ["clutch.heat_port", "oil.port"]}
    )
    run = simulate(drive, 1.0, **TIGHT)
    torque = 10 * sqrt(4) * exp(-1)
    assert run.final["clutch.tau"] == pytest.approx(-torque, rel=1e-9)
    assert -run.energy()["oil"].source == pytest.approx(200 * torque, rel=1e-9)


def test_oldham_coupling_loses_its_share_in_either_direction_of_power() -> None:
    for load in (-20.0, 20.0):
        parts: dict[str, Component] = {
            "motor": ConstantSpeed(w_fixed=2 * pi, phi=0.0), "disc": OldhamCoupling(offset=4e-3, arm=0.05, mu=0.1),
            "load": ConstantTorque(tau_constant=load),
        }  # fmt: skip
        run = simulate(Assembly("drive", parts=parts, series={"s": list(parts)}), 5.0, **TIGHT)
        assert run.energy()["disc"].lost == pytest.approx(8 / pi * 0.1 * 4e-3 / 0.05 * 20 * 5 * 2 * pi, rel=1e-6)


def test_synchroniser_is_pulled_out_by_a_negative_force() -> None:
    parts: dict[str, Component] = {
        "fork": Sine(f=0.5), "motor": ConstantSpeed(w_fixed=50.0),
        "ring": Synchroniser(fn_max=500.0, cgeo=0.3, r_t=0.04, beta=1.0, travel_time=0.01),
        "shaft": Inertia(J=0.01, w=50.0, phi=0.0), "load": ConstantTorque(tau_constant=-1.0),
    }  # fmt: skip
    drive = Assembly(
        "drive", parts=parts, series={"s": ["motor", "ring", "shaft", "load"]},
        connect={"f": ["fork.y", "ring.f_normalized"]},
    )  # fmt: skip
    run = simulate(drive, 1.5, **TIGHT)
    assert run.at(0.9)["shaft.w"] == pytest.approx(50)
    assert run.final["shaft.w"] == pytest.approx(50 - 1 / 0.01 * 0.5, abs=1e-9)


def test_damped_coupling_rings_down_as_its_logarithmic_decrement_says() -> None:
    coupling = ElasticCoupling(stages=((0.0, 400.0),), d=2.0)
    parts: dict[str, Component] = {"wall": Fixed(), "coupling": coupling, "wheel": Inertia(J=1.0, phi=0.1, w=0.0)}
    run = simulate(Assembly("drive", parts=parts, series={"s": list(parts)}), 2.0, **TIGHT)
    swing = sqrt(400 - 1)
    assert run.at(2 * 2 * pi / swing)["wheel.phi"] == pytest.approx(0.1 * exp(-2 * 2 * pi / swing), rel=1e-7)


def test_disc_of_an_oldham_coupling_is_an_inertia() -> None:
    disc = OldhamCoupling(offset=0.1, arm=0.2, mu=0.0, J=0.3, m=20.0, w=0.0)
    parts: dict[str, Component] = {
        "motor": ConstantTorque(tau_constant=6.0),
        "disc": disc,
        "load": Inertia(J=0.5, phi=0.0),
    }
    run = simulate(Assembly("drive", parts=parts, series={"s": list(parts)}), 1.0, **TIGHT)
    assert run.final["load.w"] == pytest.approx(6 / (0.3 + 20 * 0.1**2 + 0.5), rel=1e-9)
    assert run.energy()["disc"].stored == pytest.approx(0.5 * (0.3 + 20 * 0.1**2) * 6**2, rel=1e-7)
    assert run.energy().power_closure <= 1e-8


@pytest.mark.parametrize(("fill", "share"), [(0.25, 0.25), (-0.5, 0.0)])
def test_filling_of_a_viscous_clutch(fill: float, share: float) -> None:
    """Less than nothing in it is nothing: it never drives."""
    clutch = ViscousClutch(tau_nominal=10.0, w_nominal=50.0, fill=fill)
    plates = OpenPlates(n=4, r_o=0.1, r_i=0.05, h=1e-4, eta=0.05, fill=fill)
    parts: dict[str, Component] = {"motor": ConstantSpeed(w_fixed=100.0), "clutch": clutch, "wall": Fixed()}
    beside = {"plates": ["motor.flange", "plates.flange_a"], "still": ["plates.flange_b", "wall.flange"]}
    drive = Assembly("drive", parts={**parts, "plates": plates}, series={"s": list(parts)}, connect=beside)
    run = simulate(drive, 0.1, **TIGHT)
    assert run.final["clutch.tau"] == pytest.approx(-20.0 * share)
    assert run.final["plates.tau"] == pytest.approx(-4 * np.pi * 0.05 * (0.1**4 - 0.05**4) / 2e-4 * 100 * share)


@pytest.mark.parametrize(("cones", "blocks"), [(1.001, True), (0.999, False)])
def test_ring_blocks_where_the_cones_turn_it_harder_than_the_chamfers(cones: float, blocks: bool) -> None:
    """Chamfers of half the angle beta with friction mu_t turn the ring with F·r_t/tan(beta + rho)."""
    turning = 0.04 / tan(0.8 + atan(0.15))
    ring = Synchroniser(
        fn_max=500.0, cgeo=cones * turning / 0.1, mu_pos=((0.0, 0.1),), r_t=0.04, beta=0.8, mu_t=0.15, travel_time=0.01
    )
    parts: dict[str, Component] = {
        "fork": Step(start_time=0.1), "car": Inertia(J=100.0, phi=0.0, w=50.0), "ring": ring,
        "shaft": Inertia(J=0.1, w=0.0, phi=0.0),
    }  # fmt: skip
    drive = Assembly(
        "drive", parts=parts, series={"s": ["car", "ring", "shaft"]}, connect={"f": ["fork.y", "ring.f_normalized"]}
    )
    run = simulate(drive, 0.15, **TIGHT)
    assert bool(run.impacts) is not blocks


def test_pendulum_loses_what_its_damping_takes() -> None:
    pendulum = CentrifugalPendulum(m=0.5, R=0.09, l=0.01, d=1e-3, theta=0.01, w_theta=0.0)
    parts: dict[str, Component] = {"engine": ConstantSpeed(w_fixed=100.0), "pendulum": pendulum}
    run = simulate(Assembly("drive", parts=parts, series={"s": list(parts)}), 1.0, **TIGHT)
    # Small swings decay with d/(2·m·l²): that is 10 per second.
    w = sqrt(300**2 - 10**2)
    assert run.at(4 * pi / w)["pendulum.theta"] == pytest.approx(0.01 * exp(-10 * 4 * pi / w), rel=1e-4)
    assert run.energy().power_closure < 1e-9


def test_rope_pulls_with_spring_and_damper_and_slackens_faster_than_it_can_follow() -> None:
    for speed, tension in ((-0.1, 2e4 * (0.1 * 0.05) + 500 * 0.1), (0.1, 0.0)):
        parts: dict[str, Component] = {
            "beam": TranslationalFixed(),
            "rope": Rope(c=2e4, d=500.0),
            "slide": ConstantVelocity(v_fixed=speed, s=0.0),
        }
        run = simulate(Assembly("drive", parts=parts, series={"s": list(parts)}), 0.1, **TIGHT)
        assert run.at(0.05)["rope.tension"] == pytest.approx(tension, rel=1e-7)
    parts["slide"] = ConstantVelocity(v_fixed=2.0, s=-0.01)
    run = simulate(Assembly("drive", parts=parts, series={"s": list(parts)}), 0.002, **TIGHT)
    assert np.max(run["rope.tension"]) == 0  # 500·2 N.s/m·m/s are more than the 200 N of its stretch
    assert run.energy()["rope"].lost == pytest.approx(0.5 * 2e4 * (0.01**2 - 0.006**2), rel=1e-6)


def test_a_rope_that_just_hangs_straight_is_slack() -> None:
    parts: dict[str, Component] = {
        "beam": TranslationalFixed(),
        "rope": Rope(c=2e4),
        "slide": Mass(m=1.0, s=0.0, v=0.0),
    }
    assert not simulate(Assembly("drive", parts=parts, series={"s": list(parts)}), 0.1)["rope.rope"].any()
