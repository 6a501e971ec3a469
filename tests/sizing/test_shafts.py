"""Document 002, section 5.4: bearing reactions, section forces, stresses and safety; other shafts in closed form."""

import math

import numpy as np
import pytest

from components.sizing import (
    SHOULDER_IN_BENDING,
    SHOULDER_IN_TORSION,
    Load,
    Section,
    bearing_reactions,
    shaft_diameter,
    shaft_statics,
    shaft_stress,
    stepped_shaft,
    stress_concentration,
)

YIELD = 275e6
TORQUE = 0.60625
ONE = shaft_statics([Load(0.0, -40.5, -25.0, TORQUE), Load(0.060, torque=-TORQUE)], [0.025, 0.037], at=[0.022])
TWO = shaft_statics([Load(0.035, -25.0, 40.5)], [0.0, 0.175])
A1, A2 = ONE.reactions
B, C = TWO.reactions
PLAIN = bearing_reactions([Load(0.0, 40.5)], [0.025, 0.037])
SHOULDER = next(cut for cut in ONE.diagram if cut.at == 0.022)
AT_A1 = next(cut for cut in ONE.diagram if cut.at == 0.025)
NOTCH = stress_concentration(8e-3, 6e-3, 2e-3, SHOULDER_IN_BENDING)
TWIST = stress_concentration(8e-3, 6e-3, 2e-3, SHOULDER_IN_TORSION)
AT_NOTCH = shaft_stress(SHOULDER.bending, TORQUE, 6e-3, YIELD, 1.25, 1.14)
AT_LOAD = shaft_stress(TWO.largest_bending, TORQUE, 8e-3, YIELD)

# value, published, recomputed, deviation in per cent
NUMBERS = {
    "F_A1y": (A1.y, 124.9, 124.875, -0.020),
    "F_A1z": (A1.z, 77.1, 77.08333, -0.022),
    "F_A2y": (-A2.y, 84.4, 84.375, -0.030),
    "F_A2z": (-A2.z, 52.1, 52.08333, -0.032),
    "F_A1rad": (A1.radial, 146.8, 146.7501, -0.034),
    "F_A2rad": (A2.radial, 99.2, 99.15551, -0.045),
    "F_A1rad, F_w only": (PLAIN[0].radial, None, 124.875, None),
    "M_x1": (SHOULDER.torque * 1e3, 606.25, 606.25, 0.0),
    "M_y1": (AT_A1.bending_z * 1e3, -625.25, -625.0, -0.040),
    "M_z1": (AT_A1.bending_y * 1e3, -1012.5, -1012.5, 0.0),
    "F_By": (B.y, 20, 20, 0.0),
    "F_Bz": (-B.z, 32.4, 32.4, 0.0),
    "F_Cy": (C.y, 5, 5, 0.0),
    "F_Cz": (-C.z, 8.1, 8.1, 0.0),
    "M_max II y": (abs(TWO.diagram[2].bending_z) * 1e3, 1134, 1134, 0.0),
    "M_max II z": (abs(TWO.diagram[2].bending_y) * 1e3, 700, 700, 0.0),
    "29 mixed": (math.hypot(TWO.diagram[2].bending_z, AT_A1.bending_y) * 1e3, 1520.2, 1520.234, +0.002),
    "29 shaft I": (ONE.largest_bending * 1e3, None, 1189.866, None),
    "29 shaft II": (TWO.largest_bending * 1e3, 1333, 1332.65, -0.026),
    "30 sigma_zul": (shaft_diameter(1.5202, YIELD, 2.5, 6e-3).allowable_stress / 1e6, 110, 110, 0.0),
    "31 d_min": (shaft_diameter(math.hypot(1.134, 1.0125), YIELD, 2.5, 6e-3).smallest_diameter * 1e3, 5.2, 5.202028,
                 +0.039),
    "31 d_min, one shaft": (shaft_diameter(TWO.largest_bending, YIELD, 2.5, 6e-3).smallest_diameter * 1e3, None,
                            4.978607, None),
    "M_bK": (SHOULDER.bending * 1e3, 1047, 1047.082, +0.008),
    "32 sigma_b": (AT_NOTCH.bending_stress / 1e6, 49.4, 49.37727, -0.046),
    "33 tau_t": (AT_NOTCH.torsional_stress / 1e6, 14.3, 14.29447, -0.039),
    "34 alpha_b": (NOTCH, 1.25, 1.248266, -0.139),
    "34 alpha_t": (TWIST, 1.14, 1.139823, -0.016),
    "sigma_bmax": (AT_NOTCH.largest_bending / 1e6, 61.8, 61.72159, -0.127),
    "tau_max": (AT_NOTCH.largest_torsion / 1e6, 16.3, 16.2957, -0.026),
    "35 sigma_V": (AT_NOTCH.equivalent_stress / 1e6, 67.9, 67.86902, -0.046),
    "36 S_F": (AT_NOTCH.safety, 4, 4.051922, +1.298),
    "II sigma_b": (AT_LOAD.bending_stress / 1e6, 26.5, 26.51223, +0.046),
    "II tau": (AT_LOAD.torsional_stress / 1e6, 6, 6.03048, +0.508),
    "II sigma_V": (AT_LOAD.equivalent_stress / 1e6, 28.5, 28.49559, -0.015),
    "II S_F": (AT_LOAD.safety, 9.5, 9.650618, +1.585),
}  # fmt: skip


@pytest.mark.parametrize(("value", "published", "recomputed", "deviation"), NUMBERS.values(), ids=NUMBERS)
def test_number(value: float, published: float | None, recomputed: float, deviation: float | None) -> None:
    assert value == pytest.approx(recomputed, rel=1e-6)
    if published is not None:
        assert 100 * (value / published - 1) == pytest.approx(deviation, abs=6e-4)


def test_the_fillet_that_is_not_printed_is_2_mm() -> None:
    """Both stress concentrations of the document lead to it."""
    radii = np.linspace(1.5e-3, 2.5e-3, 10001)
    for published, radius, coefficients in (
        (1.25, 1.988e-3, SHOULDER_IN_BENDING),
        (1.14, 1.997e-3, SHOULDER_IN_TORSION),
    ):
        factors = stress_concentration(8e-3, 6e-3, radii, coefficients)
        assert radii[np.argmin(abs(factors - published))] == pytest.approx(radius, abs=1e-6)


def test_the_eight_equations_of_the_document() -> None:
    """The printed matrix with its garbled rows put right gives the printed forces."""
    rows = np.zeros((8, 8))
    rows[0, [0, 2]], rows[1, [1, 3]], rows[2, 3], rows[3, 2] = (1, -1), (1, -1), -12, -12
    rows[4, [4, 6]], rows[5, [5, 7]], rows[6, 7], rows[7, 6] = (1, 1), (-1, -1), 175, 175
    forces = np.linalg.solve(rows, [40.5, 25, -625, -1012.5, 25, -40.5, 1417.5, 875])
    assert forces == pytest.approx([A1.y, A1.z, -A2.y, -A2.z, B.y, -B.z, C.y, -C.z])


def test_stepped_shaft_finds_the_notch() -> None:
    shaft = stepped_shaft(
        [Load(0.0, -40.5, -25.0, TORQUE), Load(0.060, torque=-TORQUE)], [0.025, 0.037],
        [Section(0.022, 6e-3, 2e-3), Section(0.060, 8e-3)], YIELD, required_safety=4.5,
    )  # fmt: skip
    assert shaft.place == pytest.approx(0.022)
    assert shaft.safety == pytest.approx(shaft_stress(SHOULDER.bending, TORQUE, 6e-3, YIELD, NOTCH, TWIST).safety)
    verdict = {line.name: line.verdict for line in shaft.lines()}["safety"]
    assert verdict == "below the limit 4.5 by 0.4433 (9.85 %)"


def test_point_load_between_bearings_and_on_an_overhang() -> None:
    middle = shaft_statics([Load(0.3, y=-1000.0)], [0.0, 1.0])
    assert [reaction.y for reaction in middle.reactions] == pytest.approx([700.0, 300.0])
    assert middle.largest_bending == pytest.approx(1000 * 0.3 * 0.7)
    overhang = shaft_statics([Load(1.2, z=100.0)], [0.0, 1.0])
    assert [reaction.z for reaction in overhang.reactions] == pytest.approx([20.0, -120.0])
    assert (overhang.largest_bending, overhang.place) == pytest.approx((20.0, 1.0))


def test_couple_of_an_axial_force() -> None:
    """A couple jumps the moment; the bearings answer with a couple of their own."""
    statics = shaft_statics([Load(0.4, bend_y=50.0)], [0.0, 1.0])
    assert [reaction.y for reaction in statics.reactions] == pytest.approx([-50.0, 50.0])
    left, right = (cut.bending_y for cut in statics.diagram if cut.at == 0.4)
    assert (left, right) == pytest.approx((-20.0, 30.0))
    assert statics.largest_bending == pytest.approx(30.0)
    at_end = shaft_statics([Load(0.0, bend_y=50.0)], [0.0, 1.0])
    assert (at_end.largest_bending, at_end.place) == (pytest.approx(50.0), 0.0)
    assert statics.diagram[-1].bending_y == pytest.approx(0.0, abs=1e-12)


def test_three_bearings_and_a_hinge() -> None:
    """The right part is a beam on hinge and bearing, the left one carries the hinge force on its overhang."""
    statics = shaft_statics([Load(1.75, y=-100.0)], [0.0, 1.0, 2.0], hinges=[1.5])
    assert [reaction.y for reaction in statics.reactions] == pytest.approx([-25.0, 75.0, 50.0])
    assert next(cut for cut in statics.diagram if cut.at == 1.5).bending == pytest.approx(0.0, abs=1e-12)


def test_many_loads_against_integration() -> None:
    """Random loads: forces and moments in equilibrium, and the moment is the integral of the shear force."""
    random = np.random.default_rng(7)
    loads = [Load(*row) for row in np.c_[random.uniform(0, 2, 20), random.normal(0, 100, (20, 3))]]
    statics = shaft_statics(loads, [0.3, 1.7])
    for plane in ("y", "z"):
        moment = 0.0
        for before, after in zip(statics.diagram[1::2], statics.diagram[2::2], strict=False):
            moment += getattr(before, f"shear_{plane}") * (after.at - before.at)
            assert getattr(after, f"bending_{plane}") == pytest.approx(moment, abs=1e-9)
        assert getattr(statics.diagram[-1], f"shear_{plane}") == pytest.approx(0.0, abs=1e-9)
        assert moment == pytest.approx(0.0, abs=1e-9)
    assert statics.diagram[-1].torque == pytest.approx(statics.unbalanced_torque)


@pytest.mark.parametrize(
    ("bearings", "hinges", "message"),
    [
        ([0.0, 0.5, 1.0], [], "with 0 hinges is statically determinate with 2 bearings, not with 3"),
        ([0.0], [], "not with 1"),
        ([0.5, 0.5], [], "can move without deforming"),
        ([0.0, 0.2, 0.4], [1.0], "can move without deforming"),
    ],
)
def test_not_statically_determinate(bearings: list[float], hinges: list[float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        bearing_reactions([Load(0.1, y=1.0)], bearings, hinges)


def test_no_shoulder() -> None:
    with pytest.raises(ValueError, match="two diameters that differ"):
        stress_concentration(8e-3, 8e-3, 2e-3, SHOULDER_IN_BENDING)


def test_load_beyond_the_end() -> None:
    with pytest.raises(ValueError, match="beyond the last section"):
        stepped_shaft([Load(0.2, y=1.0)], [0.0, 0.1], [Section(0.15, 0.01)], YIELD)


def test_an_axial_force_pulls_at_the_whole_section() -> None:
    """1 kN at 4 mm: F/A = 79.577 MPa, without a factor of the notch."""
    made = shaft_stress(0.0, 0.0, 4e-3, YIELD, bending_factor=2.0, axial_force=-1000.0)
    assert made.equivalent_stress == pytest.approx(1000.0 / (math.pi * 4e-6), rel=1e-12)
