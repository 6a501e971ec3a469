"""Document 000: all 19 numbers of the clutch of a machine table; document 002: selection of a clutch."""

import math

import pytest

from components.sizing import clutch_selection, friction_work, machine_table_clutch, referred_inertia, referred_mass

RPM = math.pi / 30
DIRECT = machine_table_clutch(6000 * RPM, 0.2, 15.0, 500.0, 1.5, 0.016, 0.004)
GEARED = machine_table_clutch(1440 * RPM, 0.2, 15.0, 500.0, 1.5, 0.016, 0.004, 6000 * RPM, 0.014, 0.007)

# value, published, recomputed, deviation in per cent (the document goes on with truncated intermediate values)
NUMBERS = {
    "omega_M": (DIRECT.motor_speed, 628.3, 628.3185, +0.003),
    "lead": (DIRECT.lead, None, 0.015, None),
    "J_T": (DIRECT.table_inertia, 0.00284, 0.002849658, +0.340),
    "J_red": (DIRECT.referred_inertia, 0.02284, 0.02284966, +0.042),
    "alpha": (DIRECT.acceleration, 3141.5, 3141.593, +0.003),
    "M_B": (DIRECT.acceleration_torque, 71.63, 71.78432, +0.215),
    "M_K": (DIRECT.clutch_torque, 86.63, 86.78432, +0.178),
    "phi": (DIRECT.slip_angle, None, 62.83185, None),
    "g.phi": (GEARED.slip_angle, None, 15.07964, None),
    "W_KS": (DIRECT.friction_work, 5443, 5452.82, +0.180),
    "g.omega_M": (GEARED.motor_speed, 150.8, 150.7964, -0.002),
    "g.J_Gab_red": (GEARED.gear_output_inertia, 0.1215, 0.1215278, +0.023),
    "g.J_S_red": (GEARED.spindle_inertia, 0.278, 0.2777778, -0.080),
    "g.J_T_red": (GEARED.table_inertia, 0.049, 0.04947323, +0.966),
    "g.J_red": (GEARED.referred_inertia, 0.467, 0.4667788, -0.047),
    "g.alpha": (GEARED.acceleration, 754, 753.9822, -0.002),
    "g.M_B": (GEARED.acceleration_torque, 352.12, 351.9429, -0.050),
    "g.i": (GEARED.ratio, 0.24, 0.24, 0.0),
    "g.M_L": (GEARED.load_torque, 62.5, 62.5, 0.0),
    "g.M_K": (GEARED.clutch_torque, 414.62, 414.4429, -0.043),
    "g.W_KS": (GEARED.friction_work, 6252, 6249.652, -0.038),
    "002 eq. 48": (clutch_selection(40.0, 1333 * RPM, 0.6, 2.0).required_torque, 0.573, 0.5731433, +0.025),
}


@pytest.mark.parametrize(("value", "published", "recomputed", "deviation"), NUMBERS.values(), ids=NUMBERS)
def test_number(value: float, published: float | None, recomputed: float, deviation: float | None) -> None:
    assert value == pytest.approx(recomputed, rel=1e-6)
    if published is not None:
        assert 100 * (value / published - 1) == pytest.approx(deviation, abs=6e-4)


def test_direct_drive_is_the_geared_one_with_ratio_one() -> None:
    geared = machine_table_clutch(6000 * RPM, 0.2, 15.0, 500.0, 1.5, 0.016, 0.004, 6000 * RPM, 0.0, 0.0)
    assert geared == DIRECT


def test_friction_work_is_half_of_what_the_motor_delivers() -> None:
    motor_work = DIRECT.clutch_torque * DIRECT.motor_speed * 0.2
    assert motor_work == pytest.approx(10905.64, rel=1e-6)
    assert friction_work(DIRECT.clutch_torque, DIRECT.motor_speed, 0.2) == pytest.approx(motor_work / 2)


def test_table_that_moves_already() -> None:
    """From half the speed: half the acceleration torque, half the angle, and W = M·(w_A - w_L0)·t/2."""
    moving = machine_table_clutch(6000 * RPM, 0.2, 15.0, 500.0, 1.5, 0.016, 0.004, load_speed=3000 * RPM)
    assert moving.slip_angle == pytest.approx(100 * math.pi * 0.2 / 2)
    assert moving.clutch_torque == pytest.approx(71.78432 / 2 + 15, rel=1e-6)
    assert moving.friction_work == pytest.approx((71.78432 / 2 + 15) * 10 * math.pi, rel=1e-6)


def test_referring_keeps_the_kinetic_energy() -> None:
    assert referred_mass(500.0, 1.5, 100.0) * 100.0**2 == pytest.approx(500.0 * 1.5**2)
    assert referred_inertia(2.0, 0.25) * 100.0**2 == pytest.approx(2.0 * 400.0**2)


def test_clutch_for_the_85_watts_of_the_drive_would_be_too_small() -> None:
    """Document 002 sizes the clutch with 40 W, the belt with 85 W."""
    selection = clutch_selection(85.0, 1333 * RPM, 0.6, 2.0)
    assert selection.required_torque == pytest.approx(1.218, rel=1e-3)
    assert selection.required_torque == pytest.approx(selection.exact_torque, rel=1e-4)
    assert selection.lines()[0].exceeded
