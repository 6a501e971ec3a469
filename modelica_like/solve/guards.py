"""Guards along a segment: the times at which transitions fire."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.compile.compiled import CompiledDae, CompiledTransition, Vector
from modelica_like.flatten.conditions import JUST_TRUE
from modelica_like.solve.initialize import Point, is_linear, newton_at

_LOCATED = 1e-13
_NOISE = 1e-30
"""Values with which a decaying signal oscillates around zero; this is not an event."""
_LARGE = 1e300
_MAX_TRIALS = 60
_GUESSING, _GUESSED = 12, 1e-6
_NEAR = 0.1
"""A maximum between two results is checked if it is this close to zero, relative to the values at both ends."""


class Guards:
    """Evaluates guards and their rates, with the active ones of each mode."""

    def __init__(self, model: CompiledDae) -> None:
        self.model = model
        self.state_events = [t for t in model.transitions if not t.timed]
        self.count = len(self.state_events)
        self.positions = {id(one): k for k, one in enumerate(self.state_events)}
        self._at = model.fast("guards at", lambda: _clean(model, self.state_events))
        self._modes = np.array(sorted({one.mode for one in self.state_events}), int)
        self._active: dict[bytes, Any] = {}

    def active(self, d: Vector) -> Any:
        """Return the numbers of the guards that are active in the modes."""
        key = d[self._modes].tobytes()  # counters and samples change at every event, modes have few values
        if key not in self._active:
            may = [k for k, one in enumerate(self.state_events) if int(d[one.mode]) in one.sources]
            self._active[key] = np.array(may, int)
        return self._active[key]

    def at(self, point: Point) -> list[Vector]:
        """Return guards, their rates, and guards one time resolution later; inactive ones are -1."""
        return self._at(point.t, point.x, point.z, self.model.p, self.model.u, point.d)

    def follow(self, point: Point) -> list[Vector]:
        """Solve for the implicit unknowns by one or two steps of Newton's method; guards as by `at`.

        Returns:
            Guards, their rates, guards soon, and the implicit unknowns before the last step.
        """
        model = self.model
        follow = model.fast("guards follow", lambda: _following(model, self._at.function))
        *found, point.z = follow(point.t, point.x, point.z, model.p, model.u, point.d)
        return found

    def near(
        self, t: float, base: Vector, data: Vector, two: Vector, tolerances: tuple[float, Vector], z: Vector, d: Vector
    ) -> tuple[float, list[float], list[float]]:
        """Judge two interpolations of the states at a time by the states, and by the guards they give.

        Args:
            t: in s.
            base: is added to both, shape (nx,).
            data: what is interpolated, shape (terms, nx).
            two: weights of the data in both, shape (2, terms).
            tolerances: relative one, and absolute ones of the states.
            z: guess for the implicit unknowns.
            d: modes and discrete values.

        Returns:
            The largest difference of a state in tolerances (infinite if one is no number), the differences of the
            guards, and their changes if the states of the first interpolation change by their tolerances.
        """
        model = self.model
        near = model.fast("guards near", lambda: _near(model, len(data)))
        doubt, rough, moved = near(t, base, data.ravel(), two.ravel(), *tolerances, z, model.p, model.u, d)
        return float(doubt[0]), rough.tolist(), moved.tolist()

    def wanting(self, point: Point) -> list[CompiledTransition]:
        """State events that fire now: positive within the time resolution."""
        if not self.count:
            return []
        return [self.state_events[k] for k in (self.at(point)[2] > 0).nonzero()[0]]

    def along(self, times: Vector, x: Vector, z: Vector, d: Vector) -> tuple[Vector, Vector, Vector]:
        """Guards, rates and derivatives of the states at many times with the same modes.

        Shapes (guards, times), (guards, times), (nx, times).
        """
        count, model = len(times), self.model
        seen = model.fast(("seen", count), lambda: _along(*model.once("seen", lambda: _apart(_seen(model))), count))
        results = seen(times, x.ravel("F"), z.ravel("F"), model.p, model.u, d)
        values, rates, slopes = (v.reshape(count, -1).T for v in results)
        return values, rates, slopes


def _seen(model: CompiledDae) -> ca.Function:
    """Guards, their rates and those of the states in one function, because they share most operations."""
    arguments = list(model.arguments.values())
    rates = model.guard_rates(*arguments)
    rates = ca.densify(ca.if_else(ca.fabs(rates) <= _LARGE, rates, 0))
    results = [_numbers(model.guards(*arguments)), rates, model.ode(*arguments)]
    return ca.Function("seen", arguments, ca.cse(results))


def _apart(function: ca.Function) -> tuple[ca.Function, ca.Function]:
    """Split a function of (t, x, z, p, u, d): what depends on the last three only becomes its last argument."""
    arguments = function.sx_in()
    moving, symbols, fixed = ca.extract_parametric(function.call(arguments), ca.vertcat(*arguments[3:]))
    known = ca.Function("fixed", arguments[3:], [ca.vertcat(ca.SX(0, 1), *fixed)])
    return ca.Function("moving", [*arguments, ca.vertcat(ca.SX(0, 1), *symbols)], moving), known


def _along(moving: ca.Function, fixed: ca.Function, count: int) -> ca.Function:
    """Return both parts as one function at `count` times with the same parameters, inputs and modes."""
    everywhere = moving.map("moving_along", "serial", count, [3, 4, 5, 6], [])
    arguments = everywhere.mx_in()[:6]
    return ca.Function("seen_along", arguments, everywhere.call([*arguments, fixed(*arguments[3:])]))


def _clean(model: CompiledDae, events: list[CompiledTransition]) -> ca.Function:
    """Guards, rates and guards a moment later, with inactive ones set by the modes."""
    arguments, d = list(model.arguments.values()), model.arguments["d"]
    values, rates, _ = _seen(model)(*arguments)
    soon = _numbers(model.guards_soon(*arguments))
    may = ca.vertcat(*(functools.reduce(ca.logic_or, [d[one.mode] == k for k in one.sources]) for one in events))
    results = [ca.if_else(may, one, -1) if events else ca.SX(0, 1) for one in (values, soon)]
    return ca.Function("guards_at", arguments, [ca.densify(one) for one in ca.cse([results[0], rates, results[1]])])


def _near(model: CompiledDae, terms: int) -> ca.Function:
    nx = len(model.states)
    shapes = {"base": (nx, 1), "data": (nx, terms), "two": (terms, 2), "relative": (1, 1), "absolute": (nx, 1)}
    base, data, two, relative, absolute = given = [ca.MX.sym(name, *shape) for name, shape in shapes.items()]
    precise, coarse = (base + data @ one for one in ca.horzsplit(two))
    allowed = relative * ca.fabs(precise) + absolute
    doubts = ca.fabs(precise - coarse) / allowed
    doubt = ca.mmax(ca.densify(ca.vertcat(0, ca.if_else(doubts < np.inf, doubts, np.inf))))
    arguments = list(model.arguments.values())
    values = ca.Function("guards", arguments, [_numbers(model.guards(*arguments))], {"cse": True})
    if model.implicit:
        following = _following(model, values)
        values = ca.Function("guards", arguments := following.mx_in(), following.call(arguments)[:1])
    t, _, *rest = values.mx_in()
    first, second, third = (values(t, x, *rest) for x in (precise, coarse, precise + allowed))
    return ca.Function("near", [t, *given, *rest], [doubt, ca.fabs(second - first), ca.fabs(third - first)])


def _following(model: CompiledDae, at: ca.Function) -> ca.Function:
    newton = newton_at(model, look=False)
    arguments = newton.mx_in()
    t, x, z, *rest = arguments
    before = newton(t, x, z, *rest)[0]
    after = before if is_linear(model) else newton(t, x, before, *rest)[0]
    return ca.Function("guards_follow", arguments, [*at.call([t, x, after, *rest]), before, after])


def _numbers(guards: Any) -> Any:
    """Set a guard that is not a number to false, and rounding to zero."""
    sizes = ca.fabs(guards)
    rounding = ca.logic_and(sizes < _NOISE, sizes > JUST_TRUE)
    numbers = ca.if_else(guards > _LARGE, _LARGE, ca.if_else(guards >= -_LARGE, guards, -1))
    return ca.densify(ca.if_else(rounding, 0, numbers))


@dataclass
class Candidate:
    """An interval in which a guard becomes positive, at its end or in between."""

    guard: int
    interval: int
    inside: bool


def candidates(values: Vector, rates: Vector, active: Any, step: float) -> Iterator[list[Candidate]]:
    """Yield the intervals in which active guards may become positive.

    Args:
        values: guards at successive times, shape (guards, times).
        rates: their time derivatives.
        active: numbers of the active ones.
        step: longest distance of two times in s.
    """
    values, rates = values.take(active, 0), rates.take(active, 0)
    below, up = values <= 0, rates > _NOISE / step
    some = below[:, :-1] & ((below > up)[:, 1:] & up[:, :-1] | ~below[:, 1:])
    for k in np.logical_or.reduce(some, axis=0).nonzero()[0].tolist():
        rises, humps = list[Candidate](), list[Candidate]()
        for g in some[:, k].nonzero()[0].tolist():
            if not below[g, k + 1]:
                rises.append(Candidate(int(active[g]), k, False))
            elif _nearly(*values[g, k : k + 2].tolist(), *(rates[g, k : k + 2] * step).tolist()):
                humps.append(Candidate(int(active[g]), k, True))
        if rises or humps:
            yield rises + humps


def _nearly(g0: float, g1: float, r0: float, r1: float) -> bool:
    """Whether the cubic through both ends, not above zero, with the given slopes comes near zero, by samples."""
    return r1 < -_NOISE and float(np.max(_CUBIC @ [g0, r0, g1, r1])) > _NEAR * (g0 + g1)


def _hermite(s: Vector) -> Vector:
    """Values of the four cubic Hermite polynomials at s in (0, 1), shape (len(s), 4)."""
    return np.array([(1 + 2 * s) * (1 - s) ** 2, s * (1 - s) ** 2, s * s * (3 - 2 * s), s * s * (s - 1)]).T


_CUBIC = _hermite(np.linspace(0.05, 0.95, 19))

Trial = Callable[[float], tuple[Point, list[Vector]]]
"""Steps from the beginning of an interval by a time; returns the point with guards, rates, and guards soon."""
Ends = dict[int, tuple[float, float, float, float]]
"""By guard: values at both ends of an interval, and changes over it by the rates at both ends."""


@dataclass
class Located:
    """An event: its point, the guards that are zero there, and all guards a moment later."""

    point: Point
    guards: list[int]
    soon: Vector


def locate(trial: Trial, span: float, ends: Ends, group: list[Candidate], t: float) -> Located | None:
    """Find the earliest time in (0, span] at which a guard of the group becomes positive.

    Args:
        trial: steps into the interval.
        span: length of the interval in s.
        ends: guards at its ends.
        group: the guards that become positive in the interval.
        t: time of its beginning.

    Returns:
        The event, or None if a guard only came near zero.
    """
    low, high = 0.0, span
    if not any(ends[one.guard][1] > 0 for one in group):
        top = _positive_top(trial, span, ends, group)
        if top is None:
            return None
        high = top
    tolerance = _LOCATED * max(1.0, abs(t))
    guess = min(_cubic(*ends[one.guard], one.inside) * span for one in group)
    guess = min(high, max(guess, tolerance))
    for _ in range(_MAX_TRIALS):
        now = trial(guess)
        found, slopes = now[1][0].tolist(), now[1][1].tolist()
        watched = [(found[g], slopes[g]) for g in ends]
        if any(value > 0 for value, _ in watched):
            high = guess
        else:
            low = guess
        step = _newton(watched)
        if abs(step) <= tolerance:
            return _event(*now, ends, tolerance)
        if high - low <= tolerance:
            break
        guess = guess + step if low < guess + step < high else 0.5 * (low + high)
    return _event(*trial(high), ends, tolerance)


def _positive_top(trial: Trial, span: float, ends: Ends, group: list[Candidate]) -> float | None:
    """Search for a time at which a guard that rises and falls again is positive; None if it stays below zero."""
    for one in group:
        g, low, high = one.guard, 0.0, span
        rising, falling = ends[g][2] / span, ends[g][3] / span
        guess = _cubic(*ends[g], inside=True) * span
        for number in range(_MAX_TRIALS):
            values, rates, _ = trial(guess)[1]
            value, rate = float(values[g]), float(rates[g])
            if value > 0:
                return guess
            if rate > 0:
                low, rising = guess, rate
            else:
                high, falling = guess, rate
            # The remaining rise cannot pass zero.
            if value + abs(rate) * (high - low) <= 0:
                break
            guess = low + (high - low) * (rising / (rising - falling) if number % 3 else 0.5)
    return None


def _event(point: Point, guards: list[Vector], watched: Ends, tolerance: float) -> Located:
    values, rates, soon = guards
    return Located(point, [g for g in watched if values[g] + 10 * tolerance * max(rates[g], 0) > 0], soon)


def _newton(watched: list[tuple[float, float]]) -> float:
    """Newton step to the earliest zero of the rising guards; infinite if one has risen before, and falls again."""
    if any(value > 0 and rate <= 0 for value, rate in watched):
        return math.inf
    return min((-value / rate for value, rate in watched if rate > 0), default=math.inf)


def _cubic(g0: float, g1: float, r0: float, r1: float, inside: bool) -> float:
    """Rising zero (or, if `inside`, the top) of the cubic Hermite interpolant in (0, 1)."""
    a, b, c = 2 * g0 - 2 * g1 + r0 + r1, -3 * g0 + 3 * g1 - 2 * r0 - r1, r0
    if inside:
        # The slope falls from r0 > 0 to r1 < 0: one zero, in a form that also holds for a = 0.
        return c / (math.sqrt(max(0.0, b * b - 3 * a * c)) - b)
    if g0 == 0 and c >= 0:
        return 0.0
    low, high, s = 0.0, 1.0, 0.5
    for _ in range(_GUESSING):
        value, slope = ((a * s + b) * s + c) * s + g0, (3 * a * s + 2 * b) * s + c
        low, high = (low, s) if value > 0 else (s, high)
        newton = s - (value / slope if slope > 0 else math.inf)
        before, s = s, newton if low <= newton < high else 0.5 * (low + high)
        if abs(s - before) < _GUESSED:
            break
    return s
