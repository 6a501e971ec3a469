"""The event loop: smooth segments by IDAS, events located and iterated between them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from modelica_like.compile.compiled import CompiledDae, CompiledTransition, Vector
from modelica_like.compile.soon import TIME_RESOLUTION
from modelica_like.errors import StepFailed
from modelica_like.initialize import Point
from modelica_like.solve.guards import Guards, Located, candidates, locate
from modelica_like.solve.idas import Integrator
from modelica_like.solve.instants import SAME_TIME, Instants, just_after
from modelica_like.solve.options import Options
from modelica_like.solve.recorder import Recorder

_FIRST_PANEL = 8
_GROWTH = 4
_NEVER = 1e-12
"""Rates, relative to the value and per second, below which a guard does not rise."""
_STEPS_PER_CHECK = 6
"""Guards are looked at about as often as the integrator needs steps: what oscillates between results is not missed."""
_STEPS_TO_START = 30
_MAX_CHECKS = 2**16
_MAX_HALVINGS = 30
_MAX_FAILURES = 40
_ON_GRID = 1e-7

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
        self.begin = start.t
        self.end = end
        self.step = (end - start.t) / options.points
        self.checks = 1
        self._failures = 0
        self._failed_before = start.t
        self._in_sight = np.inf
        self._ahead = np.inf
        self.progress = progress
        self.integrator = Integrator(model, options)
        self.guards = Guards(model)
        self.record = Recorder()
        self.panel = _FIRST_PANEL if self.guards.count else options.points
        self.instants = Instants(model, options, self.guards, self.record, end - start.t)

    def run(self) -> Recorder:
        """Simulate.

        Raises:
            Chattering, StepFailed, SingularAtStart: the run cannot go on.
        """
        self.instants.settle(self.now, self._wanting())
        self.record.begin(self.now)
        while self.now.t < self.end:
            self._advance(min(self.instants.next_moment(self.now), self.end))
            if self.progress is not None:
                self.progress(self.now.t)
        self.record.end(self.now.d)
        return self.record

    # -- smooth pieces -----------------------------------------------------------------------------------------------

    def _advance(self, stop: float) -> None:
        """Integrate up to `stop` at most, ending earlier at an event or at the end of a panel."""
        first = self.now
        times, x, z = self._panel(stop)
        if self.guards.count and self._stop_at_event(times, x, z):
            return
        self._keep(times, x, z, stop)
        self.now = Point(float(times[-1]), x[:, -1].copy(), z[:, -1].copy(), first.d)
        if self.now.t >= self._failed_before:
            self._failures = 0
        longer = self.panel * _GROWTH
        if self.guards.count and len(times) >= self.panel and longer * self.step / self.checks < self._ahead:
            self.panel = longer
        if times[-1] == stop and self.instants.due(self.now):
            self._event(self._wanting())

    def _keep(self, times: Vector, x: Vector, z: Vector, stop: float = np.inf) -> None:
        """Record the results among the points at which guards were looked at."""
        position = (times - self.begin) / self.step
        kept = (np.abs(position - np.rint(position)) < _ON_GRID) | (times == stop)
        self.record.add(times[kept], x[:, kept], z[:, kept])

    def _shorten(self, steps: int, times: Vector, x: Vector, z: Vector) -> bool:
        """Let the next panel end at the first event in sight, if this one was laborious; True if that is much sooner.

        Behind an event the old mode's equations mean nothing, so what they cost tells nothing about looks at guards.
        """
        outputs = len(times)
        if not self.guards.count or outputs < _FIRST_PANEL or steps <= _STEPS_PER_CHECK * outputs:
            return False
        values, _ = self.guards.along(times, x, z, self.now.d)
        risen = np.flatnonzero((values[self.guards.active(self.now.d)] > 0).any(axis=0))
        if not len(risen) or 2 * (risen[0] + 1) > outputs:
            return False
        self._in_sight = float(times[risen[0]])
        return True

    def _refine(self, steps: int, points: int) -> bool:
        """Adapt the number of looks at the guards per result to the integrator's steps; True if it was too small."""
        if not self.guards.count:
            return False
        each = max(steps - _STEPS_TO_START, 0) / points
        if each > _STEPS_PER_CHECK and self.checks < _MAX_CHECKS:
            self.checks = min(self.checks << int(np.ceil(np.log2(each / _STEPS_PER_CHECK))), _MAX_CHECKS)
            return True
        if points >= 4 * _FIRST_PANEL and each < _STEPS_PER_CHECK / 8:
            self.checks = max(self.checks // 2, 1)
        return False

    def _panel(self, stop: float) -> tuple[Vector, Vector, Vector]:
        """Integrate one panel.

        A panel that spans several results may run past an event, where the equations of the old mode mean nothing and
        may blow up; then a
        shorter one ends before.
        """
        while True:
            goal = min(stop, self._in_sight) if self._in_sight > just_after(self.now.t) else stop
            span, outputs = self._next_panel(goal)
            arrives = self.now.t + span >= goal - SAME_TIME * max(1.0, abs(goal))
            span = goal - self.now.t if arrives else span
            before = self.integrator.steps
            try:
                x, z = self.integrator.run(self.now, span, outputs, patient=not self.guards.count)
            except StepFailed:
                if self._gives_up(self.now.t + span):
                    raise
                if outputs == 1:
                    return self._short_piece(span)
                self.panel = max(1, outputs // _GROWTH)
                continue
            times = self.now.t + span * np.arange(1, outputs + 1) / outputs
            steps = self.integrator.steps - before
            if self._shorten(steps, times, x, z) or self._refine(steps, outputs):
                continue
            if outputs > 1:
                self._snap(times)
            if arrives:
                times[-1] = goal
            return times, x, z

    def _gives_up(self, end: float) -> bool:
        """Count failures on the way to one place: behind it is an event, or nothing."""
        self._failures += 1
        self._failed_before = max(self._failed_before, end)
        return not self.guards.count or self._failures > _MAX_FAILURES

    def _short_piece(self, span: float) -> tuple[Vector, Vector, Vector]:
        """Integrate a part of the distance to the next result, as long as possible."""
        for halvings in range(1, _MAX_HALVINGS):
            piece = span / 2**halvings
            try:
                x, z = self.integrator.run(self.now, piece, patient=False)
            except StepFailed:
                if self._gives_up(self.now.t + piece) or halvings + 1 == _MAX_HALVINGS:
                    raise
                continue
            return np.array([self.now.t + piece]), x, z
        raise AssertionError

    def _next_panel(self, stop: float) -> tuple[float, int]:
        """Choose length and number of points.

        They lie on the regular grid of results or in between, except where an event ends a segment.
        """
        step = self.step / self.checks
        position = (self.now.t - self.begin) / step
        nearest = round(position)
        if abs(position - nearest) > 1e-9 * max(1.0, position):
            result = self.begin + (np.floor(position / self.checks) + 1) * self.step
            looks = 1 << int(np.ceil(np.log2(max((min(result, stop) - self.now.t) / step, 1.0))))
            if self.guards.count and looks <= self.panel:
                return min(result, stop) - self.now.t, looks
            to_grid = self.begin + (np.floor(position) + 1) * step
            return min(to_grid, stop) - self.now.t, 1
        whole = int(np.floor((stop - self.now.t) / step + 1e-9))
        if whole == 0:
            return stop - self.now.t, 1
        outputs = min(whole, self.panel)
        if self.guards.count:
            outputs = 1 << (outputs.bit_length() - 1)
        return outputs * step, outputs

    def _snap(self, times: Vector) -> None:
        """Put times exactly on the regular grid, so that they do not collect rounding errors."""
        position = (times - self.begin) / self.step * self.checks
        numbers = np.rint(position)
        on_grid = np.abs(position - numbers) < _ON_GRID
        times[on_grid] = self.begin + (self.end - self.begin) * (numbers[on_grid] / (self.options.points * self.checks))

    def _stop_at_event(self, times: Vector, x: Vector, z: Vector) -> bool:
        """Look for guards that become positive; if one does, go there and handle the event."""
        first = self.now
        all_times = np.concatenate([[first.t], times])
        all_x = np.concatenate([first.x[:, None], x], axis=1)
        all_z = np.concatenate([first.z[:, None], z], axis=1)
        values, rates = self.guards.along(all_times, all_x, all_z, first.d)
        # What the last event left positive did not want to fire: it is on its way down.
        values[:, 0] = np.minimum(values[:, 0], 0.0)
        active = self.guards.active(first.d)
        found = candidates(values, rates, active, float(np.max(np.diff(all_times))))
        while found:
            k = found[0].interval
            group = [one for one in found if one.interval == k]
            base = Point(float(all_times[k]), all_x[:, k], all_z[:, k], first.d)
            located = locate(
                lambda span, base=base: self._trial(base, span),
                float(all_times[k + 1] - all_times[k]),
                (values[:, k], rates[:, k]),
                (values[:, k + 1], rates[:, k + 1]),
                group,
                base.t,
            )
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
                wanting = self._look_behind(base, located, late, float(all_times[k + 1]))
            if k > 0:
                self._keep(all_times[1 : k + 1], all_x[:, 1 : k + 1], all_z[:, 1 : k + 1])
            self.now = located.point
            if not wanting:
                return True
            self.record.add(np.array([self.now.t]), self.now.x[:, None], self.now.z[:, None])
            self._event([*wanting, *self.instants.due(self.now)])
            return True
        self._ahead = _foreseen(values[active, -1], rates[active, -1])
        return False

    def _look_behind(self, base: Point, located: Located, late: list[int], end: float) -> list[CompiledTransition]:
        """Go on by the time resolution; what is still positive there wants to fire, else the search begins anew."""
        behind = located.point.t + TIME_RESOLUTION * max(1.0, abs(located.point.t))
        located.point, values, _ = self._trial(base, min(behind, end) - base.t)
        return [self.guards.state_events[g] for g in late if values[g] > 0]

    def _trial(self, base: Point, span: float) -> tuple[Point, Vector, Vector]:
        if span <= 0.0:
            point = base.copy()
        else:
            x, z = self.integrator.run(base, span)
            point = Point(base.t + span, x[:, 0], z[:, 0], base.d)
        return point, *self.guards.at(point)

    def _wanting(self) -> list[CompiledTransition]:
        return [*self.instants.due(self.now), *self.instants.rising(self.now)]

    def _event(self, wanting: list[CompiledTransition]) -> None:
        """Handle an event: close the segment, change modes until nothing fires, begin the next segment."""
        self.record.end(self.now.d)
        self._failures, self._failed_before, self._in_sight = 0, self.now.t, np.inf
        self.now = self.now.copy()
        self.instants.settle(self.now, wanting)
        self.record.begin(self.now)
        self.panel = _FIRST_PANEL if self.guards.count else self.options.points


def _foreseen(values: Vector, rates: Vector) -> float:
    """Time until the first guard rises, as far as straight lines tell."""
    rising = (values < 0) & (rates > -_NEVER * values)
    return float(np.min(-values[rising] / rates[rising], initial=np.inf))
