"""Strength of shafts: smallest diameter, stress concentration, equivalent stress, safety against yielding."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from components.sizing.maths import is_symbolic, maximum, minimum, require, sqrt, where
from components.sizing.shaft_statics import Load, SectionForces, section_forces, shaft_statics
from modelica_like.language.quantities import Force, Length, Ratio, SmallTorque, Stress, Torque
from modelica_like.language.results import Result, line

_NOTHING = 1e-9


@dataclass(frozen=True)
class NotchCoefficients:
    """Coefficients of the stress concentration at a shoulder (Steinhilper, Konstruktionselemente, table 3.6)."""

    A: float
    E: float
    G: float
    k: float
    l: float  # noqa: E741 -- the source's letter
    m: float


SHOULDER_IN_BENDING = NotchCoefficients(A=0.40, E=6.00, G=0.80, k=0.40, l=2.75, m=1.50)
SHOULDER_IN_TORSION = NotchCoefficients(A=0.40, E=25.00, G=0.20, k=0.45, l=2.25, m=2.00)


def stress_concentration(large: Length, small: Length, fillet: Length, coefficients: NotchCoefficients) -> Ratio:
    """Return the stress-concentration factor of a shoulder with a fillet (Steinhilper; document 002, equation 34).

    1 + 1/sqrt(A/(t/r)^k + E·[(1 + d/2r)/(d/2r)^1.5]^l + G·d/(D·(t/r)^m)) with t = (D - d)/2.

    Args:
        large: diameter D in m.
        small: diameter d in m.
        fillet: radius r in m.
        coefficients: of the kind of loading.

    Raises:
        ValueError: there is no shoulder.
    """
    require("A shoulder needs two diameters that differ, and a fillet radius.", large > small, fillet > 0)
    depth, size, c = (large - small) / (2 * fillet), small / (2 * fillet), coefficients
    total = c.A / depth**c.k + c.E * ((1 + size) / size**1.5) ** c.l + c.G * small / (large * depth**c.m)
    return 1 + 1 / sqrt(total)


def bending_stress(moment: Torque, diameter: Length) -> Stress:
    """Return the nominal bending stress of a round shaft in Pa: 32·M/(pi·d³) (document 002, equation 32)."""
    return 32 * moment / (math.pi * diameter**3)


def torsional_stress(torque: Torque, diameter: Length) -> Stress:
    """Return the nominal torsional stress of a round shaft in Pa: 16·T/(pi·d³) (document 002, equation 33)."""
    return 16 * torque / (math.pi * diameter**3)


def von_mises(normal: Stress, shear: Stress) -> Stress:
    """Return the equivalent stress in Pa: sqrt(sigma² + 3·tau²) (von Mises; document 002, equation 35)."""
    return sqrt(normal**2 + 3 * shear**2)


class ShaftDiameter(Result):
    """Smallest diameter of a shaft in bending."""

    bending: SmallTorque = line("resultant bending moment")
    allowable_stress: Stress = line("strength over required safety")
    smallest_diameter: Length = line("smallest diameter for the bending moment", at_most="diameter")
    diameter: Length = line("diameter of the shaft")


def shaft_diameter(bending: Torque, strength: Stress, safety: Ratio, diameter: Length) -> ShaftDiameter:
    """Compare the diameter with the smallest one: d³ = 32·M/(pi·sigma) (document 002, equations 29 to 31).

    Args:
        bending: resultant bending moment in N.m.
        strength: fatigue strength in Pa; document 002 uses the yield strength.
        safety: required safety.
        diameter: smallest diameter of the shaft in m.
    """
    require("Strength and safety of a shaft are positive.", strength > 0, safety > 0)
    allowable = strength / safety
    return ShaftDiameter(bending, allowable, (32 * abs(bending) / (math.pi * allowable)) ** (1 / 3), diameter)


class ShaftStress(Result):
    """Stresses and safety at one section of a shaft."""

    at: Length = line("position")
    diameter: Length = line("diameter")
    bending: SmallTorque = line("resultant bending moment")
    torque: SmallTorque = line("torsional moment")
    bending_stress: Stress = line("nominal bending stress")
    torsional_stress: Stress = line("nominal torsional stress")
    bending_factor: Ratio = line("stress concentration in bending")
    torsion_factor: Ratio = line("stress concentration in torsion")
    largest_bending: Stress = line("largest bending stress")
    largest_torsion: Stress = line("largest torsional stress")
    equivalent_stress: Stress = line("equivalent stress (von Mises)")
    safety: Ratio = line("safety against yielding", at_least="required_safety")
    required_safety: Ratio = line("required safety")


def shaft_stress(
    bending: Torque, torque: Torque, diameter: Length, yield_strength: Stress, bending_factor: Ratio = 1.0,
    torsion_factor: Ratio = 1.0, axial_force: Force = 0.0, required_safety: Ratio = 1.0, at: Length = 0.0,
) -> ShaftStress:  # fmt: skip
    """Work out stresses and safety of a round section (Roloff/Matek; document 002, equations 32 to 36).

    Args:
        bending: resultant bending moment in N.m.
        torque: torsional moment in N.m.
        diameter: in m.
        yield_strength: in Pa.
        bending_factor: stress concentration in bending.
        torsion_factor: stress concentration in torsion.
        axial_force: in N, without stress concentration.
        required_safety: smallest safety.
        at: position in m, for the table.

    Raises:
        ValueError: diameter or strength is not above zero.
    """
    require("Diameter and strength of a shaft are positive.", diameter > 0, yield_strength > 0)
    normal, shear = bending_stress(bending, diameter), torsional_stress(abs(torque), diameter)
    tension = 4 * abs(axial_force) / (math.pi * diameter**2)
    equivalent = von_mises(tension + bending_factor * normal, torsion_factor * shear)
    safety = yield_strength / maximum(equivalent, _NOTHING * yield_strength)
    return ShaftStress(
        at, diameter, bending, abs(torque), normal, shear, bending_factor, torsion_factor, bending_factor * normal,
        torsion_factor * shear, equivalent, safety, required_safety,
    )  # fmt: skip


@dataclass(frozen=True)
class Section:
    """A cylindrical section of a shaft.

    Attributes:
        end: position of its end in m; it begins where the one before ends.
        diameter: in m.
        fillet: radius in m of the shoulder at its end.
    """

    end: Length
    diameter: Length
    fillet: Length = 0.0


class SteppedShaft(Result):
    """Safety of a stepped shaft at every relevant place."""

    reactions: tuple[Result, ...] = line("bearings")
    stresses: tuple[ShaftStress, ...] = line("stresses at bearings, loads and shoulders")
    largest_bending: SmallTorque = line("largest resultant bending moment")
    largest_stress: Stress = line("largest equivalent stress (von Mises)")
    safety: Ratio = line("smallest safety against yielding", at_least="required_safety")
    place: Length = line("its position")
    required_safety: Ratio = line("required safety")


def stepped_shaft(
    loads: Sequence[Load], bearings: Sequence[Length], sections: Sequence[Section], yield_strength: Stress,
    hinges: Sequence[Length] = (), required_safety: Ratio = 1.0,
) -> SteppedShaft:  # fmt: skip
    """Check a stepped shaft against yielding, from its loads to the safety.

    Positions and diameters are plain numbers; forces and torques may be arrays or expressions.

    Args:
        loads: on the shaft.
        bearings: positions in m.
        sections: pieces of the shaft from its left end on.
        yield_strength: in Pa.
        hinges: positions in m of joints without bending moment.
        required_safety: smallest safety.

    Raises:
        ValueError: the shaft is not statically determinate, its sections are not in order, or something acts beyond
            its end.
    """
    if not sections or any(after.end <= before.end for before, after in itertools.pairwise(sections)):
        raise ValueError("A stepped shaft needs sections, each of which ends behind the one before.")
    statics = shaft_statics(loads, bearings, hinges)
    last = max(cut.at for cut in statics.diagram)
    require(f"Something acts at {np.max(last):g} m, beyond the last section.", last <= sections[-1].end)
    everything = [*loads, *(Load(reaction.at, reaction.y, reaction.z) for reaction in statics.reactions)]
    stresses: list[ShaftStress] = []
    for sides in zip(statics.diagram[::2], statics.diagram[1::2], strict=True):
        stresses += _worst([_at_cut(cut, sections, yield_strength, required_safety) for cut in sides])
    for before, after in itertools.pairwise(sections):
        cuts = section_forces(everything, before.end)
        stresses += _worst([_at_shoulder(cut, before, after, yield_strength, required_safety) for cut in cuts])
    stresses.sort(key=lambda stress: stress.at)
    lowest, place = stresses[0].safety, stresses[0].at
    for stress in stresses[1:]:
        place = where(stress.safety < lowest, stress.at, place)
        lowest = minimum(lowest, stress.safety)
    largest = maximum(*(stress.equivalent_stress for stress in stresses))
    return SteppedShaft(
        statics.reactions, tuple(stresses), statics.largest_bending, largest, lowest, place, required_safety
    )


def _worst(stresses: list[ShaftStress]) -> list[ShaftStress]:
    """Of both sides of one cut only the worse one is kept, if it can be decided."""
    if is_symbolic(*(stress.safety for stress in stresses)) or any(np.ndim(stress.safety) for stress in stresses):
        return stresses
    return [min(stresses, key=lambda stress: stress.safety)]


def _at_cut(
    cut: SectionForces, sections: Sequence[Section], yield_strength: Stress, required_safety: Ratio
) -> ShaftStress:
    piece = next(section for section in sections if cut.at <= section.end)
    return shaft_stress(
        cut.bending, cut.torque, piece.diameter, yield_strength, required_safety=required_safety, at=cut.at
    )


def _at_shoulder(
    cut: SectionForces, before: Section, after: Section, yield_strength: Stress, required_safety: Ratio
) -> ShaftStress:
    small, large = sorted((before.diameter, after.diameter))
    factors = [
        stress_concentration(large, small, before.fillet, coefficients)
        for coefficients in (SHOULDER_IN_BENDING, SHOULDER_IN_TORSION)
    ]
    return shaft_stress(
        cut.bending, cut.torque, small, yield_strength, *factors, required_safety=required_safety, at=cut.at
    )
