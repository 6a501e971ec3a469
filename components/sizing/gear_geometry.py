"""Geometry of cylindrical gears: contact, undercut, and form of the teeth at their root (DIN 3960, DIN 3990-3)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from components.sizing.maths import (
    Number,
    absolute,
    acos,
    cos,
    hypot,
    is_symbolic,
    maximum,
    minimum,
    require,
    sin,
    sqrt,
    tan,
    where,
)
from modelica_like.language.quantities import Angle, Length, Ratio, Teeth

RACK_ANGLE = math.pi / 9
"""Pressure angle of the standard rack, 20°, in rad."""
_NEWTON_STEPS = 12
_UNDERCUT = "The teeth of a gear end in a point, or have no root: check teeth, profile shift and rack."
_HALVINGS = 50
"""Halvings of an interval below pi/2, to rounding."""


@dataclass(frozen=True)
class GearPair:
    """A pair of cylindrical gears cut by a standard rack, without tip shortening.

    Attributes:
        pinion_teeth: of the smaller gear.
        wheel_teeth: of the larger gear, negative for internal teeth.
        module: normal module in m.
        face_width: common width in m.
        pinion_shift: profile shift of the pinion in modules.
        wheel_shift: of the wheel; of internal teeth with the signs of DIN 3960 (pinion + wheel = 0: no shift in sum).
        helix: helix angle at the pitch circle in rad; its sign, left or right, does not matter.
        pressure_angle: of the rack in rad.
        addendum: of the rack of the gear in modules.
        dedendum: in modules.
        root_radius: of the rack's root in modules.
        internal_root_radius: of the root of internal teeth in modules (GB/T 3480: 0.15).
    """

    pinion_teeth: Teeth
    wheel_teeth: Teeth
    module: Length
    face_width: Length
    pinion_shift: Ratio = 0.0
    wheel_shift: Ratio = 0.0
    helix: Angle = 0.0
    pressure_angle: Angle = RACK_ANGLE
    addendum: Ratio = 1.0
    dedendum: Ratio = 1.25
    root_radius: Ratio = 0.38
    internal_root_radius: Ratio = 0.15

    @property
    def transverse_angle(self) -> Angle:
        """Pressure angle in the transverse plane in rad."""
        return _atan(tan(self.pressure_angle) / cos(self.helix))

    @property
    def working_angle(self) -> Angle:
        """Transverse pressure angle at the working pitch circles in rad.

        inv(alpha_w) = inv(alpha_t) + 2·(x1 + x2)·tan(alpha_n)/(z1 + z2), by Newton's method.
        """
        shift = 2 * (self.pinion_shift + self.wheel_shift) * tan(self.pressure_angle)
        aim = involute(self.transverse_angle) + shift / (self.pinion_teeth + self.wheel_teeth)
        angle = self.transverse_angle
        for _ in range(_NEWTON_STEPS):
            angle = angle - (involute(angle) - aim) / tan(angle) ** 2
        return angle

    @property
    def base_helix(self) -> Angle:
        """Helix angle at the base circle in rad."""
        return _atan(tan(self.helix) * cos(self.transverse_angle))

    def pitch_diameter(self, teeth: Teeth) -> Length:
        """Return the pitch diameter in m, negative for internal teeth."""
        return teeth * self.module / cos(self.helix)

    def tip_over_base(self, teeth: Teeth, shift: Ratio) -> Number:
        """Return sqrt((d_a/d_b)² - 1), the tangent of the pressure angle at the tip circle."""
        pitch = self.pitch_diameter(teeth)
        tip = pitch + 2 * self.module * (self.addendum + shift)
        square = (tip / (pitch * cos(self.transverse_angle))) ** 2 - 1
        require("A tip circle lies inside its base circle.", square > 0)
        return sqrt(square)

    def meeting(self, tangent: Number, teeth: Teeth, mate: Teeth) -> Number:
        """Return the tangent of the pressure angle at which a point of a gear meets its mate.

        Args:
            tangent: of the pressure angle of the point.
            teeth: of the gear.
            mate: teeth of its mate.
        """
        return tan(self.working_angle) * (1 + teeth / mate) - tangent * teeth / mate

    @property
    def used_tips(self) -> tuple[Number, Number]:
        """Tangents of the pressure angles up to which the flanks of pinion and wheel are used.

        A tip is not used where it meets the mate within its undercut, or below its base circle. Internal teeth have
        no undercut.
        """
        pinion, wheel = self.pinion_teeth, self.wheel_teeth
        first, second = self.tip_over_base(pinion, self.pinion_shift), self.tip_over_base(wheel, self.wheel_shift)
        by_pinion = self.meeting(undercut_end(self, pinion, self.pinion_shift), pinion, wheel)
        # The tip of internal teeth is their inner end.
        used = where(wheel < 0, maximum(second, by_pinion), minimum(second, by_pinion))
        outside = maximum(wheel, 1.0)
        by_wheel = self.meeting(undercut_end(self, outside, self.wheel_shift), outside, pinion)
        return where(wheel < 0, first, minimum(first, by_wheel)), used

    @property
    def contact_ratio(self) -> Ratio:
        """Transverse contact ratio: (z1·(tan a_a1 - tan a_w) + z2·(tan a_a2 - tan a_w))/(2·pi) (DIN 3960).

        Only flanks that are there count: an undercut shortens the contact.
        """
        working, (pinion, wheel) = tan(self.working_angle), self.used_tips
        return (self.pinion_teeth * (pinion - working) + self.wheel_teeth * (wheel - working)) / (2 * math.pi)

    @property
    def overlap_ratio(self) -> Ratio:
        """Overlap ratio b·sin(|beta|)/(pi·m)."""
        return self.face_width * sin(absolute(self.helix)) / (math.pi * self.module)


def involute(angle: Angle) -> Number:
    """Return the involute function tan(a) - a of an angle in rad."""
    return tan(angle) - angle


def _atan(tangent: Number) -> Angle:
    return acos(1 / sqrt(1 + tangent**2))


def involute_start(pair: GearPair, teeth: Teeth, shift: Ratio) -> Number:
    """Return the tangent of the pressure angle at which the involute of an external gear begins.

    The straight flank of the rack, whose height is h = dedendum - radius·(1 - sin a), makes it from
    tan a_F = tan a_t - (h - x)/(r·sin a_t·cos a_t) on (DIN 3960). Where that is below the base circle, the rack's
    rounded tip cuts the involute away up to the crossing of its path; helical gears count by their transverse section.

    Args:
        pair: its rack, module and helix.
        teeth: of the gear, not negative.
        shift: its profile shift in modules.
    """
    angle, radius = pair.transverse_angle, teeth / (2 * cos(pair.helix))
    height = pair.dedendum - pair.root_radius * (1 - sin(pair.pressure_angle))
    start = tan(angle) - (height - shift) / (radius * sin(angle) * cos(angle))
    return maximum(start, undercut_end(pair, teeth, shift))


def undercut_end(pair: GearPair, teeth: Teeth, shift: Ratio) -> Number:
    """Return the tangent of the pressure angle at which the undercut of an external gear ends; 0 if it has none.

    The normal of the fillet passes the pitch point at an angle, whose two values are sought by halving: on the base
    circle, and between there and the pressure angle where the fillet crosses the involute.
    """
    angle, radius = pair.transverse_angle, teeth / (2 * cos(pair.helix))
    height = pair.dedendum - pair.root_radius * (1 - sin(pair.pressure_angle))
    undercut = height - shift > radius * sin(angle) ** 2
    if not is_symbolic(undercut) and not np.any(undercut):
        return 0.0 * radius
    depth = maximum(pair.dedendum - pair.root_radius - shift, 1e-9)  # without an undercut it may be negative
    half = (math.pi / 4 - pair.dedendum * tan(pair.pressure_angle)) / cos(pair.helix)
    half = half - (1 - sin(angle)) * pair.root_radius / cos(angle)
    space = (math.pi / 2 - 2 * shift * tan(pair.pressure_angle)) / teeth - involute(angle)

    def over_base(normal: Angle) -> tuple[Number, Number]:
        lever = depth / sin(normal) + pair.root_radius
        across, up = lever * cos(normal), radius - lever * sin(normal)
        turned = acos(up / hypot(across, up)) - (depth / tan(normal) - half) / radius
        return (across**2 + up**2) / (radius * cos(angle)) ** 2 - 1, turned

    def into_flank(normal: Angle) -> Number:
        square, turned = over_base(normal)
        tangent = sqrt(maximum(square, 0.0))
        return turned - space - (tangent - _atan(tangent))

    low, high = angle, math.pi / 2
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        above = over_base(middle)[0] > 0
        low, high = where(above, middle, low), where(above, high, middle)
    end, low = high, angle
    for _ in range(_HALVINGS):
        middle = (low + end) / 2
        outside = into_flank(middle) < 0
        low, end = where(outside, middle, low), where(outside, end, middle)
    return where(undercut, sqrt(maximum(over_base(end)[0], 0.0)), 0.0)


def internal_form(pair: GearPair) -> tuple[Ratio, Ratio]:
    """Return form factor Y_Fa and stress correction factor Y_Sa of internal teeth (DIN 3990-3, GB/T 3480).

    A rack with the tooth depth and the root radius of the ring stands for them, so they do not depend on its teeth:
    2.053 and 2.65 for the depth of 2.25 modules and the radius of 0.15 modules.
    """
    angle, radius = pair.pressure_angle, pair.internal_root_radius
    depth = pair.addendum + pair.dedendum
    chord = math.pi / 4 + (pair.dedendum - radius) * tan(angle) + radius / cos(angle) - radius * math.cos(math.pi / 6)
    arm = depth - (math.pi / 4 + (pair.dedendum - depth) * tan(angle)) * tan(angle) - radius / 2
    slenderness, sharpness = 2 * chord / arm, chord / radius
    correction = (1.2 + 0.13 * slenderness) * sharpness ** (1 / (1.21 + 2.3 / slenderness))
    return 6 * arm / (2 * chord) ** 2, correction


def tooth_form(pair: GearPair, teeth: Teeth, shift: Ratio) -> tuple[Ratio, Ratio]:
    """Return form factor Y_Fa and stress correction factor Y_Sa of a gear, for a load at its tip (DIN 3990-3, C).

    The root section is where its tangents are at 30° to the middle of the tooth.

    Args:
        pair: its geometry.
        teeth: of the gear, not negative.
        shift: its profile shift in modules.

    Raises:
        ValueError: the tooth has no root section.
    """
    angle, dedendum, radius = pair.pressure_angle, pair.dedendum, pair.root_radius
    virtual = teeth / (cos(pair.base_helix) ** 2 * cos(pair.helix))
    half = math.pi / 4 - dedendum * tan(angle) - (1 - sin(angle)) * radius / cos(angle)
    depth = radius - dedendum + shift
    turn = 2 / virtual * (math.pi / 2 - half) - math.pi / 3
    theta = math.pi / 6
    for _ in range(_NEWTON_STEPS):
        theta = theta - (theta - 2 * depth / virtual * tan(theta) + turn) / (
            1 - 2 * depth / (virtual * cos(theta) ** 2)
        )
    chord = virtual * sin(math.pi / 3 - theta) + math.sqrt(3) * (depth / cos(theta) - radius)
    fillet = radius + 2 * depth**2 / (cos(theta) * (virtual * cos(theta) ** 2 - 2 * depth))
    tip = virtual + 2 * (pair.addendum + shift)
    at_tip = acos(virtual * cos(angle) / tip)
    gamma = (math.pi / 2 + 2 * shift * tan(angle)) / virtual + involute(angle) - involute(at_tip)
    direction = at_tip - gamma
    arm = (cos(gamma) - sin(gamma) * tan(direction)) * tip / 2
    arm = arm - (virtual * cos(math.pi / 3 - theta) + depth / cos(theta) - radius) / 2
    require(_UNDERCUT, chord > 0, fillet > 0, gamma > 0, arm > 0)
    form = 6 * arm * cos(direction) / (chord**2 * cos(angle))
    slenderness, sharpness = chord / arm, chord / (2 * fillet)
    return form, (1.2 + 0.13 * slenderness) * sharpness ** (1 / (1.21 + 2.3 / slenderness))
