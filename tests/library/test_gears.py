"""Gears, planetary sets and screws: kinematics, torques, no loss."""

from math import pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from components import (
    BallScrew,
    ConstantSpeed,
    ConstantTorque,
    Damper,
    Fixed,
    IdealGear,
    IdealPlanetary,
    Inertia,
    Mass,
    SpringDamper,
    TranslationalDamper,
    TranslationalFixed,
)
from modelica_like import Assembly, Component, build, simulate


def shaft(**parts: Component) -> Assembly:
    return Assembly("drive", parts=parts, series={"shaft": list(parts)})


@settings(max_examples=15, deadline=None)
@given(ratio=st.one_of(st.floats(0.02, 50), st.floats(-50, -0.02)))
def test_referred_inertia(ratio: float) -> None:
    """Seen from the motor, a load weighs J/ratio²; the gear neither stores nor loses energy."""
    motor, gear, load = Inertia(J=0.3), IdealGear(ratio=ratio), Inertia(J=2.0, phi=0.0, w=0.0)
    run = simulate(shaft(torque=ConstantTorque(tau_constant=5.0), motor=motor, gear=gear, load=load), "1 s", points=20)
    acceleration = 5.0 / (0.3 + 2.0 / ratio**2)
    np.testing.assert_allclose(run["motor.w"], acceleration * run.time, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(run["motor.w"], ratio * run["load.w"], rtol=1e-12)
    np.testing.assert_allclose(run["gear.flange_b.tau"], -ratio * run["gear.flange_a.tau"], rtol=1e-12)
    balance = run.energy()
    assert balance["gear"].inflow == pytest.approx(0.0, abs=1e-9 * balance.throughput)


@pytest.mark.parametrize("stages", [1, 2, 10, 50])
def test_rigid_gear_train_has_two_states(stages: int) -> None:
    parts: dict[str, Component] = {"J0": Inertia(J=1.0, phi=0.0, w=0.0)}
    for k in range(1, stages + 1):
        parts |= {f"gear{k}": IdealGear(ratio=1.1), f"J{k}": Inertia(J=1.0)}
    model = build(shaft(**parts))
    assert len(model.states) == 2


def test_housing_carries_the_difference_of_the_torques() -> None:
    parts = {
        "torque": ConstantTorque(tau_constant=5.0),
        "motor": Inertia(J=0.3),
        "gear": IdealGear(ratio=3.0),
        "load": Inertia(J=2.0, phi=0.0, w=0.0),
        "mount": SpringDamper(c=1e4, d=50.0, phi_rel=0.0),
        "housing": Inertia(J=1.0, w=0.0),
        "ground": Fixed(),
    }
    drive = Assembly(
        "drive",
        parts=parts,
        series={"shaft": ["torque", "motor", "gear", "load"], "stand": ["ground", "mount", "housing"]},
        connect={"support": ["gear.support", "housing.flange_b"]},
    )
    run = simulate(drive, "0.5 s", rtol=1e-9)
    np.testing.assert_allclose(run["gear.support.tau"], -run["gear.flange_a.tau"] - run["gear.flange_b.tau"], atol=1e-9)
    housing = run["housing.phi"]
    np.testing.assert_allclose(run["motor.phi"] - housing, 3.0 * (run["load.phi"] - housing), atol=1e-9)
    assert np.max(np.abs(housing)) > 1e-4
    assert run.energy().power_closure < 1e-8


# -- planetary sets ----------------------------------------------------------------------------------------------------


def planetary(ratio: float, held: str, driven: str, taken: str) -> Assembly:
    parts = {
        "planets": IdealPlanetary(ratio=ratio),
        "motor": ConstantSpeed(w_fixed=10.0),
        "brake": Fixed(),
        "mass": Inertia(J=0.1),
        "oil": Damper(d=2.0),
        "wall": Fixed(),
    }
    return Assembly(
        "drive",
        parts=parts,
        series={"load": ["mass", "oil", "wall"]},
        connect={
            "in": ["motor.flange", f"planets.{driven}"],
            "out": ["mass.flange_a", f"planets.{taken}"],
            "held": ["brake.flange", f"planets.{held}"],
        },
    )


# (held, driven, taken): speed ratio driven/taken, after R. Willis with the fixed-carrier ratio -r
RATIOS = [
    ("ring", "sun", "carrier", lambda r: 1 + r), ("ring", "carrier", "sun", lambda r: 1 / (1 + r)),
    ("sun", "ring", "carrier", lambda r: (1 + r) / r), ("sun", "carrier", "ring", lambda r: r / (1 + r)),
    ("carrier", "sun", "ring", lambda r: -r), ("carrier", "ring", "sun", lambda r: -1 / r),
]  # fmt: skip


@pytest.mark.parametrize("ratio", [1.0, 2.5, 80 / 24])
@pytest.mark.parametrize(("held", "driven", "taken", "formula"), RATIOS)
def test_planetary_ratios(held: str, driven: str, taken: str, formula: object, ratio: float) -> None:
    run = simulate(planetary(ratio, held, driven, taken), "1 s", points=10)
    expected = formula(ratio)  # type: ignore[operator]
    assert 10.0 / run.final["mass.w"] == pytest.approx(expected, rel=1e-12)
    sun, carrier, ring = (run[f"planets.{name}.tau"] for name in ("sun", "carrier", "ring"))
    np.testing.assert_allclose(sun + carrier + ring, 0.0, atol=1e-12 * np.max(np.abs(carrier)))
    np.testing.assert_allclose(ring, ratio * sun, rtol=1e-12)
    balance = run.energy()
    assert balance["planets"].inflow == pytest.approx(0.0, abs=1e-9 * balance.throughput)
    assert balance["planets"].lost == 0.0
    assert balance["oil"].lost == pytest.approx(2.0 * (10 / expected) ** 2, rel=1e-8)


def test_planetary_as_differential_splits_the_torque() -> None:
    """With equal arms sun and ring are the two wheels: equal torques, and the carrier turns with their mean speed."""
    parts = {
        "engine": ConstantTorque(tau_constant=8.0), "differential": IdealPlanetary(ratio=1.0),
        "left": Inertia(J=1.0, phi=0.0, w=0.0), "right": Inertia(J=3.0, phi=0.0, w=0.0),
    }  # fmt: skip
    drive = Assembly(
        "drive",
        parts=parts,
        connect={
            "in": ["engine.flange", "differential.carrier"],
            "l": ["differential.sun", "left.flange_a"],
            "r": ["differential.ring", "right.flange_a"],
        },
    )
    run = simulate(drive, "1 s", points=10)
    assert run.final["left.w"] == pytest.approx(4.0, rel=1e-9)
    assert run.final["right.w"] == pytest.approx(4.0 / 3.0, rel=1e-9)
    assert run.final["engine.phi"] == pytest.approx((run.final["left.phi"] + run.final["right.phi"]) / 2, rel=1e-9)


# -- screws ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("lead", [0.005, 0.015, -0.01])
def test_ball_screw(lead: float) -> None:
    parts = {
        "motor": ConstantTorque(tau_constant=2.0),
        "rotor": Inertia(J=0.001),
        "screw": BallScrew(lead=lead),
        "table": Mass(m=200.0, s=0.0, v=0.0),
        "oil": TranslationalDamper(d=100.0),
        "bed": TranslationalFixed(),
    }
    run = simulate(shaft(**parts), "0.5 s", rtol=1e-9)
    np.testing.assert_allclose(run["table.s"], lead * run["rotor.phi"] / (2 * pi), rtol=1e-12)
    np.testing.assert_allclose(2 * pi * run["screw.flange_r.tau"], -lead * run["screw.flange_t.f"], rtol=1e-12)
    mass, d, push = 200.0 + 0.001 * (2 * pi / lead) ** 2, 100.0, 2.0 * 2 * pi / lead
    np.testing.assert_allclose(run["table.v"], push / d * (1 - np.exp(-d / mass * run.time)), rtol=1e-6, atol=1e-9)
    assert run.energy().power_closure < 1e-8
