"""Waves, transients and stepped signals: their values, and time events exactly where they jump or have a kink."""

from collections.abc import Callable
from math import cos, exp, log, pi, sin
from typing import Any

import numpy as np
import pytest

from components import (
    BooleanPulse,
    BooleanStep,
    BooleanTable,
    CombiTable,
    Constant,
    Cosine,
    Exponentials,
    ExpSine,
    Inertia,
    LogFrequencySweep,
    SawTooth,
    Sinc,
    StepTable,
    Torque,
    VariableSine,
)
from modelica_like import Assembly, Component, Solution, simulate


def run_of(signal: Component, until: float = 2.0, **more: Any) -> Solution:
    """Run the signal beside a rotor."""
    parts = {"signal": signal, "torque": Torque(tau=1.0), "J": Inertia(J=1.0, phi=0.0, w=0.0), **more.pop("parts", {})}
    return simulate(Assembly("d", parts=parts, series={"s": ["torque", "J"]}, **more), until, rtol=1e-9)


def rise(t: float) -> float:
    up = 1 - exp(-min(max(t - 0.3, 0), 0.5) / 0.2)
    return 1 + 2 * up * exp(-max(t - 0.8, 0) / 0.4)


CASES: list[tuple[Component, Callable[[float], float], list[float]]] = [
    (
        Cosine(amplitude="2 N.m", f=3.0, phase="30 deg", offset="1 N.m", start_time=0.4),
        lambda t: 1 + (2 * cos(6 * pi * (t - 0.4) + pi / 6) if t >= 0.4 else 0),
        [0.4],
    ),
    (
        ExpSine(amplitude="2 N.m", f=3.0, damping=1.5, start_time=0.4),
        lambda t: 2 * exp(-1.5 * (t - 0.4)) * sin(6 * pi * (t - 0.4)) if t >= 0.4 else 0,
        [0.4],
    ),
    (Sinc(amplitude="2 N.m", f=2.0), lambda t: 2 * float(np.sinc(4 * t)), []),
    (
        Exponentials(height="2 N.m", offset="1 N.m", rise_time=0.5, T_rise=0.2, T_fall=0.4, start_time=0.3),
        rise,
        [0.3, 0.8],
    ),
    (
        SawTooth(amplitude="2 N.m", period=0.5, periods=2, offset="1 N.m", start_time=0.3),
        lambda t: 1 + 4 * ((t - 0.3) % 0.5) * (0.3 <= t < 1.3),
        [0.3, 0.8, 0.8, 1.3],
    ),
    (
        LogFrequencySweep(f_min=1.0, f_max=8.0, duration=1.2, start_time=0.3),
        lambda t: exp(log(8) * min(max(t - 0.3, 0) / 1.2, 1)),
        [0.3, 1.5],
    ),
    (
        StepTable(table=((0.2, 1), (0.7, 3), (1.1, -2)), scale="1 N.m"),
        lambda t: 1 if t < 0.7 else 3 if t < 1.1 else -2,
        [0.2, 0.7, 1.1],
    ),
    (BooleanStep(start_time=0.7), lambda t: t >= 0.7, [0.7]),
    (BooleanStep(start_time=0.7, start_value=True), lambda t: t < 0.7, [0.7]),
    (
        BooleanTable(times=(0.2, 0.7, 1.1), start_value=True),
        lambda t: t < 0.2 or 0.7 <= t < 1.1,
        [0.2, 0.7, 1.1],
    ),
    (
        BooleanPulse(period=0.8, width=0.25, start_time=0.3),
        lambda t: t >= 0.3 and (t - 0.3) % 0.8 < 0.2,
        [0.3, 0.5, 1.1, 1.3, 1.9],
    ),
]  # fmt: skip


@pytest.mark.parametrize(("signal", "law", "kinks"), CASES, ids=lambda case: type(case).__name__)
def test_values_and_events(signal: Component, law: Callable[[float], float], kinks: list[float]) -> None:
    run = run_of(signal)
    assert [event.time for event in run.events] == pytest.approx(kinks, abs=1e-12)
    away = [k for k, t in enumerate(run.time) if all(abs(t - kink) > 1e-9 for kink in kinks)]
    np.testing.assert_allclose(run["signal.y"][away], [law(run.time[k]) for k in away], atol=1e-9)


def test_table_of_several_signals() -> None:
    run = run_of(CombiTable(table=((0, 0, 1), (1, 2, 1), (2, 0, 3))))
    np.testing.assert_allclose(run["signal.columns[1].y"], np.interp(run.time, (0, 1, 2), (0, 2, 0)), atol=1e-12)
    np.testing.assert_allclose(run["signal.columns[2].y"], np.interp(run.time, (0, 1, 2), (1, 1, 3)), atol=1e-12)


def test_sine_of_a_sweep() -> None:
    """Its angle is the integral of the frequency: (f_max - f_min)·T/ln(f_max/f_min) turns."""
    sweep = LogFrequencySweep(f_min=1.0, f_max=8.0, duration=2.0)
    parts = {"sine": VariableSine(offset="1 N.m"), "a": Constant(k="3 N.m")}
    connect = {"f": ["signal.y", "sine.f"], "a": ["a.y", "sine.amplitude"]}
    run = run_of(sweep, parts=parts, connect=connect)
    angle = 2 * pi * 2 / log(8) * (np.exp(log(8) * run.time / 2) - 1)
    np.testing.assert_allclose(run["sine.y"], 1 + 3 * np.sin(angle), atol=1e-5)
