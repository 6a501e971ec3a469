"""Integrals of the powers along a run: by a rule over its results and, where these are too coarse, over finer ones.

Finer ones are read off the run's dense output, so that they see what the integrator has seen between two results. Where
that was not kept, IDAS integrates again.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache

import casadi as ca
import numpy as np

from modelica_like.compile.cached import Cached
from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.errors import StepFailed
from modelica_like.options import SMALLEST_ATOL, Options
from modelica_like.runs.quadrature import Places, composite, rules
from modelica_like.solve.dense import Dense
from modelica_like.solve.idas import Grid, Integrator
from modelica_like.solve.initialize import Point
from modelica_like.solve.recorder import Segment

POWERS = 4
"""Powers of a component that are integrated: loss, source, inflow, rate of the stored energy."""
_PIECE, _LARGEST = 20_000, 10_000_000
"""Number of results processed together, and largest count of numbers in their energy terms."""
_SHARE, _ALL = 0.1, 50.0
"""Accepted errors of one interval and of all, in relative tolerances of the exchanged energy."""
_ASTRAY = 3.0
"""The same for one interval where stored energies do not follow their rates."""
_FINER = 0.1
_FINEST = 1e-12
"""Factor of precision of a repeated integration over the run, and its limit."""
_NEAR = 8
"""Intervals that are also integrated again, because a new start would cost more."""
_DIGITS = 4e-16
"""Relative change of states that shows what in the energies is rounding."""
_SIGNS = np.array([-1.0, 1.0, -1.0])
_ROUNDING = 10.0
"""Errors that are left, in such changes."""
_CANCELLED = 0.1
"""Share of the sizes of stored energies below which these cancel."""
_MORE, _LEAST, _DEEPEST, _DEEPEST_READ = 4, 4, 12, 24
"""Finer results per interval, the smallest number of intervals for this, and the numbers of repetitions: by IDAS, and
off dense output, which costs little, and may show a start of nanoseconds between results that are hours apart."""
_SHORTEST = 1e-13
"""Length of an interval, relative to the time, in which more results would differ in the last digits of time only."""
_FINEST_RESULTS, _FOR_EACH = 100_000, 100
"""Finer results off dense output in all, and for each result: what is no number, or noise, never becomes fine."""
_FAILURES = 20
"""Failures of IDAS in a piece of a run after which the given results must suffice."""
_FEW = 4
"""Largest number of intervals of a smooth piece for which slopes of the powers are used."""
_BESIDE = np.array([[1 / 2, 1 / 2], [2 / 3, 1 / 3], [1 / 2, 1 / 2]])
"""Weights of the powers at both ends of an interval: with slopes at both, at the first, and without slopes."""
_NOTHING = 1e-15
"""Energy, in J, that counts as rest: it is rounding."""
_DECAYED = 1e-200
"""Power in W that counts as none."""
_CLOSE = 0.1
"""Distance of two results, relative to the next one, below which one of them is left out."""


@dataclass
class Results:
    """Some results of a run with their energy terms.

    Attributes:
        times: shape (n,), in s.
        x: states, shape (nx, n).
        z: implicit unknowns, shape (nz, n).
        d: modes and discrete values, shape (nd, n).
        first: the first result of the smooth piece each one belongs to, shape (n,).
        last: its last result, shape (n,).
        terms: energy terms in the order of `CompiledDae.energy`, shape (6, components, n).
        shaken: changes of the terms by the last digits of all unknowns, in size, at a few results.
    """

    times: Vector
    x: Vector
    z: Vector
    d: Vector
    first: Places
    last: Places
    terms: Vector
    shaken: Vector

    def point(self, k: int) -> Point:
        """Return one result."""
        return Point(float(self.times[k]), self.x[:, k].copy(), self.z[:, k].copy(), self.d[:, k].copy())


def results(model: CompiledDae, segments: Sequence[Segment], *, stored: bool = False) -> Iterator[Results]:
    """Yield a run in pieces of bounded size; pieces of a long segment share a result.

    Args:
        model: the compiled model.
        segments: smooth pieces of its run.
        stored: only stored energies and their rates are asked for, instead of all terms.
    """
    held: list[Segment] = []
    count, most = 0, min(_PIECE, max(_LARGEST // (6 * max(len(model.components), 1)), 100))
    for segment in segments:
        for first in range(0, max(len(segment.times) - 1, 1), most):
            part = slice(first, first + most + 1)
            held.append(Segment(segment.times[part], segment.x[:, part], segment.z[:, part], segment.d))
            count += len(held[-1].times)
            if count > most:
                yield _together(model, held, stored=stored)
                held, count = [], 0
    if held:
        yield _together(model, held, stored=stored)


def _together(model: CompiledDae, segments: list[Segment], *, stored: bool) -> Results:
    sizes = np.array([len(segment.times) for segment in segments])
    ends = sizes.cumsum()
    count, nx = int(ends[-1]), len(segments[0].x)
    owner = np.repeat(np.arange(len(sizes)), sizes)
    # One array, so that the results whose last digits are changed stand at its end.
    some, whole = [0, count // 2, count - 1], np.empty((1 + nx + len(segments[0].z), count + 3))
    for name, rows in (("times", 0), ("x", slice(1, 1 + nx)), ("z", slice(1 + nx, None))):
        np.concatenate([getattr(segment, name) for segment in segments], axis=-1, out=whole[rows, :count])
    whole[:, count:] = whole[:, some]
    whole[1::2, count:] *= 1.0 + _DIGITS * _SIGNS
    whole[2::2, count:] *= 1.0 - _DIGITS * _SIGNS
    d = np.array([segment.d for segment in segments]).T[:, np.append(owner, owner[some])]
    function = model.along((Cached.TERMS, stored), lambda: energy_terms(model, stored=stored))
    columns = function(whole[0], whole[1 : 1 + nx], whole[1 + nx :], model.p, model.u, d)[0]
    columns, whole = columns.reshape(-1, len(model.components), count + 3), whole[:, :count]
    terms, first, last = columns[..., :count], (ends - sizes)[owner], (ends - 1)[owner]
    shaken = np.abs(columns[..., count:] - terms[..., some])
    return Results(whole[0], whole[1 : 1 + nx], whole[1 + nx :], d[:, :count], first, last, terms, shaken)


def energy_terms(model: CompiledDae, *, stored: bool) -> ca.Function:
    """Return the energy terms of all components, or only stored energies and their rates, as a function."""
    arguments = list(model.arguments.values())
    terms = model.energy(*arguments)
    wanted = terms[:, [0, POWERS]] if stored else terms
    return ca.Function("terms", arguments, [ca.densify(ca.vec(wanted))], {"cse": True})


def drifts_of_results(model: CompiledDae, segments: Sequence[Segment]) -> tuple[Vector, float]:
    """Return changes of stored energies minus integrals of their rates, from results as they are.

    Returns:
        In J, of each component, shape (components,); and how much energy the components store and exchange with their
        stores, in J.
    """
    total, moved = np.zeros(len(model.components)), _NOTHING
    for some in results(model, segments, stored=True):
        steps, (stored, rates) = some.times[1:] - some.times[:-1], some.terms
        kept, weights = _apart(some, steps), np.zeros(len(some.times))
        weights[kept] = composite(
            some.times[kept], *(kept.searchsorted(ends[kept]) for ends in (some.first, some.last))
        )
        moved = max(moved, *_moving(stored, rates, steps))
        numbers = np.arange(len(some.times))
        total += stored[:, numbers == some.last].sum(axis=1) - stored[:, numbers == some.first].sum(axis=1)
        total -= rates @ weights
    return total, moved


class Powers:
    """Integrates the powers along a run, piece by piece.

    Args:
        model: the compiled model.
        options: of the run.
        count: number of its results.
        dense: its dense output, if that was kept.

    Attributes:
        stored: the largest energy that all components stored at one time so far, in J.
        moved: that, or the largest energy that one component exchanged. The precision of an integral is relative to
            it: an oscillation exchanges its energy repeatedly.
        unknown: differences in J between the stored energy of each component and the integral of its rate where no
            results were fine enough; shape (components,).
    """

    def __init__(self, model: CompiledDae, options: Options, count: int, dense: Dense | None = None) -> None:
        self.model, self.options, self._dense = model, options, dense
        self._share, self._left = min(_SHARE, _ALL / count), _FINEST_RESULTS + _FOR_EACH * count
        self.stored, self.moved, self._noise = 0.0, _NOTHING, np.zeros(2)
        self.unknown = np.zeros(len(model.components))
        rtol = min(options.rtol, max(_FINER * options.rtol, _FINEST))
        finer = replace(options, rtol=rtol, atol=max(options.atol * rtol / options.rtol, SMALLEST_ATOL))
        self._integrator = Integrator(model, finer, counted=False)

    def integrals(self, every: Results, depth: int = 0) -> Vector:
        """Integrate all powers over some results; shape (4, components), in J.

        Where these are too coarse, finer ones are computed between them, if needed repeatedly.
        """
        steps = every.times[1:] - every.times[:-1]
        kept, (intervals, places, weights) = _laid(every, steps)
        first, last = (kept.searchsorted(ends[kept])[intervals] for ends in (every.first, every.last))
        ends, places = kept[np.array([intervals, intervals + 1])], kept[places]
        powers = every.terms[1 : 1 + POWERS].reshape(-1, len(every.times))
        stored, moved = _moving(every.terms[0], powers, steps)
        self.stored = max(self.stored, stored)
        self.moved = max(self.moved, self.stored, moved)
        if not depth:
            self._hear(every)
        bent, bends = intervals[:0], np.zeros((2, len(powers), 0))
        coarse = self._coarse(every.terms, ends, places, weights, bent, bends, depth)
        few = (coarse & (last - first < _FEW)).nonzero()[0]
        if len(few) > 1 and self.model.states and not self.model.implicit:
            bent, bends = few, self._bends(every, ends[:, few])
            places[bent, :2] = ends[:, bent].T
            weights[bent] = 0.0
            weights[bent, :, :2] = _BESIDE * np.diff(every.times[ends[:, bent]], axis=0)[0][:, None, None]
            coarse = self._coarse(every.terms, ends, places, weights, bent, bends, depth)
        if self._dense is None:
            finest = np.full(len(coarse), depth >= _DEEPEST)
        else:
            begin, end = every.times[ends]
            finest = (depth >= _DEEPEST_READ) | (end - begin <= _SHORTEST * np.abs(end))
        again, finer = self._again(every, ends, _stretches(coarse & ~finest, first))
        # What is unknown in intervals that remain too coarse. Dense output is known down to its last digit: if stored
        # energy changes there without a power, it jumps.
        missed = coarse & ~again if self._dense is None else coarse & ~again & ~finest
        for k in missed.nonzero()[0]:
            change = np.diff(every.terms[0][:, ends[:, k]])[:, 0]
            self.unknown += np.abs(change - every.terms[POWERS][:, places[k]] @ weights[k, 0])
        weights[again] = 0.0
        total = _summed(powers, places, weights[:, 0]) + bends[0] @ ~again[bent]
        parts = (self.integrals(some, depth + 1) for some in results(self.model, finer))
        return sum(parts, total.reshape(POWERS, -1))

    def _again(self, every: Results, ends: Places, stretches: list[Places]) -> tuple[Places, list[Segment]]:
        """Return the intervals with finer results, and these; a stretch lies within one smooth piece.

        If IDAS gives up, stretches are divided; some may remain without finer results.
        """
        again, finer, failures = np.zeros(ends.shape[1], bool), list[Segment](), 0
        if not stretches:
            return again, finer
        with self._integrator.interrupts.watched():
            while stretches and failures < _FAILURES:
                stretch = stretches.pop()
                segment = self._finer(every, ends[0, stretch[0]], ends[1, stretch[-1]], len(stretch))
                if segment is not None:
                    finer.append(segment)
                    again[stretch] = True
                    continue
                failures += 1
                stretches += np.array_split(stretch, 2) if len(stretch) > 1 else []
        return again, finer

    def _finer(self, every: Results, begin: int, end: int, intervals: int) -> Segment | None:
        """Return more results from one of them to another; None if IDAS gives up, or there are too many."""
        start = every.point(begin)
        span, count = float(every.times[end]) - start.t, _MORE * 2 ** math.ceil(math.log2(max(intervals, _LEAST)))
        times = start.t + span * np.arange(count + 1) / count
        if self._dense is None:
            try:
                x, z = self._integrator.run(start, span, Grid(looks=count))
            except StepFailed:
                return None
        else:
            self._left -= count
            if self._left < 0 or not np.isfinite(start.x).all():
                return None
            # Its end is known: a time that is rounded up would be read behind the event there.
            x, z = (
                np.column_stack((inner, ends[:, end]))
                for inner, ends in zip(self._dense.at(times[1:-1]), (every.x, every.z), strict=True)
            )
        times[-1] = every.times[end]
        states, implicit = (np.column_stack(pair) for pair in ((start.x, x), (start.z, z)))
        return Segment(times, states, implicit, start.d)

    @property
    def cancelled(self) -> float:
        """Size in J of stored energies that cancel: a pendulum falling from the height of its pivot stores nothing."""
        return _CANCELLED * float(self._noise[0]) / (_ROUNDING * _DIGITS)

    @property
    def precision(self) -> float:
        """Accepted error of an interval in J."""
        return _ASTRAY * self.options.rtol * max(self.moved, self.cancelled)

    def _hear(self, every: Results) -> None:
        """Estimate the rounding of stored energies in J and of powers in W."""
        changes = every.shaken[0].sum(axis=0).max(), every.shaken[1:].sum(axis=(0, 1)).max()
        self._noise = np.maximum(self._noise, _ROUNDING * np.array(changes))

    def _bends(self, every: Results, ends: Places) -> Vector:
        """Return the part of slopes of powers in the integrals of the first two rules; shape (2, 4 components, m)."""
        model = self.model
        function = model.along(Cached.POWER_SLOPES, lambda: _slopes(model))
        x, z, d = (part[:, ends.ravel()] for part in (every.x, every.z, every.d))
        slopes = function(every.times[ends.ravel()], x, z, model.p, model.u, d)[0].reshape(-1, *ends.shape)
        squares = np.diff(every.times[ends], axis=0) ** 2
        return squares * np.stack([(slopes[:, 0] - slopes[:, 1]) / 12.0, slopes[:, 0] / 6.0])

    def _coarse(
        self, terms: Vector, ends: Places, places: Places, weights: Vector, bent: Places, bends: Vector, depth: int
    ) -> Places:
        """Return the intervals in which the powers are integrated too coarsely.

        The difference of two rules is the error of the lower one; another difference gives the gain of an order.
        Changes of stored energies are known, so their error is known directly; it also gives the gain of an order,
        unless it is the error of the states. All are checked in two sums with different weights, so that they do not
        cancel.
        """
        if not self.model.states and not depth:
            # There is no information between the results.
            return np.ones(len(places), bool)
        mixed, stored = _mixed(terms[1 : 1 + POWERS]), _mixing(terms[0].shape[0]) @ terms[0]
        best, lower, lowest = np.matmul(weights, mixed.T.take(places, 0)).transpose(1, 2, 0).copy()
        if len(bent):
            for rule, more in zip((best, lower), bends, strict=True):
                rule[:, bent] += _mixed(more.reshape(POWERS, terms.shape[1], -1))
        near, far = np.abs(best - lower), np.abs(lower - lowest)
        change = np.maximum(*np.abs(stored[:, ends[1]] - stored[:, ends[0]] - best[2:]))
        smooth = np.maximum(*near[2:])
        gain = np.maximum(_ratio(near[:2], far[:2]), _ratio(change, smooth))
        errors = np.maximum(np.maximum(*(near[:2] * gain)), np.minimum(change, smooth))
        allowed = self.options.rtol * max(self.moved, self.cancelled)
        # A weight that exactly balances a motion leaves nothing but rounding, which no finer result makes smaller.
        noise = self._noise[0] + self._noise[1] * np.abs(weights[:, 0].sum(axis=1))
        return ~(
            (errors <= np.maximum(self._share * allowed, noise)) & (change <= np.maximum(_ASTRAY * allowed, noise))
        )


def _laid(every: Results, gaps: Vector) -> tuple[Places, tuple[Places, Places, Vector]]:
    """Return the results that are not too close to others, and the rules over them."""
    kept = _apart(every, gaps)
    return kept, rules(every.times[kept], *(kept.searchsorted(ends[kept]) for ends in (every.first, every.last)))


def _moving(stored: Vector, powers: Vector, steps: Vector) -> tuple[float, float]:
    """Return the largest energy that all components store at one time, and that which one of them exchanges, in J."""
    # After a sudden start, the power of a single result would fill an interval in which it decays at once.
    sizes = np.abs(powers)
    least = (np.minimum(sizes[:, :-1], sizes[:, 1:]) @ steps).max(initial=0.0)
    most = 0.0 if least else (sizes[:, 1:] @ steps).max(initial=0.0)
    return float(np.abs(stored).sum(axis=0).max()), max(float(least), float(most))


def _summed(powers: Vector, places: Places, weights: Vector) -> Vector:
    return powers @ np.bincount(places.ravel(), weights.ravel(), powers.shape[1])


def _slopes(model: CompiledDae) -> ca.Function:
    """Return the rates of powers, as a function."""
    arguments = list(model.arguments.values())
    slopes = model.motion.held(ca.vec(model.energy(*arguments)[:, 1 : 1 + POWERS]))
    return ca.Function("slopes", arguments, [ca.densify(slopes)], {"cse": True})


def _apart(every: Results, gaps: Vector) -> Places:
    """Return the ends of segments, and results between them with enough distance from their neighbours.

    Results may be arbitrarily close to an event; a polynomial through both would follow their errors.
    """
    places = np.arange(len(every.times))
    kept = (places == every.first) | (places == every.last)
    kept[1:-1] |= np.minimum(gaps[:-1], gaps[1:]) >= _CLOSE * np.maximum(gaps[:-1], gaps[1:])
    return kept.nonzero()[0]


def _stretches(coarse: Places, piece: Places) -> list[Places]:
    """Return groups of coarse intervals of one smooth piece, joined if they are near each other."""
    chosen = np.flatnonzero(coarse)
    if not len(chosen):
        return []
    cuts = np.flatnonzero((np.diff(chosen) > _NEAR) | (np.diff(piece[chosen]) > 0)) + 1
    return [np.arange(run[0], run[-1] + 1) for run in np.split(chosen, cuts)]


def _ratio(small: Vector, large: Vector) -> Vector:
    return np.divide(small, large, out=np.ones_like(small), where=large > small)


def _mixed(powers: Vector) -> Vector:
    """Return two sums each, with different weights, of powers and of rates of stored energies; (4, n)."""
    flat, rates = powers.reshape(-1, powers.shape[-1]), powers[-1]
    mixed = np.concatenate([_mixing(len(flat)) @ flat, _mixing(len(rates)) @ rates])
    # Processors are slow with numbers near the smallest one, which are left of a decay.
    mixed[np.abs(mixed) < _DECAYED] = 0.0
    return mixed


@cache
def _mixing(count: int) -> Vector:
    turns = 0.618 * np.arange(count)
    return np.array([1.0 + np.modf(turns)[0], 2.0 - 3.0 * np.modf(1.7 * turns)[0]])
