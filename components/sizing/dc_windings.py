"""Windings of DC machines: force and voltage of a conductor, motor constant, ripple of torque and voltage."""

from __future__ import annotations

import math

from components.sizing.maths import cos, floor, require, sin
from modelica_like.language.quantities import (
    Angle,
    Current,
    Field,
    Flux,
    Force,
    Length,
    MotorConstant,
    Ratio,
    Velocity,
    Voltage,
)
from modelica_like.language.results import Result, line


def conductor_force(current: Current, length: Length, field: Field, angle: Angle = math.pi / 2) -> Force:
    """Return the force in N on a straight conductor: F = I·l·B·sin(angle), of I·(l x B) (document 002, equation 1).

    Args:
        current: in A.
        length: of the conductor in the field in m.
        field: flux density B in T.
        angle: between conductor and field in rad.
    """
    return current * length * field * sin(angle)


def conductor_voltage(velocity: Velocity, length: Length, field: Field, angle: Angle = math.pi / 2) -> Voltage:
    """Return the voltage in V induced in a conductor: U = v·B·l·sin(angle), of ∫(v x B)·ds (document 002, equation 2).

    Args:
        velocity: at a right angle to the conductor in m/s.
        length: of the conductor in m.
        field: flux density B in T.
        angle: between velocity and field in rad.
    """
    return velocity * field * length * sin(angle)


class MachineConstant(Result):
    """Constants of a DC machine that follow from its winding."""

    torque_factor: Ratio = line("c_M1 of the torque, M = c_M1·flux·I")
    speed_factor: Ratio = line("c_M2 of the voltage over turns per second, U = c_M2·flux·n")
    constant: MotorConstant = line("torque constant and back-EMF constant, c_M1·flux")


def machine_constant(conductors: Ratio, pole_pairs: Ratio, flux: Flux, parallel_pairs: Ratio = 1.0) -> MachineConstant:
    """Work out the constant of a DC machine: c_M2 = z_A·p/a, c_M1 = c_M2/(2·pi) (document 002, equations 3 to 6).

    As printed, equation 6 takes c_M2 with the angular speed, 2·pi times too much, and there are no parallel branches.

    Args:
        conductors: number of conductors in the armature z_A.
        pole_pairs: p.
        flux: of one pole in Wb.
        parallel_pairs: pairs of parallel branches a: 1 of a wave winding, p of a lap winding.
    """
    factor = conductors * pole_pairs / parallel_pairs
    return MachineConstant(factor / (2 * math.pi), factor, factor / (2 * math.pi) * flux)


class CommutationRipple(Result):
    """Ripple of a commutated torque or voltage over one turn."""

    pulses: Ratio = line("pulses per turn of the rotor")
    smallest: Ratio = line("smallest value over the largest")
    mean: Ratio = line("mean value over the largest")
    ripple: Ratio = line("largest less smallest value over the mean")


def commutation_ripple(loops: Ratio, pole_pairs: Ratio = 1.0) -> CommutationRipple:
    """Work out torque ripple and voltage ripple of loops that a commutator turns over (document 002, 2.1.2 and 2.2).

    The loops are pi/N apart and each has a sine. With only the best one connected (figure 3 of the document) or all in
    series, the result is the crest of a cosine, |x| ≤ pi/(2·N), with its mean and smallest value.

    Args:
        loops: number of loops N; the document's rotor has two.
        pole_pairs: p; each pair repeats the pulses.

    Raises:
        ValueError: there is no loop.
    """
    require("A rotor has at least one loop.", loops >= 1)
    half = math.pi / (2 * loops)
    smallest, mean = cos(half), sin(half) / half
    return CommutationRipple(2 * loops * pole_pairs, smallest, mean, (1 - smallest) / mean)


def commutated(angle: Angle, loops: Ratio) -> Ratio:
    """Return the torque or voltage of commutated loops at an electrical angle in rad, over its largest value."""
    step = math.pi / loops
    return cos(angle - step * floor(angle / step + 0.5))
