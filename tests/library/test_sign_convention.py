"""docs/sign_convention.md, sentence by sentence."""

from pathlib import Path

import numpy as np
import pytest

from components import (
    Brake,
    Clutch,
    ConstantSpeed,
    ConstantTorque,
    Damper,
    Fixed,
    IdealGear,
    Inertia,
    PowerSensor,
    SpeedDependentLoad,
    Spring,
    TorqueSensor,
)
from modelica_like import Assembly, Component, Solution, simulate

PAGE = (Path(__file__).parents[2] / "docs" / "sign_convention.md").read_text(encoding="utf-8")


def run(until: float = 0.1, **parts: Component) -> Solution:
    return simulate(Assembly("drive", parts=parts, series={"shaft": list(parts)}), until, points=10)


@pytest.fixture(scope="module")
def example() -> Solution:
    return run(motor=ConstantSpeed(w_fixed=10.0), clutch=Clutch(capacity=3.0), load=Inertia(J=1.0, phi=0.0, w=0.0))


def test_the_table(example: Solution) -> None:
    rows = [line.split("|")[1:3] for line in PAGE.splitlines() if line.startswith("| `")]
    names = example.model.flat_discretes[example.model.discrete_position["clutch.mode"]].names
    checked = 0
    for shown, sign in rows:
        for name in (text.strip(" `") for text in shown.replace(" = ", ",").split(",")):
            if sign.strip() in "+−":
                expected = 1 if sign.strip() == "+" else -1
                assert np.all(expected * example[name][1:] > 0), name
            else:
                assert names[int(example[name][0])] == sign.strip(" `"), name
            checked += 1
    assert checked == 9


def test_1_one_direction_for_all() -> None:
    result = run(1.0, motor=ConstantSpeed(w_fixed=10.0), slip=Damper(d=1.0), load=Inertia(J=0.01, phi=0.0, w=0.0))
    assert result.final["load.w"] == pytest.approx(10.0, rel=1e-6)


def test_2_a_positive_cut_torque_drives_the_component(example: Solution) -> None:
    assert np.all(example["load.flange_a.tau"] > 0)
    assert np.all(np.diff(example["load.w"]) > 0)
    assert np.all(example["clutch.flange_a.tau"] + example["motor.flange.tau"] == 0)


@pytest.mark.parametrize("twist", [0.1, -0.1])
def test_3_torque_of_a_twisted_spring(twist: float) -> None:
    result = run(wall=Fixed(), spring=Spring(c=20.0), mass=Inertia(J=1.0, phi=twist, w=0.0))
    assert result["spring.phi_rel"][0] == twist
    assert result["spring.tau"][0] == pytest.approx(20.0 * twist)
    assert np.array_equal(result["spring.tau"], result["spring.flange_b.tau"])
    assert np.sign(result.final["mass.w"]) == -np.sign(twist)


def test_4_sources_drive_and_loads_hold_back() -> None:
    driven = run(motor=ConstantTorque(tau_constant=5.0), mass=Inertia(J=1.0, phi=0.0, w=0.0))
    assert driven.final["mass.w"] > 0
    assert driven.final["motor.flange.tau"] == -5.0
    for load in (SpeedDependentLoad(a=2.0), Brake(capacity=2.0)):
        braked = run(mass=Inertia(J=1.0, phi=0.0, w=3.0), load=load)
        assert braked.final["load.tau"] == pytest.approx(2.0)
        assert braked.final["mass.w"] < 3.0


def test_5_ratio_is_left_over_right() -> None:
    result = run(motor=ConstantSpeed(w_fixed=10.0), gear=IdealGear(ratio=-4.0), mass=Inertia(J=1.0))
    assert result.final["mass.w"] == pytest.approx(-2.5)


def test_6_sensors_count_from_left_to_right() -> None:
    result = run(
        motor=ConstantSpeed(w_fixed=10.0),
        slip=Damper(d=1.0),
        tau=TorqueSensor(),
        power=PowerSensor(),
        load=Inertia(J=1.0, phi=0.0, w=1.0),
    )
    assert result["tau.tau"][0] == pytest.approx(9.0)
    assert result["power.power"][0] == pytest.approx(9.0)


def test_7_the_housing_carries_the_reaction() -> None:
    parts = {"motor": ConstantTorque(tau_constant=5.0), "mass": Inertia(J=1.0, phi=0.0, w=0.0), "ground": Fixed()}
    drive = Assembly(
        "drive",
        parts=parts,
        series={"shaft": ["motor", "mass"]},
        connect={"housing": ["motor.support", "ground.flange"]},
    )
    result = simulate(drive, 0.1, points=2)
    assert result.final["motor.support.tau"] == 5.0
    assert result.final["ground.flange.tau"] == -5.0
