"""Geometry of cylindrical gears: contact, and form of the teeth at their root (DIN 3960, DIN 3990-3)."""

from __future__ import annotations

import math
from dataclasses import dataclass

from components.sizing.maths import Number, acos, cos, require, sin, sqrt, tan
from modelica_like.language.quantities import Angle, Length, Ratio, Teeth

RACK_ANGLE = math.pi / 9
"""Pressure angle of the standard rack, 20°, in rad."""
_NEWTON_STEPS = 12
_UNDERCUT = "The teeth of a gear end in a point, or have no root: check teeth, profile shift and rack."
INTERNAL_FORM, INTERNAL_CORRECTION = 2.053, 2.65
"""Form and stress correction factors of internal teeth, of the rack that stands for them (GB/T 3480, DIN 3990-3)."""


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
        helix: helix angle at the pitch circle in rad.
        pressure_angle: of the rack in rad.
        addendum: of the rack of the gear in modules.
        dedendum: in modules.
        root_radius: of the rack's root in modules.
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

    @property
    def contact_ratio(self) -> Ratio:
        """Transverse contact ratio: (z1·(tan a_a1 - tan a_w) + z2·(tan a_a2 - tan a_w))/(2·pi) (DIN 3960)."""
        working = tan(self.working_angle)
        tips = (
            teeth * (self.tip_over_base(teeth, shift) - working)
            for teeth, shift in ((self.pinion_teeth, self.pinion_shift), (self.wheel_teeth, self.wheel_shift))
        )
        return sum(tips) / (2 * math.pi)

    @property
    def overlap_ratio(self) -> Ratio:
        """Overlap ratio b·sin(beta)/(pi·m)."""
        return self.face_width * sin(self.helix) / (math.pi * self.module)


def involute(angle: Angle) -> Number:
    """Return the involute function tan(a) - a of an angle in rad."""
    return tan(angle) - angle


def _atan(tangent: Number) -> Angle:
    return acos(1 / sqrt(1 + tangent**2))


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
