"""Flywheels: inertia and width of a solid cylinder, switching time."""

from __future__ import annotations

import math

from components.sizing.maths import require
from modelica_like.language.quantities import Density, Length, Mass, SmallInertia, Speed, Time, Torque
from modelica_like.language.results import Result, line

_INCOMPLETE = "Dimensions, density, torque, speed and time of a flywheel are positive."


def cylinder_mass(density: Density, radius: Length, width: Length) -> Mass:
    """Return the mass of a solid cylinder in kg: pi·rho·r²·b."""
    return math.pi * density * radius**2 * width


def cylinder_inertia(mass: Mass, radius: Length) -> SmallInertia:
    """Return the moment of inertia of a solid cylinder in kg.m2: m·r²/2 (document 002, equation 40)."""
    return mass * radius**2 / 2


def switching_time(inertia: SmallInertia, speed: Speed, torque: Torque) -> Time:
    """Return the time in s in which a constant torque brings an inertia to speed: J·w/M (document 002, equation 43).

    Torque, speed and inertia belong to one shaft; document 002, section 6.2, mixes the motor's torque with speed and
    inertia of the clutch shaft, and its 0.68 s agree with the measurement by chance.
    """
    return inertia * speed / torque


class Flywheel(Result):
    """Flywheel in the form of a solid cylinder."""

    inertia: SmallInertia = line("moment of inertia")
    radius: Length = line("radius")
    width: Length = line("width", at_most="width_limit")
    width_limit: Length = line("available width")
    mass: Mass = line("mass")
    switching_time: Time = line("time to reach the speed")


def flywheel_for_time(
    time: Time, torque: Torque, speed: Speed, density: Density, radius: Length, width_limit: Length = math.inf
) -> Flywheel:
    """Size a flywheel that takes a given time to come to speed (document 002, equations 40 to 44).

    J = M·t/w, b = 2·J/(pi·rho·r⁴). Table 2 of the document has widths computed with r = 50 mm, and inertias computed
    from these widths with r = 45 mm: (45/50)⁴ = 0.656 of the inertia required by the times.

    Args:
        time: switching time in s.
        torque: of the clutch in N.m.
        speed: at the end in rad/s.
        density: in kg/m3.
        radius: in m.
        width_limit: available width in m.

    Raises:
        ValueError: something is not above zero.
    """
    require(_INCOMPLETE, time > 0, torque > 0, speed > 0, density > 0, radius > 0)
    inertia = torque * time / speed
    width = 2 * inertia / (math.pi * density * radius**4)
    return Flywheel(inertia, radius, width, width_limit, cylinder_mass(density, radius, width), time)


def flywheel(
    width: Length, radius: Length, density: Density, torque: Torque, speed: Speed, width_limit: Length = math.inf
) -> Flywheel:
    """Compute the switching time of a flywheel of given size; the inverse of `flywheel_for_time`.

    Args:
        width: in m.
        radius: in m.
        density: in kg/m3.
        torque: of the clutch in N.m.
        speed: at the end in rad/s.
        width_limit: available width in m.

    Raises:
        ValueError: something is not above zero.
    """
    require(_INCOMPLETE, width > 0, radius > 0, density > 0, torque > 0, speed > 0)
    mass = cylinder_mass(density, radius, width)
    inertia = cylinder_inertia(mass, radius)
    return Flywheel(inertia, radius, width, width_limit, mass, switching_time(inertia, speed, torque))
