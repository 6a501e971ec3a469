"""A whole run by the compiled run-time, recorded as IDAS's runs are."""

from __future__ import annotations

import ctypes
from collections.abc import Callable

import numpy as np

from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.errors import Chattering, SolveError
from modelica_like.initialize import Impact, Point
from modelica_like.native.library import MORE, OK, Run
from modelica_like.native.model import Instance
from modelica_like.solve.instants import chattering, note_sharing
from modelica_like.solve.options import Options
from modelica_like.solve.recorder import Recorder, Segment

_BREATH = 5000
"""Steps between two looks at whether the user wants to go on."""
_EVENT, _IMPACT = 7, 3
_FIRST_EVENTS = 32


class NativeLoop:
    """Runs a model from a start point to the end; has the face of `EventLoop`.

    Args:
        model: the compiled model.
        options: tolerances and number of results; `max_steps` and `iterations` are IDAS's.
        start: consistent start.
        end: end time in s.
        progress: called with the time reached.
    """

    def __init__(
        self, model: CompiledDae, options: Options, start: Point, end: float,
        progress: Callable[[float], None] | None = None,
    ) -> None:  # fmt: skip
        self.model, self.options, self.end, self.progress = model, options, end, progress
        self.record = Recorder()
        self.instance = Instance(model)
        self.instance.reset(start.t, end, options.rtol, options.atol)
        x, z, d = (np.ascontiguousarray(part, dtype=float) for part in (start.x, start.z, start.d))
        self.instance.check(self._call("begin_at", *(part.ctypes.data for part in (x, z, d))))
        self._buffers: dict[str, Vector] = {}
        self._run = Run(steps=_BREATH)
        self._make_room()

    @property
    def counts(self) -> tuple[int, int, int]:
        """Steps, evaluations of the equations, and integrations: steps that were tried."""
        steps, rejected, evaluations, _ = self.instance.counts()
        return steps, evaluations, steps + rejected

    def run(self) -> Recorder:
        """Simulate.

        Raises:
            Chattering, StepFailed, SingularAtStart: the run cannot go on; `record` of the error is what came before.
        """
        code = MORE
        try:
            while code == MORE:
                code = self._call("run", self.end, self.options.points, ctypes.byref(self._run))
                self._make_room()
                if self.progress is not None:
                    self.progress(self._run.last)
                if self._run.n_events > self.options.max_events:
                    break
        finally:
            self._read()
        try:
            if self._run.n_events > self.options.max_events:
                raise chattering(self.record.events, f"There were more than {self.options.max_events} events")
            if code != OK:
                self._fail(code)
        except SolveError as error:
            error.record = self.record
            raise
        return self.record

    def _call(self, name: str, *arguments: object) -> int:
        return getattr(self.instance.library, name)(self.instance.address, *arguments)

    def _fail(self, code: int) -> None:
        try:
            self.instance.check(code)
        except Chattering as error:
            if not self.record.events:
                raise
            raise chattering(self.record.events, error.what.partition(" at t")[0]) from None

    def _make_room(self) -> None:
        """Double the buffers that are nearly full."""
        run, states, discretes = self._run, len(self.model.states) + len(self.model.implicit), self.model.discrete_size
        first = self.options.points + 2 * _FIRST_EVENTS
        for name, kept, columns, least in (
            ("points", "points", 1 + states, first), ("modes", "segments", discretes, _FIRST_EVENTS),
            ("firsts", "segments", 1, _FIRST_EVENTS), ("events", "events", _EVENT, _FIRST_EVENTS),
            ("impacts", "impacts", _IMPACT, _FIRST_EVENTS),
        ):  # fmt: skip
            old = self._buffers.get(name)
            used, room = getattr(run, f"n_{kept}"), 0 if old is None else len(old)
            if 2 * used < room:
                setattr(run, f"room_{kept}", room)
                continue
            new = self._buffers[name] = np.zeros((max(2 * room, least), columns))
            if old is not None:
                new[:used] = old[:used]
            setattr(run, name, new.ctypes.data)
            setattr(run, f"room_{kept}", len(new))

    def _read(self) -> None:
        """Put what was written into the record."""
        run, record, model = self._run, self.record, self.model
        count, states = run.n_points, len(model.states)
        table = np.ascontiguousarray(self._buffers["points"][:count].T)
        firsts = self._buffers["firsts"][: run.n_segments, 0].astype(int)
        events = self._buffers["events"][: run.n_events]
        for k, (first, last) in enumerate(zip(firsts, [*firsts[1:], count], strict=True)):
            self._note(events, k)
            times, x, z = np.split(table[:, first:last], [1, 1 + states])
            record.segments.append(Segment(times[0], x, z, self._buffers["modes"][k].copy()))
            if model.circuits:
                note_sharing(record, model, record.segments[-1].start)
        self._note(events, len(firsts))
        for time, held, energy in self._buffers["impacts"][: run.n_impacts].tolist():
            record.impacts.append(Impact(time, model.holds[int(held)].component, energy))

    def _note(self, events: Vector, segment: int) -> None:
        """Note the events before a segment."""
        for row in events[events[:, -1] == segment].tolist():
            transition, mode, before, after, round = (int(one) for one in row[1:6])
            self.record.note(self.model, row[0], mode, (before, after), transition, round)
