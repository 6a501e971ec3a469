"""Whether the teeth of two cylindrical gears can be cut, and run together without touching where they should not."""

from __future__ import annotations

import math

from components.sizing.gear_geometry import GearPair, involute, involute_start
from components.sizing.maths import Number, absolute, acos, cos, maximum, minimum, sin, sqrt, tan, where
from modelica_like.language.quantities import Angle, Length, Ratio, Teeth
from modelica_like.language.results import Result, line


class GearTeeth(Result):
    """Undercut, interference, tips and clearances of a pair of gears."""

    contact_ratio: Ratio = line("transverse contact ratio of the flanks that are there", at_least="required_ratio")
    required_ratio: Ratio = line("required contact ratio")
    pinion_shift: Ratio = line("profile shift of the pinion in modules", at_least="least_pinion_shift")
    least_pinion_shift: Ratio = line("that from which on it has no undercut")
    wheel_shift: Ratio = line("profile shift of the wheel in modules", at_least="least_wheel_shift")
    least_wheel_shift: Ratio = line("that from which on it has no undercut; internal teeth have none")
    pinion_contact: Ratio = line("roll angle in rad where the wheel's tip meets it", at_least="pinion_involute")
    pinion_involute: Ratio = line("roll angle in rad where its involute begins: below, its root is hit")
    wheel_contact: Ratio = line("roll angle in rad where the pinion's tip meets it", at_least="wheel_involute")
    wheel_involute: Ratio = line("roll angle in rad where its involute begins")
    pinion_tip: Length = line("tooth thickness of the pinion at its tip", at_least="required_tip")
    wheel_tip: Length = line("tooth thickness of the wheel at its tip", at_least="required_tip")
    required_tip: Length = line("required tooth thickness at the tip")
    pinion_clearance: Length = line("from the pinion's tip to the wheel's root", at_least="required_clearance")
    wheel_clearance: Length = line("from the wheel's tip to the pinion's root", at_least="required_clearance")
    required_clearance: Length = line("required tip clearance")
    tips_pass: bool = line("the tips of an internal pair pass each other outside the path of contact", required=True)


def gear_teeth(
    pair: GearPair, required_ratio: Ratio = 1.1, required_tip: Ratio = 0.2, required_clearance: Ratio = 0.12
) -> GearTeeth:
    """Check the teeth of a pair of gears (DIN 3960; tips of internal pairs: KHK, Gear Technical Reference).

    Without an undercut x >= h - z·sin² a_t/(2·cos b), h the height of the straight flank of the rack. The roll angle of
    the first contact, tan a_w·(1 + z2/z1) - tan a_a2·z2/z1, is not below that of the first involute. The thickness of a
    tip is d_a·((pi/2 + 2·x·tan a_n)/z + inv a_t - inv a_a), with negative z and d_a of internal teeth. The tips of an
    internal pair have room behind the path of contact if theta_1·z1/z2 + inv a_w - inv a_a2 >= theta_2 with the angles
    theta of the crossing of the tip circles. How the pinion is assembled, radially or not, is not checked.

    Args:
        pair: geometry.
        required_ratio: smallest contact ratio.
        required_tip: smallest thickness of a tip in modules; 0.4 for hardened teeth is usual.
        required_clearance: smallest tip clearance in modules.
    """
    pinion, wheel, outside = pair.pinion_teeth, pair.wheel_teeth, maximum(pair.wheel_teeth, 1.0)
    inside = wheel < 0
    tips = pair.tip_over_base(pinion, pair.pinion_shift), pair.tip_over_base(wheel, pair.wheel_shift)
    height = pair.dedendum - pair.root_radius * (1 - sin(pair.pressure_angle))
    least = [height - teeth * sin(pair.transverse_angle) ** 2 / (2 * cos(pair.helix)) for teeth in (pinion, outside)]
    met = pair.meeting(tips[1], wheel, pinion), pair.meeting(tips[0], pinion, wheel)
    begins = involute_start(pair, pinion, pair.pinion_shift), involute_start(pair, outside, pair.wheel_shift)
    radii, distance = _tip_radii(pair), centre_distance(pair)
    roots = [(absolute(radius) - where(teeth < 0, -1, 1) * pair.module * (pair.addendum + pair.dedendum))
             for radius, teeth in zip(radii, (pinion, wheel), strict=True)]  # fmt: skip
    clearances = (
        where(inside, roots[1] - distance - radii[0], distance - radii[0] - roots[1]),
        where(inside, radii[1] - distance - roots[0], distance - radii[1] - roots[0]),
    )
    return GearTeeth(
        pair.contact_ratio, required_ratio, pair.pinion_shift, least[0], pair.wheel_shift,
        where(inside, pair.wheel_shift, least[1]), met[0], begins[0], met[1], where(inside, met[1], begins[1]),
        _tip_thickness(pair, pinion, pair.pinion_shift), _tip_thickness(pair, wheel, pair.wheel_shift),
        required_tip * pair.module, *clearances, required_clearance * pair.module, _tips_pass(pair, radii, distance),
    )  # fmt: skip


def centre_distance(pair: GearPair) -> Length:
    """Return the distance of the axes in m, of internal pairs, too: (z1 + z2)·m/(2·cos b)·cos a_t/cos a_w."""
    pitch = absolute(pair.pitch_diameter(pair.pinion_teeth + pair.wheel_teeth)) / 2
    return pitch * cos(pair.transverse_angle) / cos(pair.working_angle)


def _tip_radii(pair: GearPair) -> tuple[Length, Length]:
    gears = (pair.pinion_teeth, pair.pinion_shift), (pair.wheel_teeth, pair.wheel_shift)
    first, second = (
        absolute(pair.pitch_diameter(teeth) / 2 + pair.module * (pair.addendum + shift)) for teeth, shift in gears
    )
    return first, second


def _tip_thickness(pair: GearPair, teeth: Teeth, shift: Ratio) -> Length:
    angle = acos(1 / sqrt(1 + pair.tip_over_base(teeth, shift) ** 2))
    tip = pair.pitch_diameter(teeth) + 2 * pair.module * (pair.addendum + shift)
    half = (math.pi / 2 + 2 * shift * tan(pair.pressure_angle)) / teeth
    return tip * (half + involute(pair.transverse_angle) - involute(angle))


def _tips_pass(pair: GearPair, radii: tuple[Length, Length], distance: Length) -> bool:
    pinion, ring = radii
    angles: list[Angle] = [acos(1 / sqrt(1 + pair.tip_over_base(*gear) ** 2)) for gear in (
        (pair.pinion_teeth, pair.pinion_shift), (pair.wheel_teeth, pair.wheel_shift))]  # fmt: skip
    first = _turned((ring**2 - pinion**2 - distance**2) / (2 * distance * pinion))
    first = first + involute(angles[0]) - involute(pair.working_angle)
    second = _turned((distance**2 + ring**2 - pinion**2) / (2 * distance * ring))
    room = first * pair.pinion_teeth / absolute(pair.wheel_teeth) + involute(pair.working_angle) - involute(angles[1])
    crossing = ring < pinion + distance
    return where(pair.wheel_teeth < 0, where(crossing, room >= second, True), True)


def _turned(cosine: Number) -> Angle:
    return acos(maximum(minimum(cosine, 1.0), -1.0))
