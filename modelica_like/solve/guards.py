"""Guards along a segment: where does a transition want to fire?"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.compile.buffers import BufferedFunction, buffered
from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.flatten.conditions import JUST_TRUE
from modelica_like.initialize import Point, call
from modelica_like.solve.idas import along

_LOCATED = 1e-13
_NOISE = 1e-30
"""A decaying signal ends by swinging around zero with such values; that is no event."""
_MAX_TRIALS = 60
_GUESSING = 12
_NEAR = 0.1
"""A top between two results is looked at if it is this near zero, relative to the values at both ends."""


class Guards:
    """Evaluates guards and their rates, and knows which are active in which mode."""

    def __init__(self, model: CompiledDae) -> None:
        self.model = model
        self.state_events = [t for t in model.transitions if not t.timed]
        self.count = len(self.state_events)
        self.positions = {id(one): k for k, one in enumerate(self.state_events)}
        self._mode = np.array([t.mode for t in self.state_events], int)
        largest = max((len(one.names) for one in model.flat_discretes), default=1)
        self._sources = np.zeros((self.count, max(largest, 1)), bool)
        for k, transition in enumerate(self.state_events):
            self._sources[k, list(transition.sources)] = True
        self._rows = np.arange(self.count)

    def active(self, d: Vector) -> Any:
        """Which guards may fire, by the modes."""
        if not self.count:
            return np.zeros(0, bool)
        return self._sources[self._rows, d[self._mode].astype(int)]

    def at(self, point: Point) -> tuple[Vector, Vector]:
        """Guards and rates at a point."""
        values, rates, _ = self._seen(1)(point.t, point.x, point.z, self.model.p, self.model.u, point.d)
        return _numbers(values), _finite(rates)

    def along(self, times: Vector, x: Vector, z: Vector, d: Vector) -> tuple[Vector, Vector, Vector]:
        """Guards, rates and derivatives of the states at many times with the same modes.

        Shapes (guards, times), (guards, times), (nx, times).
        """
        count = len(times)
        results = self._seen(count)(times, x.ravel("F"), z.ravel("F"), self.model.p, self.model.u, d)
        values, rates, slopes = (v.reshape(count, -1).T for v in results)
        return _numbers(values), _finite(rates), slopes

    def _seen(self, count: int) -> BufferedFunction:
        return buffered(self.model._cache, ("seen", count), lambda: along(_seen(self.model), count))

    def soon(self, point: Point) -> Vector:
        """Guards as they will be one time resolution later."""
        return _numbers(call(self.model, self.model.guards_soon, point))


def _seen(model: CompiledDae) -> ca.Function:
    """Guards, their rates and the states' in one function: they share most of what they compute."""
    if "seen" not in model._cache:
        arguments = list(model.arguments.values())
        results = [model.guards(*arguments), model.guard_rates(*arguments), model.ode(*arguments)]
        model._cache["seen"] = ca.Function("seen", arguments, ca.cse(results))
    return model._cache["seen"]


def _finite(rates: Vector) -> Vector:
    return rates if np.isfinite(rates).all() else np.where(np.isfinite(rates), rates, 0.0)


def _numbers(guards: Vector) -> Vector:
    """Let a guard that is not a number be false, and what is nothing but rounding zero."""
    sizes = np.abs(guards)
    if not sizes.size or _NOISE <= np.minimum.reduce(sizes, None) <= np.maximum.reduce(sizes, None) < np.inf:
        return guards
    rounding = (sizes < _NOISE) & (sizes > JUST_TRUE)
    guards = np.where(rounding, 0.0, guards) if rounding.any() else guards
    return guards if sizes.max() < np.inf else np.nan_to_num(guards, nan=-1.0)


@dataclass
class Candidate:
    """An interval in which a guard becomes positive, at its end or in between."""

    guard: int
    interval: int
    inside: bool


def candidates(values: Vector, rates: Vector, active: Any, step: float) -> list[Candidate]:
    """Find the first interval in which active guards become positive.

    Args:
        values: guards at successive times, shape (guards, times).
        rates: their time derivatives.
        active: which guards count.
        step: longest distance of two times in s.
    """
    rows = active.nonzero()[0]
    values, rates = values[rows], rates[rows]
    above = values > 0
    crossing = above[:, 1:] > above[:, :-1]
    slow = _NOISE / step
    humps = (rates > slow)[:, :-1] & (rates < -slow)[:, 1:]
    if humps.any():
        humps &= ~(above[:, :-1] | crossing)
        places = np.nonzero(humps)
        ends = values[:, :-1][places], values[:, 1:][places]
        top = _peak(*ends, rates[:, :-1][places] * step, rates[:, 1:][places] * step)
        humps[places] = top > -_NEAR * (np.abs(ends[0]) + np.abs(ends[1]))
    found: list[Candidate] = []
    for k in np.flatnonzero(np.any(crossing | humps, axis=0)):
        found += [Candidate(int(rows[g]), int(k), False) for g in crossing[:, k].nonzero()[0]]
        found += [Candidate(int(rows[g]), int(k), True) for g in humps[:, k].nonzero()[0]]
    return found


def _peak(g0: Vector, g1: Vector, r0: Vector, r1: Vector) -> Vector:
    """Largest value of the cubics through both ends with the given slopes (sampled)."""
    h = _CUBIC @ np.array([g0, r0, g1, r1])
    return np.max(h, axis=0)


def _hermite(s: Vector) -> Vector:
    """Values of the four cubic Hermite polynomials at s in (0, 1), shape (len(s), 4)."""
    return np.array([(1 + 2 * s) * (1 - s) ** 2, s * (1 - s) ** 2, s * s * (3 - 2 * s), s * s * (s - 1)]).T


_CUBIC = _hermite(np.linspace(0.05, 0.95, 19))

Trial = Callable[[float], tuple[Point, Vector, Vector]]
"""Integrates from the beginning of the interval by a time and gives the point there with guards and rates."""


@dataclass
class Located:
    """An event: where, and which guards are at zero there."""

    point: Point
    guards: list[int]


def locate(
    trial: Trial,
    span: float,
    first: tuple[Vector, Vector],
    last: tuple[Vector, Vector],
    group: list[Candidate],
    t: float,
) -> Located | None:
    """Find the earliest time in (0, span] at which a guard of the group becomes positive.

    Safeguarded Newton iterations on re-integrations from the beginning of the interval.

    Args:
        trial: integrates into the interval.
        span: length of the interval in s.
        first: guards and rates at its beginning.
        last: guards and rates at its end.
        group: the guards that become positive in the interval.
        t: time of its beginning.

    Returns:
        The event, or None if a guard only came near zero.
    """
    watched = np.array(sorted({one.guard for one in group}))
    low, high = 0.0, span
    if not np.any(last[0][watched] > 0):
        top = _positive_top(trial, span, first, last, group)
        if top is None:
            return None
        high = top
    tolerance = _LOCATED * max(1.0, abs(t))
    guess = min(_first_guess(first, last, group, span), high)
    best: tuple[Point, Vector, Vector] | None = None
    for _ in range(_MAX_TRIALS):
        point, values, rates = trial(guess)
        if np.any(values[watched] > 0):
            high, best = guess, (point, values, rates)
        else:
            low = guess
        step = _newton(values, rates, watched)
        if step is not None and abs(step) <= tolerance:
            return _event(point, values, rates, watched, tolerance)
        if high - low <= tolerance:
            break
        target = guess + step if step is not None else -1.0
        guess = target if low < target < high else 0.5 * (low + high)
    return _event(*(best or trial(high)), watched, tolerance)


def _positive_top(
    trial: Trial, span: float, first: tuple[Vector, Vector], last: tuple[Vector, Vector], group: list[Candidate]
) -> float | None:
    """Look for a time at which a guard that rises and falls again is positive; None if it stays below zero."""
    for one in group:
        g, low, high = one.guard, 0.0, span
        guess = _cubic(first[0][g], last[0][g], first[1][g] * span, last[1][g] * span, inside=True) * span
        for _ in range(_MAX_TRIALS):
            _, values, rates = trial(guess)
            if values[g] > 0:
                return guess
            low, high = (guess, high) if rates[g] > 0 else (low, guess)
            # What is left of the rise cannot reach zero any more.
            if values[g] + abs(rates[g]) * (high - low) < 0 or high - low < 1e-12:
                break
            guess = 0.5 * (low + high)
    return None


def _event(point: Point, values: Vector, rates: Vector, watched: Any, tolerance: float) -> Located:
    near = [int(g) for g in watched if values[g] > 0 or (rates[g] > 0 and -values[g] <= 10 * tolerance * rates[g])]
    return Located(point, near)


def _newton(values: Vector, rates: Vector, watched: Any) -> float | None:
    """Newton step to the earliest zero of the rising guards; None where one has risen before, and falls again."""
    if np.any((values[watched] > 0) & (rates[watched] <= 0)):
        return None
    steps = [float(-values[g] / rates[g]) for g in watched if rates[g] > 0]
    return min(steps) if steps else None


def _first_guess(
    first: tuple[Vector, Vector], last: tuple[Vector, Vector], group: list[Candidate], span: float
) -> float:
    guesses: list[float] = []
    for one in group:
        g = one.guard
        roots = _cubic(first[0][g], last[0][g], first[1][g] * span, last[1][g] * span, one.inside)
        guesses.append(roots * span)
    return min(guesses)


def _cubic(g0: float, g1: float, r0: float, r1: float, inside: bool) -> float:
    """Rising zero (or, if `inside`, the first top) of the cubic Hermite interpolant in (0, 1)."""
    a, b, c = 2 * g0 - 2 * g1 + r0 + r1, -3 * g0 + 3 * g1 - 2 * r0 - r1, r0
    if inside:
        tops = [
            s.real
            for s in np.roots([3 * a, 2 * b, c])
            if abs(s.imag) < 1e-12 and 0 < s.real < 1 and 6 * a * s.real + 2 * b < 0
        ]
        return min(tops, default=0.5)
    if not g0 <= 0 < g1 or (g0 == 0 and c >= 0):
        return 0.5
    low, high, s = 0.0, 1.0, 0.5
    for _ in range(_GUESSING):
        value, slope = ((a * s + b) * s + c) * s + g0, (3 * a * s + 2 * b) * s + c
        low, high = (low, s) if value > 0 else (s, high)
        newton = s - value / slope if slope > 0 else -1.0
        s = newton if low < newton < high else 0.5 * (low + high)
    return s
