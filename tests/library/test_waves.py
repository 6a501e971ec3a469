"""Waves, transients and stepped signals: their values at all times, besides the areas under them."""

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from components import BooleanPulse, BooleanTable, Exponentials, Gain, Inertia, LogFrequencySweep, SawTooth, Torque
from modelica_like import Assembly, Component, Solution, simulate

WAVES = Path(__file__).parents[2] / "examples" / "components" / "waves.toml"
GROWTH = np.log(8) / 2
Curve = Callable[[Any], Any]


def heating(t: Any) -> Any:
    rise = 1 - np.exp(-np.clip(t - 0.25, 0, 1) / 0.4)
    return 2 * rise * np.exp(-np.clip(t - 1.25, 0, None) / 0.3)


CURVES: dict[str, Curve] = {
    "cosine.y": lambda t: 2 * np.cos(0.6 * np.pi * t),
    "hit.y": lambda t: np.where(t > 0.5, 2 * np.exp(-1.5 * (t - 0.5)) * np.sin(4 * np.pi * (t - 0.5)), 0),
    "sinc.y": lambda t: 2 * np.sinc(4 * t),
    "heating.y": heating,
    "saw.y": lambda t: np.where(t > 0.2, 2 * (((t - 0.2) / 0.4) % 1), 0),
    "octaves.y": lambda t: 0.5 * 8 ** (t / 2),
    "sweep.y": lambda t: 2 * np.sin(np.pi * (np.exp(GROWTH * t) - 1) / GROWTH),
    "steps.y": lambda t: np.select([t < 0.5, t < 1.25], [1, 3], -2),
    "switch.y": lambda t: t > 1.5,
    "pulses.y": lambda t: (t > 0.1) & ((t - 0.1) % 0.5 < 0.1),
    "gates.y": lambda t: np.select([t < 0.25, t < 0.5, t < 1.75], [1, 0, 1], 0),
    "both.columns[1].y": lambda t: 2 * np.interp(t, [0, 1, 2], [0, 1, 0]),
    "both.columns[2].y": lambda t: np.interp(t, [0, 1, 2], [1, 1, 3]),
}
TIMES = np.arange(0.013, 2, 0.037)


@cache
def waves() -> Solution:
    return simulate(WAVES, rtol=1e-9, atol=1e-11)


@pytest.mark.parametrize("path", CURVES)
def test_values(path: str) -> None:
    """At times between the jumps, which are all at multiples of 0.05 s."""
    values = [waves().at(float(t))[path] for t in TIMES]
    np.testing.assert_allclose(values, CURVES[path](TIMES), atol=1e-6)


@pytest.mark.parametrize(
    ("signal", "value"),
    [
        (SawTooth(amplitude=2.0, period=0.4, start_time=-1.0), 2 * 0.75),
        (Exponentials(rise_time=1.0, T_rise=0.4, T_fall=0.3, start_time=-3.0), (1 - np.exp(-2.5)) * np.exp(-2.1 / 0.3)),
        (BooleanPulse(period=0.5, width=0.4, start_time=-1.0), 1.0),
        (BooleanTable(times=(-2.0, -1.0, -0.5)), 1.0),
    ],
    ids=lambda item: type(item).__name__ if isinstance(item, Component) else "",
)
def test_signals_that_began_before_the_run(signal: Component, value: float) -> None:
    parts = {"signal": signal, "unit": Gain(k="1 N.m"), "torque": Torque(), "J": Inertia(J=1.0, phi=0.0, w=0.0)}
    connect = {"u": ["signal.y", "unit.u"], "y": ["unit.y", "torque.tau"]}
    run = simulate(Assembly("d", parts=parts, series={"s": ["torque", "J"]}, connect=connect), 0.15)
    assert run.at(0.1)["signal.y"] == pytest.approx(value, abs=1e-9)
    assert run.energy().closure <= 1e-8


def test_sweep_keeps_its_last_frequency() -> None:
    sweep = LogFrequencySweep(f_min=1.0, f_max=4.0, duration=0.2)
    unit = Gain(k="1 N.m.s")
    parts = {"sweep": sweep, "unit": unit, "torque": Torque(), "J": Inertia(J=1.0, phi=0.0, w=0.0)}
    connect = {"u": ["sweep.y", "unit.u"], "y": ["unit.y", "torque.tau"]}
    run = simulate(
        Assembly("d", parts=parts, series={"s": ["torque", "J"]}, connect=connect), 0.5, rtol=1e-9, atol=1e-11
    )
    assert run.at(0.1)["sweep.y"] == pytest.approx(2.0, rel=1e-12)
    assert run.final["sweep.y"] == pytest.approx(4.0, rel=1e-12)
    assert run.final["J.w"] == pytest.approx(0.2 * 3 / np.log(4) + 0.3 * 4, rel=1e-8)
