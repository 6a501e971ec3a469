"""Belt drives: pitch diameters, centre distance, wrap angle, teeth in mesh, strand forces and load of the shafts."""

from __future__ import annotations

import math

from components.sizing.maths import asin, cos, exp, floor, hypot, maximum, require, sin, sqrt
from modelica_like.language.quantities import (
    Angle,
    Area,
    Density,
    Force,
    Length,
    Power,
    Ratio,
    Speed,
    Stress,
    Teeth,
    Velocity,
)
from modelica_like.language.results import Result, line

_NEWTON_STEPS = 8


def pitch_diameter(teeth: Teeth, pitch: Length) -> Length:
    """Return the pitch diameter of a toothed pulley in m: d = z·p/pi (document 002, equation 17)."""
    return teeth * pitch / math.pi


def centre_distance(belt_length: Length, small: Length, large: Length) -> Length:
    """Return the centre distance in m of an open belt by the approximate rule.

    e = a + sqrt(a² - (d2 - d1)²/8) with a = L/4 - pi/8·(d1 + d2) (Roloff/Matek; document 002, equation 18).

    Raises:
        ValueError: the belt is too short for the pulleys.
    """
    mean = belt_length / 4 - math.pi / 8 * (small + large)
    square = mean**2 - (large - small) ** 2 / 8
    require("The belt is too short for the pulleys.", mean > 0, square >= 0)
    return mean + sqrt(square)


def exact_centre_distance(belt_length: Length, small: Length, large: Length) -> Length:
    """Return the centre distance in m at which an open belt of the given length fits exactly.

    L = 2·e·cos(a) + pi/2·(d1 + d2) + a·(d2 - d1) with sin(a) = (d2 - d1)/(2·e), solved by Newton's method from the rule
    of `centre_distance`; dL/de = 2·cos(a).
    """
    distance = centre_distance(belt_length, small, large)
    for _ in range(_NEWTON_STEPS):
        angle = asin((large - small) / (2 * distance))
        length = 2 * distance * cos(angle) + math.pi / 2 * (small + large) + angle * (large - small)
        distance = distance - (length - belt_length) / (2 * cos(angle))
    return distance


def wrap_angle(small: Length, large: Length, distance: Length) -> Angle:
    """Return the wrap angle of the small pulley in rad: 2·acos((d2 - d1)/(2·e)) (document 002, equation 20)."""
    return math.pi - 2 * asin((large - small) / (2 * distance))


def belt_velocity(diameter: Length, speed: Speed) -> Velocity:
    """Return the velocity of a belt in m/s: v = d/2·w (document 002, equation 22)."""
    return diameter / 2 * speed


class BeltGeometry(Result):
    """Geometry of an open timing belt."""

    ratio: Ratio = line("speed of the small pulley over speed of the large one")
    small_diameter: Length = line("pitch diameter of the small pulley")
    large_diameter: Length = line("pitch diameter of the large pulley")
    centre_distance: Length = line("centre distance by the approximate rule")
    exact_distance: Length = line("exact centre distance")
    take_up: Length = line("travel for tensioning, 0.5 % of the belt's length")
    wrap_angle: Angle = line("wrap angle of the small pulley")
    engaged: Teeth = line("teeth in mesh before rounding down")
    teeth_in_mesh: Teeth = line("teeth in mesh")


def belt_geometry(small_teeth: Teeth, large_teeth: Teeth, pitch: Length, belt_length: Length) -> BeltGeometry:
    """Work out the geometry of an open timing belt (Roloff/Matek; document 002, equations 16 to 21).

    Args:
        small_teeth: teeth of the small pulley.
        large_teeth: teeth of the large pulley.
        pitch: distance of the teeth in m.
        belt_length: pitch length of the belt in m.

    Raises:
        ValueError: the small pulley is the larger one, or the belt is too short.
    """
    require("Pulleys and belt need teeth and a pitch.", small_teeth > 0, pitch > 0)
    require("small_teeth are more than large_teeth: swap them.", small_teeth <= large_teeth)
    small, large = pitch_diameter(small_teeth, pitch), pitch_diameter(large_teeth, pitch)
    distance = centre_distance(belt_length, small, large)
    angle = wrap_angle(small, large, distance)
    engaged = small_teeth * angle / (2 * math.pi)
    return BeltGeometry(
        ratio=large_teeth / small_teeth, small_diameter=small, large_diameter=large, centre_distance=distance,
        exact_distance=exact_centre_distance(belt_length, small, large), take_up=0.005 * belt_length,
        wrap_angle=angle, engaged=engaged, teeth_in_mesh=floor(engaged),
    )  # fmt: skip


def effective_pull(power: Power, velocity: Velocity, application_factor: Ratio = 1.0) -> Force:
    """Return the force in N that a belt transmits: F_t = K_A·P/v (document 002, equation 24)."""
    return application_factor * power / velocity


def strand_resultant(tight: Force, slack: Force, angle: Angle) -> Force:
    """Return the vector sum in N of both strand forces by the law of cosines (document 002, equation 27).

    F_w² = F1² + F2² - 2·F1·F2·cos(wrap angle): at half a turn it is F1 + F2, so the minus sign is right.
    """
    return sqrt(maximum(tight**2 + slack**2 - 2 * tight * slack * cos(angle), 0.0))


class BeltForces(Result):
    """Forces of a belt and the load of its shafts."""

    effective_pull: Force = line("transmitted force, difference of the strands")
    force_ratio: Ratio = line("largest ratio of the strands, exp(mu·wrap angle)")
    tight_strand: Force = line("force in the tight strand")
    slack_strand: Force = line("force in the slack strand")
    shaft_load: Force = line("load of the shaft: vector sum of both strands")
    along_centres: Force = line("its component along the line of centres")
    across_centres: Force = line("its component across the line of centres")
    doubled_load: Force = line("load with the effective pull counted twice, as in document 002")
    centrifugal_force: Force = line("tension by centrifugal force, A·rho·v²")
    load_at_rest: Force = line("load of the shaft at rest by Roloff/Matek, F_w + F_z")
    relief: Force = line("relief of the shaft in motion, 2·F_z·sin(wrap angle/2)")


def belt_forces(
    pull: Force, angle: Angle, friction: Ratio, velocity: Velocity, section: Area = 0.0, density: Density = 0.0
) -> BeltForces:
    """Work out strand forces and shaft load (Eytelwein, Roloff/Matek; document 002, equations 23 to 28).

    F1 = F_t·m/(m - 1) and F2 = F_t/(m - 1) with m = exp(mu·beta). For a timing belt, which cannot slip, Eytelwein's
    ratio is a convention of sizing. The shaft load is already the sum of both strands; document 002 adds the effective
    pull to it at a right angle, which counts it twice (`doubled_load`).

    Args:
        pull: effective pull in N.
        angle: wrap angle of the small pulley in rad.
        friction: coefficient of friction mu.
        velocity: of the belt in m/s.
        section: cross-section of the belt, width by thickness, in m2.
        density: of the belt in kg/m3.

    Raises:
        ValueError: nothing presses the belt on its pulleys, or it weighs less than nothing.
    """
    require("A belt needs a friction and a wrap angle above zero.", friction > 0, angle > 0)
    require("Section and density of a belt are not below zero.", section >= 0, density >= 0)
    ratio = exp(friction * angle)
    slack = pull / (ratio - 1)
    tight = pull + slack
    load = strand_resultant(tight, slack, angle)
    centrifugal = section * density * velocity**2
    return BeltForces(
        effective_pull=pull, force_ratio=ratio, tight_strand=tight, slack_strand=slack, shaft_load=load,
        along_centres=(tight + slack) * sin(angle / 2), across_centres=(tight - slack) * cos(angle / 2),
        doubled_load=hypot(load, pull), centrifugal_force=centrifugal, load_at_rest=load + centrifugal,
        relief=2 * centrifugal * sin(angle / 2),
    )  # fmt: skip


class TimingBeltLoad(Result):
    """Load of a timing belt against its limits."""

    power: Power = line("transmitted power, application factor included", at_most="power_limit", either_way=True)
    power_limit: Power = line("power that the belt can transmit")
    tooth_force: Force = line("force of one tooth in mesh")
    flank_pressure: Stress = line("pressure on the flanks of the teeth", at_most="pressure_limit", either_way=True)
    pressure_limit: Stress = line("permissible pressure on the flanks")


def timing_belt_load(
    pull: Force, velocity: Velocity, teeth_in_mesh: Teeth, width: Length, tooth_height: Length,
    power_limit: Power = math.inf, pressure_limit: Stress = math.inf,
) -> TimingBeltLoad:  # fmt: skip
    """Compare power and flank pressure of a timing belt with their limits: p = F_t/(z_e·b·h) (document 002, 5.3).

    Args:
        pull: effective pull in N, application factor included.
        velocity: of the belt in m/s.
        teeth_in_mesh: whole number of teeth that carry.
        width: of the belt in m.
        tooth_height: in m; 1.27 mm of profile XL (ISO 5296).
        power_limit: of the catalogue in W.
        pressure_limit: in Pa.

    Raises:
        ValueError: no tooth carries.
    """
    require("A timing belt needs teeth in mesh, a width and a height of its teeth.",
            teeth_in_mesh > 0, width > 0, tooth_height > 0)  # fmt: skip
    force = pull / teeth_in_mesh
    return TimingBeltLoad(pull * velocity, power_limit, force, force / (width * tooth_height), pressure_limit)
