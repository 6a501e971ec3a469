"""The drive of the README: both forms run, and give the same."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from modelica_like import Solution, simulate
from modelica_like.netlist import loads

README = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")


def block(language: str) -> str:
    found = re.search(rf"```{language}\n(.*?)```", README, re.DOTALL)
    assert found is not None
    return found.group(1)


@pytest.fixture(scope="module")
def run() -> Solution:
    names: dict[str, Any] = {"__name__": "readme"}
    exec(compile(block("python"), "README.md", "exec"), names)
    return names["run"]


def test_the_clutch_locks_after_slipping(run: Solution) -> None:
    assert [(event.before, event.after) for event in run.events] == [("backward", "stuck")]
    inertia = 0.02 + 800 * (0.02 / (2 * np.pi)) ** 2
    speed = 1500 * 2 * np.pi / 60
    # The shaft swings a little, so the lock-up is near, not at, the time of the rigid drive.
    assert run.events[0].time == pytest.approx(inertia * speed / 25, rel=0.05)
    assert run.energy().closure < 1e-8


def test_the_netlist_is_the_same_drive(run: Solution) -> None:
    other = simulate(loads(block("toml")))
    assert other.names == run.names
    assert [event.time for event in other.events] == [event.time for event in run.events]
    assert all(np.array_equal(other[name], run[name]) for name in run.names)


def test_the_picture_is_there() -> None:
    for path in re.findall(r"!\[[^\]]*\]\(([^)]+)\)", README):
        assert (Path(__file__).parents[2] / path).is_file()
