"""Document 002, equations 37 to 47: bearing life, flywheels, deflection."""

import math
import re
from pathlib import Path

import numpy as np
import pytest

from components.sizing import (
    bearing_life,
    cylinder_inertia,
    deflection,
    flywheel,
    flywheel_for_time,
    midspan_sag,
    round_second_moment,
    speed_limit,
    switching_time,
)

RPM = math.pi / 30
CLUTCH_SPEED = 1333 * RPM
ALUMINIUM, STEEL = 2700.0, 7850.0
PRINTED = bearing_life(150.0, CLUTCH_SPEED, 2600.0, 1060.0)
BUILT = flywheel(0.068, 0.045, ALUMINIUM, 0.6, CLUTCH_SPEED)
HEAVY = flywheel(0.067, 0.045, STEEL, 0.6, CLUTCH_SPEED)
INERTIA = 1182.6e-6


def wheel(time: float, density: float, radius: float = 0.045) -> tuple[float, float]:
    made = flywheel_for_time(time, 0.6, CLUTCH_SPEED, density, radius)
    return made.inertia * 1e6, made.width * 1e3


# value, published, recomputed, deviation in per cent
NUMBERS = {
    "37 S_0": (PRINTED.static_safety, 7, 7.066667, +0.952),
    "37 S_0, 146.8 N": (bearing_life(146.75, CLUTCH_SPEED, 2600.0, 1060.0).static_safety, None, 7.223, None),
    "38 L10": (PRINTED.life_revolutions / 1e6, 5207, 5207.704, +0.014),
    "39 L10h": (PRINTED.life / 3600, 65000, 65112.57, +0.173),
    "39 L10h, 146.75 N": (bearing_life(146.7501, 4000 / 3 * RPM, 2600.0, 1060.0).life / 3600, None, 69517.61, None),
    "39 L10h, F_w only": (bearing_life(124.875, 4000 / 3 * RPM, 2600.0, 1060.0).life / 3600, None, 112824.5, None),
    "T2 J t=0.2": (wheel(0.2, ALUMINIUM)[0], 574, 859.6516, +49.765),
    "T2 J t=1.0": (wheel(1.0, STEEL)[0], 2832, 4298.258, +51.775),
    "T2 b Al 0.2": (wheel(0.2, ALUMINIUM)[1], 33, 49.42979, +49.787),
    "T2 b St 0.2": (wheel(0.2, STEEL)[1], 11, 17.00133, +54.558),
    "T2 b St 1.0": (wheel(1.0, STEEL)[1], 56, 85.00665, +51.798),
    "40 J_ZM": (BUILT.inertia * 1e6, 1183, 1182.613, -0.033),
    "m_ZM": (BUILT.mass, 1.1, 1.168013, +6.183),
    "J from m=1.1": (cylinder_inertia(1.1, 0.045) * 1e6, None, 1113.75, None),
    "m_St": (HEAVY.mass, 3.4, 3.345949, -1.590),
    "47 u_max": (deflection(HEAVY.mass, 0.105, 0.008).sag * 1e6, 11, 11.04376, +0.398),
    "47 u_max l=175": (deflection(HEAVY.mass, 0.175, 0.008).sag * 1e6, None, 51.12853, None),
    "weight": (deflection(HEAVY.mass, 0.105, 0.008).weight, 33, 32.82376, -0.534),
    "t_switch": (switching_time(INERTIA, 1320 * RPM, 0.24), 0.68, 0.6811287, +0.166),
    "t_switch M=.223": (switching_time(INERTIA, 1320 * RPM, 0.2231), 0.68, 0.7327247, +7.754),
    "t_switch M=0.6": (switching_time(INERTIA, 1320 * RPM, 0.6), None, 0.2724515, None),
    "t_switch M=3*.24": (switching_time(INERTIA, 1320 * RPM, 3 * 0.24), None, 0.2270429, None),
}


@pytest.mark.parametrize(("value", "published", "recomputed", "deviation"), NUMBERS.values(), ids=NUMBERS)
def test_number(value: float, published: float | None, recomputed: float, deviation: float | None) -> None:
    assert value == pytest.approx(recomputed, rel=1e-6 if len(str(recomputed)) > 5 else 1e-4)
    if published is not None:
        assert 100 * (value / published - 1) == pytest.approx(deviation, abs=6e-4)


TIMES = np.array([0.2, 0.4, 0.5, 0.8, 1.0, 1.2, 1.5, 1.7, 1.8, 2.0])
PRINTED_INERTIAS = [557, 1113, 1415, 2275, 2832, 3388, 4248, 4804, 5107, 5613]
PRINTED_WIDTHS = [11, 22, 28, 45, 56, 67, 84, 95, 101, 111]


def test_table_2_as_it_should_be() -> None:
    made = flywheel_for_time(TIMES, 0.6, CLUTCH_SPEED, STEEL, 0.045, width_limit=0.105)
    inertias = [859.7, 1719.3, 2149.1, 3438.6, 4298.3, 5157.9, 6447.4, 7307.0, 7736.9, 8596.5]
    assert made.inertia * 1e6 == pytest.approx(inertias, abs=0.05)
    assert made.width[:7] * 1e3 == pytest.approx([17.0, 34.0, 42.5, 68.0, 85.0, 102.0, 127.5], abs=0.05)
    verdict = {line.name: line.verdict for line in made.lines()}["width"]
    assert verdict == "above the limit 105 mm by 65.01 mm (61.9 %)"


def test_table_2_mixes_two_radii() -> None:
    """The printed widths are those of a radius of 50 mm, the printed inertias those of these widths at 45 mm."""
    wide = flywheel_for_time(TIMES, 0.6, CLUTCH_SPEED, STEEL, 0.050)
    assert wide.width * 1e3 == pytest.approx(PRINTED_WIDTHS, abs=0.61)
    narrow = flywheel(np.array(PRINTED_WIDTHS) * 1e-3, 0.045, STEEL, 0.6, CLUTCH_SPEED)
    assert narrow.inertia * 1e6 == pytest.approx(PRINTED_INERTIAS, rel=2e-3)
    assert narrow.switching_time / TIMES == pytest.approx((45 / 50) ** 4, rel=0.02)
    aluminium = flywheel(0.033, 0.045, ALUMINIUM, 0.6, CLUTCH_SPEED)
    assert aluminium.inertia * 1e6 == pytest.approx(574, rel=1e-3)
    assert aluminium.switching_time == pytest.approx(0.134, abs=5e-4)


def test_table_2_of_the_page() -> None:
    """All ten rows of docs/examples/test_bench.md."""
    page = (Path(__file__).parents[2] / "docs" / "examples" / "test_bench.md").read_text(encoding="utf-8")
    table = page.partition("## Table 2")[2].partition("\n## ")[0]
    rows = [line.strip("| ").split("|") for line in re.findall(r"^\| \d.*", table, re.MULTILINE)]
    assert [float(row[0]) for row in rows] == pytest.approx(TIMES)
    for cells, width, inertia in zip(rows, PRINTED_WIDTHS, PRINTED_INERTIAS, strict=True):
        time = float(cells[0])
        assert [float(cells[3]), float(cells[4])] == [width, inertia]
        expected = 0.6 * time / CLUTCH_SPEED
        widths = [2e3 * expected / (math.pi * density * 0.045**4) for density in (ALUMINIUM, STEEL)]
        assert [float(cell) for cell in cells[5:8]] == pytest.approx([1e6 * expected, *widths], abs=0.051)
        actual = math.pi / 2 * STEEL * 0.045**4 * width * 1e-3 * CLUTCH_SPEED / 0.6
        assert float(cells[8]) == pytest.approx(actual, abs=5.1e-4)


def test_flywheel_and_its_inverse() -> None:
    made = flywheel_for_time(0.4, 0.6, CLUTCH_SPEED, STEEL, 0.045)
    back = flywheel(made.width, 0.045, STEEL, 0.6, CLUTCH_SPEED)
    assert (back.inertia, back.mass, back.switching_time) == pytest.approx((made.inertia, made.mass, 0.4))


def test_round_shaft_sags() -> None:
    assert midspan_sag(100.0, 1.0, round_second_moment(0.02), 210e9) == pytest.approx(
        100 / (48 * 210e9 * math.pi * 0.02**4 / 64)
    )


def test_bearing_with_axial_load_and_its_limits() -> None:
    life = bearing_life(
        100.0, CLUTCH_SPEED, 2600.0, 1060.0, 1000 * RPM, axial_load=-50.0, radial_factor=0.56, axial_factor=1.6,
        required_safety=8.0,
    )  # fmt: skip
    assert life.equivalent_load == pytest.approx(136.0)
    verdicts = {line.name: line.verdict for line in life.lines()}
    assert verdicts["static_safety"].startswith("below the limit 8 by 0.2059")
    assert verdicts["speed"] == "above the limit 1000 rpm by 333 rpm (33.3 %)"


def test_speed_of_the_clutch_at_24_v() -> None:
    limit = speed_limit(4550 * RPM, 1500 * RPM, 3.0)
    assert limit.speed / RPM == pytest.approx(1516.667, rel=1e-6)
    assert 100 * (limit.speed / limit.limit - 1) == pytest.approx(1.111, abs=6e-4)
    assert limit.lines()[0].exceeded
