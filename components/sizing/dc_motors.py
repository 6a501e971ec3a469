"""DC machines: characteristic curves n(M), I(M) and eta(M), operating points, series and shunt machines."""

from __future__ import annotations

import math

from components.sizing.maths import require, sqrt
from modelica_like.language.quantities import (
    Compliance,
    Current,
    CurrentSlope,
    Damping,
    Length,
    Mass,
    MotorConstant,
    Power,
    Ratio,
    Resistance,
    Speed,
    Torque,
    Voltage,
)
from modelica_like.language.results import Result, line

GRAVITY = 9.81


class MotorLines(Result):
    """Speed and current of a motor as straight lines over the torque: w = w0 - s·M, I = I0 + a·M."""

    voltage: Voltage = line("supply voltage")
    no_load_speed: Speed = line("speed without load")
    speed_drop: Compliance = line("fall of the speed with the torque")
    no_load_current: Current = line("current without load")
    current_rise: CurrentSlope = line("rise of the current with the torque")


class DcMotor(Result):
    """Parameters of a DC motor with constant flux."""

    constant: MotorConstant = line("torque constant and back-EMF constant, one number")
    resistance: Resistance = line("resistance of the armature circuit")
    friction: Torque = line("friction torque that does not depend on the speed")
    damping: Damping = line("friction torque over speed")


def measured_lines(
    voltage: Voltage, no_load_speed: Speed, speed_drop: Compliance, no_load_current: Current,
    current_rise: CurrentSlope,
) -> MotorLines:  # fmt: skip
    """Return the straight lines through measured points: w = w0 - s·M, I = I0 + a·M.

    Args:
        voltage: in V.
        no_load_speed: w0 in rad/s.
        speed_drop: s in rad/(N.m.s).
        no_load_current: I0 in A.
        current_rise: a in A/(N.m).
    """
    return MotorLines(voltage, no_load_speed, speed_drop, no_load_current, current_rise)


def motor_lines(motor: DcMotor, voltage: Voltage) -> MotorLines:
    """Return the characteristic curves of a DC motor, which are straight.

    U = k·w + R·I and k·I = M + M_f + b·w, so with D = k² + R·b: w = (U·k - R·(M + M_f))/D and
    I = (k·(M + M_f) + b·U)/D (document 002, equations 3, 6 and 10, with one constant: as printed, equation 6 is larger
    than equation 3 by 2·pi and would not conserve energy).

    Args:
        motor: its parameters.
        voltage: in V.
    """
    k, scale = motor.constant, motor.constant**2 + motor.resistance * motor.damping
    return MotorLines(
        voltage, (voltage * k - motor.resistance * motor.friction) / scale, motor.resistance / scale,
        (k * motor.friction + motor.damping * voltage) / scale, k / scale,
    )  # fmt: skip


class MotorPoint(Result):
    """Operating point of a motor."""

    torque: Torque = line("torque of the load")
    speed: Speed = line("speed")
    current: Current = line("current")
    input_power: Power = line("electrical power U·I")
    output_power: Power = line("mechanical power M·w")
    efficiency: Ratio = line("efficiency")


def motor_point(torque: Torque, speed: Speed, voltage: Voltage, current: Current) -> MotorPoint:
    """Work out powers and efficiency of a motor from measured values (document 002, equations 11, 12 and 14).

    Args:
        torque: in N.m.
        speed: in rad/s.
        voltage: in V.
        current: in A.
    """
    electrical, mechanical = voltage * current, torque * speed
    return MotorPoint(torque, speed, current, electrical, mechanical, mechanical / electrical)


def motor_on_lines(lines: MotorLines, torque: Torque) -> MotorPoint:
    """Return the operating point under a load (document 002, section 6.1).

    Args:
        lines: characteristic curves, measured or from `motor_lines`.
        torque: of the load in N.m; an array gives the curves n(M), I(M) and eta(M).
    """
    speed = lines.no_load_speed - lines.speed_drop * torque
    return motor_point(torque, speed, lines.voltage, lines.no_load_current + lines.current_rise * torque)


def dc_motor_point(motor: DcMotor, voltage: Voltage, torque: Torque) -> MotorPoint:
    """Return the operating point of a DC motor under a load.

    Args:
        motor: its parameters.
        voltage: in V.
        torque: of the load in N.m.
    """
    return motor_on_lines(motor_lines(motor, voltage), torque)


def torque_at_speed(lines: MotorLines, speed: Speed) -> Torque:
    """Return the load in N.m under which a motor runs at a speed in rad/s."""
    return (lines.no_load_speed - speed) / lines.speed_drop


class MotorSummary(Result):
    """Key values of the characteristic curves of a motor."""

    no_load_speed: Speed = line("speed without load")
    no_load_current: Current = line("current without load")
    stall_torque: Torque = line("torque at standstill")
    stall_current: Current = line("current at standstill")
    best_torque: Torque = line("torque of the best efficiency")
    best_speed: Speed = line("speed there")
    best_efficiency: Ratio = line("best efficiency")


def motor_summary(lines: MotorLines) -> MotorSummary:
    """Return stall and best efficiency of a motor with straight characteristic curves.

    eta = M·(w0 - s·M)/(U·(I0 + a·M)) is largest at M = (sqrt(s²·I0² + s·a·w0·I0) - s·I0)/(s·a).

    Args:
        lines: characteristic curves.
    """
    s, a, current, speed = lines.speed_drop, lines.current_rise, lines.no_load_current, lines.no_load_speed
    stall = speed / s
    best = motor_on_lines(lines, (sqrt(s**2 * current**2 + s * a * speed * current) - s * current) / (s * a))
    return MotorSummary(
        speed, current, stall, current + a * stall, best.torque, best.speed, best.efficiency
    )  # fmt: skip


class DriveForClutch(Result):
    """Motor that can load a clutch up to its rated torque through a reduction."""

    clutch_speed: Speed = line("speed of the clutch", at_most="clutch_speed_limit", either_way=True)
    clutch_speed_limit: Speed = line("speed limit of the clutch")
    power: Power = line("power at the rated torque of the clutch")
    motor_torque: Torque = line("torque of the motor at the rated torque of the clutch")


def drive_for_clutch(
    clutch_torque: Torque, motor_speed: Speed, ratio: Ratio, clutch_speed_limit: Speed = math.inf
) -> DriveForClutch:
    """Work out speed, power and motor torque: w2 = w1/i, P = M_k·w2, M1 = M_k/i (document 002, equations 12 and 16).

    Args:
        clutch_torque: rated torque in N.m.
        motor_speed: in rad/s.
        ratio: speed of the motor over speed of the clutch.
        clutch_speed_limit: in rad/s.
    """
    speed = motor_speed / ratio
    return DriveForClutch(speed, clutch_speed_limit, clutch_torque * speed, clutch_torque / ratio)


def rope_brake_mass(torque: Torque, diameter: Length) -> Mass:
    """Return the mass in kg on the rope of a brake: M/(g·d/2) (document 002, section 6.1)."""
    return torque / (GRAVITY * diameter / 2)


def overload_current(clutch_torque: Torque, ratio: Ratio, generator: DcMotor, speed: Speed = 0.0) -> Current:
    """Return the generator current in A at which a clutch slips: (M_k/i - M_f - b·w)/k.

    Args:
        clutch_torque: of the clutch in N.m.
        ratio: speed of the generator over speed of the clutch.
        generator: its parameters.
        speed: of the generator in rad/s, for its damping.
    """
    return (clutch_torque / ratio - generator.friction - generator.damping * speed) / generator.constant


def generator_voltage(generator: DcMotor, speed: Speed, current: Current = 0.0) -> Voltage:
    """Return the terminal voltage in V of a generator: k·w - R·I (document 002, equation 10)."""
    return generator.constant * speed - generator.resistance * current


class GeneratorPoint(Result):
    """Operating point of a generator."""

    torque: Torque = line("torque that drives it")
    voltage: Voltage = line("voltage at its terminals")
    input_power: Power = line("mechanical power M·w")
    output_power: Power = line("electrical power U·I")
    efficiency: Ratio = line("efficiency")


def generator_point(generator: DcMotor, speed: Speed, current: Current) -> GeneratorPoint:
    """Work out powers and efficiency of a generator: U = k·w - R·I, M = k·I + M_f + b·w (document 002, equation 15).

    Args:
        generator: its parameters.
        speed: in rad/s.
        current: that it delivers in A.
    """
    voltage = generator_voltage(generator, speed, current)
    torque = generator.constant * current + generator.friction + generator.damping * speed
    mechanical, electrical = torque * speed, voltage * current
    return GeneratorPoint(torque, voltage, mechanical, electrical, electrical / mechanical)


def series_motor_speed(torque: Torque, voltage: Voltage, mutual: Ratio, resistance: Resistance) -> Speed:
    """Return the speed in rad/s of a series machine with linear field: U/sqrt(c·M) - R/c.

    M = c·I² and U = R·I + c·I·w. Without load the speed grows without bounds: a series machine runs away.

    Args:
        torque: inner torque in N.m, above zero.
        voltage: in V.
        mutual: c, torque over current squared, in N.m/A2.
        resistance: of armature and field together in Ohm.

    Raises:
        ValueError: the torque is not above zero.
    """
    require("A series machine without load runs away: its torque must be above zero.", torque > 0)
    return voltage / sqrt(mutual * torque) - resistance / mutual


def shunt_motor(
    voltage: Voltage, mutual: Ratio, field_resistance: Resistance, resistance: Resistance, friction: Torque = 0.0
) -> DcMotor:
    """Return a shunt machine with linear field at a supply voltage: k = c·U/R_f.

    Its supply also feeds the field current U/R_f.

    Args:
        voltage: in V.
        mutual: c, motor constant over field current, in N.m/A2.
        field_resistance: in Ohm.
        resistance: of the armature in Ohm.
        friction: in N.m.
    """
    return DcMotor(mutual * voltage / field_resistance, resistance, friction, 0.0)
