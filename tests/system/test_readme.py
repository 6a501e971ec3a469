"""The drive of the README: both forms run, and give the same."""

import re
import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from calls import called

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
    assert run.energy().power_closure < 1e-8


@pytest.mark.slow
def test_what_follows_follows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """All commands on the drive run, in their order."""
    (tmp_path / "spindle_drive.toml").write_text(block("toml"), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    lines = re.findall(r"^modelica-like (.*spindle_drive.*)$", README, re.MULTILINE)
    assert len(lines) == 8
    for line in lines:
        result = called(shlex.split(line, comments=True))
        assert result.exit_code == 0, f"{line}: {result.stderr}"
    assert (tmp_path / "parts" / "system.toml").exists()


def test_the_netlist_is_the_same_drive(run: Solution) -> None:
    other = simulate(loads(block("toml")))
    assert other.names == run.names
    assert [event.time for event in other.events] == [event.time for event in run.events]
    assert all(np.array_equal(other[name], run[name]) for name in run.names)


def test_the_picture_is_there() -> None:
    for path in re.findall(r"!\[[^\]]*\]\(([^)]+)\)", README):
        assert (Path(__file__).parents[2] / path).is_file()
