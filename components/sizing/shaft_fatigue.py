"""Fatigue strength of shafts: safety against fatigue fracture (DIN 743)."""

from __future__ import annotations

import math
from dataclasses import dataclass

from components.sizing.maths import log10, maximum, minimum, require, sqrt, where
from components.sizing.shaft_strength import bending_stress, torsional_stress
from modelica_like.language.quantities import Length, Ratio, SmallTorque, Stress, Torque
from modelica_like.language.results import Result, line

_MM, _UM, _MPA = 1e-3, 1e-6, 1e6
_SMOOTH = 1e-9


@dataclass(frozen=True)
class ShaftMaterial:
    """Strength of a steel for shafts, as in DIN 743-3.

    Attributes:
        tensile_strength: in Pa.
        yield_strength: in Pa.
        bending_fatigue: strength in alternating bending in Pa.
        torsion_fatigue: strength in alternating torsion in Pa.
    """

    tensile_strength: Stress
    yield_strength: Stress
    bending_fatigue: Stress
    torsion_fatigue: Stress


class ShaftFatigue(Result):
    """Safety against fatigue fracture at one section of a shaft."""

    bending: SmallTorque = line("resultant bending moment, which the rotation makes alternate")
    bending_amplitude: Stress = line("amplitude of the bending stress")
    torsion_mean: Stress = line("mean torsional stress")
    torsion_amplitude: Stress = line("amplitude of the torsional stress")
    bending_notch: Ratio = line("notch factor in bending, stress concentration over support number")
    torsion_notch: Ratio = line("notch factor in torsion")
    size_factor: Ratio = line("geometrical size factor K2")
    roughness_factor: Ratio = line("factor of the surface roughness in bending")
    bending_strength: Stress = line("bending amplitude that the section endures")
    torsion_strength: Stress = line("torsion amplitude that the section endures")
    safety: Ratio = line("safety against fatigue fracture", at_least="required_safety")
    required_safety: Ratio = line("required safety")


def shaft_fatigue(
    bending: Torque, torque: Torque, diameter: Length, material: ShaftMaterial, large_diameter: Length = 0.0,
    fillet: Length = 0.0, bending_factor: Ratio = 1.0, torsion_factor: Ratio = 1.0, alternating: Ratio = 0.0,
    roughness: Length = 6.3e-6, technological_size: Ratio = 1.0, hardening: Ratio = 1.0, required_safety: Ratio = 1.2,
) -> ShaftFatigue:  # fmt: skip
    """Work out the safety against fatigue fracture of a rotating shaft (DIN 743; Roloff/Matek, chapter 11).

    K = (beta/K2 + 1/K_F - 1)/K_V, W = K1·sigma_W/K; a mean stress lowers it by psi·sigma_mv, psi = W/(2·K1·R_m - W),
    and amplitude and mean together stay below the yield strength. S_D = 1/sqrt((sigma_a/W_b)² + (tau_a/W_t)²), and 0
    where the mean stress alone is too much.

    Args:
        bending: resultant bending moment in N.m; the rotation makes it alternate.
        torque: largest torsional moment in N.m.
        diameter: d in m.
        material: of a specimen.
        large_diameter: D of the shoulder in m; 0 without one.
        fillet: radius of the shoulder in m; 0 without one.
        bending_factor: stress concentration in bending (`stress_concentration`).
        torsion_factor: stress concentration in torsion.
        alternating: amplitude of the torque over its largest value: 0 steady, 0.5 switched on and off, 1 reversed.
        roughness: Rz in m.
        technological_size: K1, of the heat treatment of thick shafts.
        hardening: K_V, of a hardened surface.
        required_safety: smallest safety; 1.2 in DIN 743, if the loads are certain.

    Raises:
        ValueError: the shaft has no diameter, or `alternating` is no share.
    """
    require("The diameter of a shaft is positive.", diameter > 0)
    require("The share `alternating` of the torque is from 0 to 1.", alternating >= 0, alternating <= 1)
    normal, shear = bending_stress(abs(bending), diameter), torsional_stress(abs(torque), diameter)
    swing, mean = alternating * shear, (1 - alternating) * shear
    supports = support_numbers(diameter, large_diameter, fillet, material.yield_strength)
    notches = maximum(bending_factor / supports[0], 1.0), maximum(torsion_factor / supports[1], 1.0)
    size = 1 - 0.2 * log10(minimum(maximum(diameter / _MM, 7.5), 150.0) / 7.5) / math.log10(20)
    rough = 1 - 0.22 * log10(maximum(roughness / _UM, 1.0)) * (log10(material.tensile_strength / _MPA / 20) - 1)
    bends, twists = (
        technological_size * strength * hardening / (notch / size + 1 / factor - 1)
        for strength, notch, factor in zip(
            (material.bending_fatigue, material.torsion_fatigue), notches, (rough, 0.575 * rough + 0.425), strict=True
        )
    )
    tensile, limit = technological_size * material.tensile_strength, technological_size * material.yield_strength
    bends = _under_mean(bends, sqrt(3) * mean, limit - sqrt(3) * mean, tensile)
    twists = _under_mean(twists, mean, limit / sqrt(3) - mean, tensile)
    used = sqrt((normal / maximum(bends, _SMOOTH * limit)) ** 2 + (swing / maximum(twists, _SMOOTH * limit)) ** 2)
    safety = where(minimum(bends, twists) > 0, 1 / maximum(used, _SMOOTH), 0.0)
    strengths = *notches, size, rough, bends, twists
    return ShaftFatigue(bending, normal, mean, swing, *strengths, safety, required_safety)


def support_numbers(small: Length, large: Length, fillet: Length, yield_strength: Stress) -> tuple[Ratio, Ratio]:
    """Return the support numbers n of a shoulder in bending and in torsion, 1 without a shoulder (DIN 743-2).

    n = 1 + sqrt(G')·10^-(0.33 + R_e/712), G' = 2.3·(1 + phi)/r in bending and 1.15/r in torsion, with
    phi = 1/(4·sqrt(t/r) + 2) for d/D > 0.67, in mm and N/mm²; for steels that are not hardened.

    Args:
        small: diameter d in m.
        large: diameter D in m.
        fillet: radius r in m.
        yield_strength: in Pa.
    """
    radius = maximum(fillet, _SMOOTH) / _MM
    depth = maximum(large - small, 0.0) / (2 * _MM)
    shallow = where(small > 0.67 * large, 1 / (4 * sqrt(depth / radius) + 2), 0.0)
    exponent = 10.0 ** -(0.33 + yield_strength / _MPA / 712)
    notched = 1.0 * (fillet > 0)
    bending, torsion = (1 + notched * sqrt(slope / radius) * exponent for slope in (2.3 * (1 + shallow), 1.15))
    return bending, torsion


def _under_mean(endured: Stress, mean: Stress, room: Stress, tensile: Stress) -> Stress:
    """Return the amplitude that is endured with a mean stress, which leaves so much room below the yield strength."""
    return maximum(minimum(endured - endured / (2 * tensile - endured) * mean, room), 0.0)
