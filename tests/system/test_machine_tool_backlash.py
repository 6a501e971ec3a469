"""Document 003 with play in the gears: the swing after the lock-up crosses it, as hand-written equations say."""

from math import radians
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from modelica_like import Solution, simulate

NETLIST = Path(__file__).parents[2] / "examples" / "machine_tool_backlash.toml"
J1, J23, J4 = 1.61, 0.57 + 0.05, 1.02
h0, h1, h2, k0, k1, k2, motor_speed = 156.0, 10.0, 2.5, 16400.0, 6120.0, 14300.0, 32.417
PLAY = radians(0.5)


def shaft2(twist: float, slip: float) -> float:
    """Return the torque on the machine: flanks that never pull, whose damper is limited to the spring."""
    side = np.sign(twist)
    spring = k2 * max(abs(twist) - PLAY / 2, 0.0)
    return side * (spring + min(max(h2 * slip * side, -spring), spring))


def rates(_: float, y: Any) -> list[float]:
    """Return the slopes of th0, w1, th1, w2 = w3, th2, w4 while the clutch holds."""
    th0, w1, th1, w, th2, w4 = y
    T0, T1, T2 = k0 * th0, k1 * th1 + h1 * (w1 - w), shaft2(th2, w - w4)
    load_torque = 9 + 0.1 * w4 ** (2 / 3)
    return [motor_speed - T0 / h0 - w1, (T0 - T1) / J1, w1 - w, (T1 - T2) / J23, w - w4, (T2 - load_torque) / J4]


@pytest.fixture(scope="module")
def run() -> Solution:
    return simulate(NETLIST, "1 s", rtol=1e-10, points=20_000)


@pytest.mark.slow
def test_swing_through_the_play(run: Solution) -> None:
    """From a moment after the lock-up, before the flanks part for the first time."""
    at = run.at(0.28)
    names = ("shaft0.phi_rel", "J1.w", "shaft1.phi_rel", "J2.w", "shaft2.phi_rel", "J4.w")
    start = [-at[name] if "phi" in name else at[name] for name in names]
    later = solve_ivp(rates, (0.28, 0.6), start, "DOP853", rtol=1e-9, atol=1e-11, max_step=2e-5, dense_output=True)
    for time in (0.3, 0.309, 0.32, 0.35, 0.4, 0.5, 0.6):
        expected = later.sol(time)
        now = run.at(time)
        assert [now["J1.w"], now["J2.w"], now["J4.w"]] == pytest.approx(expected[[1, 3, 5]], rel=2e-6)
        assert -now["shaft2.phi_rel"] == pytest.approx(expected[4], abs=2e-8)


def test_largest_torques_are_those_without_play(run: Solution) -> None:
    """Residual torque keeps the flanks together until the machine moves; the largest torques come before they part."""
    assert [-np.min(run[f"{name}.tau"]) for name in ("shaft1", "shaft2", "clutch")] == pytest.approx(
        [494.85, 552.81, 604.89], rel=1e-4
    )
    parted = next(event.time for event in run.events if event.mode == "shaft2.contact")
    assert parted > run.time[np.argmin(run["shaft2.tau"])]


def test_releasing_parts_no_flanks() -> None:
    run = simulate(NETLIST, "4 s", points=8000)
    assert not [event for event in run.events if event.mode == "shaft2.contact" and event.time > 3]
    assert np.max(run["shaft2.tau"][run.time > 3]) < -2.0


@pytest.mark.parametrize("play", [0.1, 0.5, 2.0])
def test_the_page_has_these_numbers(play: float) -> None:
    page = (NETLIST.parents[1] / "docs" / "examples" / "machine_tool_startup.md").read_text(encoding="utf-8")
    tau = simulate(NETLIST, "0.6 s", parameters={"backlash": radians(play)}, points=12_000)["shaft2.tau"]
    assert f"| {play:g} | {-np.min(tau):.1f} | {np.max(tau):.1f} |" in page
