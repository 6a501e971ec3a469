"""The event loop: smooth segments by IDAS, events located and iterated between them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from modelica_like.compile.compiled import TERMINAL, CompiledDae, CompiledTransition, Vector
from modelica_like.compile.soon import time_resolution
from modelica_like.errors import StepFailed
from modelica_like.options import Options
from modelica_like.solve.between import Between, Piece
from modelica_like.solve.delays import Delays
from modelica_like.solve.dense import Dense, OfLooks, Stretch
from modelica_like.solve.guards import Candidate, Ends, Guards, Located, candidates, locate
from modelica_like.solve.idas import Integrator
from modelica_like.solve.initialize import Point
from modelica_like.solve.instants import Instants, just_after, note_rest, note_sharing
from modelica_like.solve.looks import Cell, Looks
from modelica_like.solve.pace import Pace, foreseen
from modelica_like.solve.passing import Passing
from modelica_like.solve.recorder import Recorder
from modelica_like.solve.ticks import Ticks

_NOTHING = 1e-25
"""Value of a guard, in SI units, below which it is rounding."""
_CLOSER = 8
"""Number of closer looks into an interval between two looks."""
_DEEPEST = 10
_CUTS = 20
"""How often a panel is cut at an edge before it is taken as it is: what switches without end runs as written."""
_MAX_FAILURES = 40
_FEW_FAILURES = 6
_SAME = 1e-3
"""Distance of two places at which the integrator gave up, relative to the panel, below which they are one."""

Progress = Callable[[float], None]


class EventLoop:
    """Runs a model from a start point to the end.

    Args:
        model: the compiled model.
        options: tolerances and number of results.
        start: consistent start.
        end: end time in s.
        progress: called with the time reached.
    """

    def __init__(
        self, model: CompiledDae, options: Options, start: Point, end: float, progress: Progress | None = None
    ) -> None:
        self.model = model
        self.options = options
        self.now = start
        self.end = end
        self._failures = 0
        self._failed_before = start.t
        self._gave_up_at = -np.inf
        self._since = start.t
        self.progress = progress
        self.guards = Guards(model)
        self.record = Recorder()
        timed = len(model.transitions) > self.guards.count or bool(model.delay_parts or model.edges.count)
        self.pace = Pace(start.t, end, options, guarded=bool(self.guards.count), timed=timed)
        self.integrator = Integrator(model, options, whole=self.pace.on_grid)
        self.passing = Passing(model, self.integrator)
        self.between = Between(self.integrator, self._closer)
        self.instants = Instants(model, options, self.record, start.t, end)
        self.ticks = Ticks(model, self.instants)
        self.delays = Delays(model, options, start, self.between)

    @property
    def counts(self) -> tuple[int, int, int]:
        """Steps, evaluations of the equations, and calls of the integrator so far."""
        return self.integrator.steps, self.integrator.evaluations, self.integrator.calls

    def dense(self, stretches: list[Stretch]) -> Dense:
        """Return the dense output of stretches."""
        looks = sum({id(one.looks): one.looks.count for one in stretches}.values())
        if self.pace.on_grid and self.integrator.steps > looks > 0:
            # Results are no looks where there are fewer of them than steps.
            more = math.ceil(2 * self.integrator.steps / looks)
            finer = [self._integrate(o.looks.point(0), o.looks.span, more * o.looks.count) for o in stretches]
            stretches = [replace(o, looks=f, last=f.count) for o, f in zip(stretches, finer, strict=True)]
        return OfLooks(self.between, stretches)

    def run(self) -> Recorder:
        """Simulate.

        Raises:
            Chattering, StepFailed, SingularAtStart: the run cannot continue; `record` has the run up to then.
        """
        with self.integrator.interrupts.watched():
            try:
                self._go()
            finally:
                # Remaining results after an error or an interrupt; otherwise there are none.
                self.record.end(self.now.d)
                self._write(precisely=False)
        return self.record

    def begin(self) -> None:
        """Let happen what happens at the start, or raise what `Instants.settle` raises."""
        self.instants.settle(self.now, self._wanting(), begins=True)

    def _go(self) -> None:
        self.begin()
        note_sharing(self.record, self.model, self.now)
        self.record.begin(self.now)
        while self.now.t < self.end and not self.record.ended:
            known = self._known()
            self._advance(min(self.ticks.stop(self.now), known, self.end))
            if self.between.many or self.record.many:
                self._write()
            if self.progress is not None:
                self.progress(self.now.t)
        terminal = self.model.discrete_position.get(TERMINAL)
        if terminal is not None:
            self.record.end(self.now.d)
            self.now = self.now.copy()
            self.now.d[terminal] = 1.0
            self.instants.settle(self.now, [], begins=True)
            self.record.begin(self.now)
        self.record.end(self.now.d)
        note_rest(self.record, self.options, self.instants.span)
        self._write()

    def _write(self, *, precisely: bool = True) -> None:
        """Interpolate results, and build the finished segments."""
        self.between.fill(precisely=precisely)
        self.record.build(complete=precisely)

    def _known(self) -> float:
        """Return the time up to which delayed values are known, renewed where they end."""
        if just_after(self.now.t) >= self.delays.until:
            self._close()
            self.now = self.delays.renewed(self.now, self.end)
            self.record.begin(self.now)
        return self.delays.until

    # -- smooth pieces -----------------------------------------------------------------------------------------------

    def _advance(self, stop: float) -> None:
        """Integrate up to `stop` at most, ending earlier at an event or at the end of a panel."""
        looks = self._whole_panel(stop)
        if not self.guards.count:
            self.pace.longer(looks.span, np.inf)
        if not self.guards.count or not self._search(looks):
            self._arrive(looks)
        ends, due = just_after(self.now.t) >= stop and not self.record.ended, self.instants.due(self.now)
        if ends:
            self.now.t = stop
        if (ends or due) and self.record.last != self.now.t:
            self.record.add(np.array([self.now.t]), self.now.x[:, None], self.now.z[:, None])
        if due:
            self._event(self._wanting())

    def _arrive(self, looks: Looks) -> None:
        """Go to the last look, unless a tick before it changes what moves."""
        if not self._keep(looks, float(looks.times[-1]), looks.count):
            return
        self._move(looks.point(looks.count))
        if self.now.t >= self._failed_before:
            self._failures = 0

    def _move(self, point: Point) -> None:
        """Go to a point of a panel; ticks in the panel may have changed discrete values that it does not use."""
        point.d = self.now.d
        self.now = point

    def _keep(self, looks: Looks, end: float, last: int, *, event: bool = False) -> bool:
        """Record the results up to a time, and fire the ticks before it; `last` is the last valid look.

        At an event, results that are closer to it than they can be told apart are left out.

        Returns:
            Whether the run can go there: a tick that changes what moves takes it back to its time.
        """
        first = max(float(looks.times[0]), self.now.t)
        until = self.pace.before(end) if event else end
        times = self.pace.results(first, until)
        if self.pace.on_grid:
            numbers = np.rint((times - looks.times[0]) / looks.width).astype(int)
            piece = Piece(looks, times, last, looks.x[:, numbers], looks.z[:, numbers])
        else:
            piece = self.between.ask(looks, times, last)
        self.delays.keep(first, looks, last, self.now.d)
        while just_after(tick := self.instants.next_moment(self.now)) < end:
            self._add(piece, self.pace.results(first, self.pace.before(tick)))
            self.record.keeper.keep(Stretch(looks, first, tick, last, self.now.d))
            self._move(self.ticks.point(looks, tick, last, self._closer))
            self.record.add(np.array([tick]), self.now.x[:, None], self.now.z[:, None])
            if self._event(self.instants.due(self.now)):
                return False
            times = self.pace.results(first := tick, until)
        self._add(piece, times)
        self.record.keeper.keep(Stretch(looks, first, end, last, self.now.d))
        return True

    def _add(self, piece: Piece, times: Vector) -> None:
        """Record the results of a piece at some of its times."""
        if len(times):
            some = slice(begin := int(piece.times.searchsorted(times[0])), begin + len(times))
            self.record.add(times, piece.x[:, some], piece.z[:, some])

    def _closer(self, looks: Looks, k: int) -> Looks:
        """Look into an interval between two looks.

        A new start there is also more precise: a guard may depend on values that are small compared with tolerances.
        """
        return self._integrate(looks.point(k), float(looks.times[k + 1] - looks.times[k]), _CLOSER).every(1)

    def _integrate(
        self, start: Point, span: float, looks: int, *, patient: bool = True, partial: bool = False
    ) -> Looks:
        x, z = self.integrator.run(start, span, looks, patient=patient, partial=partial, polish=False)
        times = start.t + span * np.arange(x.shape[1] + 1) / looks
        # Row by row, in the order of IDAS.
        x = np.concatenate([start.x[None], x.T]).T
        z = np.concatenate([start.z[None], z.T]).T if len(z) else np.empty((0, len(times)))
        return Looks(self.integrator, self.guards, times, x, z, start.d)

    def _whole_panel(self, stop: float) -> Looks:
        """Integrate one panel that steps over no edge: where it does, it is cut there."""
        looks = self._panel(stop)
        for _ in range(_CUTS):
            edge = self.passing.first(looks, self._in_sight(looks), self.now.t + time_resolution(self.now.t))
            if edge is None or just_after(edge) >= looks.times[-1]:
                break
            looks = self._panel(edge)
        return looks

    def _panel(self, stop: float) -> Looks:
        """Integrate one panel.

        It may run past an event, where the equations of the old mode are not valid and may diverge; then it ends
        before.
        """
        while True:
            span, count = self.pace.panel(self.now.t, stop)
            before = self.integrator.steps
            try:
                looks = self._integrate(self.now, span, count, patient=not self.guards.count, partial=True)
            except StepFailed:
                if not self._go_on(self.now.t + span):
                    raise
                if self._failures:  # else the tolerance has been relaxed, and the pace begins again
                    self.pace.shorter(span, denser=True)
                continue
            if looks.count < count:
                if not self._go_on(self.now.t + span):
                    raise self.integrator.gave_up
                return looks.every(1)
            steps = self.integrator.steps - before
            stride = 1 if self.pace.on_grid else self.pace.stride(steps, count, looks.width)
            stride = self.pace.resolved(stride, self.passing.advance(looks, self._in_sight), looks.width)
            if not stride and looks.width <= time_resolution(self.now.t):
                stride = 1  # no wave is shorter than what times tell apart
            if not stride:
                self.pace.shorter(looks.width * self._in_sight(looks.every(1)))
                continue
            looks = looks.every(stride)
            if just_after(self.now.t + span) >= stop:
                looks.times[-1] = stop
            return looks

    def _in_sight(self, looks: Looks) -> int:
        """Return the first look behind an event, or else the last one.

        Behind an event the old mode's equations are not valid, so what is there says nothing about steps and edges.
        """
        risen = (looks.seen[0][self.guards.active(looks.d), 1:] > 0).any(axis=0)
        return int(np.argmax(risen)) + 1 if risen.any() else looks.count

    def _go_on(self, end: float) -> bool:
        """Count failures on the way to one place; True if another try makes sense (an event may be behind it).

        Shorter panels start closer to it. The last resort is a relaxed tolerance.
        """
        # Without events, nothing but a tolerance can help across the same place.
        same = not self.guards.count and abs(self.integrator.reached - self._gave_up_at) <= _SAME * (end - self.now.t)
        self._gave_up_at = self.integrator.reached
        self._failures += _FEW_FAILURES if same else 1
        self._failed_before = max(self._failed_before, end)
        allowed = _MAX_FAILURES if self.guards.count else _FEW_FAILURES
        if self._failures <= allowed and end > just_after(self.now.t):
            return True
        if not self.integrator.relax():
            return False
        self._failures = 0
        self.pace.again(self._failed_before - self.now.t)
        self.record.notices.append(
            f"At {self.now.t:.9g} s the integrator gave up; from there on its tolerance is {self.integrator.rtol:g} "
            f"instead of {self.options.rtol:g}."
        )
        return True

    # -- events ------------------------------------------------------------------------------------------------------

    def _search(self, looks: Looks, depth: int = 0, *, begins: bool = True) -> bool:
        """Search for guards that become positive; if one does, go there and handle the event.

        Args:
            looks: integrated points.
            depth: number of refinements so far.
            begins: whether it begins at the end of the last event or of the search before.
        """
        values, rates, _ = looks.seen
        if begins:
            # A guard that the last event left positive did not fire: it is falling.
            values[:, 0] = np.minimum(values[:, 0], 0.0)
        # A guard at the limit, such as a rope without load, has values of rounding only: it crosses nothing.
        values[np.abs(values).max(axis=1) < _NOTHING] = 0.0
        active = self.guards.active(looks.d)
        for group in candidates(values, rates, active, looks.width):
            k = group[0].interval
            while group:
                cell, located = self._locate(looks, values, rates, group, depth)
                if cell is None:
                    return self._search_closer(looks, k, depth, begins=begins and k == 0)
                if located is None:
                    break
                wanting = [self.guards.state_events[g] for g in located.guards if located.soon[g] > 0]
                late = [one.guard for one in group if not one.inside]
                if wanting or late:
                    # Positive for less than the time resolution: a guard left by the last event is falling.
                    self._reach(looks, k, located.point, wanting or self._look_behind(looks, cell, located, late))
                    return True
                over = located.guards or [one.guard for one in group]
                group = [one for one in group if one.guard not in over]
        if depth == 0:
            self.pace.longer(looks.span, foreseen(values[active, -1], rates[active, -1]))
        return False

    def _locate(
        self, looks: Looks, values: Vector, rates: Vector, group: list[Candidate], depth: int
    ) -> tuple[Cell | None, Located | None]:
        """Find the event in the interval of a group; no interval if its states are not known precisely enough."""
        k, width = group[0].interval, looks.width
        ends: Ends = {}
        for g in sorted({one.guard for one in group}):
            (g0, g1), (r0, r1) = values[g, k : k + 2].tolist(), rates[g, k : k + 2].tolist()
            ends[g] = g0, g1, r0 * width, r1 * width
        # Closer looks have to differ in time.
        t = float(looks.times[k])
        sure, fresh = depth >= _DEEPEST or t + width / _CLOSER <= t, depth > 0
        cell = next((one for one in looks.cells(k, k + 1) if sure or looks.is_sharp(one, ends, fresh=fresh)), None)
        if cell is None:
            return None, None

        def trial(span: float) -> tuple[Point, list[Vector]]:
            return looks.at(cell.t + span, cell)

        return cell, locate(trial, width, ends, group, cell.t)

    def _search_closer(self, looks: Looks, k: int, depth: int, *, begins: bool) -> bool:
        """Search between two looks again, with closer ones; the run continues from there in any case."""
        if not self._keep(looks, float(looks.times[k]), k + 1):
            return True
        closer = self._closer(looks, k)
        closer.times[-1] = looks.times[k + 1]
        if not self._search(closer, depth + 1, begins=begins):
            self._arrive(closer)
        return True

    def _reach(self, looks: Looks, k: int, point: Point, wanting: list[CompiledTransition]) -> None:
        """Go to a point between look k and the next and fire its transitions."""
        if not self._keep(looks, point.t, k + 1, event=True):
            return
        self._move(point)
        if wanting:
            self.record.add(np.array([point.t]), point.x[:, None], point.z[:, None])
            self._event([*wanting, *self.instants.due(point)])

    def _look_behind(self, looks: Looks, cell: Cell, located: Located, late: list[int]) -> list[CompiledTransition]:
        """Go on by the time resolution; guards that are still positive fire, otherwise the search starts again."""
        behind = located.point.t + time_resolution(located.point.t)
        located.point, guards = looks.at(min(behind, cell.t + cell.width), cell)
        return [self.guards.state_events[g] for g in late if guards[0][g] > 0]

    def _wanting(self) -> list[CompiledTransition]:
        return [*self.instants.due(self.now), *self.guards.wanting(self.now)]

    def _close(self) -> None:
        """Close the segment, unless it has just begun: two things happen at one instant."""
        if not self.record.fresh:
            self.record.end(self.now.d)

    def _event(self, wanting: list[CompiledTransition]) -> bool:
        """Handle an event: close the segment, change modes until nothing fires, begin the next segment.

        Returns:
            Whether anything that moves has changed, or the run has ended.
        """
        self._close()
        before, self.now = self.now, self.now.copy()
        self.instants.settle(self.now, wanting)
        moved = self.ticks.moved(before, self.now, wanting)
        if moved:
            self.delays.broken(self.now.t)
            self._failures, self._failed_before = 0, self.now.t
            lasted, self._since = self.now.t - self._since, self.now.t
            self.pace.anew(before.d, lasted, self.now.d)
        self.record.begin(self.now)
        return moved or self.record.ended
