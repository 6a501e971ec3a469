"""Document 003: disengaging, its laboratory's other aim, against the laws of motion written out by hand.

From the steady run the coil is switched off: its current falls as exp(-t/20 ms). The clutch holds until its static
friction is less than its torque, then slides with the document's kinetic friction and its residual torque; the load
stops the machine. Integrated by DOP853 between these moments.
"""

from math import exp, log, pi, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from modelica_like import Solution, load, simulate

NETLIST = Path(__file__).parents[2] / "examples" / "machine_tool_startup.toml"
J1, J2, J3, J4 = 1.61, 0.57, 0.05, 1.02
h0, h1, h2, k0, k1, k2 = 156.0, 10.0, 2.5, 16400.0, 6120.0, 14300.0
motor_speed, drag, radius, mu_static, force = 32.417, 2.5, 1.3, 0.133, 5256.25
switch_off, T_off = 3.0, 0.02
steady = brentq(lambda w: motor_speed - w - (9 + 0.1 * w ** (2 / 3)) / h0, 30, 33)
torque = 9 + 0.1 * steady ** (2 / 3)


def mu(slip: float) -> float:
    return 3.023e-5 * (12.57 - slip) ** 3 + 0.04 if slip < 12.57 else 1.55e-4 * (slip - 12.57) + 0.04


def pressed(t: float) -> float:
    return force * exp(-2 * (t - switch_off) / T_off)


def rates(t: float, y: Any) -> list[float]:
    """Return the slopes of th0, w1, th1, w2, w3, th2, w4 while the clutch slides and the machine moves."""
    th0, w1, th1, w2, w3, th2, w4 = y
    T0, T1, T2 = k0 * th0, k1 * th1 + h1 * (w1 - w2), k2 * th2 + h2 * (w3 - w4)
    M = pressed(t) * radius * mu(w2 - w3) + drag
    load_torque = 9 + 0.1 * max(w4, 0.0) ** (2 / 3)
    return [motor_speed - T0 / h0 - w1, (T0 - T1) / J1, w1 - w2, (T1 - M) / J2, (M - T2) / J3, w3 - w4,
            (T2 - load_torque) / J4]  # fmt: skip


# The clutch holds while nothing else changes: it slips when static friction is what it carries.
slips = switch_off + T_off / 2 * log(force * radius * mu_static / (torque - drag))


@pytest.fixture(scope="module")
def reference() -> Any:
    start = [torque / k0, steady, torque / k1, steady, steady, torque / k2, steady]

    def stops(t: float, y: Any) -> float:
        return y[6]

    stops.terminal, stops.direction = True, -1
    return solve_ivp(rates, (slips, 12.0), start, "DOP853", rtol=1e-11, atol=1e-12, events=stops, dense_output=True)


@pytest.fixture(scope="module")
def run() -> Solution:
    drive = load(NETLIST)
    drive.set("coil.stop_time", switch_off)
    drive.set("coil.T_off", T_off)
    return simulate(drive, "9 s", points=9000, rtol=1e-9)


def test_moments(run: Solution, reference: Any) -> None:
    times = {(event.mode, event.after): event.time for event in run.events}
    assert times["clutch.mode", "start_backward"] == pytest.approx(slips, abs=1e-6)
    assert times["load.mode", "stuck"] == pytest.approx(reference.t[-1], abs=1e-6)
    assert slips - switch_off == pytest.approx(0.04795, abs=5e-6)


@pytest.mark.parametrize("after", [0.001, 0.01, 0.03, 0.1, 0.5, 2.0, 4.5])
def test_samples(after: float, run: Solution, reference: Any) -> None:
    names = ("J1.w", "J2.w", "J3.w", "J4.w")
    w1, w2, w3, w4 = reference.sol(slips + after)[[1, 3, 4, 6]]
    at = run.at(slips + after)
    assert [at[name] for name in names] == pytest.approx([w1, w2, w3, w4], rel=1e-6)
    M = pressed(slips + after) * radius * mu(w2 - w3) + drag
    assert -at["clutch.tau"] == pytest.approx(M, rel=1e-5)


def test_the_page_has_these_numbers(run: Solution) -> None:
    page = (NETLIST.parents[1] / "docs" / "examples" / "machine_tool_startup.md").read_text(encoding="utf-8")
    later = ", ".join(f"{-run.at(slips + after)['clutch.tau']:.3f}" for after in (0.005, 0.01, 0.02, 0.05))
    assert f"| 5, 10, 20, 50 ms later / N·m | {later} |" in page
    stopped = next(event.time for event in run.events if (event.mode, event.after) == ("load.mode", "stuck"))
    assert f"| the machine stands still after / s | {stopped - switch_off:.3f} |" in page
    assert f"| the clutch holds for / ms | {1e3 * (slips - switch_off):.2f} |" in page
    after = (run.time >= slips) & (run.time <= stopped)
    work = np.trapezoid(run["clutch.loss_power"][after], run.time[after])
    assert f"| friction work from the slip to standstill / J | {work:.0f} |" in page
    smallest = np.min(-run["shaft2.tau"][run.time >= slips])
    assert f"| smallest torque of shaft 2 / N·m | {smallest:.2f} |" in page


def test_what_is_left(run: Solution) -> None:
    """The motor idles against the residual torque; the driven side swings at 87.2 Hz, and the load stops it."""
    assert run.final["J2.w"] == pytest.approx(motor_speed - drag / h0, rel=1e-7)
    assert -run.final["clutch.tau"] == pytest.approx(drag)
    assert run.final["J4.w"] == pytest.approx(0, abs=1e-9)
    assert -run.final["shaft2.tau"] == pytest.approx(drag, rel=1e-3)
    swing = sqrt(k2 * (1 / J3 + 1 / J4)) / (2 * pi)
    assert swing == pytest.approx(87.18, abs=0.1)


def test_friction_work(run: Solution, reference: Any) -> None:
    """Nearly all of it is residual torque: 2.5 N.m over the slip."""
    moments = np.linspace(slips, reference.t[-1], 400_001)
    _, _, _, w2, w3, _, _ = reference.sol(moments)
    forces = force * np.exp(-2 * (moments - switch_off) / T_off) * radius
    kinetic = np.array([mu(slip) for slip in w2 - w3])
    work = np.trapezoid((forces * kinetic + drag) * (w2 - w3), moments)
    rest = drag * (motor_speed - drag / h0) * (9.0 - reference.t[-1])
    after = run.time >= slips
    ours = np.trapezoid(run["clutch.loss_power"][after], run.time[after])
    assert ours == pytest.approx(work + rest, rel=1e-3)
