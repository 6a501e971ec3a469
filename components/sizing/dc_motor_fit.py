"""Parameters of a DC motor from measured lines of speed and current over the torque."""

from __future__ import annotations

from collections.abc import Sequence

from components.sizing.dc_motors import DcMotor, MotorLines, motor_lines, motor_on_lines
from components.sizing.maths import Number, absolute, maximum, settled, solve, sqrt
from modelica_like.language.quantities import Current, MotorConstant, Ratio, Resistance, Speed, Torque
from modelica_like.language.results import Result, line

_STEPS = 12
_NAMES = ("constant", "resistance", "friction", "damping")


class LineConsistency(Result):
    """Whether two measured lines can belong to one DC motor."""

    torque_constant: MotorConstant = line("torque constant from the line of the current")
    friction: Torque = line("friction torque from the line of the current")
    back_emf_constant: MotorConstant = line("back-EMF constant from the line of the speed and the no-load current")
    resistance: Resistance = line("resistance from both lines")
    largest_constant: MotorConstant = line("back-EMF constant if the armature had no resistance")
    constants: Ratio = line("torque constant over back-EMF constant", at_most="conserving")
    conserving: Ratio = line("value that conserves energy; above it the machine would create energy")


def line_consistency(lines: MotorLines) -> LineConsistency:
    """Compare torque constant and back-EMF constant, which are equal in a machine with constant flux.

    The line of the current gives k_t = 1/a and M_f = I0/a. The line of the speed gives R = s·k_e·k_t and
    U = k_e·w0 + R·I0. The lines of document 002, section 6.1, contradict each other by 7 %.

    Args:
        lines: measured lines.
    """
    torque_constant, loss = 1 / lines.current_rise, lines.no_load_current * lines.speed_drop / lines.current_rise
    emf = lines.voltage / (lines.no_load_speed + loss)
    return LineConsistency(
        torque_constant, lines.no_load_current * torque_constant, emf, lines.speed_drop * emf * torque_constant,
        lines.voltage / lines.no_load_speed, torque_constant / emf, 1.0,
    )  # fmt: skip


class MotorFit(DcMotor):
    """Parameters of a DC motor with the largest deviations from the measured lines."""

    speed_error: Speed = line("largest deviation of the speed")
    current_error: Current = line("largest deviation of the current")
    relative_current_error: Ratio = line("the same over the current at the largest torque")


def fit_speed_line(lines: MotorLines, largest_torque: Torque) -> MotorFit:
    """Identify a motor that has the line of the speed and the no-load current exactly (set A of document 002).

    R = s·k² and U = k·w0 + R·I0, a quadratic equation for k; M_f = k·I0.

    Args:
        lines: measured lines.
        largest_torque: of the measurements in N.m, for the deviations.
    """
    a, speed = lines.speed_drop * lines.no_load_current, lines.no_load_speed
    constant = (sqrt(speed**2 + 4 * a * lines.voltage) - speed) / (2 * a)
    motor = DcMotor(constant, lines.speed_drop * constant**2, constant * lines.no_load_current, 0.0)
    return _compared(motor, lines, largest_torque)


def fit_current_line(lines: MotorLines, nominal_torque: Torque) -> MotorFit:
    """Identify a motor that has the line of the current and the nominal speed exactly (set B of document 002).

    Args:
        lines: measured lines.
        nominal_torque: in N.m.
    """
    constant, nominal = 1 / lines.current_rise, motor_on_lines(lines, nominal_torque)
    resistance = (lines.voltage - constant * nominal.speed) / nominal.current
    motor = DcMotor(constant, resistance, constant * lines.no_load_current, 0.0)
    return _compared(motor, lines, nominal_torque)


def fit_least_squares(
    lines: MotorLines, largest_torque: Torque, speed_scale: Speed, current_scale: Current, viscous: bool = False,
    points: int = 26,
) -> MotorFit:  # fmt: skip
    """Identify a motor by least squares of both lines (sets C and D of document 002), by Gauss and Newton's method.

    The deviations of speed and current at evenly spaced torques are divided by the scales.

    Args:
        lines: measured lines.
        largest_torque: of the measurements in N.m.
        speed_scale: deviation of the speed in rad/s that weighs as much as `current_scale`.
        current_scale: in A.
        viscous: the friction is proportional to the speed (set D) instead of constant (set C).
        points: number of torques, from zero on.
    """
    start = fit_speed_line(lines, largest_torque)
    free = ("constant", "resistance", "damping" if viscous else "friction")
    guess = {name: getattr(start, name) for name in _NAMES}
    if viscous:
        guess |= {"damping": start.friction / lines.no_load_speed, "friction": 0.0}
    motor = DcMotor(**guess)
    torques = [largest_torque * k / (points - 1) for k in range(points)]
    for _ in range(_STEPS):
        motor = _gauss_newton(motor, lines, torques, free, (speed_scale, current_scale))
    return _compared(motor, lines, largest_torque)


def _gauss_newton(
    motor: DcMotor, lines: MotorLines, torques: Sequence[Torque], free: Sequence[str], scales: tuple[Speed, Current]
) -> DcMotor:
    """Return the motor after one step; the free parameters are relative to their values."""
    lines_of_motor = motor_lines(motor, lines.voltage)
    matrix: list[list[Number]] = [[0.0] * len(free) for _ in free]
    right: list[Number] = [0.0] * len(free)
    for torque in torques:
        aim, now = motor_on_lines(lines, torque), motor_on_lines(lines_of_motor, torque)
        rates = _rates(motor, lines.voltage, now.speed, now.current, torque)
        for k, (missing, scale) in enumerate(
            zip((aim.speed - now.speed, aim.current - now.current), scales, strict=True)
        ):
            row = [getattr(motor, name) * rates[name][k] / scale for name in free]
            for i, rate in enumerate(row):
                right[i] = right[i] + rate * missing / scale
                matrix[i] = [old + rate * other for old, other in zip(matrix[i], row, strict=True)]
    steps = dict(zip(free, solve(matrix, right), strict=True))
    return DcMotor(*(getattr(motor, name) * (1 + steps.get(name, 0.0)) for name in _NAMES))


def _rates(
    motor: DcMotor, voltage: Number, speed: Speed, current: Current, torque: Torque
) -> dict[str, tuple[Number, Number]]:
    """Return the derivatives of speed and current by each parameter, at a load."""
    k, r, b, load = motor.constant, motor.resistance, motor.damping, torque + motor.friction
    scale = k**2 + r * b
    return {
        "constant": ((voltage - 2 * k * speed) / scale, (load - 2 * k * current) / scale),
        "resistance": (-(load + b * speed) / scale, -b * current / scale),
        "friction": (-r / scale, k / scale),
        "damping": (-r * speed / scale, (voltage - r * current) / scale),
    }


def _compared(motor: DcMotor, lines: MotorLines, largest_torque: Torque) -> MotorFit:
    """Compare at the ends: all curves are straight, so the deviations are largest there."""
    lines_of_motor = motor_lines(motor, lines.voltage)
    ends = [(motor_on_lines(lines, torque), motor_on_lines(lines_of_motor, torque)) for torque in (0.0, largest_torque)]
    speed, current = (
        maximum(*(absolute(settled(getattr(aim, name) - getattr(now, name), getattr(aim, name))) for aim, now in ends))
        for name in ("speed", "current")
    )
    return MotorFit(
        motor.constant, motor.resistance, motor.friction, motor.damping, speed, current, current / ends[1][0].current
    )
