"""Delayed values: polynomials of time for a piece of a run, through what the run has been before."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.errors import ValueOutOfRange
from modelica_like.language.delay import TERMS
from modelica_like.options import Options
from modelica_like.solve.between import Between
from modelica_like.solve.initialize import Point, call, solve_implicit
from modelica_like.solve.instants import just_after
from modelica_like.solve.looks import Looks

_NODES = -np.cos(np.pi * (np.arange(TERMS) + 0.5) / TERMS)
_SERIES = np.cos(np.outer(np.arange(TERMS), np.arccos(_NODES))) * 2 / TERMS
_SERIES[0] /= 2
"""Terms of the Chebyshev series from the values at its nodes."""
_LAST = 3
"""Number of last terms that must be below the tolerance."""
_SHORTEST = 1e-6
"""Part of the length for which a series is sought at first that the shortest piece has."""
_NOISE, _SMOOTHER = 100.0, 0.6
"""Last terms in tolerances, and what half the length leaves of them, where they are errors of the run itself."""
_SMOOTH = 7
"""A kink that has come again so often is smooth: each time a state integrates it once."""


@dataclass(frozen=True)
class _Past:
    """What a run has been from a time on: looks, of which the last valid one is known."""

    begin: float
    looks: Looks
    last: int
    d: Vector


class Delays:
    """Gives delayed values to a run, and knows until when they are valid.

    Args:
        model: the compiled model.
        options: tolerances.
        start: of the run.
        between: reads the past.

    Attributes:
        until: time in s until which the present series are valid.

    Raises:
        ValueOutOfRange: a delay is not positive.
    """

    def __init__(self, model: CompiledDae, options: Options, start: Point, between: Between) -> None:
        self._model, self._options, self._between = model, options, between
        self._places = np.array(model.delay_parts, int).reshape(-1, TERMS + 2)
        self.until = start.t if len(self._places) else np.inf
        if not len(self._places):
            return
        self._times = call(model, model.delays, start)[1::2].copy()
        for one, time in zip(self._places, self._times, strict=True):
            if not 0 < time < np.inf:
                path = model.flat_discretes[one[0]].path.removesuffix("[0]")
                raise ValueOutOfRange(f"The time of {path} is {time:g} s: it must be positive.")
        self._start, self._past = start.t, list[_Past]()
        self._before = self._scale = np.zeros(len(self._times))
        self._breaks: list[tuple[float, int]] = [(start.t, 0)]

    def keep(self, begin: float, looks: Looks, last: int, d: Vector) -> None:
        """Remember looks from a time on."""
        if len(self._places):
            self._past.append(_Past(begin, looks, last, d))

    def renewed(self, now: Point, stop: float) -> Point:
        """Return the present point with series for the time ahead."""
        if now.t <= self._start:
            self._before = call(self._model, self._model.delays, now)[::2].copy()
        half = 0.5 * (self._next_break(min(stop, now.t + self._times.min()), now.t) - now.t)
        needed = sum(one.begin <= now.t - self._times.max() for one in self._past)
        self._past = self._past[max(needed - 1, 0) :]
        half, series = self._resolved(now.t, half)
        self.until, after = now.t + 2 * half, now.copy()
        after.d[self._places[:, :TERMS]] = series
        after.d[self._places[:, TERMS]] = now.t
        after.d[self._places[:, TERMS + 1]] = 1 / half
        solve_implicit(self._model, after)
        self._pass_on(now, after)
        return after

    def broken(self, t: float, before: int = -1) -> None:
        """Note a jump or kink, which comes again later; `before` says how often it has been integrated."""
        if len(self._places) and before < _SMOOTH:
            self._breaks.append((t, before + 1))

    def _next_break(self, stop: float, t: float) -> float:
        return min([stop, *(b for one, _ in self._breaks for b in one + self._times if just_after(t) < b)])

    def _pass_on(self, now: Point, after: Point) -> None:
        """Note the jumps and kinks that come again now."""
        near = just_after(now.t) - now.t
        here = [order for one, order in self._breaks if (np.abs(one + self._times - now.t) <= near).any()]
        self._breaks = [one for one in self._breaks if one[0] + self._times.max() > just_after(now.t)]
        if here:
            values = [call(self._model, self._model.delays, one)[::2] for one in (now, after)]
            jumps = np.abs(values[1] - values[0]) > self._allowed()
            self.broken(now.t, -1 if jumps.any() else min(here))

    def _series(self, t: float, half: float) -> Vector:
        """Return the series of all delayed values from a time on; shape (delays, TERMS)."""
        times = t + half * (1 + _NODES)
        series = np.array([_SERIES @ self._value(k, times) for k in range(len(self._times))])
        self._scale = np.maximum(self._scale, np.abs(series).max(axis=1))
        return series

    def _resolved(self, t: float, half: float) -> tuple[float, Vector]:
        """Return a length at which the series are within the tolerances, half of it in s, and the series."""
        series, least = self._series(t, half), half * _SHORTEST
        while (rough := self._rough(series)) > 1.0 and half > least:
            shorter = self._series(t, 0.5 * half)
            if rough < _NOISE and self._rough(shorter) > _SMOOTHER * rough:
                break
            half, series = 0.5 * half, shorter
        return half, series

    def _rough(self, series: Vector) -> float:
        return float((np.abs(series[:, -_LAST:]).max(axis=1) / self._allowed()).max())

    def _allowed(self) -> Vector:
        return self._options.rtol * self._scale + self._options.atol

    def _value(self, k: int, times: Vector) -> Vector:
        """Return a delayed value at times."""
        times = times - self._times[k]
        values = np.full(len(times), self._before[k])
        begins = [one.begin for one in self._past]
        numbers = np.searchsorted(begins, times, side="right") - 1
        for number in np.unique(numbers[times > self._start]):
            past, those = self._past[number], (numbers == number) & (times > self._start)
            piece = self._between.now(past.looks, times[those], past.last)
            d = np.repeat(past.d[:, None], len(piece.times), axis=1)
            everywhere = self._model.along("delays", lambda: self._model.delays)
            found = everywhere(piece.times, piece.x, piece.z, self._model.p, self._model.u, d)[0]
            values[those] = found[2 * k]
        return values
