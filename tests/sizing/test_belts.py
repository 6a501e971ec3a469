"""Document 002, equations 11 to 28: drive, belt geometry, strand forces and shaft load."""

import math

import numpy as np
import pytest

from components.sizing import (
    belt_forces,
    belt_geometry,
    belt_speed_limit,
    centre_distance,
    drive_for_clutch,
    effective_pull,
    strand_resultant,
)

RPM = math.pi / 30
DRIVE = drive_for_clutch(0.6, 4000 * RPM, 3.0, 1500 * RPM)
BELT = belt_geometry(10.0, 30.0, 5.08e-3, 0.330)
LONG = belt_geometry(10.0, 30.0, 5.08e-3, 65 * 5.08e-3)
SPEED = belt_speed_limit(4000 * RPM, BELT.small_diameter, 5000 * RPM, 80.0)
LOAD = belt_forces(25.0, BELT.wrap_angle, 0.5, SPEED.velocity, 9.5e-3 * 2e-3, 1200.0)

# value, published, recomputed, deviation in per cent
NUMBERS = {
    "16 n2": (DRIVE.clutch_speed / RPM, 1333, 1333.333, +0.025),
    "12 P_mot_max": (DRIVE.power, 83.78, 83.7758, -0.005),
    "16 M_mot_max": (DRIVE.motor_torque, 0.2, 0.2, 0.0),
    "17 d_a1": (1e3 * BELT.small_diameter, 16.2, 16.17014, -0.184),
    "17 d_a2": (1e3 * BELT.large_diameter, 48.5, 48.51043, +0.021),
    "18 e approx": (1e3 * BELT.centre_distance, 113, 113.0435, +0.038),
    "18 e exact": (1e3 * BELT.exact_distance, 113, 113.0415, +0.037),
    "18 e z=65": (1e3 * LONG.exact_distance, 113, 113.1425, +0.126),
    "19 x": (1e3 * BELT.take_up, 1.65, 1.65, 0.0),
    "20 beta_k": (math.degrees(BELT.wrap_angle), 163.6, 163.552, -0.029),
    "21 z_e": (BELT.teeth_in_mesh, 4, 4, 0.0),
    "21 z_e raw": (BELT.engaged, None, 4.543, None),
    "22 v_R": (SPEED.velocity, 3.4, 3.386667, -0.392),
    "24 F_t": (effective_pull(85.0, 3.4), 25, 25, 0.0),
    "24 F_t exact": (effective_pull(DRIVE.power, SPEED.velocity), 25, 24.73695, -1.052),
    "25 m": (LOAD.force_ratio, 4.17, 4.167267, -0.066),
    "26 F1": (LOAD.tight_strand, 32.9, 32.89324, -0.021),
    "F2": (LOAD.slack_strand, 7.9, 7.893241, -0.086),
    "27 F_w": (LOAD.shaft_load, 40.5, 40.52514, +0.062),
    "28 F_z": (LOAD.centrifugal_force, 0.26, 0.2615049, +0.579),
    "28 F_w0": (LOAD.load_at_rest, 40.76, 40.78665, +0.065),
    "along the centres": (LOAD.along_centres, None, 40.36705, None),
    "across the centres": (LOAD.across_centres, None, 3.576089, None),
    "relief": (LOAD.relief, None, 0.518, None),
}


@pytest.mark.parametrize(("value", "published", "recomputed", "deviation"), NUMBERS.values(), ids=NUMBERS)
def test_number(value: float, published: float | None, recomputed: float, deviation: float | None) -> None:
    digits = 1e-3 if len(str(recomputed)) < 6 and published is None else 1e-6
    assert value == pytest.approx(recomputed, rel=digits)
    if published is not None:
        assert 100 * (value / published - 1) == pytest.approx(deviation, abs=6e-4)


def test_sign_of_the_law_of_cosines() -> None:
    """With half a turn both strands pull in one direction; with the other sign there would be 25.4 N."""
    assert strand_resultant(32.9, 7.9, math.pi) == pytest.approx(40.8)
    assert strand_resultant(0.2, 0.1, math.pi) == pytest.approx(0.3)
    wrong = strand_resultant(LOAD.tight_strand, LOAD.slack_strand, math.pi - BELT.wrap_angle)
    assert wrong == pytest.approx(25.42145, rel=1e-6)


def test_a_belt_of_unknown_section_or_density_has_no_centrifugal_tension() -> None:
    for given in ({}, {"section": 2e-5}, {"density": 1200.0}):
        assert belt_forces(25.0, BELT.wrap_angle, 0.5, 10.0, **given).centrifugal_force == 0.0


def test_the_load_is_the_sum_of_both_strands() -> None:
    assert math.hypot(LOAD.along_centres, LOAD.across_centres) == pytest.approx(LOAD.shaft_load, rel=1e-12)
    assert LOAD.doubled_load == pytest.approx(math.hypot(LOAD.shaft_load, 25.0))


def test_exact_distance_fits_the_belt() -> None:
    e, d1, d2 = BELT.exact_distance, BELT.small_diameter, BELT.large_diameter
    angle = math.asin((d2 - d1) / (2 * e))
    length = 2 * e * math.cos(angle) + math.pi / 2 * (d1 + d2) + angle * (d2 - d1)
    assert length == pytest.approx(0.330, rel=1e-13)


def test_equal_pulleys() -> None:
    assert BELT.ratio == 3.0
    belt = belt_geometry(20.0, 20.0, 5e-3, 0.5)
    assert belt.exact_distance == pytest.approx(0.2)
    assert belt.wrap_angle == pytest.approx(math.pi)


def test_speed_limits() -> None:
    assert [line.verdict for line in SPEED.lines()] == ["ok", "", "ok", ""]
    assert DRIVE.lines()[0].verdict == "ok"
    fast = drive_for_clutch(0.6, 4550 * RPM, 3.0, 1500 * RPM)
    assert fast.lines()[0].verdict == "above the limit 1500 rpm by 16.67 rpm (1.11 %)"


def test_belt_that_is_too_short() -> None:
    with pytest.raises(ValueError, match="too short"):
        centre_distance(0.06, 0.016, 0.048)
    with pytest.raises(ValueError, match="too short"):
        centre_distance(np.array([0.33, 0.06]), 0.016, 0.048)
