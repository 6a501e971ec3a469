"""The netlists of examples/elements: each runs, keeps its energy, and gives the numbers of its closed forms."""

from collections.abc import Callable
from functools import lru_cache
from math import exp, log, sqrt
from pathlib import Path

import pytest
from scipy.integrate import quad

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
