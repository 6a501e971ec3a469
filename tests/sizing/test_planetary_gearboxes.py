"""Document 001: every mesh of the Ravigneaux set, its gears and assembly; the Lepelletier gearbox."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from components.sizing import (
    Lepelletier,
    LepelletierGear,
    RavigneauxGear,
    RavigneauxTeeth,
    lepelletier,
    lepelletier_gear,
    ravigneaux_assembly,
    ravigneaux_gear,
)
from components.sizing.ravigneaux_shafts import lossy_ratios

RPM = math.pi / 30
TEETH = RavigneauxTeeth(small_sun=21, large_sun=39, short_planet=13, long_planet=10, ring=60)


def gear(driving: str = "small_sun", brake: str = "large_sun", mesh: float = 0.99) -> RavigneauxGear:
    return ravigneaux_gear(TEETH, 1000 * RPM, 100.0, driving, brake, mesh_efficiency=mesh)


SECOND = gear()
FIRST_MESH, PLANETS, RING, SECOND_MESH = SECOND.meshes

# value, published, recomputed, deviation in per cent
NUMBERS = {
    "i0i": (TEETH.ratios[0], None, 2.857143, None),
    "i0e": (TEETH.ratios[1], None, -1.538462, None),
    "n_C": (SECOND.carrier_speed / RPM, None, 350, None),
    "n_H": (SECOND.ring_speed / RPM, None, 577.5, None),
    "i2": (SECOND.ratio, None, 1.731602, None),
    "n_PiC": (-SECOND.short_planet_speed / RPM, 1050, 1050, 0.0),
    "n_PeC": (SECOND.long_planet_speed / RPM, 1365, 1365, 0.0),
    "T_Hi": (SECOND.inner_ring_torque, -285.7, -285.7143, +0.005),
    "T_Ci": (SECOND.inner_carrier_torque, 185.7, 185.7143, +0.008),
    "T_Ce": (SECOND.outer_carrier_torque, -185.7, -185.7143, +0.008),
    "T_Se": (SECOND.large_sun_torque, 73, 73.16017, +0.219),
    "T_He": (SECOND.outer_ring_torque, 112.7, 112.5541, -0.129),
    "T_H": (SECOND.ring_torque, -173, -173.1602, +0.093),
    "P_in": (SECOND.input_power / 1e3, None, 10.47198, None),
    "P_wi": (SECOND.inner_rolling_power / 1e3, 6.8, 6.806784, +0.100),
    "P_we": (SECOND.outer_rolling_power / 1e3, -2.7, -2.68146, -0.687),
    "SiPi.T1": (FIRST_MESH.torque, 20.6, 20.63492, +0.170),
    "SiPi.P": (FIRST_MESH.power / 1e3, 2.27, 2.268928, -0.047),
    "PiPe.T1": (PLANETS.torque, 15.9, 15.87302, -0.170),
    "PiPe.P": (PLANETS.power / 1e3, 2.27, 2.268928, -0.047),
    "PeH.T1": (RING.torque, 9.6, 9.62001, +0.208),
    "PeH.P": (RING.power / 1e3, 1.37, 1.375108, +0.373),
    "PeH.P_check": (RING.torque * RING.speed / 1e3, 1.37, 1.375108, +0.373),
    "SePe.T1": (SECOND_MESH.torque, 6.2, 6.253006, +0.855),
    "SePe.P": (SECOND_MESH.power / 1e3, 0.9, 0.8938201, -0.687),
}


@pytest.mark.parametrize(("value", "published", "recomputed", "deviation"), NUMBERS.values(), ids=NUMBERS)
def test_number(value: float, published: float | None, recomputed: float, deviation: float | None) -> None:
    assert value == pytest.approx(recomputed, rel=1e-6)
    if published is not None:
        assert 100 * (value / published - 1) == pytest.approx(deviation, abs=6e-4)


def test_speeds_of_the_pinions() -> None:
    assert [mesh.pinion for mesh in SECOND.meshes] == ["short planet", "long planet", "long planet", "long planet"]
    assert [mesh.speed / RPM for mesh in SECOND.meshes] == pytest.approx([1050, 1365, 1365, 1365])
    for mesh in SECOND.meshes:
        assert mesh.power == pytest.approx(mesh.torque * mesh.speed)


def test_shorter_planet_becomes_the_pinion() -> None:
    """The document's rule for a short planet with fewer teeth than the long one."""
    teeth = replace(TEETH, short_planet=8)
    mesh = ravigneaux_gear(teeth, 1000 * RPM, 100.0).meshes[1]
    assert (mesh.pinion, mesh.torque) == ("short planet", pytest.approx(100 / 3 * 8 / 21))
    assert mesh.power == pytest.approx(mesh.torque * mesh.speed)


GEARS = {
    "first": ("small_sun", "carrier", 350, 2.857143),
    "second": ("small_sun", "large_sun", 577.5, 1.731602),
    "third": ("small_sun", "", 1000, 1),
    "overdrive": ("carrier", "large_sun", 1650, 0.6060606),
    "reverse": ("large_sun", "carrier", -650, -1.538462),
}


@pytest.mark.parametrize(("driving", "brake", "output", "ratio"), GEARS.values(), ids=GEARS)
def test_gears_of_the_set(driving: str, brake: str, output: float, ratio: float) -> None:
    made = gear(driving, brake)
    assert (made.ring_speed / RPM, made.ratio) == pytest.approx((output, ratio), rel=1e-6)
    torques = (made.small_sun_torque, made.large_sun_torque, made.carrier_torque, made.ring_torque)
    speeds = (made.small_sun_speed, made.large_sun_speed, made.carrier_speed, made.ring_speed)
    assert sum(torques) == pytest.approx(0, abs=1e-10)
    assert sum(torque * speed for torque, speed in zip(torques, speeds, strict=True)) == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize(
    ("mesh", "first_order", "exact"), [(0.99, 0.98050, 0.98069), (0.985, 0.97075, 0.97119), (0.98, 0.96100, 0.96177)]
)
def test_efficiency(mesh: float, first_order: float, exact: float) -> None:
    made = gear(mesh=mesh)
    assert made.first_order_efficiency == pytest.approx(first_order, abs=5e-6)
    assert made.efficiency == pytest.approx(exact, abs=5e-6)


def test_lost_power() -> None:
    lost = SECOND.input_power * (1 - SECOND.first_order_efficiency)
    assert lost == pytest.approx(204.2, abs=0.05)


def test_direct_gear_does_not_roll() -> None:
    third = gear("small_sun", "")
    assert (third.inner_rolling_power, third.outer_rolling_power) == (0.0, 0.0)
    assert (third.efficiency, third.first_order_efficiency) == (pytest.approx(1), pytest.approx(1))


def test_assembly() -> None:
    fits = ravigneaux_assembly(TEETH)
    assert (fits.outer_step, fits.inner_step) == (33, 13)
    assert (fits.ring_distance, fits.sun_distance, fits.profile_shift) == (25, 24.5, 0.5)
    assert [line.verdict for line in fits.lines() if line.verdict] == ["ok", "ok"]
    does_not = ravigneaux_assembly(replace(TEETH, small_sun=20))
    assert [line.verdict for line in does_not.lines() if line.verdict] == ["ok", "not fulfilled"]


def test_shafts_that_do_not_exist() -> None:
    with pytest.raises(ValueError, match="'sun' is not a shaft of a Ravigneaux set"):
        gear("sun")
    with pytest.raises(ValueError, match="three different shafts"):
        gear("carrier", "carrier")


LEPELLETIER = lepelletier(1000 * RPM, 1.0, -1.917, 2.74, -2.24, 0.99)

# published speed, recomputed, deviation in per cent, ratio, speeds of small sun, large sun and carrier
SPEEDS = {
    "1": (240, 239.8475, -0.064, 4.16932, (657.18, -537.26, 0.00)),
    "2": (427, 427.5642, +0.132, 2.33883, (657.18, 0.00, 295.60)),
    "3": (657, 657.182, +0.028, 1.52165, (657.18, 657.18, 657.18)),
    "4": (874, 874.884, +0.101, 1.14301, (657.18, 1280.26, 1000.00)),
    "5": (1153, 1153.044, +0.004, 0.86727, (1419.34, 657.18, 1000.00)),
    "6": (1446, 1446.429, +0.030, 0.69136, (2223.21, 0.00, 1000.00)),
    "R": (-293, -293.3848, +0.131, -3.40849, (-803.87, 657.18, 0.00)),
}
# torques of small sun, large sun, carrier and ring; rolling powers over input power of both suns and the front set
TORQUES = {
    "1": ((1.5216, 0, 2.6477, -4.1693), (1, 0, 0.3428)),
    "2": ((1.5216, 0.8172, 0, -2.3388), (0.5502, -0.2416, 0.3428)),
    "3": ((0.9900, 0.5317, 0, -1.5216), (0, 0, 0.3428)),
    "4": ((0.4172, 0, 0.7259, -1.1430), (-0.1430, 0, 0.0940)),
    "5": ((0, -0.3872, 1.2544, -0.8673), (0, 0.1327, -0.0872)),
    "6": ((0, -0.3086, 1, -0.6914), (0, 0.3086, 0)),
    "R": ((0, 1.5216, -4.9301, 3.4085), (0, 1, 0.3428)),
}
EXACT = {"1": 0.96368, "2": 0.97695, "3": 0.99318, "6": 0.99377, "R": 0.97341}
FIRST_ORDER = {"1": 0.9631, "2": 0.9766, "3": 0.9931, "4": 0.9938, "5": 0.9956, "6": 0.9938, "R": 0.9731}


def made(name: str, of: Lepelletier = LEPELLETIER) -> LepelletierGear:
    return next(gear for gear in of.gears if gear.gear == name)


@pytest.mark.parametrize("name", SPEEDS)
def test_lepelletier_speeds(name: str) -> None:
    published, recomputed, deviation, ratio, speeds = SPEEDS[name]
    now = made(name)
    assert now.output_speed / RPM == pytest.approx(recomputed, rel=1e-6)
    assert 100 * (now.output_speed / RPM / published - 1) == pytest.approx(deviation, abs=6e-4)
    assert now.ratio == pytest.approx(ratio, abs=5e-6)
    own = (now.small_sun_speed, now.large_sun_speed, now.carrier_speed)
    assert [speed / RPM for speed in own] == pytest.approx(speeds, abs=5e-3)


@pytest.mark.parametrize("name", TORQUES)
def test_lepelletier_torques_and_rolling_powers(name: str) -> None:
    torques, rolling = TORQUES[name]
    now = made(name)
    own = (now.small_sun_torque, now.large_sun_torque, now.carrier_torque, now.output_torque)
    assert own == pytest.approx(torques, abs=5e-5)
    powers = (now.inner_rolling_power, now.outer_rolling_power, now.front_rolling_power)
    assert [power / (1000 * RPM) for power in powers] == pytest.approx(rolling, abs=5e-5)
    assert now.first_order_efficiency == pytest.approx(FIRST_ORDER[name], abs=5e-5)
    if name in EXACT:
        assert now.efficiency == pytest.approx(EXACT[name], abs=5e-6)


def test_lepelletier_front_set_and_steps() -> None:
    assert LEPELLETIER.front_speed / RPM == pytest.approx(657.182, rel=1e-6)
    assert LEPELLETIER.steps == pytest.approx((1.7827, 1.5370, 1.3313, 1.3179, 1.2544), abs=5e-5)


def test_the_real_gearbox() -> None:
    """Tooth counts and ratios of the ZF 6HP26."""
    real = lepelletier(1000 * RPM, 1.0, -71 / 37, 85 / 31, -85 / 38)
    ratios = (4.17083, 2.33973, 1.52113, 1.14279, 0.86718, 0.69106, -3.40252)
    assert [gear.ratio for gear in real.gears] == pytest.approx(ratios, abs=5e-6)
    data_sheet = (4.171, 2.340, 1.521, 1.143, 0.867, 0.691, -3.403)
    assert [gear.ratio for gear in real.gears] == pytest.approx(data_sheet, abs=6e-4)
    assert all(gear.efficiency == pytest.approx(1) for gear in real.gears)


def test_efficiency_agrees_with_the_losses_to_first_order() -> None:
    close = lepelletier(1000 * RPM, 1.0, -1.917, 2.74, -2.24, 1 - 1e-6)
    for gear in close.gears:
        assert gear.efficiency == pytest.approx(gear.first_order_efficiency, abs=1e-10)


def test_gear_that_does_not_exist() -> None:
    with pytest.raises(ValueError, match="There is no gear '7'; there are 1, 2, 3, 4, 5, 6, R"):
        lepelletier_gear("7", 1.0, 1.0, -1.917, 2.74, -2.24)


def test_rolling_powers_that_cancel_but_for_rounding_lose_nothing_at_the_ring() -> None:
    """What the suns send is their own two meshes and one; the ring's mesh passes 1e-14 of it, whose sign is chance."""
    for left in (-1e-14, 1e-14):
        small, large = lossy_ratios(3.0, -2.0, (1.0, -1.0 + left, left), 0.9)
        assert (small, large) == (pytest.approx(3.0 * 0.9**2, rel=1e-12), pytest.approx(-2.0 / 0.9, rel=1e-12))


def test_a_sun_whose_rolling_power_is_rounding_loses_nothing() -> None:
    for left in (-1e-14, 1e-14):
        assert lossy_ratios(3.0, -2.0, (1.0, left, 1.0), 0.9) == pytest.approx((3.0 * 0.9**3, -2.0 * 0.9), rel=1e-12)
        assert lossy_ratios(3.0, -2.0, (left, 1.0, 1.0), 0.9) == pytest.approx((3.0 * 0.9, -2.0 * 0.9**2), rel=1e-12)


MEMBERS = ("small_sun", "large_sun", "carrier", "ring")


def efficiencies(zs: int, zl: int, zr: int, shafts: tuple[str, str, str], mesh: float) -> list[float]:
    """Efficiencies for all directions of power in the three meshes that agree with themselves."""
    driving, brake, output = shafts
    idle = next(member for member in MEMBERS if member not in shafts)
    i1, i2 = zr / zs, -zr / zl
    willis = {"small_sun": (1 - i1, i1), "large_sun": (1 - i2, i2), "carrier": (1.0, 0.0), "ring": (0.0, 1.0)}
    w = np.linalg.solve([willis[driving], willis[brake]], [1.0, 0.0])
    speed = {member: float(np.dot(willis[member], w)) for member in MEMBERS}
    found: list[float] = []
    for one, two, three in itertools.product((1, -1), repeat=3):
        # Two meshes from the small sun to the long planet, one from the large sun; one more to the ring.
        a, b, c = mesh ** (2 * one), mesh**two, mesh**three
        given = [[float(member == which) for member in MEMBERS] for which in (driving, idle)]
        balance = [[1.0] * 4, [i1 * a * c, i2 * b * c, 0.0, 1.0]]
        torque = dict(zip(MEMBERS, np.linalg.solve([*given, *balance], [1.0, 0.0, 0.0, 0.0]), strict=True))
        first, second = (torque[sun] * (speed[sun] - speed["carrier"]) for sun in MEMBERS[:2])
        if all(power * way > -1e-12 for power, way in ((first, one), (second, two), (first * a + second * b, three))):
            found.append(-float(torque[output]) * speed[output])
    return found


@pytest.mark.parametrize("teeth", [(21, 39, 60), (30, 31, 80), (58, 20, 60), (20, 58, 60)])
@pytest.mark.parametrize("mesh", [0.99, 0.97, 0.9])
def test_losses_may_turn_the_direction_of_a_small_rolling_power(teeth: tuple[int, int, int], mesh: float) -> None:
    """The large sun of 58, 20 and 60 teeth takes 2.6 % of the rolling power, and gives some of it with losses."""
    small, large, ring = teeth
    compared = 0
    for shafts in itertools.permutations(MEMBERS, 3):
        only = set(np.round(efficiencies(small, large, ring, shafts, mesh), 12))
        made = ravigneaux_gear(RavigneauxTeeth(small, large, 15, 18, ring), 100.0, 50.0, *shafts, mesh)
        if len(only) == 1:
            assert made.efficiency == pytest.approx(only.pop(), rel=1e-9)
            compared += 1
        else:
            assert np.isnan(made.efficiency) or round(float(made.efficiency), 12) in only
    assert compared > 12


def test_an_efficiency_that_is_none() -> None:
    for mesh in (0.0, 98.0, -0.5):
        with pytest.raises(ValueError, match="The efficiency of a mesh is above 0 and at most 1"):
            ravigneaux_gear(TEETH, 100.0, 100.0, mesh_efficiency=mesh)
        with pytest.raises(ValueError, match="The efficiency of a mesh is above 0 and at most 1"):
            lepelletier(100.0, 1.0, -1.917, 2.74, -2.24, mesh)
