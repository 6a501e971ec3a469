"""Document 002, chapter 2: the four types of DC machine.

The document has no numbers for them. Expected are the closed forms that follow from its equations (03), (06), (10) and
from where each machine has its flux: U = c·phi·w + R·I, M = c·phi·I. Its equation (06) is wrong by 2·pi (see below).
"""

from functools import cache
from math import pi, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from components import ConstantCurrent, ConstantSpeed, Ground, Resistor, SeriesDCMachine, ShuntDCMachine
from modelica_like import Assembly, CompiledDae, Component, Solution, build, simulate
from modelica_like.show.report.run import notices

MACHINES = Path(__file__).parents[2] / "examples" / "dc_machines"
TYPES = ("permanent_magnet", "separately_excited", "shunt", "series")
U, K, RA, ROTOR = 24.0, 0.04668892, 0.7943932, 5.4e-5
EXCITATION, NOMINAL_EXCITATION = 48.0, 0.5  # Ohm, A
C, R_SERIES = K / 4.0, RA + 0.2
W_MAX = 8000 * pi / 30
WITHIN = 2e-6


@cache
def model(kind: str) -> CompiledDae:
    return build(MACHINES / f"{kind}.toml")


@cache
def curves(kind: str) -> Solution:
    return simulate(model(kind))


def efficiency(run: Solution) -> Any:
    return run["shaft.power"] / (-run["battery.v"] * run["battery.i"])


def matches(run: Solution, torque: Any, current: Any, w: Any) -> None:
    """Compare armature current and speed with closed forms; both cross zero, so the scale is the largest value."""
    np.testing.assert_allclose(run["shaft.tau"], torque, rtol=WITHIN, atol=WITHIN)
    np.testing.assert_allclose(run["machine.ia"], current, rtol=WITHIN, atol=WITHIN * abs(current).max())
    np.testing.assert_allclose(run["machine.w"], w, rtol=WITHIN)


def rising_load(run: Solution, first: float = -0.1, last: float = 0.4) -> Any:
    return first + (last - first) * run.time / run.time[-1]


def test_permanent_magnet() -> None:
    """I = M/k and w = U/k - R·M/k²: the speed falls linearly; above the no-load speed it is a generator."""
    run = curves("permanent_magnet")
    torque = rising_load(run)
    matches(run, torque, torque / K, U / K - RA * torque / K**2)
    motor = torque > 0.01
    np.testing.assert_allclose(efficiency(run)[motor], 1 - RA * torque[motor] / (K * U), rtol=WITHIN)
    generator = torque < 0
    assert np.all(run["machine.w"][generator] > U / K)
    # (10) with the sign of the generator: U = U_q - I·R.
    np.testing.assert_allclose(U, (run["machine.v_induced"] - RA * abs(run["machine.ia"]))[generator], rtol=1e-9)


@pytest.mark.parametrize("excitation", [24.0, 18.0, 12.0])
def test_separately_excited(excitation: float) -> None:
    """The flux follows the excitation: less of it makes the machine faster, w0 = U/(k·phi), but weaker."""
    run = simulate(model("separately_excited"), parameters={"excitation": excitation})
    torque, flux = rising_load(run), excitation / EXCITATION / NOMINAL_EXCITATION
    current = torque / (K * flux)
    w = (U - RA * current) / (K * flux)
    matches(run, torque, current, w)
    assert np.interp(0.0, torque, run["machine.w"]) == pytest.approx(U / (K * flux), rel=WITHIN)
    supply = -run["battery.v"] * run["battery.i"] - run["exciter.v"] * run["exciter.i"]
    motor = torque > 0.01
    expected = torque * w / (U * current + excitation**2 / EXCITATION)
    np.testing.assert_allclose((run["shaft.power"] / supply)[motor], expected[motor], rtol=WITHIN)


@pytest.mark.parametrize("supply", [24.0, 12.0])
def test_shunt(supply: float) -> None:
    """Excitation and armature share the voltage: as long as the iron does not saturate, w0 does not depend on it."""
    run = simulate(model("shunt"), parameters={"supply": supply, "last_load": 0.1})
    torque, flux = rising_load(run, last=0.1), supply / EXCITATION / NOMINAL_EXCITATION
    current = torque / (K * flux)
    w = (supply - RA * current) / (K * flux)
    matches(run, torque, current, w)
    supplied = current + supply / EXCITATION
    np.testing.assert_allclose(-run["battery.i"], supplied, rtol=WITHIN, atol=WITHIN * abs(supplied).max())
    assert np.interp(0.0, torque, run["machine.w"]) == pytest.approx(24.0 / K, rel=WITHIN)
    motor = torque > 0.01
    expected = torque * w / (supply * supplied)
    np.testing.assert_allclose(efficiency(run)[motor], expected[motor], rtol=WITHIN)


def test_series() -> None:
    """M = c·I², w = U/sqrt(c·M) - R/c: at a quarter of the torque twice as fast, but for the resistance."""
    run = curves("series")
    torque = rising_load(run, 1.0, 0.03)
    current = np.sqrt(torque / C)
    w = U / np.sqrt(C * torque) - R_SERIES / C
    matches(run, torque, current, w)
    np.testing.assert_allclose(efficiency(run), torque * w / (U * current), rtol=2 * WITHIN)


@pytest.mark.parametrize("kind", TYPES)
def test_electrical_power_is_mechanical_power(kind: str) -> None:
    """M·w = U_q·I always.

    With (06) as printed, U_q = c_M2·phi·w where c_M2 = 2·pi·c_M1, it would be 2·pi times larger: (06) means n, not w.
    """
    run = curves(kind)
    np.testing.assert_allclose(
        run["machine.tau_electrical"] * run["machine.w"], run["machine.v_induced"] * run["machine.ia"], rtol=1e-12
    )
    assert run.energy().power_closure < 1e-9


STALL = {
    "permanent_magnet": K * U / RA, "separately_excited": K * U / RA, "shunt": K * U / RA,
    "series": C * (U / R_SERIES) ** 2,
}  # fmt: skip


@pytest.mark.parametrize("kind", TYPES)
def test_stall(kind: str) -> None:
    """The load at which the machine stands still; that of the series machine is five times as large: 6.8 N.m."""
    loads = {"first_load": STALL[kind], "last_load": STALL[kind]}
    run = simulate(model(kind), "1 s", points=1, parameters=loads)
    assert run.final["machine.w"] == pytest.approx(0.0, abs=1e-6)
    assert run.final["machine.ia"] == pytest.approx(U / (R_SERIES if kind == "series" else RA), rel=1e-9)


# -- a series machine without load -------------------------------------------------------------------------------------


def speed_without_load(elapsed: float, w: float) -> float:
    """J·der(w) = c·(U/(R + c·w))², so (R + c·w)³ grows by 3·c²·U²/J in each second: without end."""
    return (((R_SERIES + C * w) ** 3 + 3 * C**2 * U**2 * elapsed / ROTOR) ** (1 / 3) - R_SERIES) / C


def test_series_machine_runs_away_without_load() -> None:
    run = simulate(MACHINES / "series_runaway.toml", rtol=1e-8)
    loaded = U / sqrt(C * 0.2) - R_SERIES / C
    assert run.at(0.0)["machine.w"] == pytest.approx(loaded, rel=1e-9)
    exceeded = next(event.time for event in run.events if event.mode == "overspeed.limit")
    expected = 0.05 + ROTOR / (3 * C**2 * U**2) * ((R_SERIES + C * W_MAX) ** 3 - (R_SERIES + C * loaded) ** 3)
    assert exceeded == pytest.approx(expected, rel=1e-6)
    for elapsed in (0.1, 0.5, 0.95):
        assert run.at(0.05 + elapsed)["machine.w"] == pytest.approx(speed_without_load(elapsed, loaded), rel=1e-5)
    assert notices(run) == [
        f"At {exceeded:.9g} s overspeed exceeds 837.758 rad/s: a series machine runs away without load."
    ]
    later = simulate(MACHINES / "series_runaway.toml", "1000 s").final["machine.w"]
    assert later == pytest.approx(speed_without_load(999.95, loaded), rel=1e-5)


def test_other_machines_have_a_no_load_speed() -> None:
    for kind in TYPES[:3]:
        run = simulate(model(kind), "1 s", points=1, parameters={"first_load": 0.0, "last_load": 0.0})
        assert run.final["machine.w"] == pytest.approx(U / K, rel=1e-9)


def test_loads_too_small_for_the_series_machine() -> None:
    """The smallest load at which it stays below its limit: M = c·(U/(R + c·w_max))²."""
    run = curves("series")
    exceeded = next(event.time for event in run.events if event.mode == "overspeed.limit")
    smallest = C * (U / (R_SERIES + C * W_MAX)) ** 2
    assert run.at(exceeded)["shaft.tau"] == pytest.approx(smallest, rel=1e-5)
    assert simulate(model("series"), parameters={"last_load": 1.001 * smallest}).events[0].mode == "load.stage"


# -- as generators -----------------------------------------------------------------------------------------------------


def generator(machine: Component, load: Component, speed: float) -> Solution:
    parts = {"drive": ConstantSpeed(w_fixed=speed), "machine": machine, "load": load, "earth": Ground()}
    wires = {
        "shaft": ["drive.flange", "machine.flange"],
        "plus": ["machine.ap", "load.p"],
        "minus": ["machine.an", "load.n", "earth.p"],
    }
    return simulate(Assembly("generator", parts=parts, connect=wires), "20 ms", rtol=1e-11, atol=1e-14)


@pytest.mark.parametrize(("remanence", "speed"), [(0.0, 600.0), (1e-3, 600.0), (1e-3, 500.0)])
def test_shunt_generator_needs_remanence(remanence: float, speed: float) -> None:
    """Without load (L_e + L_a)·der(i_e) = (k·w/I_eN - R_e - R_a)·i_e: from nothing comes nothing."""
    machine = ShuntDCMachine(
        k=K, Ra=RA, La=1e-3, Re=EXCITATION, Le=0.5, Ie_nominal=NOMINAL_EXCITATION, Jr=ROTOR, ie=remanence
    )
    run = generator(machine, ConstantCurrent(I=0.0), speed)
    rate = (K * speed / NOMINAL_EXCITATION - EXCITATION - RA) / 0.501
    np.testing.assert_allclose(run["machine.ie"], remanence * np.exp(rate * run.time), rtol=1e-6, atol=1e-12)
    assert (run.final["machine.ie"] > remanence) == (remanence > 0 and speed > 522.6)


@pytest.mark.parametrize("speed", [600.0, -600.0])
def test_series_generator_needs_its_winding_reversed(speed: float) -> None:
    """L·der(I) = -(R_L + R + c·w)·I: driven forward its current dies; c·w is negative with the winding reversed.

    Here the rotation is, which is the same.
    """
    machine = SeriesDCMachine(k=K, I_nominal=4.0, Ra=RA, La=1e-3, Re=0.2, Le=4e-3, Jr=ROTOR, ia=0.01)
    run = generator(machine, Resistor(R=4.0), speed)
    rate = -(4.0 + R_SERIES + C * speed) / 5e-3
    np.testing.assert_allclose(run["machine.ia"], 0.01 * np.exp(rate * run.time), rtol=1e-6, atol=1e-12)
    assert (run.final["machine.ia"] > 0.01) == (speed < 0)
