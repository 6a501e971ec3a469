"""Load capacity of gears: factors against printed tables, one pair written out by hand, life curves, Miner's rule."""

from dataclasses import replace
from math import acos, cos, inf, pi, radians, sin, sqrt, tan

import numpy as np
import pytest

from components.sizing import (
    HARDENED_FLANK,
    HARDENED_ROOT,
    GearMaterial,
    GearPair,
    LoadStage,
    gear_life,
    gear_strength,
    gear_teeth,
    life_factor,
    tooth_form,
)
from components.sizing.gear_geometry import internal_form, involute_start
from components.sizing.gear_life import damage_per_cycle
from components.sizing.gear_strength import single_contact
from components.sizing.gear_teeth import centre_distance

ALPHA = pi / 9
STEEL = GearMaterial(1500e6, 500e6)
# Teeth, Y_Fa, Y_Sa of standard teeth (20°, c* = 0.25, root radius 0.38): Pu Lianggui, Machine Design, table 10-5.
TABLE = [
    (17, 2.97, 1.52), (18, 2.91, 1.53), (19, 2.85, 1.54), (20, 2.80, 1.55), (21, 2.76, 1.56), (22, 2.72, 1.57),
    (25, 2.62, 1.59), (30, 2.52, 1.625), (40, 2.40, 1.67), (50, 2.32, 1.70), (60, 2.28, 1.73), (70, 2.24, 1.75),
    (80, 2.22, 1.77), (100, 2.18, 1.79), (150, 2.14, 1.83), (200, 2.12, 1.865), (1e6, 2.06, 1.97),
]  # fmt: skip


@pytest.mark.parametrize(("teeth", "form", "correction"), TABLE)
def test_form_of_the_teeth(teeth: float, form: float, correction: float) -> None:
    made = tooth_form(GearPair(teeth, 50, 1e-3, 0.01), teeth, 0.0)
    assert made == (pytest.approx(form, rel=8e-3), pytest.approx(correction, rel=5e-3))


def test_spur_pair_by_hand() -> None:
    """20 and 30 teeth of 4 mm, 40 mm wide, 200 N.m: every step of the standard with numbers of its own."""
    d1, d2, b, force = 80.0, 120.0, 40.0, 2 * 200e3 / 80
    tips, bases = (88.0, 128.0), (80 * cos(ALPHA), 120 * cos(ALPHA))
    path = sum(sqrt(tip**2 - base**2) for tip, base in zip(tips, bases, strict=True)) / 2 - 100 * sin(ALPHA)
    ratio = path / (4 * pi * cos(ALPHA))
    at_tip = [tan(acos(base / tip)) for tip, base in zip(tips, bases, strict=True)]
    inner = tan(ALPHA) / sqrt((at_tip[0] - 2 * pi / 20) * (at_tip[1] - (ratio - 1) * 2 * pi / 30))
    zone = sqrt(2 * cos(ALPHA) / (cos(ALPHA) ** 2 * sin(ALPHA)))
    factors = 1.25 * 1.1 * 1.2
    hertz = inner * zone * 189.81 * sqrt((4 - ratio) / 3) * sqrt(force / (d1 * b) * (1.5 + 1) / 1.5 * factors)
    made = gear_strength(GearPair(20, 30, 4e-3, 0.04), 200.0, STEEL, 1.25, 1.1, 1.2)
    assert (made.zone_factor, d2 / d1) == (pytest.approx(2.495, abs=5e-4), 1.5)
    assert made.contact_ratio == pytest.approx(ratio, rel=1e-12)
    assert made.contact_ratio == pytest.approx(1.605, abs=5e-4)
    assert made.single_contact == pytest.approx(inner, rel=1e-12)
    assert made.contact_stress / 1e6 == pytest.approx(hertz, rel=2e-5)
    root = force / (b * 4) * 2.80 * 1.55 * (0.25 + 0.75 / ratio) * factors
    assert made.pinion_root_stress / 1e6 == pytest.approx(root, rel=3e-3)
    assert made.pitting_safety == pytest.approx(1500 / hertz, rel=2e-5)
    assert made.pinion_root_safety == pytest.approx(1000 / root, rel=3e-3)


def test_worked_example_of_another_program() -> None:
    """19 and 104 teeth of 4 mm, 535.93 N.m after DIN 3990 (test_1 of the Python package din3990, github.com).

    It stops the search for the 30° tangent earlier (Y_Fa differs by 1e-4), and has Z_E = 189.8 sqrt(N)/mm.
    """
    pair = GearPair(19, 104, 4e-3, 48.64e-3, 0.5, 0.15, root_radius=0.25)
    assert np.degrees(pair.working_angle) == pytest.approx(21.531902292465457, rel=1e-9)
    made = gear_strength(pair, 535.9299104114843, STEEL)
    assert made.contact_ratio == pytest.approx(1.5363235945832296, rel=1e-12)
    assert made.zone_factor == pytest.approx(2.3959406670899934, rel=1e-9)
    assert made.contact_ratio_factor == pytest.approx(0.906214912960638, rel=1e-12)
    assert made.single_contact == pytest.approx(1.00554704549864, rel=1e-9)
    assert made.contact_stress / 1e6 == pytest.approx(1.00554704549864 * 875.3827378988153, rel=1e-4)
    assert tooth_form(pair, 19, 0.5) == pytest.approx((2.246336378902072, 1.9147262565947287), rel=2e-4)
    assert tooth_form(pair, 104, 0.15) == pytest.approx((2.1616566798058514, 2.008781657562889), rel=2e-4)
    assert made.pinion_root_stress / 1e6 == pytest.approx(230.15142071941582, rel=1e-4)
    assert made.wheel_root_stress / 1e6 == pytest.approx(232.3547901900354, rel=1e-4)
    # Its safeties with K_A·K_V·K_Hbeta = 1.990; for the root it has a smaller K_Fbeta of its own.
    loaded = gear_strength(pair, 535.9299104114843, STEEL, 1.75, 1.0278576187783273, 1.1064272863295082)
    assert loaded.pitting_safety == pytest.approx(1.2079360526264216, rel=1e-4)
    rooted = gear_strength(
        pair, 535.9299104114843, GearMaterial(1500e6, 430e6), 1.75, 1.0278576187783273, 1.0864854433487987
    )
    assert rooted.pinion_root_safety == pytest.approx(1.9120087306681766, rel=1e-4)


def test_helical_gears() -> None:
    """From an overlap of one on: Z_eps = 1/sqrt(eps), no single contact, Z_beta = 1/sqrt(cos beta)."""
    pair = GearPair(20, 30, 4e-3, 0.08, helix=radians(15))
    made = gear_strength(pair, 200.0, STEEL)
    assert pair.overlap_ratio == pytest.approx(80 * sin(radians(15)) / (4 * pi))
    assert made.single_contact == 1
    transverse = np.arctan(tan(ALPHA) / cos(radians(15)))
    base = np.arctan(tan(radians(15)) * cos(transverse))
    assert made.zone_factor == pytest.approx(sqrt(2 * cos(base) / (cos(transverse) * sin(transverse))))
    d1 = 80 / cos(radians(15))
    hertz = made.zone_factor * 189.81 / sqrt(made.contact_ratio * cos(radians(15)))
    assert made.contact_stress / 1e6 == pytest.approx(
        hertz * sqrt(2 * 200e3 / (d1 * d1 * 80) * 2.5 / 1.5), rel=2e-5
    )  # fmt: skip


def test_profile_shift_moves_the_centres() -> None:
    """Document 001: 39 and 10 teeth at 25 modules instead of 24.5; cos(a_w) = 24.5/25·cos(20°) gives the shifts."""
    working = acos(24.5 / 25 * cos(ALPHA))
    shifts = ((tan(working) - working) - (tan(ALPHA) - ALPHA)) * 49 / (2 * tan(ALPHA))
    pair = GearPair(10, 39, 2e-3, 0.02, 0.5, shifts - 0.5)
    assert pair.working_angle == pytest.approx(working, rel=1e-12)
    assert GearPair(10, -60, 2e-3, 0.02, 0.5, -0.5).working_angle == pytest.approx(ALPHA, rel=1e-12)


def test_internal_gears() -> None:
    """The ring curves the other way: (u + 1)/u = 5/6, and its teeth count as those of a rack.

    Z_B is that of the inner point of single contact of the pinion: the curvatures there over those at the pitch point.
    """
    pair = GearPair(18, -60, 2e-3, 0.02, 0.5, -0.5)
    made = gear_strength(pair, 15.873, STEEL)
    tips, bases = (42.0, 118.0), (36 * cos(ALPHA), 120 * cos(ALPHA))
    path = (sqrt(tips[0] ** 2 - bases[0] ** 2) - sqrt(tips[1] ** 2 - bases[1] ** 2)) / 2 + 42 * sin(ALPHA)
    assert made.contact_ratio == pytest.approx(path / (2 * pi * cos(ALPHA)), rel=1e-12)
    # Radii of curvature 2 of the pinion and of the ring, whose base circles are a·sin(a_w) apart along the line.
    inner = sqrt(tips[0] ** 2 - bases[0] ** 2) / 2 - 2 * pi * cos(ALPHA)
    at_pitch, at_inner = (1 / radius - 1 / (radius + 42 * sin(ALPHA)) for radius in (18 * sin(ALPHA), inner))
    assert made.single_contact == pytest.approx(max(1.0, sqrt(at_inner / at_pitch)), rel=1e-12)
    hertz = 2.4946 * 189.81 * sqrt((4 - made.contact_ratio) / 3) * sqrt(2 * 15873 / 36 / (36 * 20) * 42 / 60)
    assert made.contact_stress / 1e6 == pytest.approx(hertz * made.single_contact, rel=1e-4)
    assert made.wheel_form == pytest.approx(
        2.053 * 2.65, rel=3e-4
    )  # GB/T 3480, of a depth of 2.25 and a radius of 0.15
    assert internal_form(replace(pair, addendum=0.8))[0] < internal_form(pair)[0]


def test_the_inner_point_of_an_internal_pair() -> None:
    """Document 001, long planet and ring: 803 N/mm² at the inner point of single contact, 756 at the pitch point."""
    pair = GearPair(10, -60, 2e-3, 0.02, 0.5, -0.5)
    assert gear_strength(pair, 9.62, STEEL).single_contact == pytest.approx(803 / 755.7, abs=1e-3)


def cut(teeth: int, shift: float, pair: GearPair) -> float:
    """Return tan of the pressure angle where an involute begins, by moving the rack past its points in small steps."""
    radius, tip = teeth / 2, pair.dedendum - shift
    rho = pair.root_radius
    rolls = np.linspace(-3, 3, 20001)
    centre = pi / 4 - pair.dedendum * tan(ALPHA) - (1 - sin(ALPHA)) * rho / cos(ALPHA)

    def survives(tangent: float) -> bool:
        over = radius * cos(ALPHA) * sqrt(1 + tangent**2)
        half = (pi / 2 - 2 * shift * tan(ALPHA)) / teeth - (tan(ALPHA) - ALPHA) + tangent - np.arctan(tangent)
        across, depth = over * np.sin(half + rolls), radius - over * np.cos(half + rolls)
        across = across - radius * rolls  # to the middle of the rack's tooth; depth below the rolling line
        inside = np.abs(across) < pi / 4 - (depth + shift) * tan(ALPHA) - 1e-9
        round_begins = tip - rho * (1 - sin(ALPHA))
        in_round = np.hypot(np.maximum(np.abs(across) - centre, 0), depth - (tip - rho)) < rho - 1e-9
        return not bool(np.any(np.where(depth < round_begins, inside, in_round & (depth < tip))))

    low, high = 0.0, 1.0
    if survives(low):
        return 0.0
    for _ in range(30):
        middle = (low + high) / 2
        low, high = (low, middle) if survives(middle) else (middle, high)
    return high


@pytest.mark.parametrize(("teeth", "shift"), [(7, 0.0), (10, 0.0), (13, 0.0), (8, 0.2)])
def test_an_undercut_takes_the_involute_away(teeth: int, shift: float) -> None:
    pair = GearPair(teeth, 40, 1e-3, 0.01, shift)
    assert involute_start(pair, teeth, shift) == pytest.approx(cut(teeth, shift, pair), abs=2e-4)


def test_an_undercut_shortens_the_contact() -> None:
    """7 and 40 teeth: 1.49 by the tips, 1.04 above the pinion's base circle, less above what the rack cuts away."""
    pair = GearPair(7, 40, 1e-3, 0.01)
    to_base = 7 * pair.tip_over_base(7, 0.0) / (2 * pi)
    assert to_base == pytest.approx(1.04, abs=5e-3)
    assert pair.contact_ratio == pytest.approx(to_base - 7 * cut(7, 0.0, pair) / (2 * pi), abs=5e-4)
    teeth = gear_teeth(pair)
    assert [one.name for one in teeth.lines() if one.exceeded] == ["contact_ratio", "pinion_shift", "pinion_contact"]
    assert gear_teeth(GearPair(18, 40, 1e-3, 0.01)).lines()[2].verdict == "ok"


def test_teeth_of_document_001() -> None:
    """Short and long planet: clearance 0.124 modules, tips of the long planet 0.199 modules."""
    pair = GearPair(10, 13, 2e-3, 0.02, 0.5, 0.3)
    teeth = gear_teeth(pair)
    working = acos(11.5 * cos(ALPHA) / (centre_distance(pair) / 2e-3))
    assert tan(working) - working == pytest.approx(tan(ALPHA) - ALPHA + 1.6 * tan(ALPHA) / 23, rel=1e-9)
    assert teeth.pinion_clearance / 2e-3 == pytest.approx(centre_distance(pair) / 2e-3 - 6.5 - 5.55, rel=1e-9)
    assert teeth.pinion_clearance / 2e-3 == pytest.approx(0.124, abs=5e-4)
    at_tip = acos(10 * cos(ALPHA) / 13)
    thick = 13 * ((pi / 2 + tan(ALPHA)) / 10 + tan(ALPHA) - ALPHA - tan(at_tip) + at_tip)
    assert teeth.pinion_tip / 2e-3 == pytest.approx(thick, rel=1e-9)
    assert teeth.pinion_tip / 2e-3 == pytest.approx(0.20, abs=5e-3)


def test_internal_pairs_with_few_teeth_difference() -> None:
    """KHK, Gear Technical Reference: nine teeth of difference at least for standard teeth; 13.1683 mm."""
    for pinion in (30, 40, 60):
        passes = [bool(gear_teeth(GearPair(pinion, -pinion - more, 1e-3, 0.01)).tips_pass) for more in (7, 8, 9, 10)]
        assert passes == [False, False, True, True]
    shifted = GearPair(16, -24, 3e-3, 0.03, 0.0, -0.5)
    assert centre_distance(shifted) == pytest.approx(13.1683e-3, abs=5e-8)


def test_the_direction_of_the_torque_does_not_matter() -> None:
    pair = GearPair(20, 30, 4e-3, 0.04)
    assert gear_strength(pair, -200.0, STEEL) == gear_strength(pair, 200.0, STEEL)


def test_every_factor_acts_where_it_should() -> None:
    """Load factors raise root stresses in proportion and contact stresses by the root; the others raise strengths."""
    pair = GearPair(20, 30, 4e-3, 0.04)
    plain = gear_strength(pair, 200.0, STEEL)
    for name in ("application", "dynamic", "face_load", "transverse_load"):
        made = gear_strength(pair, 200.0, STEEL, **{name: 1.44})
        assert made.contact_stress == pytest.approx(1.2 * plain.contact_stress)
        assert made.wheel_root_stress == pytest.approx(1.44 * plain.wheel_root_stress)
    for name, line in (
        ("flank_life", "pitting_safety"), ("flank_influence", "pitting_safety"), ("root_life", "wheel_root_safety"),
        ("root_influence", "pinion_root_safety"), ("pinion_reversal", "pinion_root_safety"),
        ("wheel_reversal", "wheel_root_safety"),
    ):  # fmt: skip
        made = gear_strength(pair, 200.0, STEEL, **{name: 0.7})
        assert getattr(made, line) == pytest.approx(0.7 * getattr(plain, line))


def test_teeth_that_cannot_be() -> None:
    with pytest.raises(ValueError, match="end in a point"):
        gear_strength(GearPair(10, 30, 2e-3, 0.02, 1.5), 10.0, STEEL)
    with pytest.raises(ValueError, match="needs a torque"):
        gear_strength(GearPair(20, 30, 2e-3, 0.02), 0.0, STEEL)
    with pytest.raises(ValueError, match="a load and cycles above zero"):
        gear_life(gear_strength(GearPair(20, 30, 2e-3, 0.02), 10.0, STEEL), [LoadStage(-1.0, 1e5)])


def test_life_factors() -> None:
    cycles = np.array([1e2, 1e3, 1e5, 3e6, 5e7, 1e10, 1e11])
    root, flank = (life_factor(cycles, curve) for curve in (HARDENED_ROOT, HARDENED_FLANK))
    assert root[[0, 1, 3, 5, 6]] == pytest.approx([2.5, 2.5, 1.0, 0.85, 0.85])
    assert flank[[0, 2, 4, 5, 6]] == pytest.approx([1.6, 1.6, 1.0, 0.85, 0.85])
    assert HARDENED_ROOT.exponents[0] == pytest.approx(8.738, abs=5e-4)
    assert HARDENED_FLANK.exponents[0] == pytest.approx(13.222, abs=5e-4)
    for curve, factor in ((HARDENED_ROOT, 1.7), (HARDENED_FLANK, 0.9)):
        assert life_factor(1 / damage_per_cycle(factor, curve), curve) == pytest.approx(factor)
    assert [damage_per_cycle(u, HARDENED_ROOT) for u in (0.84, 2.51)] == [0, inf]
    assert damage_per_cycle(2.5, HARDENED_ROOT) == pytest.approx(1e-3)  # the static factor itself


def test_miner() -> None:
    """Root at 1.25 and contact at sqrt(1.44) = 1.2 of what is endured at nominal torque; a part at two thirds."""
    strength = replace(gear_strength(GearPair(20, 30, 4e-3, 0.04), 200.0, STEEL), pitting_safety=1 / 1.2,
                       pinion_root_safety=0.8, wheel_root_safety=1.0)  # fmt: skip
    life = gear_life(strength, [LoadStage(1.0, 1e5), LoadStage(2 / 3, 1e6)], wheel_cycles=0.5)
    p, q = HARDENED_ROOT.exponents[0], HARDENED_FLANK.exponents
    assert life.pinion_root == pytest.approx(1e5 / (3e6 * 1.25**-p))  # 1.25·2/3 < 0.85 does no harm
    assert life.wheel_root == pytest.approx(0.5 * 1e5 / 3e6)
    second = 1e6 / (5e7 * (1.2 * sqrt(2 / 3)) ** -q[1])
    assert 1.2 * sqrt(2 / 3) < 1
    assert life.pitting == pytest.approx(1e5 / (5e7 * 1.2 ** -q[0]) + second)
    assert life.stages[1].pitting == pytest.approx(second)
    assert life.root_application == pytest.approx(((1e5 + 1e6 * (2 / 3) ** p) / 1.1e6) ** (1 / p))
    verdict = {line.name: line.verdict for line in gear_life(strength, [LoadStage(1.0, 1e7)]).lines()}["pinion_root"]
    assert verdict.startswith("above the limit 1")


def test_a_steady_load_amounts_to_itself() -> None:
    strength = gear_strength(GearPair(20, 30, 4e-3, 0.04), 200.0, STEEL)
    life = gear_life(strength, [LoadStage(0.8, 1e5), LoadStage(0.8, 1e6)])
    assert (life.pitting_application, life.root_application) == pytest.approx((0.8, 0.8))


def test_the_inner_point_of_either_gear_may_decide() -> None:
    """Z_B of a pair is Z_D of the pair with its gears exchanged; both are above one here."""
    there, back = (single_contact(GearPair(*teeth, 4e-3, 0.04), 1.6, 0.0) for teeth in ((14, 60), (60, 14)))
    assert there == pytest.approx(back, rel=1e-12)
    assert there > 1.01


def test_a_tip_inside_its_base_circle() -> None:
    """20 teeth of 1 mm: the base circle has 18.79 mm; a shift of -1.7 leaves 18.6 mm."""
    pair = GearPair(20, 30, 1e-3, 0.01)
    assert pair.tip_over_base(20, -1.5) == pytest.approx(sqrt((19 / (20 * cos(ALPHA))) ** 2 - 1))
    with pytest.raises(ValueError, match="A tip circle lies inside its base circle"):
        pair.tip_over_base(20, -1.7)


def test_left_and_right_helix_are_as_strong() -> None:
    left, right = (GearPair(20, 60, 3e-3, 0.03, helix=radians(angle)) for angle in (-17, 17))
    assert left.overlap_ratio == right.overlap_ratio > 0
    assert gear_strength(left, 100.0, STEEL) == gear_strength(right, 100.0, STEEL)
    assert gear_teeth(left) == gear_teeth(right)
