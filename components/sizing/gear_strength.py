"""Load capacity of cylindrical gears: pitting and fracture of the tooth root (ISO 6336, DIN 3990)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from components.sizing.gear_geometry import GearPair, internal_form, tooth_form
from components.sizing.maths import Number, absolute, cos, is_symbolic, maximum, minimum, require, sqrt, tan, where
from modelica_like.language.quantities import Angle, Force, Ratio, Stress, Torque
from modelica_like.language.results import Result, line

_INCOMPLETE = "A gear pair needs a torque, a module, a width and a pinion with teeth; only the wheel's may be negative."


@dataclass(frozen=True)
class GearMaterial:
    """Strength of gear teeth, as in ISO 6336-5.

    Attributes:
        pitting_limit: allowable contact stress sigma_Hlim in Pa.
        root_limit: allowable nominal bending stress of the root sigma_Flim in Pa.
        modulus: Young's modulus in Pa.
        poisson: Poisson's ratio.
    """

    pitting_limit: Stress
    root_limit: Stress
    modulus: Stress = 206e9
    poisson: Ratio = 0.3


class GearStrength(Result):
    """Stresses and safeties of a pair of gears."""

    tangential_force: Force = line("tangential force at the pitch circle")
    working_angle: Angle = line("working pressure angle")
    contact_ratio: Ratio = line("transverse contact ratio")
    zone_factor: Ratio = line("zone factor Z_H")
    contact_ratio_factor: Ratio = line("contact ratio factor Z_eps of the flanks")
    single_contact: Ratio = line("single pair contact factor, the larger one of Z_B and Z_D")
    contact_stress: Stress = line("contact stress sigma_H")
    contact_strength: Stress = line("contact stress that the flanks endure, sigma_HG")
    pitting_safety: Ratio = line("safety against pitting S_H", at_least="required_pitting_safety")
    required_pitting_safety: Ratio = line("required safety against pitting")
    pinion_form: Ratio = line("form factor times stress correction factor of the pinion, Y_Fa·Y_Sa")
    wheel_form: Ratio = line("that of the wheel")
    pinion_root_stress: Stress = line("root stress of the pinion sigma_F1")
    wheel_root_stress: Stress = line("root stress of the wheel sigma_F2")
    pinion_root_safety: Ratio = line("safety of the pinion against root fracture S_F1", at_least="required_root_safety")
    wheel_root_safety: Ratio = line("safety of the wheel against root fracture S_F2", at_least="required_root_safety")
    required_root_safety: Ratio = line("required safety against root fracture")


def gear_strength(
    pair: GearPair, torque: Torque, material: GearMaterial, application: Ratio = 1.0, dynamic: Ratio = 1.0,
    face_load: Ratio = 1.0, transverse_load: Ratio = 1.0, flank_life: Ratio = 1.0, root_life: Ratio = 1.0,
    flank_influence: Ratio = 1.0, root_influence: Ratio = 1.0, pinion_reversal: Ratio = 1.0,
    wheel_reversal: Ratio = 1.0, required_pitting_safety: Ratio = 1.0, required_root_safety: Ratio = 1.0,
) -> GearStrength:  # fmt: skip
    """Work out the safeties against pitting and root fracture (ISO 6336-2; root as DIN 3990-3, method C).

    sigma_H = Z_B·Z_H·Z_E·Z_eps·Z_beta·sqrt(F_t/(d1·b)·(u + 1)/u·K), sigma_F = F_t/(b·m)·Y_Fa·Y_Sa·Y_eps·Y_beta·K with
    K = K_A·K_v·K_Hbeta·K_Halpha; sigma_HG = sigma_Hlim·Z_NT·Z, sigma_FG = 2·sigma_Flim·Y_NT·Y. Factors of the
    standard that need quality, lubricant or stiffness are arguments; Y_beta is that of DIN 3990.

    Args:
        pair: geometry.
        torque: of the pinion in N.m.
        material: of both gears.
        application: application factor K_A.
        dynamic: dynamic factor K_v.
        face_load: face load factor K_Hbeta, also for the root.
        transverse_load: transverse load factor K_Halpha, also for the root.
        flank_life: life factor Z_NT.
        root_life: life factor Y_NT.
        flank_influence: product of lubricant, velocity, roughness, hardness and size, Z_L·Z_v·Z_R·Z_W·Z_X.
        root_influence: product of notch sensitivity, surface and size, Y_deltarelT·Y_RrelT·Y_X.
        pinion_reversal: factor of the root limit if the pinion is loaded on both flanks; 0.7 of an idler (ISO 6336-5).
        wheel_reversal: the same for the wheel.
        required_pitting_safety: smallest S_H.
        required_root_safety: smallest S_F.

    Raises:
        ValueError: the geometry of the teeth is impossible, or there is no torque.
    """
    require(_INCOMPLETE, abs(torque) > 0, pair.module > 0, pair.face_width > 0, pair.pinion_teeth > 0)
    diameter, factors = pair.pitch_diameter(pair.pinion_teeth), application * dynamic * face_load * transverse_load
    force = 2 * abs(torque) / diameter
    zone, sharing, single = contact_factors(pair)
    gear_ratio = pair.wheel_teeth / pair.pinion_teeth
    pressure = force / (diameter * pair.face_width) * (gear_ratio + 1) / gear_ratio * factors
    elastic = sqrt(material.modulus / (2 * math.pi * (1 - material.poisson**2)))
    contact = single * zone * elastic * sharing / sqrt(cos(pair.helix)) * sqrt(pressure)
    endured = material.pitting_limit * flank_life * flank_influence
    pinion, wheel = form_factors(pair)
    nominal = force / (pair.face_width * pair.module) * root_sharing(pair) * factors
    strength = 2 * material.root_limit * root_life * root_influence
    return GearStrength(
        force, pair.working_angle, pair.contact_ratio, zone, sharing, single, contact, endured, endured / contact,
        required_pitting_safety, pinion, wheel, nominal * pinion, nominal * wheel,
        strength * pinion_reversal / (nominal * pinion), strength * wheel_reversal / (nominal * wheel),
        required_root_safety,
    )  # fmt: skip


def contact_factors(pair: GearPair) -> tuple[Ratio, Ratio, Ratio]:
    """Return zone factor Z_H, contact ratio factor Z_eps, and the larger one of Z_B and Z_D (ISO 6336-2)."""
    ratio, overlap = pair.contact_ratio, minimum(pair.overlap_ratio, 1.0)
    zone = sqrt(2 * cos(pair.base_helix) / (cos(pair.transverse_angle) ** 2 * tan(pair.working_angle)))
    sharing = sqrt((4 - ratio) / 3 * (1 - overlap) + overlap / ratio)
    return zone, sharing, single_contact(pair, ratio, overlap)


def root_sharing(pair: GearPair) -> Ratio:
    """Return contact ratio factor times helix factor of the root, Y_eps·Y_beta (DIN 3990-3)."""
    overlap = minimum(pair.overlap_ratio, 1.0)
    shared = 0.25 + 0.75 / pair.contact_ratio * cos(pair.base_helix) ** 2
    return shared * (1 - overlap * minimum(absolute(pair.helix), math.pi / 6) / (2 * math.pi / 3))


def single_contact(pair: GearPair, ratio: Ratio, overlap: Ratio) -> Number:
    """Return the larger one of Z_B and Z_D: contact at the inner points of single contact, not at the pitch point.

    Of internal gears Z_D is 1, and Z_B that of the pinion, whose flank is most curved at its inner point there, too.

    Args:
        pair: geometry.
        ratio: transverse contact ratio.
        overlap: overlap ratio, at most 1; no influence above it.
    """
    tips = pair.used_tips
    steps = 2 * math.pi / pair.pinion_teeth, 2 * math.pi / pair.wheel_teeth
    square = tan(pair.working_angle) ** 2
    inner = (tips[0] - steps[0]) * (tips[1] - (ratio - 1) * steps[1])
    outer = (tips[1] - steps[1]) * (tips[0] - (ratio - 1) * steps[0])
    wheel = where(pair.wheel_teeth < 0, 1.0, sqrt(square / abs(outer)))
    largest = maximum(1.0, sqrt(square / abs(inner)), wheel)
    return largest - overlap * (largest - 1)


def form_factors(pair: GearPair) -> tuple[Ratio, Ratio]:
    """Return Y_Fa·Y_Sa of pinion and wheel."""
    form, correction = tooth_form(pair, pair.pinion_teeth, pair.pinion_shift)
    if not is_symbolic(pair.wheel_teeth) and np.all(np.asarray(pair.wheel_teeth) < 0):
        wheel_form, wheel_correction = internal_form(pair)
        return form * correction, wheel_form * wheel_correction
    wheel_form, wheel_correction = tooth_form(pair, pair.wheel_teeth, pair.wheel_shift)
    return form * correction, wheel_form * wheel_correction
