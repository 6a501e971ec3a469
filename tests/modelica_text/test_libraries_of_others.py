"""Own texts in the style of public libraries of drives: read without the standard library, against closed forms.

What such libraries use: names of version 3.2, partial architectures with replaceable parts, records of data, an `inner`
world or settings, parts that parameters leave out, tables in files, own units, state machines of friction.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from modelica_like import load, simulate
from modelica_like.netlist.modelica.read import read_modelica
from modelica_like.show.report.plausible import drive_notes

OTHERS = Path(__file__).parent / "others"
CLOSE = 1e-7  # ten times the tolerance of the runs


def run(name: str, until: float = 2.0) -> Any:
    drive = load(f"{OTHERS / name.partition('.')[0]}.mo:{name}")
    return simulate(drive, until, rtol=1e-9, atol=1e-11)


def apart(time: Any, *jumps: float) -> Any:
    return np.min([abs(time - jump) for jump in jumps], axis=0) > 1e-6


def test_resistance_of_a_vehicle() -> None:
    result = run("Roads.Test")
    assert result["car.v"] == pytest.approx(30 - 0.1 * 9.80665 * result.time, rel=CLOSE)


def test_a_limit_of_torque_by_an_algorithm() -> None:
    result = run("Maps.Test", 6.0)
    w, sure = 10 * result.time, apart(result.time, 2, 4, 5)
    regions = [w < 20, w < 40, w < 50]
    high = np.select(regions, [50 + 0 * w, 1000 / np.maximum(w, 1), 25 * (1 - (w - 40) / 10)], 0)
    assert result["limit.high"][sure] == pytest.approx(high[sure], abs=1e-9)
    assert result["limit.low"][sure] == pytest.approx(-high[sure], abs=1e-9)
    assert result["limit.region"][sure] == pytest.approx(np.select(regions, [0, 1, 2], 3)[sure])


def test_an_efficiency_of_a_map_that_is_given_or_in_a_file() -> None:
    assert run("Efficiencies.Test").final["a.elePow"] == pytest.approx(0.25 / 0.65)  # bilinear, in the middle
    speed = 0.5 * 60 / (2 * np.pi) / 10
    assert run("Efficiencies.OnFile").final["a.elePow"] == pytest.approx(0.25 / (0.7 + 0.1 * speed))


def test_a_driver_follows_a_cycle_of_a_file() -> None:
    result = run("Drivers.Test", 5.0)
    assert result["car.v"] == pytest.approx(10 * (1 - np.exp(-result.time / 2)), abs=1e-7)


def test_a_battery_of_cells() -> None:
    result = run("Batteries.Test", 360.0)
    e = 35 - 20 * result.time / 7200
    assert result["pack.uBat"] == pytest.approx(e - 20 * 0.01, rel=CLOSE)
    assert result["pack.SOC"] == pytest.approx(e / 10 - 3, rel=CLOSE)
    assert result["pack.outPow.y"] == pytest.approx(20 * (e - 0.2), rel=CLOSE)


def test_a_spring_is_chosen_by_an_enumeration() -> None:
    for name, frequency in (("Test", 2), ("Other", 3)):
        result = run(f"Basic.{name}")
        assert result["J.phi"] == pytest.approx(0.1 * np.cos(frequency * result.time), abs=1e-7)


@pytest.mark.parametrize("name", ["Test", "WithoutWorld"])
def test_a_body_in_a_plane(name: str) -> None:
    result = run(f"Planar.{name}")
    t = result.time
    assert result["body.r[1]"] == pytest.approx(2 * t, abs=1e-8)
    assert result["body.r[2]"] == pytest.approx(3 * t - 9.81 * t**2 / 2, abs=1e-7)
    assert result["body.phi"] == pytest.approx(t, abs=1e-8)


def test_a_missing_inner_part_is_told() -> None:
    notes = [drive_notes(load(f"{OTHERS / 'Planar.mo'}:Planar.{name}")) for name in ("Test", "WithoutWorld")]
    told = "There is no inner planarWorld: a PlanarWorld with its own values is taken."
    assert [told in note for note in notes] == [False, True]
    assert told in read_modelica(OTHERS / "Planar.mo", "Planar.WithoutWorld")[1]


def test_a_pendulum_of_matrices() -> None:
    result = run("Planar.Pendulum")
    # Small motions: the third power of 0.005 is left out.
    assert result["pivot.phi"] == pytest.approx(0.005 * np.sin(2 * result.time), abs=1e-7)


def test_cars_of_one_architecture() -> None:
    result = run("Cars.SmallCar")
    assert result["chassis.body.v"] == pytest.approx(40 * (1 - np.exp(-10 * result.time / 520)), abs=1e-7)
    result = run("Cars.LargeCar")
    mass = 800 + 0.2 * 4**2 / 0.3**2
    assert result["chassis.body.v"] == pytest.approx(90 * (1 - np.exp(-10 * result.time / mass)), abs=1e-7)
    assert result.final["P"] == pytest.approx(150 * 2 * 100)


def test_names_of_version_3() -> None:
    result = run("Old.Motor")
    t, pi = result.time, np.pi
    # 2·dw/dt = 2·i, and i = (3·sin(pi·t) - 2·w)/4
    settled = 0.75 * (0.5 * np.sin(pi * t) - pi * np.cos(pi * t)) / (0.25 + pi**2)
    start = 2 * pi + 0.75 * pi / (0.25 + pi**2)
    assert result["J.w"] == pytest.approx(start * np.exp(-t / 2) + settled, abs=1e-6)
    sine = 2 * np.sin(pi * t)
    limited = np.clip(sine, -1, 1)
    assert result["table.y[1]"] == pytest.approx(2 * limited, abs=1e-6)
    assert result["sum.y"] == pytest.approx(sine + 3 * limited, abs=1e-6)
    assert result["body.T"] == pytest.approx(293.15 + 6.85 * np.exp(-t / 2), rel=CLOSE)
    assert [result.final[name] for name in ("w", "w2", "mu")] == pytest.approx([10 * pi, 20 * pi, pi])


def test_blocks_that_no_component_stands_for() -> None:
    result = run("Signals.Test")
    t = result.time
    late = apart(t, 1)
    assert result["c.y"][late] == pytest.approx(np.where(t < 1, 0, np.minimum(2 + 4 * t, 10))[late], abs=1e-7)
    profile, number = 10 * np.minimum(t, 1), np.where(t < 0.5, 0, 3)
    sure = apart(t, 0.15, 0.5, 1)
    assert result["multi.y"][sure] == pytest.approx((number + 2 * profile)[sure], abs=1e-8)
    assert result["pass.y"][sure] == pytest.approx(np.maximum(number, profile)[sure], abs=1e-8)
    assert result["hysteresis.y"][sure] == pytest.approx(np.where(t < 0.15, 0, 1)[sure])


def test_a_table_with_functions_of_a_library() -> None:
    result = run("Lookup.Test", 1.5)
    t = result.time
    assert result["t.y"] == pytest.approx(np.interp(t, [0, 1, 2], [0, 3, 4]), abs=1e-8)
    assert result["s.y"][t**2 < 2] == pytest.approx(np.interp(t**2, [0, 1, 2], [0, 3, 4])[t**2 < 2], abs=1e-6)


def test_friction_by_a_state_machine() -> None:
    result = run("Friction.Test", 4.0)
    t = result.time
    speed = np.select([t < 1.5, t < 3], [3 - 2 * t, 0 * t], 3 * (t - 3))
    assert result["J.w"] == pytest.approx(speed, abs=1e-6)
