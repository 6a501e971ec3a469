"""The event loop: smooth segments by IDAS, events located and iterated between them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from modelica_like.compile.compiled import CompiledDae, CompiledTransition, Vector
from modelica_like.compile.soon import TIME_RESOLUTION
from modelica_like.errors import StepFailed
from modelica_like.initialize import Point
from modelica_like.solve.guards import Candidate, Guards, Located, candidates, locate
from modelica_like.solve.idas import Integrator
from modelica_like.solve.instants import SAME_TIME, Instants, just_after, note_sharing
from modelica_like.solve.looks import Cell, Looks
from modelica_like.solve.options import Options
from modelica_like.solve.pace import Pace
from modelica_like.solve.recorder import Recorder

_NEVER = 1e-12
"""Rates, relative to the value and per second, below which a guard does not rise."""
_CLOSER = 8
"""Looks into an interval between two looks."""
_DEEPEST = 10
_MAX_HALVINGS = 30
_MAX_FAILURES = 40
_FEW_FAILURES = 6

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
        self._in_sight = np.inf
        self._since = start.t
        self._lasted: dict[bytes, float] = {}
        self.progress = progress
        self.integrator = Integrator(model, options)
        self.guards = Guards(model)
        self.record = Recorder()
        timed = len(model.transitions) > self.guards.count
        self.pace = Pace(start.t, end, options, guarded=bool(self.guards.count), timed=timed)
        self.instants = Instants(model, options, self.guards, self.record, end - start.t)

    @property
    def counts(self) -> tuple[int, int, int]:
        """Steps, evaluations of the equations, and calls of the integrator so far."""
        return self.integrator.steps, self.integrator.evaluations, self.integrator.calls

    def run(self) -> Recorder:
        """Simulate.

        Raises:
            Chattering, StepFailed, SingularAtStart: the run cannot go on; `record` is what came before.
        """
        try:
            self.instants.settle(self.now, self._wanting())
            note_sharing(self.record, self.model, self.now)
            self.record.begin(self.now)
            while self.now.t < self.end:
                self._advance(min(self.instants.next_moment(self.now), self.end))
                if self.progress is not None:
                    self.progress(self.now.t)
        finally:
            self.record.end(self.now.d)
        return self.record

    # -- smooth pieces -----------------------------------------------------------------------------------------------

    def _advance(self, stop: float) -> None:
        """Integrate up to `stop` at most, ending earlier at an event or at the end of a panel."""
        looks = self._panel(stop)
        if not self.guards.count:
            self.pace.longer(looks.count)
        if not self.guards.count or not self._search(looks):
            self._keep(looks, float(looks.times[-1]), looks.count)
            self._arrive(looks)
        if just_after(self.now.t) >= stop:
            self.now.t = stop
            if self.record.last != stop:
                self.record.add(np.array([stop]), self.now.x[:, None], self.now.z[:, None])
            if self.instants.due(self.now):
                self._event(self._wanting())

    def _arrive(self, looks: Looks) -> None:
        """Go to the last look."""
        self.now = looks.point(looks.count)
        if self.now.t >= self._failed_before:
            self._failures = 0

    def _keep(self, looks: Looks, end: float, last: int) -> None:
        """Record the results up to a time; `last` is the last look that means something."""
        times = self.pace.results(float(looks.times[0]), end)
        if not len(times):
            return
        numbers = np.minimum(np.rint((times - looks.times[0]) / looks.width).astype(int), looks.count)
        if np.all(np.abs(times - looks.times[numbers]) <= SAME_TIME * np.maximum(1.0, np.abs(times))):
            self.record.add(times, looks.x[:, numbers], looks.z[:, numbers])
        else:
            self.record.add(times, *self._between(looks, times, last))

    def _between(self, looks: Looks, times: Vector, last: int, depth: int = 0) -> tuple[Vector, Vector]:
        """Return states and implicit unknowns between looks, from closer looks where interpolation is not precise."""
        x, z, unknown = looks.along(times, last)
        if depth < _DEEPEST:
            for k in unknown:
                those = looks.intervals(times) == k
                x[:, those], z[:, those] = self._between(self._closer(looks, int(k)), times[those], _CLOSER, depth + 1)
        return x, z

    def _closer(self, looks: Looks, k: int) -> Looks:
        """Look into an interval between two looks."""
        return self._integrate(looks.point(k), float(looks.times[k + 1] - looks.times[k]), _CLOSER)

    def _integrate(self, start: Point, span: float, looks: int, *, patient: bool = True) -> Looks:
        x, z = self.integrator.run(start, span, looks, patient=patient)
        times = start.t + span * np.arange(looks + 1) / looks
        x, z = np.concatenate([start.x[:, None], x], axis=1), np.concatenate([start.z[:, None], z], axis=1)
        return Looks(self.integrator, self.guards, times, x, z, start.d)

    def _panel(self, stop: float) -> Looks:
        """Integrate one panel.

        It may run past an event, where the equations of the old mode mean nothing and may blow up; then a shorter one
        ends before.
        """
        while True:
            goal = min(stop, self._in_sight) if self._in_sight > just_after(self.now.t) else stop
            span, count = self.pace.panel(self.now.t, goal)
            before = self.integrator.steps
            try:
                looks = self._integrate(self.now, span, count, patient=not self.guards.count)
            except StepFailed:
                if not self._go_on(self.now.t + span):
                    raise
                if count == 1:
                    return self._short_piece(span)
                self.pace.shorter(count)
                continue
            steps = self.integrator.steps - before
            if self.guards.count and (self._shorten(steps, looks) or self.pace.refine(steps, count)):
                continue
            self.pace.snap(looks.times[1:])
            if self.now.t + span >= goal - SAME_TIME * max(1.0, abs(goal)):
                looks.times[-1] = goal
            return looks

    def _shorten(self, steps: int, looks: Looks) -> bool:
        """Let the next panel end at the first event in sight, if this one was laborious; True if that is much sooner.

        Behind an event the old mode's equations mean nothing, so what they cost tells nothing about looks at guards.
        """
        if not self.pace.laborious(steps, looks.count):
            return False
        values = looks.seen[0]
        risen = np.flatnonzero((values[self.guards.active(looks.d), 1:] > 0).any(axis=0))
        if not len(risen) or 2 * (risen[0] + 1) > looks.count:
            return False
        self._in_sight = float(looks.times[risen[0] + 1])
        return True

    def _go_on(self, end: float) -> bool:
        """Count failures on the way to one place: behind it is an event, or nothing; True if another try makes sense.

        Shorter panels begin anew nearer to it. The last resort is a relaxed tolerance.
        """
        self._failures += 1
        self._failed_before = max(self._failed_before, end)
        if self._failures <= (_MAX_FAILURES if self.guards.count else _FEW_FAILURES):
            return True
        if not self.integrator.relax():
            return False
        self._failures = 0
        self.record.notices.append(
            f"At {self.now.t:.9g} s the integrator gave up; from there its tolerance is {self.integrator.rtol:g} "
            f"instead of {self.options.rtol:g}."
        )
        return True

    def _short_piece(self, span: float) -> Looks:
        """Integrate a part of the distance to the next look, as long as possible."""
        for halvings in range(1, _MAX_HALVINGS):
            piece = span / 2**halvings
            try:
                return self._integrate(self.now, piece, 1, patient=not self.guards.count)
            except StepFailed:
                if not self._go_on(self.now.t + piece) or halvings + 1 == _MAX_HALVINGS:
                    raise
        raise AssertionError

    # -- events ------------------------------------------------------------------------------------------------------

    def _search(self, looks: Looks, depth: int = 0, *, begins: bool = True) -> bool:
        """Look for guards that become positive; if one does, go there and handle the event.

        Args:
            looks: what was integrated.
            depth: how often the looks became closer already.
            begins: whether it begins where the last event, or the search before, has ended.
        """
        values, rates, _ = looks.seen
        if begins:
            # What the last event left positive did not want to fire: it is on its way down.
            values[:, 0] = np.minimum(values[:, 0], 0.0)
        active = self.guards.active(looks.d)
        found = candidates(values, rates, active, looks.width)
        while found:
            k = found[0].interval
            group = [one for one in found if one.interval == k]
            cell, located = self._locate(looks, values, rates, group, sure=depth >= _DEEPEST)
            if cell is None:
                return self._search_closer(looks, k, depth, begins=begins and k == 0)
            if located is None:
                found = [one for one in found if one.interval > k]
                continue
            soon = self.guards.soon(located.point)
            wanting = [self.guards.state_events[g] for g in located.guards if soon[g] > 0]
            if not wanting:
                # Positive for less than the time resolution: what the last event left is on its way down.
                late = [one.guard for one in group if not one.inside]
                if not late:
                    over = located.guards or [one.guard for one in group]
                    found = [one for one in found if one.interval > k or one.guard not in over]
                    continue
                wanting = self._look_behind(looks, cell, located, late)
            self._reach(looks, k, located.point, wanting)
            return True
        if depth == 0:
            self.pace.longer(looks.count, _foreseen(values[active, -1], rates[active, -1]))
        return False

    def _locate(
        self, looks: Looks, values: Vector, rates: Vector, group: list[Candidate], *, sure: bool
    ) -> tuple[Cell | None, Located | None]:
        """Find the event in the interval of a group; no interval if its states are not known precisely enough.

        With `sure`, the looks cannot be closer.
        """
        k = group[0].interval
        watched = [one.guard for one in group]
        sizes = np.abs(values[watched, k]) + np.abs(values[watched, k + 1])
        cells = looks.cells(k, k + 1)
        cell = next((one for one in cells if sure or looks.is_sharp(one, watched, sizes)), None)
        if cell is None:
            return None, None

        def trial(span: float) -> tuple[Point, Vector, Vector]:
            point = looks.at(cell.t + span, cell)
            return point, *self.guards.at(point)

        first, last = (values[:, k], rates[:, k]), (values[:, k + 1], rates[:, k + 1])
        return cell, locate(trial, cell.width, first, last, group, cell.t)

    def _search_closer(self, looks: Looks, k: int, depth: int, *, begins: bool) -> bool:
        """Search between two looks again, with closer ones; whatever is found, the run goes on from there."""
        self._keep(looks, float(looks.times[k]), k + 1)
        closer = self._closer(looks, k)
        closer.times[-1] = looks.times[k + 1]
        if not self._search(closer, depth + 1, begins=begins):
            self._keep(closer, float(closer.times[-1]), closer.count)
            self._arrive(closer)
        return True

    def _reach(self, looks: Looks, k: int, point: Point, wanting: list[CompiledTransition]) -> None:
        """Go to a point between look k and the next and fire what wants to."""
        self._keep(looks, self.pace.before(point.t), k + 1)
        self.now = point
        if wanting:
            self.record.add(np.array([point.t]), point.x[:, None], point.z[:, None])
            self._event([*wanting, *self.instants.due(point)])

    def _look_behind(self, looks: Looks, cell: Cell, located: Located, late: list[int]) -> list[CompiledTransition]:
        """Go on by the time resolution; what is still positive there wants to fire, else the search begins anew."""
        behind = located.point.t + TIME_RESOLUTION * max(1.0, abs(located.point.t))
        located.point = looks.at(min(behind, cell.t + cell.width), cell)
        values, _ = self.guards.at(located.point)
        return [self.guards.state_events[g] for g in late if values[g] > 0]

    def _wanting(self) -> list[CompiledTransition]:
        return [*self.instants.due(self.now), *self.instants.rising(self.now)]

    def _event(self, wanting: list[CompiledTransition]) -> None:
        """Handle an event: close the segment, change modes until nothing fires, begin the next segment."""
        self.record.end(self.now.d)
        self._failures, self._failed_before, self._in_sight = 0, self.now.t, np.inf
        lasted = self._lasted[self.now.d.tobytes()] = self.now.t - self._since
        self._since = self.now.t
        self.now = self.now.copy()
        self.instants.settle(self.now, wanting)
        self.pace.anew(self._lasted.get(self.now.d.tobytes(), lasted))
        self.record.begin(self.now)


def _foreseen(values: Vector, rates: Vector) -> float:
    """Time until the first guard rises, as far as straight lines tell."""
    rising = (values < 0) & (rates > -_NEVER * values)
    return float(np.min(-values[rising] / rates[rising], initial=np.inf))
