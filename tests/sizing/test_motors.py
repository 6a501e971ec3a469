"""Document 002, chapter 6: characteristic curves and identification of the motor, and the document's contradictions."""

import math

import numpy as np
import pytest

from components.sizing import (
    DcMotor,
    MotorLines,
    dc_motor_point,
    fit_current_line,
    fit_least_squares,
    fit_speed_line,
    generator_voltage,
    line_consistency,
    motor_lines,
    motor_on_lines,
    motor_point,
    motor_summary,
    overload_current,
    rope_brake_mass,
    series_motor_speed,
    shunt_motor,
    torque_at_speed,
)

RPM = math.pi / 30
LINES = MotorLines(24.0, 4736.5 * RPM, 3.48e3 * RPM, 1.06, 20.0)
CONSISTENT = line_consistency(LINES)
NOMINAL = motor_on_lines(LINES, 0.21)
READ_OFF = motor_point(0.21, 4000 * RPM, 24.0, 5.2)
SUMMARY = motor_summary(LINES)
SET_A = fit_speed_line(LINES, 0.25)

# value, published, recomputed, deviation in per cent
NUMBERS = {
    "k_t from I(M)": (CONSISTENT.torque_constant * 1e3, 50, 50, 0.0),
    "M_Reib": (CONSISTENT.friction * 1e3, 55, 53, -3.636),
    "n(210)": (NOMINAL.speed / RPM, 4000, 4005.7, +0.142),
    "M at n=4000": (torque_at_speed(LINES, 4000 * RPM), 0.21, 0.2116379, +0.780),
    "I(210)": (NOMINAL.current, 5.2, 5.26, +1.154),
    "P_el": (READ_OFF.input_power, 124.8, 124.8, 0.0),
    "P_mech": (READ_OFF.output_power, 88, 87.96459, -0.040),
    "eta": (READ_OFF.efficiency, 0.71, 0.7048445, -0.726),
    "eta I=5.26": (motor_point(0.21, 4000 * RPM, 24.0, 5.26).efficiency, 0.71, 0.6968045, -1.859),
    "M_rated 15Ncm": (motor_point(0.15, 4000 * RPM, 24.0, 4.06).output_power, None, 62.83185, None),
    "M_stall": (SUMMARY.stall_torque, None, 1.361063, None),
    "I_stall line": (SUMMARY.stall_current, None, 28.28126, None),
    "eta_max": (SUMMARY.best_efficiency, None, 0.6981316, None),
    "M at 3960": (torque_at_speed(LINES, 3960 * RPM), 0.24, 0.2231322, -7.028),
    "I_gen overload": (overload_current(0.6, 3.0, SET_A), None, 3.223672, None),
}


def test_damping_of_a_generator_takes_its_part_of_an_overload() -> None:
    generator = DcMotor(0.05, 0.8, 0.02, 1e-3)
    assert overload_current(0.6, 3.0, generator) == pytest.approx(0.18 / 0.05)
    assert overload_current(0.6, 3.0, generator, 50.0) == pytest.approx(0.13 / 0.05)


@pytest.mark.parametrize(("value", "published", "recomputed", "deviation"), NUMBERS.values(), ids=NUMBERS)
def test_number(value: float, published: float | None, recomputed: float, deviation: float | None) -> None:
    assert value == pytest.approx(recomputed, rel=1e-6)
    if published is not None:
        assert 100 * (value / published - 1) == pytest.approx(deviation, abs=6e-4)


# torque in N.mm, mass in g, speed in 1/min, current in A, efficiency
BRAKE = [
    (13.3, 58.94606, 4690, 1.326, 0.205), (25.5, 113.0169, 4648, 1.570, 0.329), (34.9, 154.678, 4615, 1.758, 0.400),
    (48.4, 214.5105, 4568, 2.028, 0.476), (55.9, 247.7507, 4542, 2.178, 0.509), (64.7, 286.7526, 4511, 2.354, 0.541),
    (84.2, 373.1773, 4443, 2.744, 0.595), (98.6, 436.9986, 4393, 3.032, 0.623),
]  # fmt: skip


@pytest.mark.parametrize(("torque", "mass", "speed", "current", "efficiency"), BRAKE)
def test_rope_brake(torque: float, mass: float, speed: float, current: float, efficiency: float) -> None:
    assert rope_brake_mass(torque / 1e3, 0.046) * 1e3 == pytest.approx(mass, rel=1e-6)
    point = motor_on_lines(LINES, torque / 1e3)
    assert (point.speed / RPM, point.current) == pytest.approx((speed, current), abs=0.5)
    assert point.current == pytest.approx(current, abs=5e-4)
    assert point.efficiency == pytest.approx(efficiency, abs=5e-4)


def test_best_efficiency() -> None:
    assert SUMMARY.best_torque * 1e3 == pytest.approx(221, abs=0.5)
    assert motor_on_lines(LINES, 0.221).speed / RPM == pytest.approx(3967, abs=0.5)
    torques = np.linspace(0.15, 0.3, 1001)
    assert np.max(motor_on_lines(LINES, torques).efficiency) == pytest.approx(SUMMARY.best_efficiency, abs=1e-7)


def test_the_lines_contradict_each_other() -> None:
    """7 %: with the constants of both lines the machine would create energy."""
    assert CONSISTENT.back_emf_constant == pytest.approx(0.04657, abs=5e-6)
    assert CONSISTENT.resistance == pytest.approx(0.849, abs=5e-4)
    assert CONSISTENT.largest_constant == pytest.approx(0.0484, abs=5e-5)
    assert CONSISTENT.constants == pytest.approx(1.074, abs=5e-4)
    verdicts = {line.name: line.verdict for line in CONSISTENT.lines()}
    assert verdicts["constants"] == "above the limit 1 by 0.07358 (7.36 %)"


def test_set_a() -> None:
    assert (SET_A.constant, SET_A.resistance, SET_A.friction) == pytest.approx((0.046689, 0.79439, 0.04949), rel=2e-5)
    point = dc_motor_point(SET_A, 24.0, 0.21)
    assert point.speed / RPM == pytest.approx(4005.7, rel=1e-6)
    assert point.current == pytest.approx(5.558, abs=5e-4)
    assert point.efficiency == pytest.approx(0.660, abs=5e-4)
    assert point.current / 5.26 - 1 == pytest.approx(0.057, abs=5e-4)
    assert SET_A.speed_error == 0.0
    assert 24 / SET_A.resistance == pytest.approx(30.21, abs=5e-3)


def test_set_b() -> None:
    fit = fit_current_line(LINES, 0.21)
    assert (fit.constant, fit.resistance, fit.friction) == pytest.approx((0.05, 0.5753, 0.053), rel=1e-4)
    assert motor_lines(fit, 24.0).no_load_speed / RPM == pytest.approx(4467, abs=0.5)


def test_set_c() -> None:
    fit = fit_least_squares(LINES, 0.25, 4000 * RPM, 5.0)
    assert (fit.constant, fit.resistance, fit.friction) == pytest.approx((0.04768, 0.7291, 0.04457), abs=4e-5)
    assert (fit.constant, fit.friction) == pytest.approx((0.04768, 0.04457), abs=5e-6)
    assert (fit.speed_error / RPM, fit.current_error) == pytest.approx((66, 0.125), rel=2e-3)
    assert dc_motor_point(fit, 24.0, 0.21).efficiency == pytest.approx(0.691, abs=5e-4)


def test_set_d() -> None:
    fit = fit_least_squares(LINES, 0.25, 4000 * RPM, 5.0, viscous=True)
    assert (fit.constant, fit.resistance) == pytest.approx((0.04711, 0.7919), abs=4e-5)
    assert fit.damping == pytest.approx(9.50e-5, abs=5e-8)
    assert fit.friction == 0.0


@pytest.mark.parametrize("viscous", [False, True])
def test_least_squares_against_another_solver(viscous: bool) -> None:
    from scipy import optimize

    torques = np.linspace(0, 0.25, 26)
    aim = motor_on_lines(LINES, torques)

    def deviations(free: list[float]) -> np.ndarray:
        motor = DcMotor(free[0], free[1], 0.0, free[2]) if viscous else DcMotor(*free, 0.0)
        now = dc_motor_point(motor, 24.0, torques)
        return np.r_[(now.speed - aim.speed) / (4000 * RPM), (now.current - aim.current) / 5.0]

    start = [0.047, 0.75, 1e-4 if viscous else 0.05]
    other = optimize.least_squares(deviations, start, x_scale=start, xtol=1e-14, ftol=1e-14, gtol=1e-14)
    fit = fit_least_squares(LINES, 0.25, 4000 * RPM, 5.0, viscous)
    own = [fit.constant, fit.resistance, fit.damping if viscous else fit.friction]
    assert own == pytest.approx(other.x, rel=1e-7)


def test_lines_of_a_motor_are_found_again() -> None:
    motor = DcMotor(0.05, 0.8, 0.04, 0.0)
    lines = motor_lines(motor, 24.0)
    assert line_consistency(lines).constants == pytest.approx(1)
    for fit in (fit_speed_line(lines, 0.2), fit_current_line(lines, 0.2), fit_least_squares(lines, 0.2, 400.0, 5.0)):
        assert (fit.constant, fit.resistance, fit.friction) == pytest.approx((0.05, 0.8, 0.04))


@pytest.mark.parametrize("motor", [DcMotor(0.05, 0.8, 0.04, 0.0), DcMotor(0.05, 0.8, 0.01, 1e-4)])
def test_power_balance(motor: DcMotor) -> None:
    """What the supply delivers is the load, the friction and the heat of the armature."""
    point = dc_motor_point(motor, 24.0, np.linspace(0, 0.5, 7))
    friction = (motor.friction + motor.damping * point.speed) * point.speed
    assert point.input_power == pytest.approx(point.output_power + friction + motor.resistance * point.current**2)


def test_bench() -> None:
    """Motor loaded by the friction of the generator only: 4564/min and 22.3 V."""
    point = dc_motor_point(SET_A, 24.0, SET_A.friction)
    assert point.speed / RPM == pytest.approx(4564.37, abs=0.1)
    assert point.current == pytest.approx(2.120, abs=5e-4)
    assert generator_voltage(SET_A, point.speed) == pytest.approx(22.316, abs=5e-4)
    slower = dc_motor_point(SET_A, 21.5, SET_A.friction)
    assert slower.speed / RPM == pytest.approx(4053, abs=0.5)
    assert abs(180 * 24 / 4500 - 1) == pytest.approx(0.04)


def test_series_machine() -> None:
    mutual, resistance = 0.01, 1.2
    stall = mutual * (24 / resistance) ** 2
    assert series_motor_speed(stall, 24.0, mutual, resistance) == pytest.approx(0, abs=1e-9)
    speed = series_motor_speed(0.5, 24.0, mutual, resistance)
    current = math.sqrt(0.5 / mutual)
    assert (resistance + mutual * speed) * current == pytest.approx(24)
    with pytest.raises(ValueError, match="runs away"):
        series_motor_speed(0.0, 24.0, mutual, resistance)


def test_shunt_machine_and_field_weakening() -> None:
    strong, weak = shunt_motor(24.0, 0.01, 4.0, 0.8), shunt_motor(24.0, 0.01, 8.0, 0.8)
    assert strong.constant == pytest.approx(0.06)
    assert motor_lines(strong, 24.0).no_load_speed == pytest.approx(24 / 0.06)
    assert motor_lines(weak, 24.0).no_load_speed == pytest.approx(2 * motor_lines(strong, 24.0).no_load_speed)
