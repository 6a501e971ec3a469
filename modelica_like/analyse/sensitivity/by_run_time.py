"""Derivatives of a run by the adjoint of the compiled run-time, where that has all of them for certain.

It does the run again, keeps it, and goes back along it. What it cannot tell for certain, `adjoint` leaves to the
replay, which has the sentences of refusals, too: a reading at an event or at a kink of a formula, what other modes
follow, events that meet at an instant.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from modelica_like.analyse.replay.chain import Reading
from modelica_like.analyse.sensitivity.moving_kinks import kinks_at
from modelica_like.analyse.sensitivity.of_formulas import formula_kinks
from modelica_like.analyse.sensitivity.values import slopes_of
from modelica_like.compile.buffers import Vector
from modelica_like.compile.compiled import TERMINAL, CompiledDae
from modelica_like.errors import ExportError, InitializationError, LanguageError, MissingExtra, NoGradient, SolveError
from modelica_like.native.along import Row, Seed
from modelica_like.native.expressions import key_of, with_expressions
from modelica_like.native.run import EngineLoop
from modelica_like.runs.collect import Number
from modelica_like.runs.readings import CONDITIONS, INTEGRATED, Output, by_output, leaves
from modelica_like.runs.solution import Solution
from modelica_like.solve.initialize import Point
from modelica_like.solve.initialize.slopes import Sizes, Slopes
from modelica_like.solve.recorder import Event

_NEAR = 1e-9
"""Distance of two times, relative to the run, that are one."""
_ALIKE = 1e-6
"""Difference of how the times of two kinks move, relative to their changes, that is rounding."""
_TRIALS = 12
"""Steps of the secant method to the top of a polynomial: it needs four."""
_TOP = 1e-11
"""Last one of them, relative to the time."""
_AT_KINK = 1e-7
"""Argument of a kink of a formula, relative to its operands, that may be at it: values are known that well."""
_SOLVED = 1e-6
"""Difference of starts and ends of both runs, relative to the largest states, beyond which they are others."""


def adjoint(solution: Solution, outputs: Sequence[Output], names: Sequence[str]) -> Vector | None:
    """Return derivatives of outputs by parameters and inputs, shape (outputs, names); None: the replay has to tell.

    Args:
        solution: the run.
        outputs: without series.
        names: paths of parameters and inputs.
    """
    model = solution.model
    refused = TERMINAL in model.discrete_position or solution.ended is not None or model.events.delay_parts
    if refused or not model.states:
        return None
    parts = leaves(outputs)
    wanted = [part for leaf in parts if leaf.kind in INTEGRATED for part in leaf.parts(model)]
    try:
        run = _again(solution, with_expressions(model, wanted, edges=True), names)
        if run is None:
            return None
        values = run.solution.read(*(leaf.name for leaf in parts))
        rows = [run.row(leaf, value) for leaf, value in zip(parts, values, strict=True)]
        if not np.all(np.isfinite(values)) or any(row is None for row in rows) or _at_kinks(outputs, values):
            return None
        slopes = run.slopes([row for row in rows if row is not None])
    except (ExportError, InitializationError, LanguageError, MissingExtra, NoGradient, SolveError):
        return None
    return _joined(outputs, values, slopes) if np.all(np.isfinite(slopes)) else None


def _again(solution: Solution, extended: CompiledDae, names: Sequence[str]) -> _Run | None:
    """Do the run again and keep it; None if it is another one, or events of it meet."""
    begin, end, options = solution.segments[0].start, float(solution.time[-1]), solution.options
    loop = EngineLoop(extended, replace(options, points=1), begin, end, by=names)
    loop.run()
    record, model = loop.record, solution.model
    again = replace(
        solution, segments=tuple(record.segments), events=tuple(record.events), impacts=tuple(record.impacts),
        readings={}, dense=record.keeper.dense(loop),
    )  # fmt: skip
    if again.dense is None or _changes(solution) != _changes(again) or _meet(again.events):
        return None
    size = np.abs(np.hstack([segment.x for segment in solution.segments])).max(axis=1) + model.equations.nominals
    for k in (0, -1):
        if not np.all(np.abs(again.segments[k].x[:, k] - solution.segments[k].x[:, k]) <= _SOLVED * size):
            return None
    return _Run(again, extended, loop)


def _changes(run: Solution) -> list[tuple[int, str, str, int, int]]:
    return [(e.transition, e.mode, e.after, e.round, e.segment) for e in run.events]


def _meet(events: Sequence[Event]) -> bool:
    """Whether several changes at an instant may have different causes, or something is held that has not slid."""
    first = [event.segment for event in events if event.round == 0 and event.segment > 0]
    return len({*first}) < len(first)


def _at_kinks(outputs: Sequence[Output], values: Sequence[float]) -> bool:
    size = _AT_KINK * float(np.max(np.abs(values), initial=0.0))
    edges = formula_kinks(outputs, [Reading(float(value)) for value in values])
    return any(abs(edge.reading.value) <= size for edge in edges)


def _joined(outputs: Sequence[Output], values: Sequence[float], slopes: Vector) -> Vector:
    """Derivatives of outputs from those of their leaves."""
    pairs = zip(outputs, by_output(outputs, values), by_output(outputs, [*slopes]), strict=True)
    joined = [output.formula()(np.array(some))[1].full()[0] @ np.array(of) if output.operands else of[0]
              for output, some, of in pairs]  # fmt: skip
    return np.array(joined)


@dataclass(frozen=True)
class _Read:
    """What a leaf reads: seeds, and weights of integrals with their sizes, by position of the variable."""

    seeds: tuple[Seed, ...] = ()
    integrals: tuple[tuple[int, float, float], ...] = ()


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
        """Return derivatives of leaves, shape (leaves, names)."""
        integrals = {place: size for read in reads for place, _, size in read.integrals}
        rows = [Row(read.seeds) for read in reads]
        rows += [Row(variable=place, size=size) for place, size in integrals.items()]
        slopes = self.loop.gradient(rows)
        result = slopes[: len(reads)].copy()
        for number, read in enumerate(reads):
            for place, weight, _ in read.integrals:
                result[number] += weight * slopes[len(reads) + [*integrals].index(place)]
        return result

    def row(self, leaf: Output, value: Number) -> _Read | None:
        """Return what a leaf with a value reads; None if that is not certain."""
        if leaf.kind in INTEGRATED:
            return self._integral(leaf, value)
        if leaf.kind == "time":
            return self._time(leaf)
        if leaf.kind in ("max", "min", "peak"):
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
        places = [self.extended.position[key_of(part)] for part in leaf.parts(self.model) if part.kind == "integral"]
        return _Read(integrals=tuple((place, weight, abs(total) or 1.0) for place in places))

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
        rate = float(slopes_of(self.model, path, here).rate[0])
        for _ in range(_TRIALS):
            if not self._begin <= here.t + step <= self._end:
                return None
            there = self._node(here.t + step)
            change = float(slopes_of(self.model, path, there).rate[0]) - rate
            here, rate, step = there, rate + change, -(rate + change) * step / change if change else 0.0
            if abs(here.t + step - t) > 1e-3 * (self._end - self._begin):
                return None
            if abs(step) <= _TOP * max(1.0, abs(t)):
                return here
        return None
