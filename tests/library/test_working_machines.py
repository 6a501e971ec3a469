"""Linkages, drives with a variable ratio and working machines beyond what their netlist shows."""

from math import pi, sin, sqrt
from typing import Any

import numpy as np
import pytest

from components import (
    Cam,
    CentrifugalPump,
    ChainDrive,
    Constant,
    ConstantSpeed,
    ConstantTorque,
    Conveyor,
    Damper,
    DeepGrooveBearing,
    DisplacementLoad,
    ElasticCoupling,
    Fixed,
    FormingForce,
    FourBar,
    Inertia,
    Mass,
    SliderCrank,
    VariableGear,
    WormGear,
)
from modelica_like import Assembly, Component, simulate
from modelica_like.errors import LanguageError, LimitPassed

TIGHT = {"rtol": 1e-10, "atol": 1e-12}


def chain_of(**parts: Component) -> Assembly:
    return Assembly("drive", parts=parts, series={"shaft": list(parts)})


@pytest.mark.parametrize("linkage", [SliderCrank(r=0.1, l=0.3, e=0.04), Cam(h=0.02, rise=2.0, dwell=0.5, fall=2.5)])
def test_linkage_passes_all_power_on(linkage: Component) -> None:
    """A flywheel drives a mass through the linkage: their energy stays, which it does only with the right slope."""
    drive = chain_of(wheel=Inertia(J=0.02, phi=0.3, w=30.0), linkage=linkage, mass=Mass(m=3.0))
    run = simulate(drive, 1.0, **TIGHT)
    kinetic = 0.5 * 0.02 * run["wheel.w"] ** 2 + 0.5 * 3.0 * run["mass.v"] ** 2
    assert np.ptp(run["wheel.w"]) > 0.1
    assert np.ptp(kinetic) < 1e-6 * kinetic[0]


def test_four_bar_passes_all_power_on_and_its_coupler_keeps_its_length() -> None:
    linkage = FourBar(crank=0.04, coupler=0.12, rocker=0.09, ground=0.13)
    run = simulate(
        chain_of(wheel=Inertia(J=0.02, phi=0.3, w=-20.0), linkage=linkage, rocker=Inertia(J=0.05)), 1.0, **TIGHT
    )
    kinetic = 0.5 * 0.02 * run["wheel.w"] ** 2 + 0.5 * 0.05 * run["rocker.w"] ** 2
    assert np.ptp(kinetic) < 1e-6 * kinetic[0]
    phi, psi = run["wheel.phi"], run["rocker.phi"]
    coupler = np.hypot(0.13 + 0.09 * np.cos(psi) - 0.04 * np.cos(phi), 0.09 * np.sin(psi) - 0.04 * np.sin(phi))
    assert np.ptp(phi) > 2 * pi
    assert coupler == pytest.approx(0.12, rel=1e-9)


@pytest.mark.parametrize("load", [-8.0, 8.0])
def test_variable_gear_loses_its_share_whichever_side_drives(load: float) -> None:
    parts: dict[str, Component] = {
        "ratio": Constant(k=2.0), "motor": ConstantSpeed(w_fixed=50.0),
        "gear": VariableGear(T=0.1, efficiency=0.8, ratio=2.0), "load": ConstantTorque(tau_constant=load, phi=0.0),
    }  # fmt: skip
    drive = Assembly(
        "drive", parts=parts, series={"s": ["motor", "gear", "load"]}, connect={"u": ["ratio.y", "gear.u"]}
    )
    run = simulate(drive, 0.5, **TIGHT)
    entering = 8 * 25 / 0.8 if load < 0 else 8 * 25
    assert run.final["gear.loss_power"] == pytest.approx(0.2 * entering, rel=1e-9)


@pytest.mark.slow
def test_chain_pulls_in_both_directions_and_is_as_fast_as_its_teeth() -> None:
    chain = ChainDrive(z_a=15, z_b=45, pitch=0.0127, c=2e5, d=500.0)
    for speed in (20.0, -20.0):
        drive = chain_of(
            motor=ConstantSpeed(w_fixed=speed, phi=0.0), chain=chain.copy(),
            wheel=Inertia(J=0.05, phi=0.0, w=speed / 3), oil=Damper(d=2.0), wall=Fixed(),
        )  # fmt: skip
        run = simulate(drive, 2.0, **TIGHT)
        assert np.sign(run.final["chain.f"]) == np.sign(speed)
        turned = run.final["wheel.phi"]
        # 2 Nm per rad/s at the wheel stretch the chain; otherwise every tooth of one is a tooth of the other.
        stretch = abs(2.0 * speed / 3) / (0.0127 / (2 * sin(pi / 45))) / 2e5
        assert abs(turned - speed * 2 / 3) < 1.2 * stretch / 0.0908 + 1e-3
        assert np.min(run["chain.loss_power"]) > -1e-9
        assert run.energy().power_closure < 1e-9


@pytest.mark.slow
def test_a_chain_on_a_frame_that_turns_does_not_notice() -> None:
    """Speeds, and the teeth that are in the chain, are those against the frame."""
    forces: list[Any] = []
    for speed in (0.0, 3.0):
        parts = {
            "motor": ConstantSpeed(w_fixed=20.0 + speed, phi=0.0), "frame": ConstantSpeed(w_fixed=speed, phi=0.0),
            "chain": ChainDrive(z_a=15, z_b=45, pitch=0.0127, c=2e5, d=500.0),
            "wheel": Inertia(J=0.05, phi=0.0, w=20 / 3 + speed),
        }  # fmt: skip
        drive = Assembly(
            "drive", parts=parts, series={"s": ["motor", "chain", "wheel"]},
            connect={"f": ["frame.flange", "chain.support"]},
        )  # fmt: skip
        forces.append(simulate(drive, 0.5, **TIGHT)["chain.f"])
    assert np.ptp(forces[0]) > 10
    assert forces[1] == pytest.approx(forces[0], abs=1e-4 * np.ptp(forces[0]))


def test_centrifugal_pump_below_its_static_head_moves_nothing() -> None:
    pump = CentrifugalPump(w_nominal=150.0, H_0=60.0, K=1e5, R=2e5, H_static=30.0, tau_0=5.0)
    still = simulate(chain_of(motor=ConstantSpeed(w_fixed=100.0), pump=pump), 0.1, **TIGHT)
    assert still.final["pump.Q"] == 0
    assert still.final["pump.tau"] == pytest.approx(5 * (2 / 3) ** 2)
    free = CentrifugalPump(w_nominal=150.0, H_0=60.0, K=1e5, R=2e5, efficiency=0.6, smooth=1e-9)
    run = simulate(chain_of(wheel=Inertia(J=2.0, phi=0.0, w=150.0), pump=free), 20.0, **TIGHT)
    # Without static head the affinity laws hold: torque falls with the square, so the speed as 1/(1 + t/T).
    flow = sqrt(60 / 3e5)
    torque = 9806.65 * 2e5 * flow**2 * flow / 0.6 / 150
    assert run.final["wheel.w"] == pytest.approx(150 / (1 + torque * 20 / (2 * 150)), rel=1e-5)
    assert np.min(run["pump.loss_power"]) >= 0


def test_loads_hold_at_standstill_up_to_what_they_take() -> None:
    pump = DisplacementLoad(V=20e-6, p_out=50e5, p_in=1e5)
    run = simulate(
        chain_of(motor=ConstantTorque(tau_constant=15.0), wheel=Inertia(J=1.0, phi=0.0, w=0.0), pump=pump), 1.0
    )
    assert run.final["wheel.w"] == 0
    belt = Conveyor(R=0.5, L=20.0, m_L=40.0, m_B=10.0, f=0.03, slope=0.02, phi=0.0, w=0.0)
    run = simulate(chain_of(motor=ConstantTorque(tau_constant=0.0), belt=belt), 1.0)
    assert run.final["belt.w"] == 0
    steep = Conveyor(R=0.5, L=20.0, m_L=40.0, m_B=10.0, f=0.03, slope=0.2, phi=0.0, w=0.0)
    run = simulate(chain_of(motor=ConstantTorque(tau_constant=0.0), belt=steep), 1.0, **TIGHT)
    down = 9.80665 * 20 * (40 * sin(0.2) - 0.03 * 60 * np.cos(0.2)) / (20 * 60) / 0.5
    assert run.final["belt.w"] == pytest.approx(-down, rel=1e-6)


def test_workpiece_resists_forward_motion_only() -> None:
    work = FormingForce(table=((0.0, 0.0), (0.001, 1e4), (0.05, 1e4), (0.051, 0.0)))
    run = simulate(chain_of(slide=Mass(m=10.0, s=0.03, v=-2.0), work=work), 0.02, **TIGHT)
    assert run.final["slide.v"] == pytest.approx(-2.0, rel=1e-9)


@pytest.mark.parametrize(
    ("part", "sentence"),
    [
        (SliderCrank(r=0.1, l=0.12, e=0.03), "its rod l is shorter than the crank r and the offset e together"),
        (Cam(h=0.01, rise=4.0, fall=4.0), "rise, dwell and fall are more than 360° together"),
        (Cam(h=0.01, rise=2.0, dwell=2.5, fall=2.0), "rise, dwell and fall are more than 360° together"),
        (FourBar(crank=0.1, coupler=0.05, rocker=0.05, ground=0.12), "cannot turn all around"),
        (FourBar(crank=0.03, coupler=0.2, rocker=0.05, ground=0.1), "cannot turn all around"),
        (WormGear(z_2=40, gamma=0.9, mu=0.9), "lead angle and friction angle are 90° together"),
    ],
)
def test_parameters_that_do_not_fit_end_the_run_with_a_sentence(part: Component, sentence: str) -> None:
    follower = Inertia(J=1.0) if isinstance(part, FourBar | WormGear) else Mass(m=1.0)
    with pytest.raises(LimitPassed, match=sentence):
        simulate(chain_of(motor=ConstantSpeed(w_fixed=10.0, phi=0.0), part=part, follower=follower), 1.0)
    bearing = DeepGrooveBearing(d=0.08, D=0.04, F_r=100.0, C_0=1e4, nu=2e-5)
    with pytest.raises(LimitPassed, match="its bore d is not below its outer diameter D"):
        simulate(chain_of(motor=ConstantSpeed(w_fixed=10.0, phi=0.0), bearing=bearing), 1.0)


def test_ratios_of_a_variable_gear_that_leave_none() -> None:
    gear = VariableGear(u=2.0, T=0.1, ratio_min=3.0, ratio_max=1.0)
    load = ConstantTorque(tau_constant=-1.0, phi=0.0)
    with pytest.raises(LimitPassed, match="has its smallest ratio ratio_min above its largest ratio ratio_max"):
        simulate(chain_of(motor=ConstantSpeed(w_fixed=10.0, phi=0.0), gear=gear, load=load), 1.0)


def test_stages_of_a_coupling_begin_at_zero() -> None:
    with pytest.raises(LanguageError, match="the first stage begins at"):
        ElasticCoupling(stages=((0.1, 100.0),))


def test_a_cam_may_take_a_whole_turn() -> None:
    """The sum of its parts may be more by rounding."""
    dwell = np.nextafter(2 * pi, 7.0) - 4.0
    assert 2.0 + dwell + 2.0 > 2 * pi
    run = simulate(
        chain_of(
            motor=ConstantSpeed(w_fixed=10.0, phi=0.0),
            cam=Cam(h=0.02, rise=2.0, dwell=dwell, fall=2.0),
            follower=Mass(m=1.0),
        ),
        0.3,
        **TIGHT,
    )
    assert run.at(0.3)["follower.s"] - run.at(0.0)["follower.s"] == pytest.approx(0.02, rel=1e-6)
