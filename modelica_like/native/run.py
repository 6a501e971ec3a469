"""A whole run by the compiled run-time, recorded like those of IDAS."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np

from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.native.buffers import Buffers
from modelica_like.native.model import Instance
from modelica_like.options import Options
from modelica_like.solve.dense import Dense
from modelica_like.solve.endless import chattering
from modelica_like.solve.events import Progress
from modelica_like.solve.idas import Integrator
from modelica_like.solve.initialize import Point
from modelica_like.solve.instants import impact_size, impacts_of, note_rest, note_sharing
from modelica_like.solve.recorder import Recorder, Segment

_PARTS = 100
"""Parts of a run that may take `max_steps` each, if it has so many results."""
_ROUNDING = 1e-9
"""Relative one of the times of results."""


class OfSteps(Dense):
    """Dense output of the run-time's steps; `piece_at` in integrate.c has the same polynomial.

    Args:
        integrator: solves for implicit unknowns.
        steps: rows of `steps_taken` in native.c.
        modes: of the segments, shape (segments, nd).
    """

    def __init__(self, integrator: Integrator, steps: Vector, modes: Vector) -> None:
        self._integrator, self._steps = integrator, steps
        self.begins, self.ends, self.d = steps[:, 1], steps[:, 2], modes[steps[:, 0].astype(int)].T

    def points(self, pieces: Any, times: Vector) -> tuple[Vector, Vector]:
        """Evaluate the polynomials of degree four."""
        rows, nx = self._steps[pieces], len(self._integrator.model.states)
        s = ((times - rows[:, 1]) / (rows[:, 2] - rows[:, 1]))[:, None]
        first, last, a, b, c = np.split(rows[:, 3:], 5, axis=1)
        y = ((1 - s) * first + s * (last + (1 - s) * (a + s * (b + s * c)))).T
        return y[:nx], self._integrator.polished(times, y[:nx], y[nx:], self.d[:, pieces])


class NativeLoop:
    """Runs a model from a start point to the end; replaces `EventLoop`.

    Args:
        model: the compiled model.
        options: tolerances and number of results; `iterations` are IDAS's.
        start: consistent start.
        end: end time in s.
        progress: called with the time reached.
    """

    def __init__(
        self, model: CompiledDae, options: Options, start: Point, end: float, progress: Progress | None = None
    ) -> None:
        self.model, self.options, self.progress = model, options, progress
        self.record, self._span = Recorder(), end - start.t
        self._part = self._span / min(options.points, _PARTS)
        self._passed = (start.t, 0)  # time, and steps until then
        self._instance = Instance(model)
        self._instance.reset(start.t, end, options.rtol, options.atol)
        if options.max_step < end - start.t:
            self._instance.limit(options.max_step)
        self._instance.begin_at(start)
        unknowns = len(model.states) + len(model.implicit)
        widths = {
            "times": 1, "states": unknowns, "modes": model.discrete_size, "firsts": 1, "events": 7,
            "impacts": impact_size(model), "steps_taken": 3 + 5 * unknowns,
        }  # fmt: skip
        self._buffers = Buffers(self._instance, end, options.points, widths)
        self._buffers.emptied = self.record.keeper.forget

    @property
    def dense(self) -> Callable[[Vector], Dense]:
        """Returns the dense output of written steps, without keeping the instance and its buffers."""
        model, options, modes = self.model, self.options, self._buffers["modes"].copy()
        return lambda steps: OfSteps(Integrator(model, options), steps, modes)

    @property
    def counts(self) -> tuple[int, int, int]:
        """Steps, evaluations of the equations, and tried steps so far."""
        steps, rejected, evaluations, _ = self._instance.counts()
        return steps, evaluations, steps + rejected

    def run(self) -> Recorder:
        """Simulate.

        Raises:
            Chattering, StepFailed, SingularAtStart: the run cannot continue; `record` has the run up to then.
        """
        try:
            code = self._buffers.go(self._reached)
        finally:
            self._read()
        if self._crowded:
            why = f"There were more than {self.options.max_events} events"
            raise chattering(self.model, self.record.events, why, self.options.on_chattering)
        if self._stuck:
            point = self.record.segments[-1].point(-1)
            what = f"The run-time gave up at about t = {point.t:.6g} s: it took more than {self.options.max_steps:,}"
            what += f" steps (max_steps) for {self._part:.3g} s."
            raise Integrator(self.model, self.options).failure(what, point)
        self._instance.check(code, self.record.events, self.options)
        note_rest(self.record, self.options, self._span)
        return self.record

    @property
    def _crowded(self) -> bool:
        return self._buffers.run.n_events > self.options.max_events

    @property
    def _stuck(self) -> bool:
        return bool(self.model.states) and self.counts[0] - self._passed[1] > self.options.max_steps

    def _reached(self, time: float) -> bool:
        if self.progress is not None:
            self.progress(time)
        if time - self._passed[0] >= self._part * (1 - _ROUNDING):
            self._passed = time, self.counts[0]
        return not (self._crowded or self._stuck)

    def _read(self) -> None:
        """Copy the written results into the record."""
        record, model, written = self.record, self.model, self._buffers
        record.keeper.stretches = written["steps_taken"].copy()
        times, states = written["times"][:, 0], np.ascontiguousarray(written["states"].T)
        firsts, modes, events = written["firsts"][:, 0].astype(int), written["modes"], written["events"]
        # Events before a segment, in order; the last ones follow it.
        before = np.split(events, np.searchsorted(events[:, -1], np.arange(1, len(firsts) + 1)))
        for k, (first, last) in enumerate(pairwise([*firsts, len(times)])):
            self._note(before[k])
            x, z = states[: len(model.states), first:last], states[len(model.states) :, first:last]
            record.segments.append(Segment(times[first:last], x, z, modes[k].copy()))
            if model.circuits:
                note_sharing(record, model, record.segments[-1].start)
        self._note(before[-1])
        record.impacts += impacts_of(model, written["impacts"].tolist())

    def _note(self, events: Vector) -> None:
        for row in events.tolist():
            transition, mode, before, after, number = (int(one) for one in row[1:6])
            self.record.note(self.model, row[0], mode, (before, after), transition, number)
