"""Document 002, chapter 7: speed control of the bench against its closed forms.

The clutch is closed and friction constant, so the drive is J·dw/dt = k·(U - k·w)/R - 2·M_f - k·i. The reset time of
the controller is the drive's own time constant: a set step is followed as 1 - exp(-t/T), a load step leaves
R·M/k²·T/(Tm - T)·(exp(-t/Tm) - exp(-t/T)).
"""

from math import pi
from pathlib import Path

import numpy as np
import pytest

from modelica_like import simulate
from modelica_like.runs.solution import Solution

NETLIST = Path(__file__).parents[2] / "examples" / "dc_bench_speed_control.toml"
RPM = pi / 30
K, R, FRICTION, ROTOR, PULLEY, DISC = 0.04668892, 0.7943932, 0.04949025, 5.4e-5, 3e-5, 1182.6e-6
J = 2 * ROTOR + (2 * PULLEY + DISC) / 9
OWN, T = J * R / K**2, 0.05
BEHIND = PULLEY + DISC + 9 * ROTOR
SLIPS_BELOW = BEHIND * 200 * RPM / 3 / (0.6 - 3 * FRICTION)


@pytest.fixture(scope="module")
def run() -> Solution:
    return simulate(NETLIST, rtol=1e-10)


def test_set_step(run: Solution) -> None:
    for time in (0.12, 0.15, 0.25, 0.5):
        expected = 3000 * RPM + 200 * RPM * (1 - np.exp(-(time - 0.1) / T))
        assert run.at(time)["motor.w"] == pytest.approx(expected, rel=1e-8)
    assert run.at(0.05)["motor.w"] == pytest.approx(3000 * RPM, rel=1e-10)


def test_load_step(run: Solution) -> None:
    before = 3200 * RPM - 200 * RPM * np.exp(-0.5 / T)
    for time in (0.61, 0.65, 0.8, 1.2):
        t = time - 0.6
        dip = R * 1.5 / K * T / (OWN - T) * (np.exp(-t / OWN) - np.exp(-t / T))
        set_speed = 3200 * RPM - (3200 * RPM - before) * np.exp(-t / T)
        assert run.at(time)["motor.w"] == pytest.approx(set_speed - dip, rel=1e-8)


def test_the_clutch_limits_how_fast_it_can_be(run: Solution) -> None:
    torque = 3 * FRICTION + BEHIND * 200 * RPM / 3 / T
    assert np.max(np.abs(run["clutch.tau"])) == pytest.approx(torque, rel=1e-6)
    assert pytest.approx(0.0263, abs=5e-5) == SLIPS_BELOW
    slips = [np.max(np.abs(simulate(NETLIST, 0.15, parameters={"settling": share * SLIPS_BELOW})["clutch.w_rel"]))
             for share in (1.01, 0.99)]  # fmt: skip
    assert slips[0] == pytest.approx(0, abs=1e-9)
    assert slips[1] > 1e-3


def test_the_page_has_these_numbers(run: Solution) -> None:
    page = (NETLIST.parents[1] / "docs" / "examples" / "dc_bench.md").read_text(encoding="utf-8")
    fine = simulate(NETLIST, rtol=1e-10, points=20_000)
    loaded = fine.time > 0.6
    for value in (
        f"speed 50 ms later / 1/min | {run.at(0.15)['motor.w'] / RPM:.2f} |",
        f"| largest torque of the clutch / N·m | {np.max(np.abs(run['clutch.tau'])):.4f} |",
        f"lowest speed / 1/min | {np.min(fine['motor.w'][loaded]) / RPM:.2f} |",
    ):
        assert value in page
