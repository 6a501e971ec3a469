"""Fatigue of shafts after DIN 743, written out formula by formula."""

from dataclasses import replace
from math import hypot, log10, pi, sqrt

import numpy as np
import pytest

from components.sizing import ShaftMaterial, shaft_fatigue

S275 = ShaftMaterial(430e6, 275e6, 215e6, 125e6)


def test_shoulder_of_the_primary_shaft() -> None:
    """D = 8, d = 6, r = 2 mm, M_b = 1047.08, T = 606.25 N.mm as in document 002, the torque steady."""
    sigma, tau = 32 * 1047.08 / (pi * 6**3), 16 * 606.25 / (pi * 6**3)
    phi = 1 / (4 * sqrt(1 / 2) + 2)
    support = 10 ** -(0.33 + 275 / 712)
    n_b, n_t = 1 + sqrt(2.3 * (1 + phi) / 2) * support, 1 + sqrt(1.15 / 2) * support
    rough = 1 - 0.22 * log10(6.3) * (log10(430 / 20) - 1)
    W_b = 215 / (1.25 / n_b + 1 / rough - 1)
    W_t = 125 / (1 + 1 / (0.575 * rough + 0.425) - 1)
    endured = W_b - W_b / (2 * 430 - W_b) * sqrt(3) * tau
    assert n_t == pytest.approx(1.1457, abs=5e-5)  # 1.14/n_t < 1: no notch is less than none
    made = shaft_fatigue(1.04708, 0.60625, 6e-3, S275, 8e-3, 2e-3, 1.25, 1.14, required_safety=2.5)
    assert made.bending_strength == pytest.approx(endured * 1e6)
    assert made.torsion_strength == pytest.approx((W_t - W_t / (860 - W_t) * tau) * 1e6)
    assert made.safety == pytest.approx(endured / sigma)
    assert made.safety == pytest.approx(3.876, abs=2e-3)
    assert {line.name: line.verdict for line in made.lines()}["safety"] == "ok"


def test_torque_switched_on_and_off() -> None:
    steady, pulsed = (shaft_fatigue(10.0, 20.0, 0.02, S275, alternating=share) for share in (0.0, 0.5))
    assert pulsed.torsion_mean == pulsed.torsion_amplitude == pytest.approx(steady.torsion_mean / 2)
    parts = (pulsed.bending_amplitude / pulsed.bending_strength, pulsed.torsion_amplitude / pulsed.torsion_strength)
    assert pulsed.safety == pytest.approx(1 / hypot(*parts))


def test_size_and_surface() -> None:
    """150 mm and more count 0.8, up to 7.5 mm one; a polished shaft has what the specimen has."""
    small, large = (shaft_fatigue(1.0, 0.0, d, S275, roughness=1e-6) for d in (7.5e-3, 0.2))
    assert (small.size_factor, large.size_factor) == pytest.approx((1.0, 0.8))
    assert (small.bending_strength, large.bending_strength) == pytest.approx((215e6, 0.8 * 215e6))
    assert shaft_fatigue(1.0, 0.0, 0.03354102, S275).size_factor == pytest.approx(0.9)  # the mean of the logarithms


def test_mean_stress_near_yielding() -> None:
    """Where psi would leave more, amplitude and mean together reach the yield strength."""
    torque = 150e6 * pi * 0.02**3 / 16
    made = shaft_fatigue(1.0, torque, 0.02, S275, roughness=1e-6)
    assert made.bending_strength == pytest.approx(275e6 - sqrt(3) * 150e6, rel=1e-9)


def test_directions_and_treatments() -> None:
    plain = shaft_fatigue(10.0, 20.0, 0.02, S275, alternating=0.5)
    assert shaft_fatigue(-10.0, -20.0, 0.02, S275, alternating=0.5).safety == plain.safety
    hard = shaft_fatigue(10.0, 0.0, 0.02, S275, hardening=1.1, technological_size=0.9)
    assert hard.bending_strength == pytest.approx(0.99 * shaft_fatigue(10.0, 0.0, 0.02, S275).bending_strength)


def test_deep_shoulders() -> None:
    """For d/D up to 0.67 the stress gradient in bending is 2.3/r."""
    support = 10 ** -(0.33 + 275 / 712)
    made = shaft_fatigue(10.0, 20.0, 0.02, S275, 0.04, 2e-3, 2.0, 1.8)
    assert made.bending_notch == pytest.approx(2.0 / (1 + sqrt(2.3 / 2) * support))
    assert made.torsion_notch == pytest.approx(1.8 / (1 + sqrt(1.15 / 2) * support))


def test_worked_example_of_another_program() -> None:
    """D = 50, d = 42, r = 5 mm of 34CrMo4, Rz = 5 µm (Q. Huss, N. Schulz: Wellennachweis, github.com, 2023).

    The strengths of its notebooks hold for 50 mm, and the yield strength of the second one counts as that of a notched
    section: 838.4 N/mm².
    """
    K1, S_d = 0.8713389943631755, 665.4007941030145e6
    steel = ShaftMaterial(871.3389943631755e6, S_d, K1 * 500e6, K1 * 300e6)
    assert shaft_fatigue(1.0, 0.0, 0.042, steel).size_factor == pytest.approx(0.884985276358004, rel=1e-12)
    made = shaft_fatigue(1.0, 0.0, 0.042, steel, 0.05, 5e-3, 1.5572817574523055, 1.2828771540477546, roughness=5e-6)
    assert made.bending_notch == pytest.approx(1.4973097887328213, rel=1e-12)
    assert made.torsion_notch == pytest.approx(1.2502697690565296, rel=1e-12)
    assert made.roughness_factor == pytest.approx(0.9017146306159467, rel=1e-12)
    assert steel.bending_fatigue / made.bending_strength == pytest.approx(1.800901923884255, rel=1e-12)
    assert steel.torsion_fatigue / made.torsion_strength == pytest.approx(1.4726569443864075, rel=1e-12)
    notched = replace(steel, yield_strength=838.4050005697983e6)
    mean, swing, section = 305.5050463303894e6, 30e6, pi * 0.042**3 / 16
    made = shaft_fatigue(
        50e6 * section / 2, (mean + swing) * section, 0.042, notched, bending_factor=1.5179405596067481,
        torsion_factor=1.2615866715165054, alternating=swing / (mean + swing), roughness=5e-6,
    )  # fmt: skip
    assert made.bending_strength == pytest.approx(154.79183517414634e6, rel=1e-12)
    assert made.torsion_strength == pytest.approx(141.66041042128347e6, rel=1e-12)
    assert made.safety == pytest.approx(2.589018228890791, rel=1e-12)


@pytest.mark.parametrize(("bending", "factor"), [(1.0, 1.01), (1.0, 100.0), (0.0, 1.01)])
def test_a_mean_stress_beyond_yielding_leaves_no_safety(bending: float, factor: float) -> None:
    """tau_m = R_e/sqrt(3) leaves nothing; more of it must not look like strength again."""
    torque = factor * 275e6 / sqrt(3) * pi * 0.02**3 / 16
    made = shaft_fatigue(bending, torque, 0.02, S275)
    assert (made.safety, made.bending_strength, made.torsion_strength) == (0.0, 0.0, 0.0)
    assert "below the limit" in {line.name: line.verdict for line in made.lines()}["safety"]


def test_the_safety_falls_with_the_torque() -> None:
    safeties = shaft_fatigue(1.05, np.geomspace(0.1, 1e3, 200), 6e-3, S275).safety
    assert np.all(np.diff(safeties) <= 0)
    assert safeties[-1] == 0.0
