"""Formulas of numbers of a whole run: energies and times of changes, the same number everywhere."""

import math
from pathlib import Path
from typing import Any

import pytest

from components import Clutch, ConstantSpeed, Inertia, RigidBacklash
from modelica_like import Assembly, build, calibrate, sensitivities, simulate, sweep
from modelica_like.analyse.calibration.measurements import Numbers
from modelica_like.analyse.sizing import size
from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import NoGradient
from modelica_like.runs.measured import read_csv
from modelica_like.runs.results import read_results

W, INERTIA, CAPACITY = 1500 * math.pi / 30, 0.4, 40.0
LOST, LOCKED = INERTIA * W**2 / 2, INERTIA * W / CAPACITY
EXACT = 1e-6
"""What both engines keep at default tolerances."""

# Half of what the motor gives is lost, and half moves the wheel.
NUMBERS = {
    "2*clutch.loss_energy": 2 * LOST,
    "2*loss_energy": 2 * LOST,
    "clutch.loss_energy + motor.source_energy": 3 * LOST,
    "clutch.loss_energy/motor.source_energy": 0.5,
    "clutch.loss_energy + 0.5*wheel.J*wheel.w**2": 2 * LOST,
    "sqrt(2*clutch.loss_energy/wheel.J)": W,
    "max(clutch.loss_energy, 1 J)": LOST,
    "-(3*clutch.lock_time)": -3 * LOCKED,
    "clutch.loss_energy/clutch.lock_time": LOST / LOCKED,
}
UNITS = ["J", "J", "J", "1", "J", "J^(1/2)/(kg^(1/2).m)", "J", "s", "W"]
BY_INERTIA = [W**2, W**2, 1.5 * W**2, 0, W**2, 0, W**2 / 2, -3 * W / CAPACITY, 0]


@pytest.fixture(scope="module")
def drive() -> CompiledDae:
    parts = {"motor": ConstantSpeed(w_fixed=W, phi=0.0), "clutch": Clutch(capacity=CAPACITY),
             "wheel": Inertia(J=INERTIA, phi=0.0, w=0.0)}  # fmt: skip
    return build(Assembly("started", parts=parts, series={"shaft": [*parts]}))


@pytest.mark.parametrize("solver", ["idas", "native"])
def test_formulas_of_energies(drive: CompiledDae, solver: Any) -> None:
    before = simulate(drive, 5.0, solver=solver, readings=[*NUMBERS])
    after = simulate(drive, 5.0, solver=solver).read(*NUMBERS)
    for number, (name, value), unit in zip(after, NUMBERS.items(), UNITS, strict=True):
        assert number == pytest.approx(value, rel=EXACT), name
        assert (number.name, number.unit) == (name, unit)
        assert before.readings[name] == number


def test_formulas_in_a_sweep(drive: CompiledDae) -> None:
    found = sweep(drive, {"wheel.J": [INERTIA, 2 * INERTIA]}, [*NUMBERS], until=7.0)
    for name, value in NUMBERS.items():
        assert float(found[name][0]) == pytest.approx(value, rel=EXACT), name
    assert found["2*clutch.loss_energy"].values[1] == pytest.approx(4 * LOST, rel=EXACT)


@pytest.mark.parametrize("method", ["forward", "adjoint"])
def test_derivatives_of_formulas(drive: CompiledDae, method: Any) -> None:
    made = sensitivities(drive, [*NUMBERS], "wheel.J", until=5.0, method=method)
    for k, (name, value) in enumerate(NUMBERS.items()):
        assert made.outputs[k].value == pytest.approx(value, rel=EXACT), name
        assert made.derivatives[k, 0] == pytest.approx(BY_INERTIA[k], rel=EXACT, abs=EXACT * abs(value) / INERTIA), name


def test_a_formula_at_a_kink_has_no_derivative(drive: CompiledDae) -> None:
    """The larger of the loss and of its own value rises with the inertia, and does not fall with it."""
    name = f"max(clutch.loss_energy, {LOST!r} J)"
    with pytest.raises(NoGradient) as caught:
        sensitivities(drive, name, "wheel.J", until=5.0)
    assert str(caught.value) == (
        f"No gradient of {name}: its formula is at a kink.\n"
        "The derivatives on both sides differ.\n"
        "Leave out wheel.J, or move the parameters away from there."
    )


def test_a_calibration_by_a_formula(drive: CompiledDae) -> None:
    found = calibrate(drive, [Numbers({"2*clutch.loss_energy": 3 * LOST}, until=9.0)], {"wheel.J": (0.2, 1.0)})
    assert found.values[0] == pytest.approx(1.5 * INERTIA, rel=1e-5)


def test_a_load_of_a_design_check(tmp_path: Path) -> None:
    """The clutch's mean torque is its capacity: LOST/(w/2 LOCKED)."""
    (tmp_path / "drive.toml").write_text(
        '[parts]\nmotor = { is = "ConstantSpeed", w_fixed = "1500 rpm", phi = 0 }\n'
        'clutch = { is = "Clutch", capacity = "40 N.m" }\n'
        'wheel = { is = "Inertia", J = "0.4 kg.m2", phi = 0, w = 0 }\n'
        '[series]\nshaft = ["motor", "clutch", "wheel"]\n[simulate]\nuntil = "4 s"\n'
    )
    (tmp_path / "check.toml").write_text(
        '[checks.shaft]\nis = "shaft_stress"\nbending = "0 N.m"\ndiameter = "40 mm"\n'
        'yield_strength = "275 N/mm2"\nrequired_safety = 2\n'
        'torque = { from = "drive.toml", reading = "2*clutch.loss_energy/(clutch.lock_time*motor.w_fixed)" }\n'
    )
    assert size(tmp_path / "check.toml")["shaft"].torque == pytest.approx(CAPACITY, rel=EXACT)


def test_formulas_of_a_table(tmp_path: Path) -> None:
    """Straight lines: 100 W fall to zero within 2 s."""
    (tmp_path / "run.csv").write_text("time [s],brake.loss_power [W]\n0,100\n1,50\n2,0\n")
    run = read_csv(tmp_path / "run.csv")
    assert run.read("3*brake.loss_energy")[0] == pytest.approx(300.0, rel=1e-12)
    numbers, sizes = read_results(run, ["3*brake.loss_energy"])
    assert sizes[0] == pytest.approx(3 * 100.0 * 2.0, rel=1e-12)
    assert numbers[0].unit == "J"


@pytest.mark.parametrize("solver", ["idas", "native"])
def test_energies_of_impacts_are_in_formulas(solver: Any) -> None:
    """Flanks that meet without rebound lose the energy of their speeds about the common centre of mass."""
    parts = {"rotor": Inertia(J=0.02, phi=0.0, w=5.0), "claw": RigidBacklash(b=0.1, e=0.0),
             "wheel": Inertia(J=0.05, phi=0.0, w=0.0)}  # fmt: skip
    model, lost = build(Assembly("met", parts=parts, series={"shaft": [*parts]})), 0.5 * 0.02 * 0.05 / 0.07 * 5.0**2
    names = ["2*claw.loss_energy", "3*loss_energy"]
    found = sweep(model, {"rotor.J": [0.02]}, names, until=0.3, solver=solver)
    for name, number, times in zip(names, simulate(model, 0.3, solver=solver).read(*names), (2, 3), strict=True):
        assert number == pytest.approx(times * lost, rel=EXACT)
        assert float(found[name][0]) == pytest.approx(times * lost, rel=EXACT)
    with pytest.raises(NoGradient, match=r"No gradient of claw\.loss_energy: claw loses 0\.178571 J in an impact"):
        sensitivities(model, names[0], "rotor.J", until=0.3)
