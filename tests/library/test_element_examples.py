"""The netlists of examples/elements: each runs, keeps its energy, and gives the numbers of its closed forms."""

from collections.abc import Callable
from functools import lru_cache
from math import acos, atan, cos, exp, log, pi, radians, sin, sqrt
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.linalg import expm
from scipy.special import ellipk

from modelica_like import simulate
from modelica_like.solve.solution import Solution

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "examples" / "elements"
PAGE = ROOT / "docs" / "examples" / "elements.md"
NUMBERS: dict[str, Callable[[Solution], None]] = {}


def numbers(check: Callable[[Solution], None]) -> Callable[[Solution], None]:
    NUMBERS[check.__name__] = check
    return check


@lru_cache
def run_of(name: str) -> Solution:
    return simulate(FOLDER / f"{name}.toml", rtol=1e-9)


def close(value: object) -> object:
    return pytest.approx(value, rel=1e-6, abs=1e-9)


def moment(run: Solution, mode: str, after: str) -> float:
    """Time at which a mode is first entered."""
    return next(event.time for event in run.events if (event.mode, event.after) == (mode, after))


@numbers
def magnetic_clutch(run: Solution) -> None:
    # At rest: half a gap, so two thirds of L_m; behind the open switch a little current flows already.
    shunt = 1 / (1 / 100 + 1e-5)
    L, leak, settled = 0.48 / 1.5, 24e-5 / (1 + 24 / shunt), 24 / (24 + 1e-5 * 1.24)
    leaves = sqrt(2 * 40 * 0.2e-3 / 0.48) * 1.5 - 0.02
    assert moment(run, "coil.stop", "moving") == close(0.1 + L / 24 * log((settled - leak) / (settled - leaves)))
    assert run.at(1.0)["coil.y"] == close(0.5 * (settled + 0.02) ** 2 * 0.48 / 0.2e-3 - 40 - 5)
    # Afterwards both resistances carry the current of the coil, until the spring is as strong as the magnet.
    drops = sqrt(2 * 45 * 0.2e-3 / 0.48) - 0.02
    decay = 1.1 + 0.48 / (24 + shunt) * log((settled - leak) / (drops - leak))
    left = next(event.time for event in run.events if (event.mode, event.before) == ("coil.stop", "driven"))
    assert left == close(decay)
    assert run.final["clutch.wear"] == close(run.final["clutch.W"] * 1e-15 / 20e-4)


@numbers
def wet_clutch(run: Solution) -> None:
    filling = quad(lambda drop: 2e-13 * sqrt(1e5 * (drop + 1e3)) / (4e-3 / 60 * drop), 6e5, 8e5)[0]
    assert moment(run, "piston.stop", "moving") == close(0.1 + filling)
    assert moment(run, "air_piston.stop", "moving") == close(0.1 + 1e-4 * 1e5 / (1e5 * 1e-8 * 7e5))
    assert [run.final["piston.y"], run.final["air_piston.y"]] == pytest.approx([1, 1], rel=1e-5)
    work = 0.5 * 0.8 * 100**2
    assert [run.final["clutch.W"], run.final["air_clutch.W"]] == close([work, work])
    assert run.final["air_clutch.T"] == close(293.15 + work / 600)
    cooling = exp(-40 * 1.5 / 600)
    assert (run.final["clutch.T"] - 333.15) / (run.at(1.0)["clutch.T"] - 333.15) == close(cooling)


@numbers
def couplings(run: Solution) -> None:
    # From 0.2 rad: 0.1 rad is reached at cos(20·t) = 0.025/0.125, then the first stage alone swings through zero.
    passing = 20 * sqrt(0.125**2 - 0.025**2)
    quarter = acos(0.2) / 20 + atan(10 * 0.1 / passing) / 10
    assert run.at(quarter)["flywheel.phi"] == pytest.approx(0, abs=0.2e-6)
    assert run.at(quarter)["flywheel.w"] == close(-sqrt(7))
    assert run.final["rubber.tau"] == close(50 * 0.2 + 4 * (1 - exp(-80 * 0.2 / 4)))
    stages = 10 * 180 / pi * 0.5 + 30 * 180 / pi * (0.5 - radians(20))
    assert run.final["two_masses.flange_b.tau"] == close(stages + 15 * (1 - exp(-300 * 0.5 / 15)))
    assert moment(run, "pin.pin", "broken") == close(0.75)
    # 2·mu·offset/arm of the torque, times |sin| + |cos|, whose integral over 10 rad is that of 6 quarters and a rest.
    rest = 10 - 6 * pi / 2
    assert run.energy()["disc"].lost == close(0.025 * 20 * (6 * 2 + 1 - cos(rest) + sin(rest)))


@numbers
def speed_clutches(run: Solution) -> None:
    sliding = 3 * 0.4 * 0.07 * (0.05 * 0.05 * 300**2 - 100)
    assert run.at(0.2)["wheel.w"] == close(sliding / 0.02 * 0.2)
    assert run.at(0.2)["fan.w"] == close(300 * (1 - exp(-0.04 * 0.2 / 0.01)))


@numbers
def absorbers(run: Solution) -> None:
    # Shaft, absorber ahead of it, their speeds, and the sine with its cosine: a linear system.
    f, c, d = 40 * pi, 0.02 * (40 * pi) ** 2, 2 * 0.1 * 0.02 * 40 * pi
    shaft = np.array([-3000, c, 0, d, 10, 0]) / 0.1
    ahead = np.array([0, -c, 0, -d, 0, 0]) / 0.02 - shaft
    rows = [np.eye(6)[2], np.eye(6)[3], shaft, ahead, f * np.eye(6)[5], -f * np.eye(6)[4]]
    for t in (0.05, 0.2, 0.45):
        angles = (expm(np.array(rows) * t) @ np.eye(6)[5])[:2]
        found = [run.at(t)[name] for name in ("shaft.phi", "absorber.phi_rel")]
        assert found == pytest.approx(list(angles), rel=1e-5, abs=1e-9)
    quarter = ellipk(sin(0.5) ** 2) / (100 * 3)
    assert [run.at(k * quarter)["pendulum.theta"] for k in (1, 2, 3, 4)] == pytest.approx([0, -1, 0, 1], abs=1e-6)


@numbers
def synchroniser(run: Solution) -> None:
    # Cones: 0.35·0.1·F; the blunt chamfers turn with 0.45·0.045·F, the sharp ones with 1.7 times that and more.
    inertia = 0.05 * 200 / 200.05
    # The force rises in 0.1 s to 800 N; the cones take the difference of the speeds, and what brakes the input shaft.
    brake, slope = 2.0 * inertia / 0.05, 0.35 * 0.1 * 800 / 0.1
    lost = 80 + brake / inertia * 0.2
    full = (lost - 0.5 * slope * 0.1**2 / inertia) / ((slope * 0.1 - brake) / inertia)
    together = moment(run, "ring.mode", "stuck")
    assert together == close(0.2 + full)
    assert moment(run, "ring.sleeve", "in") == close(together + 0.02)
    assert run.at(0.59)["input_shaft.w"] == close(run.at(0.59)["car.w"])
    grinding = run.impacts[0]
    assert (grinding.component, grinding.time) == ("sharp", close(0.12))
    slip = 80 - 0.5 * slope * 0.02**2 / inertia
    assert grinding.energy == close(0.5 * inertia * slip**2)


def test_every_netlist_has_numbers_and_a_line_on_the_page() -> None:
    names = {path.stem for path in FOLDER.glob("*.toml")}
    assert names == NUMBERS.keys()
    text = PAGE.read_text(encoding="utf-8")
    assert [name for name in sorted(names) if f"../../examples/elements/{name}.toml" not in text] == []


@pytest.mark.parametrize("name", NUMBERS)
def test_closed_form(name: str) -> None:
    NUMBERS[name](run_of(name))


@pytest.mark.parametrize("name", NUMBERS)
def test_energy_closes(name: str) -> None:
    energy = run_of(name).energy()
    assert energy.throughput > 0
    assert energy.closure < 1e-8
