"""Derivatives of a run by the adjoint of the compiled run-time, where that has all of them for certain.

The run is kept, and the adjoint goes back along it. What is not certain is left to the replay, which has the sentences
of refusals, too: a reading at an event or at a kink of a formula, other modes that follow, events that meet.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from modelica_like.analyse.replay.chain import Reading
from modelica_like.analyse.replay.noise import rounding
from modelica_like.analyse.sensitivity.at_kinks import kinks_of_outputs
from modelica_like.analyse.sensitivity.moving_kinks import kinks_at
from modelica_like.analyse.sensitivity.of_formulas import formula_kinks
from modelica_like.analyse.sensitivity.values import slopes_of
from modelica_like.compile.buffers import Vector
from modelica_like.compile.cached import Cached
from modelica_like.compile.compiled import TERMINAL, CompiledDae
from modelica_like.errors import ExportError, InitializationError, LanguageError, MissingExtra, NoGradient, SolveError
from modelica_like.native.along import Row, Seed
from modelica_like.native.expressions import key_of, with_expressions
from modelica_like.native.run import EngineLoop
from modelica_like.native.start import initialize
from modelica_like.options import Options
from modelica_like.runs.collect import Number
from modelica_like.runs.conserve import find_astray
from modelica_like.runs.readings import CONDITIONS, INTEGRATED, Output, Part, by_output, joined, leaves
from modelica_like.runs.solution import Solution
from modelica_like.runs.trajectories import Statistics
from modelica_like.solve.initialize import Point, StartKind
from modelica_like.solve.initialize.slopes import Sizes, Slopes, slopes
from modelica_like.solve.recorder import Event

_EXTREMES = ("max", "min", "peak")
_NEAR = 1e-9
"""Distance of two times, relative to the run, that are one."""
_TOGETHER = 1e-9
"""The same, of changes whose order means nothing."""
_FINER = 1e-2
"""Tolerance of a run relative to that of its derivatives: what the adjoint adds to it is about ten times as large."""
_DIGITS = 1e-13
"""What is zero, relative to the terms whose difference it is."""
_ALIKE = 1e-6
"""Difference of how the times of two kinks move, relative to their changes, that is rounding."""
_TRIALS = 12
"""Steps of the secant method to the top of a polynomial: it needs four."""
_TOP = 1e-11
"""Last one of them, relative to the time."""
_AT_KINK = 1e-7
"""Argument of a kink of a formula, relative to its operands, that may be at it: values are known that well."""
_ROUNDING = 1e-13
"""Of integrands, over their errors in units of the last digit: hundreds of roundings."""
_OF_INTEGRALS = 0.01
"""Their error in tolerances of the run over that of states: derivatives of waves are larger than these."""
_ZERO = 1e-30
"""Rounding of what is zero by zeros: everything moves it."""
_RESULTS = 100
"""Of a run: enough to judge its energies by."""


@dataclass(frozen=True)
class Differentiated:
    """A run, its outputs, and their derivatives, shape (outputs, names): nan where the replay has to tell."""

    solution: Solution
    values: Vector
    derivatives: Vector


def differentiated_run(
    model: CompiledDae, end: float, options: Options, start: StartKind, outputs: Sequence[Output], names: Sequence[str]
) -> Differentiated | None:
    """Simulate and differentiate; None where `simulate` or the replay has to tell.

    Args:
        model: the compiled model.
        end: end time in s.
        options: of the run.
        start: kind of start.
        outputs: without series.
        names: paths of parameters and inputs.
    """
    if TERMINAL in model.discrete_position or model.events.delay_parts or not model.states:
        return None
    parts = leaves(outputs)
    along = (*INTEGRATED, *_EXTREMES)
    wanted = [part for leaf in parts if leaf.kind in along for part in leaf.parts(model)]
    try:
        run = _kept(model, with_expressions(model, wanted, edges=True), end, options, start, names)
        if run is None:
            return None
        values = run.solution.read(*(leaf.name for leaf in parts))
        if not np.all(np.isfinite(values)) or _at_kinks(outputs, values):
            return None
        reads = [run.read(*each) for each in zip(outputs, by_output(outputs, values), strict=True)]
        if any(read is None for read in reads):
            return None
        off = _off_kinks(run.solution, outputs)
        slopes = run.slopes([*(read for read in reads if read), *([off] if off.seeds else ())])
    except (ExportError, InitializationError, LanguageError, MissingExtra, NoGradient, SolveError):
        return None
    given = np.abs(np.concatenate([model.p, model.u])[[model.fixed_position[name] for name in names]])
    led = ~(np.abs(slopes[len(outputs) :]) * np.where(given, given, 1.0) <= 1.0).all(axis=0)
    slopes = np.where(led, np.nan, slopes[: len(outputs)])
    return Differentiated(run.solution, np.ravel(joined(outputs, values)), slopes)


def tightened(options: Options, precision: float) -> Options:
    """Return options of a run whose derivatives are to have a precision."""
    rtol = min(options.rtol, precision * _FINER)
    return replace(options, rtol=rtol, atol=min(options.atol, rtol / 100))


def mode_sequence(events: Sequence[Event]) -> list[tuple[str, str, str]]:
    """Return mode, name before and name after of all mode changes; those at one instant in alphabetical order."""
    groups: list[list[Event]] = []
    for event in events:
        if not groups or event.time - groups[-1][0].time > _TOGETHER * max(1.0, abs(event.time)):
            groups.append([])
        groups[-1].append(event)
    ordered = (event for group in groups for event in sorted(group, key=lambda transition: transition.mode))
    return [(event.mode, event.before, event.after) for event in ordered]


def _kept(
    model: CompiledDae, extended: CompiledDae, end: float, options: Options, start: StartKind, names: Sequence[str]
) -> _Run | None:
    """Simulate and keep the run; None if it is not certain."""
    begin = initialize(model, start=start)
    loop = EngineLoop(extended, replace(options, points=_RESULTS), begin, end, by=names)
    if not loop.starts_there:
        return None
    record = loop.run()
    steps, evaluations, integrations = loop.counts
    statistics = Statistics(steps, evaluations, integrations, len(record.events), 0.0)
    solution = Solution(
        model, options, tuple(record.segments), tuple(record.events), statistics, tuple(record.impacts),
        tuple(record.notices), start, dense=record.keeper.dense(loop),
    )  # fmt: skip
    refused = solution.dense is None or solution.ended is not None
    astray = options.on_energy_drift != "off" and not refused and find_astray(solution) is not None
    return None if refused or astray else _Run(solution, extended, loop)


def _off_kinks(solution: Solution, outputs: Sequence[Output]) -> _Read:
    """Return what is zero at kinks of outputs at which the run stays all along a segment, over its rounding."""
    model = solution.model
    key, function = kinks_of_outputs(model, outputs)
    if not function.size1_out(0):
        return _Read()
    fast = model.fast(key, lambda: function)

    def at(point: Point) -> Vector:
        return fast(point.t, point.x, point.z, model.p, model.u, point.d)[0].copy()

    along = [np.array([at(segment.point(k)) for k in range(len(segment.times))]) for segment in solution.segments]
    end = solution.segments[-1].point(-1)
    part = slopes(model, end, key, None, lambda: function)
    terms = np.abs(part.by) @ np.abs(np.concatenate([end.x, model.p, model.u, end.d])) + np.abs(part.t * end.t)
    near = np.maximum(_NEAR * np.max([np.abs(values).max(axis=0) for values in along], axis=0), _DIGITS * terms)
    seeds: list[Seed] = []
    for segment, values in zip(solution.segments, along, strict=True):
        still, end = np.flatnonzero(np.all(np.abs(values) <= near, axis=0)).tolist(), segment.point(-1)
        sizes = np.abs(np.concatenate([end.x, model.p, model.u, end.d]))
        for by in slopes(model, end, key, still, lambda: function).by if still else ():
            factor = 1 + 0.6180339887498949 * len(seeds) % 1  # so that they do not cancel each other
            seeds.append(Seed(factor * by / max(_NEAR * float(np.abs(by) @ sizes), _ZERO), end.t))
    return _Read(tuple(seeds))


def _at_kinks(outputs: Sequence[Output], values: Sequence[float]) -> bool:
    size = _AT_KINK * float(np.max(np.abs(values), initial=0.0))
    edges = formula_kinks(outputs, [Reading(float(value)) for value in values])
    return any(abs(edge.reading.value) <= size for edge in edges)


@dataclass(frozen=True)
class _Read:
    """What an output reads: seeds, and weights of integrals with their sizes, by position of the variable."""

    seeds: tuple[Seed, ...] = ()
    integrals: tuple[tuple[int, float, float], ...] = ()

    def times(self, weight: float) -> _Read:
        """Return what a multiple of it reads."""
        seeds = (replace(seed, by=weight * seed.by, moving=weight * seed.moving) for seed in self.seeds)
        return _Read(tuple(seeds), tuple((place, weight * part, size) for place, part, size in self.integrals))


@dataclass(frozen=True)
class _Run:
    """A run that the run-time has kept."""

    solution: Solution
    extended: CompiledDae
    loop: EngineLoop

    @property
    def model(self) -> CompiledDae:
        """The compiled model."""
        return self.solution.model

    def slopes(self, reads: Sequence[_Read]) -> Vector:
        """Return derivatives of what is read, shape (reads, names)."""
        integrals = {place: size for read in reads for place, _, size in read.integrals}
        seeded = [number for number, read in enumerate(reads) if read.seeds or not read.integrals]
        rows = [Row(reads[number].seeds) for number in seeded]
        rows += [Row(variable=place, size=size) for place, size in integrals.items()]
        slopes = self.loop.gradient(rows)
        result = np.zeros((len(reads), slopes.shape[1]))
        result[seeded] = slopes[: len(seeded)]  # of nothing: nan by what has no derivative, zero by all else
        for number, read in enumerate(reads):
            for place, weight, _ in read.integrals:
                result[number] += weight * slopes[len(seeded) + [*integrals].index(place)]
        return result

    def read(self, output: Output, values: Sequence[Number]) -> _Read | None:
        """Return what an output reads whose leaves have values; None if that is not certain.

        Leaves that do not move it, the smaller ones of a largest value, are not looked at.
        """
        if not output.operands:
            return self._leaf(output, values[0])
        weights = np.ravel(output.formula()(np.array(values, float))[1].full())
        if not np.all(np.isfinite(weights)):
            return None
        reads = list[_Read]()
        for leaf, value, weight in zip(output.operands, values, weights.tolist(), strict=True):
            if weight:
                read = self._leaf(leaf, value)
                if read is None:
                    return None
                reads.append(read.times(weight))
        seeds, integrals = itertools.chain(*(r.seeds for r in reads)), itertools.chain(*(r.integrals for r in reads))
        return _Read(tuple(seeds), tuple(integrals))

    def _leaf(self, leaf: Output, value: Number) -> _Read | None:
        """Return what a leaf with a value reads; None if that is not certain."""
        if leaf.kind in INTEGRATED:
            return self._integral(leaf, value)
        if leaf.kind == "time":
            return self._time(leaf)
        if leaf.kind in _EXTREMES:
            return self._extreme(leaf.path, value)
        moment = {"end": self._end, "at": leaf.moment}.get(leaf.kind, value)
        if self._at_event(moment) or not self._begin <= moment <= self._end:
            return None
        node = self._node(moment)
        if kinks_at(self.model, leaf.path, node):
            return None
        part = slopes_of(self.model, leaf.path, node)
        if leaf.kind in CONDITIONS:
            return _Read((Seed(-part.by[0] / part.rate[0], node.t),)) if part.rate[0] else None
        return _Read((Seed(part.by[0], node.t),))

    @property
    def _begin(self) -> float:
        return float(self.solution.segments[0].times[0])

    @property
    def _end(self) -> float:
        return float(self.solution.segments[-1].times[-1])

    def _at_event(self, moment: float) -> bool:
        """Whether an event is at a moment: on one side it is not part of what is read."""
        near = _NEAR * max(self._end - self._begin, abs(moment))
        return any(abs(float(segment.times[0]) - moment) <= near for segment in self.solution.segments[1:])

    def _node(self, t: float) -> Point:
        assert self.solution.dense is not None
        if t == self._end:
            return self.solution.segments[-1].point(-1)
        dense = self.solution.dense()
        x, z = dense.at(np.array([t]))
        return Point(t, x[:, 0], z[:, 0], dense.d[:, max(int(np.searchsorted(dense.begins, t)) - 1, 0)].copy())

    def _integral(self, leaf: Output, value: float) -> _Read | None:
        span = self._end - self._begin
        if self._at_event(self._end) or (leaf.struck and self.solution.impacts) or (leaf.kind == "rms" and not value):
            return None
        total = {"mean": value * span, "rms": value**2 * span}.get(leaf.kind, value)
        weight = {"mean": 1.0 / span, "rms": 1.0 / (2.0 * value * span) if value else 0.0}.get(leaf.kind, 1.0)
        parts = [part for part in leaf.parts(self.model) if part.kind == "integral"]
        places = [self.extended.position[key_of(part)] for part in parts]
        sizes = [self._size(part, total) for part in parts]
        return _Read(integrals=tuple((place, weight, size) for place, size in zip(places, sizes, strict=True)))

    def _size(self, part: Part, total: float) -> float:
        """Return the size of an integral beside which errors count: rounding of the integrand is none."""
        model, given = self.model, [*self.model.arguments.values()]
        key = Cached.ROUNDING, part.text, part.form, part.change
        function = model.along(key, lambda: ca.Function("rounding", given, [rounding(given, part.expression(model))]))
        size = abs(total)
        for segment in self.solution.segments:
            d = np.repeat(segment.d[:, None], len(segment.times), axis=1)
            (noise,) = function(segment.times, segment.x, segment.z, model.p, model.u, d)
            size += _ROUNDING / self.solution.options.rtol * float(np.trapezoid(noise[0], segment.times))
        return _OF_INTEGRALS * size or 1.0

    def _time(self, leaf: Output) -> _Read | None:
        changes = [event for event in self.solution.events if leaf.is_change(event)]
        if not leaf.number <= len(changes) or self.model.held.circuits:
            return None
        instant = changes[leaf.number - 1].segment
        none = np.zeros(Sizes.of(self.model).x + Sizes.of(self.model).theta)
        return _Read((Seed(none, instant=instant, moving=1.0),)) if instant else None

    def _extreme(self, path: str, number: Number) -> _Read | None:
        """Read an extreme: at an event, at an end, at a kink that moves, or at a smooth top."""
        t, size, near = number.time, abs(number), _NEAR * max(1.0, abs(number.time))
        for k, segment in enumerate(self.solution.segments):
            for side in (-1, 0):
                if abs(segment.times[side] - t) <= near:
                    part = slopes_of(self.model, path, segment.point(side))
                    if abs(abs(float(part.value[0])) - size) <= _NEAR * size:
                        return self._at_end(k, side, part, number.sign)
        if not self._begin < t < self._end:
            return None
        node = self._node(t)
        shifts = [by for _, by in kinks_at(self.model, path, node)]
        if not shifts:
            top = self._top(path, t)
            return top and _Read((Seed(number.sign * slopes_of(self.model, path, top).by[0], top.t),))
        apart = max(float(np.max(np.abs(shift - shifts[0]))) for shift in shifts)
        if apart > _ALIKE * float(np.max(np.abs(shifts))):
            return None
        part = slopes_of(self.model, path, node)
        return _Read((Seed(number.sign * (part.by[0] + float(part.rate[0]) * shifts[0]), t),))

    def _at_end(self, k: int, side: int, part: Slopes, sign: int) -> _Read:
        """Read at an end of a segment, which moves with the event there."""
        by, rate, segment = sign * part.by[0], sign * float(part.rate[0]), self.solution.segments[k]
        if side and k + 1 < len(self.solution.segments):
            return _Read((Seed(by, instant=k + 1, moving=rate),))
        seed = Seed(by, float(segment.times[side]))
        return _Read((seed, Seed(0.0 * by, instant=k, moving=rate)) if k and not side else (seed,))

    def _top(self, path: str, t: float) -> Point | None:
        """Find where a rate is zero near a time, by the secant method; None if it is not found."""
        step = 1e-6 * (self._end - self._begin)
        here = self._node(t)
        rate = most = float(slopes_of(self.model, path, here).rate[0])
        for _ in range(_TRIALS):
            if not self._begin <= here.t + step <= self._end:
                return None
            there = self._node(here.t + step)
            change = float(slopes_of(self.model, path, there).rate[0]) - rate
            here, rate, step = there, rate + change, -(rate + change) * step / change if change else 0.0
            if abs(here.t + step - t) > 1e-3 * (self._end - self._begin):
                return None
            most = max(abs(most), abs(rate))
            if abs(step) <= _TOP * max(1.0, abs(t)):
                return here if abs(rate) <= _ALIKE * most else None  # at a kink it jumps over zero
        return None
