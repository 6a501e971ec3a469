"""A whole run by the compiled run-time, recorded like those of IDAS."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.errors import Chattering
from modelica_like.initialize import Impact, Point
from modelica_like.native.buffers import Buffers
from modelica_like.native.model import Instance
from modelica_like.solve.events import Progress
from modelica_like.solve.instants import chattering, note_rest, note_sharing
from modelica_like.solve.options import Options
from modelica_like.solve.recorder import Recorder, Segment


class NativeLoop:
    """Runs a model from a start point to the end; replaces `EventLoop`.

    Args:
        model: the compiled model.
        options: tolerances and number of results; `max_steps` and `iterations` are IDAS's.
        start: consistent start.
        end: end time in s.
        progress: called with the time reached.
    """

    def __init__(
        self, model: CompiledDae, options: Options, start: Point, end: float, progress: Progress | None = None
    ) -> None:
        self.model, self.options, self.progress = model, options, progress
        self.record, self._span = Recorder(), end - start.t
        self._instance = Instance(model)
        self._instance.reset(start.t, end, options.rtol, options.atol)
        self._instance.begin_at(start)
        widths = {
            "times": 1, "states": len(model.states) + len(model.implicit), "modes": model.discrete_size, "firsts": 1,
            "events": 7, "impacts": 3,
        }  # fmt: skip
        self._buffers = Buffers(self._instance, end, options.points, widths)

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
            raise self._chattering(f"There were more than {self.options.max_events} events")
        try:
            self._instance.check(code)
        except Chattering as error:
            if not self.record.events:
                raise
            raise self._chattering(error.what.partition(" at t = ")[0]) from None
        note_rest(self.record, self.options, self._span)
        return self.record

    def _chattering(self, why: str) -> Chattering:
        return chattering(self.record.events, why, self.options.on_chattering)

    @property
    def _crowded(self) -> bool:
        return self._buffers.run.n_events > self.options.max_events

    def _reached(self, time: float) -> bool:
        if self.progress is not None:
            self.progress(time)
        return not self._crowded

    def _read(self) -> None:
        """Copy the written results into the record."""
        record, model, written = self.record, self.model, self._buffers
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
        for time, held, energy in written["impacts"].tolist():
            record.impacts.append(Impact(time, model.holds[int(held)].component, energy))

    def _note(self, events: Vector) -> None:
        for row in events.tolist():
            transition, mode, before, after, number = (int(one) for one in row[1:6])
            self.record.note(self.model, row[0], mode, (before, after), transition, number)
