"""Numbers of the ideal circuits of examples/elements: matrix exponentials between known or solved instants."""

from itertools import pairwise
from math import exp, pi, sin, sqrt

import closed_forms
import numpy as np
import pytest
from closed_forms import close
from scipy.integrate import quad
from scipy.linalg import expm
from scipy.optimize import brentq

from modelica_like.runs.solution import Solution

numbers = closed_forms.numbers("elements")
Matrix = np.ndarray[tuple[int, int], np.dtype[np.float64]]


def follow(x: list[float], pieces: list[tuple[list[list[float]], list[float], float]]) -> Matrix:
    """Solve x' = A·x + b exactly over pieces (A, b, duration); the state at the end of each, shape (pieces, states)."""
    found, size = [], len(x)
    for a, b, duration in pieces:
        whole = np.zeros((size + 1, size + 1))
        whole[:size, :size], whole[:size, size] = a, b
        x = (expm(whole * duration) @ [*x, 1.0])[:size].tolist()
        found.append(x)
    return np.array(found)


@numbers
def diode_bridge(run: Solution) -> None:
    rectified = 10 * np.abs(np.sin(100 * pi * run.time))
    assert run["lamp_1.v"] == pytest.approx(rectified, abs=1e-8)
    # Fired at 5, 25, 45 ms, the thyristor conducts until the half wave ends.
    off_edge = np.abs(np.mod(run.time, 5e-3) - 2.5e-3) < 2.4e-3
    conducts = (np.mod(run.time, 20e-3) > 5e-3) & (np.mod(run.time, 20e-3) < 10e-3)
    assert run["lamp_3.v"][off_edge] == pytest.approx(np.where(conducts, rectified, 0)[off_edge], abs=1e-8)
    # The smoothed voltage, as far as C·v' = (|10·sin(w·t)| - v)/1 - v/100 holds; then it decays until it is overtaken.
    w, a = 100 * pi, (1 + 1 / 100) / 1e-3

    def driven(t: float, begin: float, v: float) -> float:
        part = lambda s: 1e4 / (a**2 + w**2) * (a * sin(w * s) - w * np.cos(w * s))  # noqa: E731
        return part(t) + (v - part(begin)) * exp(-a * (t - begin))

    stops = brentq(lambda t: 10 * sin(w * t) - driven(t, 0, 0), 0.005, 0.0099, xtol=1e-14)
    left = driven(stops, 0, 0)
    starts = brentq(lambda t: -10 * sin(w * t) - left * exp(-(t - stops) / 0.1), 0.0101, 0.015, xtol=1e-14)
    events = [(one.mode, one.after, one.time) for one in run.events if one.time > 0]
    assert next(time for mode, after, time in events if (mode, after) == ("D5.state", "off")) == close(stops)
    assert next(time for mode, after, time in events if (mode, after) == ("D6.state", "on")) == close(starts)
    assert run.at(0.015)["capacitor.v"] == close(driven(0.005, starts - 0.01, left * exp(-(starts - stops) / 0.1)))


def converter(run: Solution, on: list[list[float]], off: list[list[float]], b_on: float, b_off: float) -> float:
    """Compare choke and capacitor of a converter with 40 % of 0.1 ms on; return the mean voltage in the last period."""
    count = int(run.time[-1] / 1e-4)  # the run ends a little later, where nothing switches
    wanted = follow([0.0, 0.0], count * [(on, [b_on, 0.0], 4e-5), (off, [b_off, 0.0], 6e-5)])
    end = run.at(count * 1e-4)
    assert [end["choke.i"], end["capacitor.v"]] == close(wanted[-1].tolist())
    # The mean of both states is A⁻¹·(x(end) - x(begin) - b·duration) in each part of the period.
    parts = [(on, b_on, 4e-5, wanted[-3], wanted[-2]), (off, b_off, 6e-5, wanted[-2], wanted[-1])]
    return float(sum(np.linalg.solve(a, last - first - [b * t, 0.0])[1] for a, b, t, first, last in parts) / 1e-4)


@numbers
def buck_converter(run: Solution) -> None:
    a = [[0.0, -1e3], [1e4, -1 / (5 * 1e-4)]]
    assert converter(run, a, a, 24e3, 0.0) == pytest.approx(0.4 * 24, rel=1e-6)


@numbers
def boost_converter(run: Solution) -> None:
    decay = -1 / (10 * 1e-4)
    # The off-state's share of the ripple shifts the mean of the capacitor by parts in a thousand from 24/(1 - 0.4).
    stored = np.array([[1e-12, 0.0], [0.0, decay]]).tolist()
    mean = converter(run, stored, [[0.0, -1e3], [1e4, decay]], 24e3, 24e3)
    assert mean == pytest.approx(24 / 0.6, rel=2e-3)


@numbers
def three_phase_bridge(run: Solution) -> None:
    # |u_ab|max = sqrt(3)·325 V at the middle of each of six pulses; L·i' = u - R·i from rest.
    def voltage(t: float) -> float:
        phases = [325 * sin(100 * pi * t + shift) for shift in (0, -2 * pi / 3, 2 * pi / 3)]
        return max(phases) - min(phases)

    kinks = [k / 600 for k in range(13)]  # another pair conducts from every second of them on
    for t in (0.0, 0.004, 0.0093, 0.0171):
        after = run.at(t + 1e-9)
        assert after["choke.v"] + after["load.v"] == close(voltage(t + 1e-9))
    pieces = pairwise(kinks)
    current = sum(quad(lambda t: exp(-500 * (0.02 - t)) * voltage(t) / 20e-3, *one, epsabs=1e-13)[0] for one in pieces)
    assert run.at(0.02)["choke.i"] == close(current)
    times = np.linspace(0.04, 0.06, 1201)
    mean = np.trapezoid([run.at(t)["load.v"] for t in times], times) / 0.02
    assert mean == pytest.approx(3 * sqrt(3) / pi * 325, rel=1e-6)
    assert len([one for one in run.events if 0.02 < one.time < 0.04]) == 12


@numbers
def h_bridge_machine(run: Solution) -> None:
    # +24 V for 0.7 ms and, switches or diodes, -24 V for 0.3 ms, 30 times; then the diodes carry the current to zero.
    a = [[-0.8 / 2e-3, -0.05 / 2e-3], [0.05 / 5e-5, 0.0]]
    period = [(a, [24 / 2e-3, -0.1 / 5e-5], 0.7e-3), (a, [-24 / 2e-3, -0.1 / 5e-5], 0.3e-3)]
    current, speed = follow([0.0, 0.0], 30 * period)[-1]
    assert [run.at(0.03)["machine.ia"], run.at(0.03)["machine.w"]] == close([current, speed])
    coasting = lambda t: follow([current, speed], [(a, period[1][1], t)])[-1]  # noqa: E731
    empty = brentq(lambda t: coasting(t)[0], 1e-6, 3e-4, xtol=1e-16)
    assert next(one.time for one in run.events if one.time > 0.03) == close(0.03 + empty)
    assert run.final["machine.w"] == close(coasting(empty)[1] - 0.1 / 5e-5 * (0.005 - empty))
    assert run.final["machine.ia"] == pytest.approx(0, abs=1e-15)
