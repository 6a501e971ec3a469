"""Documents 002 and 003 with their clutches as circuits: coil, air gap, spring, plates that get hot and wear.

Moments follow from closed forms: the armature starts when half the square of the current times the slope of the
inductance is the spring's force, and leaves its seat when the force has fallen to it. Engaging is integrated by DOP853
from equations written out by hand.
"""

from math import exp, log, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from modelica_like import Solution, simulate

EXAMPLES = Path(__file__).parents[2] / "examples"
U, R, T, SPRING, FORCE, GAP, MASS = 24.0, 8.0, 0.07, 300.0, 5256.25, 0.5e-3, 2.0
L, X0 = T * R, T * U**2 / (2 * R * (FORCE + SPRING))
J1, J2, J3, J4 = 1.61, 0.57, 0.05, 1.02
h0, h1, h2, k0, k1, k2, motor_speed, drag, radius = 156.0, 10.0, 2.5, 16400.0, 6120.0, 14300.0, 32.417, 2.5, 1.3
C, G, OIL = 2500.0, 60.0, 333.15
SLIPS = np.array([*range(12), 12.57, 40])
MU = np.round([3.023e-5 * (12.57 - s) ** 3 + 0.04 if s < 12.57 else 1.55e-4 * (s - 12.57) + 0.04 for s in SLIPS], 5)


def fade(temperature: float, force: float) -> float:
    by_heat = np.interp(temperature - 273.15, [20, 60, 150, 250], [1.05, 1, 0.9, 0.75])
    return float(by_heat * np.interp(force / FORCE, [0, 1], [1.02, 1]))


def pull(i: float, s: float) -> float:
    return 0.5 * i**2 * L / (1 + (GAP - s) / X0) ** 2 / X0


def pull_in() -> float:
    inductance = L / (1 + GAP / X0)
    current = sqrt(2 * SPRING * L * X0) / inductance
    return -inductance / R * log(1 - current * R / U)


@pytest.fixture(scope="module")
def run() -> Solution:
    return simulate(EXAMPLES / "machine_tool_magnet.toml", "9 s", points=9000, rtol=1e-9)


def moment(run: Solution, mode: str, after: str) -> float:
    return next(event.time for event in run.events if (event.mode, event.after) == (mode, after))


def test_the_armature_starts_and_leaves(run: Solution) -> None:
    assert moment(run, "coil.stop", "leaving") == pytest.approx(pull_in(), abs=1e-8)
    left = [event.time for event in run.events if (event.mode, event.before) == ("coil.stop", "driven")]
    assert left == [pytest.approx(3 + T / 2 * log((FORCE + SPRING) / SPRING), abs=1e-7)]


def armature(_: float, y: Any) -> list[float]:
    """Return the slopes of current, way and velocity: U = R·i + L(s)·di/dt + i·dL/ds·v."""
    i, s, v = y
    inductance = L / (1 + (GAP - s) / X0)
    slope = inductance**2 / (L * X0)
    return [(U - R * i - i * slope * v) / inductance, v, (pull(i, s) - SPRING) / MASS]


def engaging(_: float, y: Any, moving: bool) -> list[float]:
    """Return the slopes of i, th0, w1, th1, w2, w3, th2, w4, T while the armature sits and the clutch slides."""
    i, th0, w1, th1, w2, w3, th2, w4, temperature = y
    T0, T1, T2 = k0 * th0, k1 * th1 + h1 * (w1 - w2), k2 * th2 + h2 * (w3 - w4)
    pressing = pull(i, GAP) - SPRING
    M = pressing * radius * float(np.interp(w2 - w3, SLIPS, MU)) * fade(temperature, pressing) + drag
    a4 = (T2 - 9 - 0.1 * max(w4, 0.0) ** (2 / 3)) / J4 if moving else 0.0
    heat = M * (w2 - w3) - G * (temperature - OIL)
    return [(U - R * i) / L, motor_speed - T0 / h0 - w1, (T0 - T1) / J1, w1 - w2, (T1 - M) / J2, (M - T2) / J3,
            w3 - w4, a4, heat / C]  # fmt: skip


@pytest.mark.slow
def test_engaging(run: Solution) -> None:
    def seated(t: float, y: Any) -> float:
        return y[1] - GAP

    def moves(t: float, y: Any) -> float:
        return k2 * y[6] + h2 * (y[5] - y[7]) - 9

    def locks(t: float, y: Any) -> float:
        return y[5] - y[4]

    ends: Any
    for ends in (seated, moves, locks):
        ends.terminal, ends.direction = True, 1
    current = U / R * (1 - exp(-pull_in() * R * (1 + GAP / X0) / L))
    options: dict[str, Any] = {"method": "DOP853", "rtol": 1e-10, "atol": 1e-12}
    flight = solve_ivp(armature, (pull_in(), 0.1), [current, 0, 0], events=seated, **options)
    assert moment(run, "coil.stop", "driven") == pytest.approx(flight.t[-1], abs=1e-7)
    idle = motor_speed - drag / h0
    # Residual torque heats the plates from the start.
    warm = OIL + drag * idle / G * (1 - exp(-G / C * flight.t[-1]))
    start = [flight.y[0, -1], drag / k0, idle, drag / k1, idle, 0, drag / k2, 0, warm]
    first = solve_ivp(engaging, (flight.t[-1], 1.0), start, args=(False,), max_step=1e-4,
                      events=lambda t, y, _: moves(t, y), **options)  # fmt: skip
    when = brentq(lambda t: moves(t, np.array([np.interp(t, first.t, row) for row in first.y])), 0.0291, 0.0330)
    assert moment(run, "load.mode", "forward") == pytest.approx(when, abs=2e-6)
    state = [np.interp(when, first.t, row) for row in first.y]
    ends = lambda t, y, _: locks(t, y)  # noqa: E731
    ends.terminal, ends.direction = True, 1
    then = solve_ivp(engaging, (when, 1.0), state, args=(True,), max_step=1e-4, events=ends, **options)
    assert moment(run, "clutch.mode", "stuck") == pytest.approx(then.t[-1], abs=2e-6)
    at = run.at(then.t[-1])
    assert at["J2.w"] == pytest.approx(then.y[4, -1], rel=1e-5)
    assert at["clutch.T"] == pytest.approx(then.y[8, -1], abs=1e-5)


def test_disengaging(run: Solution) -> None:
    """The clutch slips when its static friction, which pressure and heat change, is what it carries."""
    before = run.at(2.999)
    carried = -before["clutch.tau"]

    def spare(t: float) -> float:
        pressing = (FORCE + SPRING) * exp(-2 * t / T) - SPRING
        return 0.133 / 0.10004 * (pressing * radius * 0.10004 * fade(before["clutch.T"], pressing) + drag) - carried

    slips = next(event.time for event in run.events if event.mode == "clutch.mode" and event.time > 3)
    assert slips - 3 == pytest.approx(brentq(spare, 0, 0.102), abs=1e-6)
    assert run.at(3.2)["clutch.tau"] == pytest.approx(-drag)


def test_heat_and_wear(run: Solution) -> None:
    early, late = run.at(1.0), run.at(2.9)
    # The solver's tolerance counts for the temperature, not for its rise.
    assert late["clutch.T"] == pytest.approx(OIL + (early["clutch.T"] - OIL) * exp(-G / C * 1.9), rel=1e-8)
    assert run.final["clutch.wear"] == pytest.approx(1e-15 * run.final["clutch.W"] / 0.245, rel=1e-9)
    assert run.final["clutch.W"] == pytest.approx(run.energy()["clutch"].lost, rel=1e-6)


@pytest.mark.slow
def test_cold_and_hot_oil() -> None:
    """Hotter plates grip less: the clutch locks later, with smaller torques."""
    runs = [simulate(EXAMPLES / "machine_tool_magnet.toml", "0.5 s", parameters={"oil": 273.15 + oil})
            for oil in (20, 60, 120)]  # fmt: skip
    assert [moment(run, "clutch.mode", "stuck") for run in runs] == sorted(
        moment(run, "clutch.mode", "stuck") for run in runs
    )
    torques = [-np.min(run["clutch.tau"]) for run in runs]
    assert torques == sorted(torques, reverse=True)


@pytest.fixture(scope="module")
def bench() -> Solution:
    return simulate(EXAMPLES / "dc_bench_cycles.toml", points=40_000)


def test_times_of_the_data_sheet(bench: Solution) -> None:
    """Response delay 5 ms, engagement time 20 ms; the coil alone lets go in 4 of the 6 ms."""
    y, time = bench["coil.y"], bench.time
    assert time[np.argmax(y > 0)] == pytest.approx(5e-3, abs=1e-4)
    assert time[np.argmax(y > 0.9)] == pytest.approx(20e-3, abs=3e-4)
    after = (time > 2) & (time < 3)
    ratio = sqrt((18 + 8.6) / (18 + 86))
    assert time[after][np.argmax(y[after] < 0.1)] - 2 == pytest.approx(-5.85e-3 * log(ratio), abs=3e-4)


def test_every_engagement_heats_the_clutch(bench: Solution) -> None:
    first, second = (bench.at(t)["clutch.W"] for t in (3.9, 7.9))
    assert first == pytest.approx(22.92, abs=0.02)
    assert second == pytest.approx(2 * first, rel=1e-4)
    warm = bench.at(2.5)["clutch.T"] - 293.15
    assert bench.at(3.9)["clutch.T"] - 293.15 == pytest.approx(warm * exp(-0.3 / 60 * 1.4), rel=1e-6)
    assert warm == pytest.approx(first / 60 * exp(-0.3 / 60 * (2.5 - 0.2)), rel=5e-3)


def test_the_pages_have_these_numbers(run: Solution, bench: Solution) -> None:
    pages = EXAMPLES.parent / "docs" / "examples"
    tool, dc = ((pages / name).read_text(encoding="utf-8") for name in ("machine_tool_startup.md", "dc_bench.md"))
    left = next(event.time for event in run.events if (event.mode, event.before) == ("coil.stop", "driven"))
    slips = next(event.time for event in run.events if event.mode == "clutch.mode" and event.time > 3)
    fine = simulate(EXAMPLES / "machine_tool_magnet.toml", "0.5 s", points=20_000)
    torques = ", ".join(f"{-np.min(fine[f'{name}.tau']):.1f}" for name in ("shaft1", "shaft2", "clutch"))
    for line in (
        f"| the armature starts / ms | {1e3 * pull_in():.3f} |",
        f"| it presses / ms | {1e3 * moment(run, 'coil.stop', 'driven'):.3f} |",
        f"| the clutch locks / s | {moment(run, 'clutch.mode', 'stuck'):.5f} |",
        f"| largest torque of shaft 1, shaft 2, clutch / N·m | {torques} |",
        f"| switched off, it slips after / ms | {1e3 * (slips - 3):.2f} |",
        f"| the armature lets go after / ms | {1e3 * (left - 3):.2f} |",
        f"| the plates get warmer by / K | {np.max(run['clutch.T'][run.time < 1]) - OIL:.2f} |",
    ):
        assert line in tool
    locked = next(event.time for event in bench.events if (event.mode, event.after) == ("clutch.mode", "stuck"))
    for line in (
        f"| clutch locks / s | {locked:.4f} |",
        f"| friction work of one engagement / J | {bench.at(3.9)['clutch.W']:.2f} |",
        f"| the plates get warmer by / K | {bench.at(1.9)['clutch.T'] - 293.15:.3f} |",
    ):
        assert line in dc
