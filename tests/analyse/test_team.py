"""Searches in processes: the same designs as here, told one by one, and nothing is left of them."""

from __future__ import annotations

import math
import multiprocessing
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from modelica_like import optimize
from modelica_like.analyse.optimize.result import Front, Optimum
from modelica_like.errors import WorkersLost

EXAMPLES = Path(__file__).parents[2] / "examples"
DIRECT = EXAMPLES / "machine_table_direct.toml"
J_W = 200.0 * math.pi * (0.004 + 0.016 + 500.0 * (0.015 / (2.0 * math.pi)) ** 2)
LOAD = 15.0
"""Of document 000: the clutch locks after J W / (M - LOAD)."""
BOTH: dict[str, Any] = {
    "minimize": ["clutch.lock_time", "clutch.capacity"], "free": {"clutch.capacity": [60, 200]}, "points": 6,
}  # fmt: skip


@pytest.fixture(autouse=True)
def always_in_processes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Such short searches are not worth a process."""
    monkeypatch.setattr("modelica_like.analyse.optimize.team._WORTH", 0.0)


def children() -> list[multiprocessing.process.BaseProcess]:
    return multiprocessing.active_children()


def test_a_front_is_the_same_in_processes() -> None:
    designs: list[int] = []
    front = optimize(DIRECT, **BOTH, processes=2, progress=lambda design, most: designs.append(design))
    alone = optimize(DIRECT, **BOTH)
    assert isinstance(front, Front)
    assert isinstance(alone, Front)
    time, torque = front.values.T
    np.testing.assert_allclose(torque, J_W / time + LOAD, rtol=1e-6)
    np.testing.assert_allclose(front.values, alone.values, rtol=1e-7)
    assert designs == [*range(1, len(designs) + 1)]
    assert len(designs) > len(front.points)
    assert children() == []


def test_several_starts_and_what_a_check_reads(tmp_path: Path) -> None:
    """The least capacity that keeps a shaft safe enough; the torque is that of the clutch."""
    (tmp_path / "checks.toml").write_text(
        '[checks.shaft]\nis = "shaft_stress"\nbending = "0 N.m"\ndiameter = "20 mm"\nyield_strength = "275 N/mm2"\n'
        'required_safety = 1\ntorque = { from = "drive.toml", peak = "clutch.tau" }\n'
    )
    netlist = tmp_path / "drive.toml"
    netlist.write_text(DIRECT.read_text().replace("sizing/machine_table.toml", "checks.toml"))
    asked: dict[str, Any] = {
        "minimize": "clutch.lock_time", "free": {"clutch.capacity": [60, 300]}, "subject_to": "shaft.safety >= 2",
        "starts": 3,
    }  # fmt: skip
    best, alone = optimize(netlist, **asked, processes=2), optimize(netlist, **asked)
    assert isinstance(best, Optimum)
    assert isinstance(alone, Optimum)
    (capacity,) = (p.value for p in best.parameters)
    assert capacity == pytest.approx(alone.parameters[0].value, rel=1e-6)
    assert best["clutch.lock_time"] == pytest.approx(J_W / (capacity - LOAD), rel=1e-6)
    assert best["shaft.safety"] == pytest.approx(2.0, rel=1e-5)


def test_an_interrupt_ends_the_processes_and_knows_the_best() -> None:
    def stop(designs: int, most: int) -> None:
        if designs == 4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as caught:
        optimize(DIRECT, **BOTH, processes=2, progress=stop)
    assert caught.value.__notes__[-1].startswith("The best of 4 designs, within all limits: clutch.capacity = ")
    assert children() == []


def test_a_process_that_dies() -> None:
    def kill(designs: int, most: int) -> None:
        for child in children():
            child.kill()

    with pytest.raises(WorkersLost) as caught:
        optimize(DIRECT, **BOTH, processes=2, progress=kill)
    assert str(caught.value) == (
        "Searches were not done: a process of this machine died.\n"
        'If it died at startup: put the work of a script under if __name__ == "__main__":, or set processes=1.'
    )
