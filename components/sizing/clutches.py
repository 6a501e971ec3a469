"""Friction clutches: torque, friction work, selection."""

from __future__ import annotations

import math

from modelica_like.language.quantities import (
    Acceleration,
    Angle,
    Energy,
    Inertia,
    Length,
    Mass,
    Power,
    Ratio,
    Speed,
    Time,
    Torque,
    Velocity,
)
from modelica_like.language.results import Result, line

_RULE = 9550.0


def referred_mass(mass: Mass, velocity: Velocity, speed: Speed) -> Inertia:
    """Return the equivalent inertia in kg.m2 of a mass in kg: J = m·(v/w)², v in m/s, w in rad/s (document 000)."""
    return mass * (velocity / speed) ** 2


def referred_inertia(inertia: Inertia, ratio: Ratio) -> Inertia:
    """Return an inertia referred through a gear: J/i² with i = speed of the new shaft over speed of the old one."""
    return inertia / ratio**2


def slip_angle(speed: Speed, time: Time) -> Angle:
    """Return the angle in rad by which a clutch slips while the slip falls evenly to zero: phi = (w_A - w_L0)·t/2.

    Args:
        speed: difference of speeds at the beginning in rad/s.
        time: slipping time in s (document 000).
    """
    return speed * time / 2


def friction_work(torque: Torque, speed: Speed, time: Time) -> Energy:
    """Return the friction work in J of one engagement under constant torque: W = M·phi (document 000).

    Args:
        torque: clutch torque in N.m.
        speed: difference of speeds at the beginning in rad/s.
        time: slipping time in s.
    """
    return torque * slip_angle(speed, time)


class MachineTableClutch(Result):
    """Clutch that brings a machine table to speed."""

    motor_speed: Speed = line("speed of the motor and clutch")
    lead: Length = line("lead of the ball screw per revolution")
    table_inertia: Inertia = line("inertia of the table referred to the clutch")
    spindle_inertia: Inertia = line("inertia of the spindle referred to the clutch")
    gear_output_inertia: Inertia = line("inertia of the gear's spindle side referred to the clutch")
    referred_inertia: Inertia = line("all inertia behind the clutch")
    acceleration: Acceleration = line("angular acceleration")
    acceleration_torque: Torque = line("torque of acceleration")
    ratio: Ratio = line("speed of the motor over speed of the spindle")
    load_torque: Torque = line("load torque referred to the clutch")
    clutch_torque: Torque = line("torque the clutch has to transmit")
    slip_angle: Angle = line("angle by which the clutch slips")
    friction_work: Energy = line("friction work of one engagement")


def machine_table_clutch(
    motor_speed: Speed, acceleration_time: Time, load_torque: Torque, table_mass: Mass, table_velocity: Velocity,
    spindle_inertia: Inertia, hub_inertia: Inertia = 0.0, spindle_speed: Speed | None = None,
    gear_input_inertia: Inertia = 0.0, gear_output_inertia: Inertia = 0.0, load_speed: Speed = 0.0,
) -> MachineTableClutch:  # fmt: skip
    """Size the clutch between a running motor and a machine table at rest, or already moving (document 000).

    J_T = m·(u/w)², J_red = J_K + J_in + (J_out + J_S)/i² + J_T, M_B = J_red·(w - w_L0)/t, M_K = M_B + M_L/i,
    phi = (w - w_L0)·t/2, W = M_K·phi. The hub is entirely on the driven side of the friction surfaces; the screw has no
    loss.

    Args:
        motor_speed: speed of motor and clutch in rad/s.
        acceleration_time: time to full speed in s.
        load_torque: load on the spindle in N.m.
        table_mass: moved mass in kg.
        table_velocity: velocity of the table at full speed in m/s.
        spindle_inertia: in kg.m2.
        hub_inertia: driven side of the clutch in kg.m2.
        spindle_speed: in rad/s; without a gear that of the motor.
        gear_input_inertia: gear on the motor shaft in kg.m2.
        gear_output_inertia: gear on the spindle in kg.m2.
        load_speed: speed of the clutch's driven side before it closes, w_L0, in rad/s.
    """
    fast = motor_speed if spindle_speed is None else spindle_speed
    ratio = motor_speed / fast
    table = referred_mass(table_mass, table_velocity, motor_speed)
    spindle, gear = referred_inertia(spindle_inertia, ratio), referred_inertia(gear_output_inertia, ratio)
    total = hub_inertia + gear_input_inertia + gear + spindle + table
    slip = motor_speed - load_speed
    acceleration = slip / acceleration_time
    torque = total * acceleration + load_torque / ratio
    return MachineTableClutch(
        motor_speed=motor_speed, lead=2 * math.pi * table_velocity / fast, table_inertia=table,
        spindle_inertia=spindle, gear_output_inertia=gear, referred_inertia=total,
        acceleration=acceleration, acceleration_torque=total * acceleration, ratio=ratio,
        load_torque=load_torque / ratio, clutch_torque=torque, slip_angle=slip_angle(slip, acceleration_time),
        friction_work=friction_work(torque, slip, acceleration_time),
    )  # fmt: skip


class ClutchSelection(Result):
    """Clutch chosen from a catalogue."""

    required_torque: Torque = line("required torque by the rule 9550·P/n", at_most="rated_torque", either_way=True)
    exact_torque: Torque = line(
        "required torque K·P/w without the rounded 9550", at_most="rated_torque", either_way=True
    )
    rated_torque: Torque = line("rated torque of the clutch")


def clutch_selection(power: Power, speed: Speed, rated_torque: Torque, service_factor: Ratio = 1.0) -> ClutchSelection:
    """Compare the torque that a clutch needs with its rated torque: M = 9550·P/n·K (document 002, equation 48).

    Args:
        power: transmitted power in W.
        speed: speed of the clutch in rad/s.
        rated_torque: of the catalogue in N.m.
        service_factor: K.
    """
    per_minute = speed * 30 / math.pi
    return ClutchSelection(
        required_torque=_RULE * (power / 1e3) / per_minute * service_factor,
        exact_torque=power / speed * service_factor, rated_torque=rated_torque,
    )  # fmt: skip
