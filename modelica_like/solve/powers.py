"""Integrals of the powers along a run, by quadrature over its own results, and in between where that is too coarse."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import casadi as ca
import numpy as np

from modelica_like.compile.buffers import along
from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.errors import ModelicaLikeError
from modelica_like.initialize import Point, implicit_at
from modelica_like.solve.idas import Integrator
from modelica_like.solve.nodes import LOBATTO, LOBATTO_WEIGHTS, Nodes, Places, Rule, between, rules
from modelica_like.solve.options import Options
from modelica_like.solve.recorder import Segment

POWERS = 5
"""Powers of a component: loss, source, inflow, rate of the stored energy, magnitudes through the connectors."""
_GAIN = 0.1
"""How much better than the next lower one a rule is believed to be at most."""
_RATE = 3
_SHARE = 3.0
"""Part of the run's relative tolerance that the quadrature may add."""
_TRUSTED = 100.0
"""Mismatch of states, in relative tolerances of the run, up to which they are interpolated and not integrated again."""
_SUSPECT = 1e-3
"""Mismatch of states, relative to their largest values, from which the energies there are compared."""
_ENOUGH = 4
_ROUNDS, _EVERYWHERE = 9, 3
_TRIALS = 40
"""Calls of the integrator for one piece of a run."""
_CLOSE = 0.1
"""Distance of two results, as part of the next one, up to which one of them is left out."""
_MOST_POINTS = 200_000
_PIECE = 20_000
"""Results that are looked at together."""
_NEAR = 8
"""Intervals that are integrated again as well rather than to start once more behind them."""
_SOME, _MANY, _MOST_OUTPUTS = 32, 128, 4096
_UNRESOLVED = 1e-2
"""Mismatch of states, relative to their largest values, from which many points are needed at once."""
_POLISHING, _SMALL_STEP = 6, 1e-8
"""Newton's steps; behind a small one there is nothing but rounding."""


@dataclass
class Terms:
    """Energy terms at some points.

    Attributes:
        stored: energies, shape (components, n).
        powers: those that are not zero anyway, shape (kept, n).
        rates: derivatives of the states, shape (nx, n).
    """

    stored: Vector
    powers: Vector
    rates: Vector


def pieces(segments: tuple[Segment, ...]) -> Iterator[tuple[Segment, ...]]:
    """Go through a run in pieces of bounded size; a long segment is cut into some that share a result."""
    held: list[Segment] = []
    count = 0
    for segment in segments:
        for first in range(0, max(len(segment.times) - 1, 1), _PIECE):
            part = slice(first, first + _PIECE + 1)
            held.append(Segment(segment.times[part], segment.x[:, part], segment.z[:, part], segment.d))
            count += len(held[-1].times)
            if count > _PIECE:
                yield tuple(held)
                held, count = [], 0
    if held:
        yield tuple(held)


def stored_at_ends(model: CompiledDae, segments: tuple[Segment, ...]) -> tuple[Vector, Vector]:
    """Return stored energies at the beginnings and at the ends of segments, shapes (components, segments), in J."""
    function = along(model._cache, "energy terms", lambda: _terms_function(model))
    d = np.array([segment.d for segment in segments]).T

    def at(k: int) -> Vector:
        times = np.array([segment.times[k] for segment in segments])
        x, z = (np.array([getattr(segment, name)[:, k] for segment in segments]).T for name in "xz")
        return function(times, x, z, model.p, model.u, d)[0]

    return at(0), at(-1)


class Powers:
    """Evaluates and integrates the energy terms of a run.

    Args:
        model: the compiled model.
        options: of the run.
        segments: smooth pieces of it.

    Attributes:
        results: all of them.
        at_results: the energy terms there.
        stored: largest energy that is stored at one time, in J.
    """

    def __init__(self, model: CompiledDae, options: Options, segments: tuple[Segment, ...]) -> None:
        self.model, self.options, self.segments = model, options, segments
        self._discretes = np.array([segment.d for segment in segments]).T
        self._kept = _kept(model)
        self.results = _together([(s.times, s.x, s.z, k) for k, s in enumerate(segments)])
        self.at_results = self._terms(self.results)
        largest = np.max(np.abs(self.results.x), axis=1, initial=0.0)
        self._scales = np.maximum(largest, options.atol * model.nominals)[:, None]
        self.stored = float(np.max(np.sum(np.abs(self.at_results.stored), axis=0), initial=0.0))
        self._points = 0

    def table(self, powers: Vector) -> Vector:
        """Return powers of all components, shape (5, components, ...): loss, source, inflow, rate, magnitudes."""
        whole = np.zeros((POWERS * len(self.model.components), *powers.shape[1:]))
        whole[self._kept] = powers
        return whole.reshape(POWERS, len(self.model.components), *powers.shape[1:])

    def integrals(self) -> Vector:
        """Integrate all powers over the run; shape (5, components), in J."""
        every, terms = self.results, self.at_results
        kept = _apart(every)
        first, last = (np.searchsorted(kept, ends[kept]) for ends in (every.first, every.last))
        nodes = Nodes(every.times[kept], every.x[:, kept], every.z[:, kept], every.segment[kept], first, last)
        terms = Terms(terms.stored[:, kept], terms.powers[:, kept], terms.rates[:, kept])
        return self.table(self._integrate(nodes, terms, 0, None))

    # -- terms -------------------------------------------------------------------------------------------------------

    def _terms(self, nodes: Nodes) -> Terms:
        model = self.model
        function = along(model._cache, "energy terms", lambda: _terms_function(model))
        d = self._discretes[:, nodes.segment]
        return Terms(*function(nodes.times, nodes.x, nodes.z, model.p, model.u, d))

    def _polished(self, nodes: Nodes) -> None:
        """Let interpolated implicit unknowns meet their equations."""
        model, size = self.model, len(self.model.implicit)
        function = along(model._cache, "implicit equations", lambda: implicit_at(model))
        d = self._discretes[:, nodes.segment]
        for _ in range(_POLISHING if size else 0):
            residual, jacobian = function(nodes.times, nodes.x, nodes.z, model.p, model.u, d)
            slopes = jacobian.T.reshape(-1, size, size).transpose(0, 2, 1)
            try:
                step = np.linalg.solve(slopes, residual.T[:, :, None])[:, :, 0].T
            except np.linalg.LinAlgError:
                # What is not determined stays as near to the interpolation as it can.
                step = (np.linalg.pinv(slopes) @ residual.T[:, :, None])[:, :, 0].T
            if not np.isfinite(step).all():
                return
            nodes.z = nodes.z - step
            if np.max(np.abs(step) / (1.0 + np.abs(nodes.z)), initial=0.0) < _SMALL_STEP:
                return

    # -- integration -------------------------------------------------------------------------------------------------

    def _integrate(self, nodes: Nodes, terms: Terms, depth: int, allowed: float | None) -> Vector:
        """Integrate over the intervals of some points, over those that are too coarse with more points inside."""
        intervals = nodes.intervals
        intervals = intervals[nodes.times[intervals + 1] > nodes.times[intervals]]
        if not len(intervals):
            return np.zeros(len(terms.powers))
        self._points += len(nodes.times)
        order = rules(nodes, intervals)
        weights = order[0].totals(len(nodes.times), slice(None))
        whole = terms.powers @ weights
        if allowed is None:
            share = _SHARE if self.model.states else 0.1 * _SHARE
            allowed = share * self.options.rtol * self._moved(np.abs(terms.powers) @ np.abs(weights))
        errors, mismatch = self._errors(nodes, terms, intervals, order)
        coarse = _largest(errors, allowed)
        # Further down, it is the integrator's own error that energies drift with.
        adrift = self._adrift(nodes, terms, intervals, 2.0 * allowed if depth == 1 else np.inf)
        coarse |= adrift
        if not self.model.states and (depth == 0 or (depth < _EVERYWHERE and coarse.any())):
            # No rates of states tell what happens between the results.
            coarse[:] = True
        if not coarse.any() or depth >= _ROUNDS or self._points > _MOST_POINTS:
            return whole
        # A few results alone say too little about the states between them.
        enough = nodes.last[intervals] - nodes.first[intervals] >= _ENOUGH
        again = adrift | coarse & enough & (mismatch > _TRUSTED * self.options.rtol)
        if nodes.made:
            # What was interpolated in vain is integrated from its beginning.
            again = np.isin(nodes.first[intervals], nodes.first[intervals[again]])
        finer, done = self._integrated_again(nodes, intervals, again, mismatch)
        inside = coarse & ~done
        parts = [(finer, self._terms(finer))] if finer is not None else []
        parts += [self._interpolated(nodes, terms, intervals[inside])] if inside.any() else []
        total = terms.powers @ order[0].totals(len(nodes.times), ~(done | inside))
        for part, there in parts:
            total = total + self._integrate(part, there, depth + 1, allowed / len(parts))
        return total

    def _moved(self, integrals: Vector) -> float:
        """Return the energy that moves in a run: what it is precise to is a part of that, not of what is left over.

        An oscillation exchanges its energy again and again.
        """
        return max(self.stored, float(np.nanmax(integrals, initial=0.0)))

    def _errors(
        self, nodes: Nodes, terms: Terms, intervals: Places, order: tuple[Rule, Rule, Rule]
    ) -> tuple[Vector, Vector]:
        """Return for each interval the error of its integrals in J, and how far its states are off, as fractions.

        Powers, and rates of states, are looked at in two sums of all with different weights, lest they cancel.
        """
        mixed = np.concatenate([_mixed(terms.powers), _mixed(terms.rates / self._scales)])
        best, lower, lowest = (rule.apply(mixed) for rule in order)
        near, far = np.abs(best - lower), np.abs(lower - lowest)
        errors = np.max(_gaining(near, far)[:2], axis=0)
        if nodes.made:
            errors = errors * self._balanced(nodes, mixed[:2], errors)
        moved = np.diff(_mixed(nodes.x / self._scales), axis=1)[:, intervals]
        mismatch = np.max(np.abs(moved - best[2:]), axis=0)
        suspect = np.flatnonzero(mismatch > _SUSPECT)
        if len(suspect):
            errors[suspect] = np.maximum(
                errors[suspect], self._astray(nodes, terms, intervals[suspect], order[0], suspect)
            )
        return np.where(np.isfinite(errors), errors, np.inf), np.where(np.isfinite(mismatch), mismatch, np.inf)

    def _balanced(self, nodes: Nodes, mixed: Vector, errors: Vector) -> Vector:
        """Return by how much errors within a block cancel: Lobatto's rule as a whole is better than its parts."""
        size = len(LOBATTO)
        if len(errors) * size != len(nodes.times) * (size - 1):
            return np.ones(len(errors))
        spans = nodes.times[size - 1 :: size] - nodes.times[::size]
        blocks = mixed.reshape(2, -1, size)
        best, lower, lowest = (blocks @ weights * spans for weights in LOBATTO_WEIGHTS)
        whole = np.max(_gaining(np.abs(best - lower), np.abs(lower - lowest)), axis=0)
        parts = np.sum(errors.reshape(-1, size - 1), axis=1)
        return np.repeat(np.minimum(1.0, whole / np.maximum(parts, 1e-300)), size - 1)

    def _astray(self, nodes: Nodes, terms: Terms, intervals: Places, rule: Rule, rows: Places) -> Vector:
        """Return how much stored energies differ between what the rates lead to and the state at the end, in J."""
        ends = intervals + 1
        reached = nodes.x[:, intervals] + Rule(rule.places[rows], rule.weights[rows]).apply(terms.rates)
        led = Nodes(nodes.times[ends], reached, nodes.z[:, ends], nodes.segment[ends], ends, ends)
        return np.max(np.abs(self._terms(led).stored - terms.stored[:, ends]), axis=0, initial=0.0)

    def _adrift(self, nodes: Nodes, terms: Terms, intervals: Places, allowed: float) -> Places:
        """Mark intervals of interpolated blocks over which stored energies change otherwise than their rates say."""
        if not nodes.made or allowed == np.inf:
            return np.zeros(len(intervals), bool)
        size = len(LOBATTO)
        spans = nodes.times[size - 1 :: size] - nodes.times[::size]
        means = np.einsum("rbk,k->rb", terms.powers.reshape(len(terms.powers), -1, size), LOBATTO_WEIGHTS[0])
        change = terms.stored[:, size - 1 :: size] - terms.stored[:, ::size]
        drift = np.max(np.abs(change - self.table(means * spans)[_RATE]), axis=0, initial=0.0)
        return _largest(np.nan_to_num(drift, nan=np.inf), allowed)[nodes.first[intervals] // size]

    # -- points in between -------------------------------------------------------------------------------------------

    def _interpolated(self, nodes: Nodes, terms: Terms, intervals: Places) -> tuple[Nodes, Terms]:
        """Return a block of five points for each interval, and the energy terms there."""
        times, x, z = between(nodes, terms.rates, intervals, LOBATTO[1:-1])
        inner = np.repeat(nodes.segment[intervals], times.shape[1])
        x, z = (values.reshape(len(values), times.size) for values in (x, z))
        flat = Nodes(times.ravel(), x, z, inner, inner, inner)
        self._polished(flat)
        new = self._terms(flat)

        def joined(outer: Vector, inside: Vector) -> Vector:
            middle = inside.reshape(*outer.shape[:-1], *times.shape)
            block = [outer[..., intervals, None], middle, outer[..., intervals + 1, None]]
            return np.concatenate(block, axis=-1).reshape(*outer.shape[:-1], len(times) * len(LOBATTO))

        first = np.repeat(np.arange(len(times)) * len(LOBATTO), len(LOBATTO))
        made = Nodes(
            joined(nodes.times, flat.times), joined(nodes.x, flat.x), joined(nodes.z, flat.z),
            np.repeat(nodes.segment[intervals], len(LOBATTO)), first, first + len(LOBATTO) - 1, made=True,
        )  # fmt: skip
        pairs = ((terms.stored, new.stored), (terms.powers, new.powers), (terms.rates, new.rates))
        return made, Terms(*(joined(*pair) for pair in pairs))

    def _integrated_again(
        self, nodes: Nodes, intervals: Places, wanted: Places, mismatch: Vector
    ) -> tuple[Nodes | None, Places]:
        """Integrate the wanted intervals with more results, as far as that succeeds; return which these are."""
        done = np.zeros(len(intervals), bool)
        blocks: list[_Block] = []
        for run in _contiguous(nodes, intervals, wanted):
            a, b = intervals[run[0]], intervals[run[-1]] + 1
            d = self._discretes[:, nodes.segment[a]]
            start = Point(float(nodes.times[a]), nodes.x[:, a].copy(), nodes.z[:, a].copy(), d)
            fewest = _MANY if np.max(mismatch[run]) > _UNRESOLVED else _SOME
            outputs = min(max(fewest, 1 << (4 * len(run) - 1).bit_length()), _MOST_OUTPUTS)
            found = self._followed(start, float(nodes.times[b]), outputs, int(nodes.segment[a]))
            blocks += found
            done[run] = bool(found)
        return (_together(blocks) if blocks else None), done

    def _followed(self, start: Point, end: float, outputs: int, segment: int) -> list[_Block]:
        """Integrate from a point to a time, in pieces where it fails in one; nothing if it fails for good."""
        blocks: list[_Block] = []
        span = end - start.t
        for _ in range(_TRIALS):
            last = start.t + span >= end - 1e-9 * span
            span = end - start.t if last else span
            try:
                x, z = Integrator(self.model, self.options).run(start, span, outputs)
            except ModelicaLikeError:
                span /= 8
                continue
            times = start.t + span * np.arange(outputs + 1) / outputs
            times[-1] = end if last else times[-1]
            x = np.concatenate([start.x[:, None], x], axis=1)
            z = np.concatenate([start.z[:, None], z], axis=1)
            blocks.append((times, x, z, segment))
            if last:
                return blocks
            start = Point(float(times[-1]), x[:, -1].copy(), z[:, -1].copy(), start.d)
            span *= 2
        return []


_Block = tuple[Vector, Vector, Vector, int]


def _contiguous(nodes: Nodes, intervals: Places, wanted: Places) -> list[Places]:
    """Return runs of wanted intervals that follow each other in time, with what lies between two that are near."""
    breaks = nodes.times[intervals[1:]] != nodes.times[intervals[:-1] + 1]
    breaks |= nodes.segment[intervals[1:]] != nodes.segment[intervals[:-1]]
    piece = np.append(0, np.cumsum(breaks))
    chosen = np.flatnonzero(wanted)
    cuts = (np.diff(chosen) > _NEAR) | (np.diff(piece[chosen]) > 0)
    long = _MOST_OUTPUTS // 4
    found: list[Places] = []
    for run in np.split(chosen, np.flatnonzero(cuts) + 1) if len(chosen) else ():
        whole = np.arange(run[0], run[-1] + 1)
        found += np.split(whole, range(long, len(whole), long))
    return found


def _together(blocks: list[_Block]) -> Nodes:
    sizes = [len(times) for times, *_ in blocks]
    ends = np.cumsum(sizes)
    times = np.concatenate([block[0] for block in blocks])
    x, z = (np.concatenate([block[k] for block in blocks], axis=1) for k in (1, 2))
    segment = np.repeat([block[3] for block in blocks], sizes)
    return Nodes(times, x, z, segment, np.repeat(ends - sizes, sizes), np.repeat(ends - 1, sizes))


def _apart(nodes: Nodes) -> Places:
    """Return the ends of segments, and what lies between them well apart from its neighbours.

    The results beside an event may be as near to it as they like; a polynomial through both would follow their errors.
    """
    gaps = np.diff(nodes.times)
    before, after = np.append(0.0, gaps), np.append(gaps, 0.0)
    places = np.arange(len(nodes.times))
    inner = (places > nodes.first) & (places < nodes.last)
    return np.flatnonzero(~inner | (np.minimum(before, after) >= _CLOSE * np.maximum(before, after)))


def _largest(errors: Vector, allowed: float) -> Places:
    """Mark the largest errors, so that the others together are no more than allowed."""
    order = np.argsort(errors)
    marked = np.zeros(len(errors), bool)
    marked[order[np.cumsum(errors[order]) > allowed]] = True
    return marked


def _gaining(near: Vector, far: Vector) -> Vector:
    """Estimate the error of a rule from how much it differs from one of lower order, and this from one of still lower.

    The difference of two rules is the error of the lower one; a difference more tells what an order gains.
    """
    return near * np.divide(near, far, out=np.ones_like(near), where=far > near).clip(_GAIN)


def _mixed(rows: Vector) -> Vector:
    """Return two sums of rows with different weights, shape (2, n)."""
    turns = 0.618 * np.arange(len(rows))
    weights = np.array([1.0 + np.modf(turns)[0], 2.0 - 3.0 * np.modf(1.7 * turns)[0]])
    return weights @ rows


def _kept(model: CompiledDae) -> list[int]:
    if "energy kept" not in model._cache:
        every = ca.vec(model.energy(*model.arguments.values())[:, 1:])
        model._cache["energy kept"] = [k for k in range(every.numel()) if not every[k].is_zero()]
    return model._cache["energy kept"]


def _terms_function(model: CompiledDae) -> ca.Function:
    """Return stored energies, powers that are not zero anyway, and derivatives of the states, as one function."""
    arguments = list(model.arguments.values())
    terms = model.energy(*arguments)
    powers = ca.vec(terms[:, 1:])[_kept(model)]
    results = [ca.densify(one) for one in (terms[:, 0], powers, model.ode(*arguments))]
    return ca.Function("terms", arguments, results, {"cse": True})
