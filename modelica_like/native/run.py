"""A whole run by the compiled run-time, recorded like those of IDAS."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from itertools import pairwise
from typing import Any

import numpy as np

from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.native import library
from modelica_like.native.along import Row, gradient_along
from modelica_like.native.buffers import Buffers
from modelica_like.native.endless import chattering
from modelica_like.native.library import INTEGRATOR
from modelica_like.native.model import Instance
from modelica_like.native.notices import note_rest, note_sharing
from modelica_like.options import Options
from modelica_like.solve.dense import Dense
from modelica_like.solve.idas import Integrator
from modelica_like.solve.initialize import Impact, Point
from modelica_like.solve.panels import LOOKS, Looks, Panels, Progress
from modelica_like.solve.recorder import Recorder, Segment

_PARTS = 100
"""Parts of a run that may take `max_steps` each, if it has so many results."""
_ROUNDING = 1e-9
"""Relative one of the times of results."""
_EVENTS, _KEPT_EVENTS = 32, 2000
"""Events for which there is room at first; of a run that is kept for its derivatives there should be room for all."""
_SAME_START = 1e-8
"""Difference of two starts, relative to their states, up to which they are one: start values are solved to 1e-10."""


class _ByIdas:
    """Answers the run-time's question for the next panel.

    Args:
        instance: asks.
        panels: integrates.
        progress: called with the time reached.

    Attributes:
        error: why there was no answer: it has to pass C, and is raised behind it.
    """

    error: BaseException | None = None

    def __init__(self, instance: Instance, panels: Panels, progress: Progress | None) -> None:
        self.panels, self._instance, self._progress = panels, instance, progress
        self._x, self._d = instance.point()
        ends, wishes, errors = np.empty((3, 2 * panels.most))
        self._knots = np.empty((LOOKS * panels.most + 1) * len(self._x))
        panels.looks = Looks(self._take, ends, wishes, errors)
        at = {"ends": ends, "wishes": wishes, "errors": errors, "knots": self._knots}
        self._looks = library.Looks(**{name: array.ctypes.data for name, array in at.items()})
        self._asked = INTEGRATOR(self._answer)
        felt = panels.felt
        instance.library.integrate_by(instance.address, self._asked, felt.ctypes.data)

    def _take(
        self, x: Vector, z: Vector, shares: Vector, span: float, relative: float, absolute: float
    ) -> tuple[int, int]:
        looks = self._looks
        looks.x, looks.z, looks.shares = x.ctypes.data, z.ctypes.data, shares.ctypes.data
        looks.span, looks.relative, looks.absolute, looks.results = span, relative, absolute, len(x)
        return self._instance.library.take_looks(self._instance.address, ctypes.byref(looks)), looks.precise

    def _answer(self, limit: float, place: Any) -> int:
        nx = len(self.panels.model.states)
        now = Point(self._instance.time, self._x[:nx].copy(), self._x[nx:].copy(), self._d.copy())
        try:
            if self._progress is not None:
                self._progress(now.t)
            self.panels.go_on(now, limit, place.contents.longest, place.contents.soon)
        except BaseException as error:  # noqa: BLE001 - also an interrupt: ctypes would lose it
            self.error = error
            return 0
        return 1


class EngineLoop:
    """Runs a model from a start point to the end by the compiled run-time, with its own steps or those of IDAS.

    Args:
        model: the compiled model.
        options: tolerances and number of results; `iterations` are IDAS's.
        start: consistent start.
        end: end time in s.
        progress: called with the time reached.
        idas: whether IDAS integrates; without states there is nothing to integrate.
        by: parameters and inputs by which the run is to be differentiated: its start is found again, it is kept, and
            its steps end where slopes change.

    Attributes:
        starts_there: whether the start that is found again is the given one.
    """

    def __init__(
        self, model: CompiledDae, options: Options, start: Point, end: float, progress: Progress | None = None,
        *, idas: bool = False, by: Sequence[str] = (),
    ) -> None:  # fmt: skip
        self.model, self.options, self.progress = model, options, progress
        self.record, self._span = Recorder(), end - start.t
        self._part = self._span / min(options.points, _PARTS)
        self._passed = (start.t, 0)  # time, and steps until then
        # IDAS is the reference: its runs do not depend on a compiler.
        self._instance = Instance(model, compiled=options.compiled and not idas)
        self.record.notices += filter(None, [self._instance.native.notice])
        self._instance.reset(start.t, end, options.rtol, options.atol)
        if options.max_step < end - start.t:
            self._instance.limit(options.max_step)
        self._by = self._instance.native.references(by)
        self.starts_there = True
        if by:
            self._instance.library.land(self._instance.address)
            self._instance.begin_differentiable(self._by)
            self.starts_there = _is_near(model, self._instance.present(), start)
        else:
            self._instance.begin_at(start)
        by_idas = idas and bool(model.states)
        self._idas = _ByIdas(self._instance, Panels(model, options, start.t, end), progress) if by_idas else None
        unknowns = len(model.states) + len(model.implicit)
        widths = {
            "times": 1, "states": unknowns, "modes": model.discrete_size, "firsts": 1, "events": 7,
            "impacts": _impact_size(model), "steps_taken": 3 + 5 * unknowns,
        }  # fmt: skip
        self._buffers = Buffers(self._instance, end, options.points, widths, room=_KEPT_EVENTS if by else _EVENTS)
        self._buffers.emptied = self.record.keeper.forget

    @property
    def dense(self) -> Callable[[Vector], Dense]:
        """Returns the dense output of written steps, without keeping the instance and its buffers."""
        model, modes = self.model, self._buffers["modes"].copy()
        return lambda steps: Dense(model, steps, modes)

    @property
    def counts(self) -> tuple[int, int, int]:
        """Steps, evaluations of the equations, and tried steps or calls of IDAS so far."""
        if self._idas is not None:
            integrator = self._idas.panels.integrator
            return integrator.steps, integrator.evaluations, integrator.calls
        steps, rejected, evaluations, _ = self._instance.counts()
        return steps, evaluations, steps + rejected

    def run(self) -> Recorder:
        """Simulate.

        Raises:
            Chattering, StepFailed, SingularAtStart: the run cannot continue; `record` has the run up to then.
        """
        try:
            with self._watched():
                code = self._buffers.go(self._reached)
        finally:
            self._read()
        if self._idas is not None and self._idas.error is not None:
            raise self._idas.error
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

    def gradient(self, rows: Sequence[Row]) -> Vector:
        """Return derivatives of what is read along a run that is done, by what it was made for.

        Args:
            rows: what to differentiate.

        Returns:
            Shape (rows, by); nan by what has none, where others have.

        Raises:
            NoGradient: by nothing there are any.
        """
        return gradient_along(self._instance, rows, len(self._by))

    def begin(self) -> None:
        """Let happen what happens at the start, or raise its error."""
        states = np.zeros(len(self.model.states))
        self._instance.check(self._instance.library.states(self._instance.address, None, states.ctypes.data))

    def _watched(self) -> AbstractContextManager[None]:
        return nullcontext() if self._idas is None else self._idas.panels.integrator.interrupts.watched()

    @property
    def _crowded(self) -> bool:
        return self._buffers.run.n_events > self.options.max_events

    @property
    def _stuck(self) -> bool:
        return bool(self.model.states) and self._instance.counts()[0] - self._passed[1] > self.options.max_steps

    def _reached(self, time: float) -> bool:
        if self._idas is not None:
            self._idas.panels.integrator.interrupts.check()
        if self.progress is not None:
            self.progress(time)
        if time - self._passed[0] >= self._part * (1 - _ROUNDING):
            self._passed = time, self._instance.counts()[0]
        return not (self._crowded or self._stuck)

    def _read(self) -> None:
        """Copy the written results into the record."""
        record, model, written = self.record, self.model, self._buffers
        record.keeper.steps = written["steps_taken"].copy()
        times, states = written["times"][:, 0], np.ascontiguousarray(written["states"].T)
        firsts, modes, events = written["firsts"][:, 0].astype(int), written["modes"], written["events"]
        # Events before a segment, in order; the last ones follow it.
        before = np.split(events, np.searchsorted(events[:, -1], np.arange(1, len(firsts) + 1)))
        for k, (first, last) in enumerate(pairwise([*firsts, len(times)])):
            self._note(before[k])
            x, z = states[: len(model.states), first:last], states[len(model.states) :, first:last]
            record.segments.append(Segment(times[first:last], x, z, modes[k].copy()))
            if model.held.circuits:
                note_sharing(record, model, record.segments[-1].start)
        self._note(before[-1])
        record.impacts += _impacts_of(model, written["impacts"].tolist())
        record.notices += self._idas.panels.notices if self._idas is not None else ()

    def _note(self, events: Vector) -> None:
        for row in events.tolist():
            transition, mode, before, after, number = (int(number) for number in row[1:6])
            self.record.note(self.model, row[0], mode, (before, after), transition, number)


def _is_near(model: CompiledDae, found: Point, start: Point) -> bool:
    sizes = np.abs(start.x) + model.equations.nominals
    return bool(np.array_equal(found.d, start.d) and np.all(np.abs(found.x - start.x) <= _SAME_START * sizes))


def _impact_size(model: CompiledDae) -> int:
    """Return the number of columns that an impact takes in `NativeRun` in native.c."""
    return 3 + 2 * (len(model.states) + len(model.implicit) + model.discrete_size)


def _impacts_of(model: CompiledDae, rows: Sequence[Sequence[float]]) -> Iterator[Impact]:
    """Yield impacts from what the run-time has written; the first one of an instant has the trials of all."""
    last, (nx, nd) = np.nan, (len(model.states), model.discrete_size)
    for time, held, energy, *numbers in rows:
        parts = np.split(np.array(numbers), 2) if time != last else ()
        points = [Point(time, part[:nx], part[nx : len(part) - nd], part[len(part) - nd :]) for part in parts]
        yield Impact(time, model.held.motions[int(held)].component, energy, (points[0], points[1]) if points else None)
        last = time
