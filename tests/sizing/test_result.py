"""Results print as tables with units and verdicts; the units agree with those of the framework."""

import dataclasses

import casadi as ca
import numpy as np
import pytest

from components.sizing import (
    ClutchSelection,
    Load,
    bearing_life,
    belt_speed_limit,
    clutch_selection,
    comparison,
    drive_for_clutch,
    flywheel_for_time,
    shaft_diameter,
    shaft_statics,
    speed_limit,
    timing_belt_load,
)
from modelica_like.language import quantities
from modelica_like.language.results import Line, Result
from modelica_like.language.units import parse_unit

COUNTS = ("", "teeth", "1e6 rev")


@pytest.mark.parametrize("name", [name for name in vars(quantities) if hasattr(vars(quantities)[name], "__metadata__")])
def test_units_of_display(name: str) -> None:
    quantity = vars(quantities)[name].__metadata__[0]
    si = parse_unit(quantity.unit)
    assert si.factor == 1.0
    if quantity.shown not in COUNTS:
        shown = parse_unit(quantity.shown)
        assert shown.dimension == si.dimension
        assert shown.factor == pytest.approx(quantity.factor, rel=1e-12)


def test_table() -> None:
    selection = clutch_selection(40.0, 100.0, 0.6, 2.0)
    assert str(selection).splitlines() == [
        "ClutchSelection",
        "  required_torque  0.800059  N.m  required torque by the rule 9550·P/n            above the limit 0.6 N.m by "
        "0.2001 N.m (33.3 %)",
        "  exact_torque          0.8  N.m  required torque K·P/w without the rounded 9550  above the limit 0.6 N.m by "
        "0.2 N.m (33.3 %)",
        "  rated_torque          0.6  N.m  rated torque of the clutch",
    ]


def test_results_are_frozen() -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        clutch_selection(40.0, 100.0, 0.6).rated_torque = 1.0  # type: ignore[misc]


def test_rows_are_a_table_of_their_own() -> None:
    text = str(shaft_statics([Load(0.3, y=-1000.0)], [0.0, 1.0]))
    assert "bearings\n  at [mm]  y [N]  z [N]  radial [N]\n        0    700" in text
    assert "bending [N.mm]" in text


def test_limits_from_outside() -> None:
    life = bearing_life(150.0, 100.0, 2600.0, 1060.0)
    verdicts = {line.name: line.verdict for line in life.lines({"life": (2e7, None), "static_safety": (None, 5.0)})}
    assert verdicts["life"] == "ok"
    assert verdicts["static_safety"] == "above the limit 5 by 2.067 (41.3 %)"


def test_the_worst_of_an_array_counts() -> None:
    made = flywheel_for_time(np.array([0.2, 2.0, 0.3]), 0.6, 139.6, 7850.0, 0.045, width_limit=0.1)
    line = next(line for line in made.lines() if line.name == "width")
    assert line.value.count(",") == 2
    assert line.verdict.startswith("above the limit 100 mm by 70")


def test_nan_is_not_ok() -> None:
    assert ClutchSelection(float("nan"), 0.5, 0.6).lines()[0].exceeded


def test_the_root_of_a_negative_number_is_none() -> None:
    with pytest.raises(ValueError, match=r"^Strength and safety of a shaft are positive\.$"):
        shaft_diameter(1.5, 275e6, -2.0, 6e-3)
    with pytest.raises(
        ValueError,
        match=r"^There is no required torque K·P/w without the rounded 9550: it is the root of a negative number\.$",
    ):
        ClutchSelection(1.0, (-8.0) ** (1 / 3), 0.6)


def test_expressions_have_no_verdict() -> None:
    made = clutch_selection(ca.SX.sym("P"), 100.0, 0.6)
    assert made.lines()[0].verdict == ""
    assert "P" in str(made)


def test_comparison() -> None:
    text = comparison(light=clutch_selection(40.0, 100.0, 0.6), heavy=clutch_selection(80.0, 100.0, 0.6))
    assert text.splitlines()[0].split() == ["light", "heavy"]
    assert text.splitlines()[2].split()[:4] == ["exact_torque", "0.4", "0.8", "N.m"]


def judged(result: Result, name: str, **limits: tuple[float | None, float | None]) -> Line:
    return next(line for line in result.lines(limits) if line.name == name)


def test_a_value_or_a_limit_without_end_hides_no_other() -> None:
    speeds = speed_limit(np.array([200.0, 100.0, 180.0]), np.array([150.0, np.inf, 170.0]))
    assert judged(speeds, "speed").verdict == "above the limit 1432.39 rpm by 477.5 rpm (33.3 %)"
    with np.errstate(divide="ignore"):
        lives = bearing_life(np.array([1e4, 0.0]), 100.0, 2600.0, 1060.0)
    assert judged(lives, "static_safety").verdict.startswith("below the limit 1 by 0.894")
    assert judged(lives, "life", life=(3600.0, None)).exceeded
    assert not judged(speed_limit(100.0, np.inf), "speed").exceeded
    assert judged(speed_limit(np.nan, 100.0), "speed").exceeded


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_limits_hold_in_both_directions(way: float) -> None:
    """A shaft that turns backwards, also behind a reversing gear, is as fast; a belt that brakes has its load too."""
    assert judged(speed_limit(200.0, 150.0, way), "speed").exceeded
    assert judged(speed_limit(way * 200.0, 150.0), "speed").exceeded
    assert judged(speed_limit(200.0, 250.0, way), "speed").verdict == "ok"
    assert speed_limit(200.0, 250.0, way).margin == pytest.approx(1.25)
    assert judged(drive_for_clutch(1.0, 200.0, way, 150.0), "clutch_speed").exceeded
    belt = belt_speed_limit(way * 200.0, 0.1, 150.0, 5.0)
    assert judged(belt, "speed").exceeded
    assert judged(belt, "velocity").exceeded
    assert judged(clutch_selection(way * 1000.0, 100.0, 9.0), "exact_torque").exceeded
    load = timing_belt_load(way * 100.0, 10.0, 5.0, 0.01, 1e-3, power_limit=900.0, pressure_limit=1e6)
    assert judged(load, "power").exceeded
    assert judged(load, "flank_pressure").exceeded


def test_a_bearing_that_turns_backwards_lives_as_long() -> None:
    """L10 = 1e6·(2600/150)³ turns."""
    made = bearing_life(150.0, -100.0, 2600.0, 1060.0, speed_limit=50.0)
    assert made.life == pytest.approx(2 * np.pi * 1e6 * (2600 / 150) ** 3 / 100.0)
    assert judged(made, "speed").exceeded


@pytest.mark.parametrize(("load", "speed"), [(0.0, 100.0), (150.0, 0.0), (0.0, 0.0)])
def test_a_bearing_without_load_or_speed_lasts_for_ever(load: float, speed: float) -> None:
    made = bearing_life(load, speed, 2600.0, 1060.0)
    assert made.life == np.inf
    assert made.static_safety == pytest.approx(1060.0 / 150.0 if load else np.inf)
