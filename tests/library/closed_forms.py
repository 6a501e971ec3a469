"""What the numbers of examples have in common: a run per netlist, closed forms that check it."""

from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

import pytest

from modelica_like import simulate
from modelica_like.runs.solution import Solution

ROOT = Path(__file__).parents[2]
Check = Callable[[Solution], None]
CHECKS: dict[str, Check] = {}
"""By folder and name: `components/dogs`."""


def numbers(folder: str) -> Callable[[Check], Check]:
    """Collect a check of the netlist of examples/FOLDER that has the function's name."""

    def keep(check: Check) -> Check:
        CHECKS[f"{folder}/{check.__name__}"] = check
        return check

    return keep


@lru_cache
def run_of(name: str) -> Solution:
    return simulate(ROOT / "examples" / f"{name}.toml", rtol=1e-9)


def close(value: object) -> object:
    return pytest.approx(value, rel=1e-6, abs=1e-9)
