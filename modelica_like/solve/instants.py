"""Transitions at one instant, which the compiled run-time fires until none is left, and the times of time events."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from modelica_like import upper
from modelica_like.compile.compiled import CompiledDae, CompiledTransition
from modelica_like.errors import LimitPassed
from modelica_like.language.transition import NAME_IN_NOTICE
from modelica_like.options import Options
from modelica_like.solve.endless import chattering
from modelica_like.solve.initialize import Impact, Point, call, sharing
from modelica_like.solve.recorder import Recorder

_CHATTER_INSTANTS = 25
_CHATTER_WINDOW = 1e-6
SAME_TIME = 1e-12
"""Relative distance of two equal times."""


def just_after(t: float) -> float:
    """Return the latest time that counts as equal."""
    return t + (SAME_TIME * t if t > 1.0 else SAME_TIME if t > -1.0 else -SAME_TIME * t)


class Instants:
    """Fires the transitions of a run by the compiled run-time, and records them as events.

    Args:
        model: the compiled model.
        options: with the limit of events.
        record: of the events.
        start: time in s at which the run begins.
        end: time in s.
    """

    def __init__(self, model: CompiledDae, options: Options, record: Recorder, start: float, end: float) -> None:
        self.model = model
        self.options = options
        self.record = record
        self.span = end - start
        self._start = start
        self._engine: upper.InstantEngine | None = None
        self.timed = [t for t in model.transitions if t.timed]
        self._moments: tuple[bytes, list[tuple[CompiledTransition, float]]] = b"", []
        self._numbers = {id(transition): k for k, transition in enumerate(model.transitions)}

    def next_moment(self, now: Point) -> float:
        """Time of the next time event, or infinity."""
        return min((t for _, t in self.ahead(now)), default=np.inf) if self.timed else np.inf

    def ahead(self, now: Point) -> list[tuple[CompiledTransition, float]]:
        """Time events that come, with their times."""
        here = just_after(now.t)
        return [one for one in self._planned(now) if one[1] > here]

    def due(self, now: Point) -> list[CompiledTransition]:
        """Time events whose time is reached."""
        if not self.timed:
            return []
        here = just_after(now.t)
        return [one for one, moment in self._planned(now) if moment <= here]

    def _planned(self, now: Point) -> list[tuple[CompiledTransition, float]]:
        """Time events of the present modes with their times, which only discrete values change."""
        key = now.d.tobytes()
        if key != self._moments[0]:
            moments = call(self.model, self.model.moments, now).tolist()
            self._moments = key, [(t, moments[t.index]) for t in self.timed if _is_source(now, t)]
        return self._moments[1]

    def settle(self, now: Point, wanting: Iterable[CompiledTransition], *, begins: bool = False) -> None:
        """Fire transitions until none is left and no discrete variable changes; `now` becomes the point after.

        Without transitions, nothing happens unless the run `begins`.

        Raises:
            Chattering: transitions do not end, or events follow each other ever faster.
            LimitPassed: a transition ends the run.
            NoValidModes: ideal elements have no valid combination of modes.
            SingularAtStart: the equations have no unique solution after it.
        """
        located = [self._numbers[id(transition)] for transition in wanting]
        if not (located or (begins and (self.model.update_rows or self.model.ideal))):
            return
        if self._engine is None:
            self._engine = upper.InstantEngine(self.model, self._start, self._start + self.span, self.options)
        code, events, impacts = self._engine.settle(now, located)
        for time, *numbers in events:
            transition, mode, before, after, number = (int(one) for one in numbers[:5])
            self.record.note(self.model, time, mode, (before, after), transition, number)
        self.record.impacts += impacts_of(self.model, impacts)
        self._engine.check(code, self.record.events)
        note_sharing(self.record, self.model, now)
        if len(self.record.events) > self.options.max_events:
            why = f"There were more than {self.options.max_events} events"
            raise chattering(self.model, self.record.events, why, self.options.on_chattering)


def impact_size(model: CompiledDae) -> int:
    """Return the number of columns that an impact takes in `NativeRun` in native.c."""
    return 3 + 2 * (len(model.states) + len(model.implicit) + model.discrete_size)


def impacts_of(model: CompiledDae, rows: Sequence[Sequence[float]]) -> Iterator[Impact]:
    """Yield impacts from what the run-time has written; the first one of an instant has the trials of all."""
    last, (nx, nd) = np.nan, (len(model.states), model.discrete_size)
    for time, held, energy, *numbers in rows:
        parts = np.split(np.array(numbers), 2) if time != last else ()
        points = [Point(time, part[:nx], part[nx : len(part) - nd], part[len(part) - nd :]) for part in parts]
        yield Impact(time, model.holds[int(held)].component, energy, (points[0], points[1]) if points else None)
        last = time


def limit_passed(model: CompiledDae, now: Point, transition: CompiledTransition) -> LimitPassed:
    """Return the error of a transition that ends the run; its notice tells values of the present point."""
    owner, dot, _ = model.flat_discretes[transition.mode].path.rpartition(".")
    told = NAME_IN_NOTICE.sub(lambda name: _told(model, now, owner + dot + name[1]), transition.notice)
    return LimitPassed(f"At {now.t:.9g} s {owner or model.name} {told}.")


def _told(model: CompiledDae, now: Point, path: str) -> str:
    """Return a parameter, variable or discrete value as a number."""
    if path in model.position:
        return f"{call(model, model.variables, now)[model.position[path]]:g}"
    if path in model.discrete_position:
        return f"{now.d[model.discrete_position[path]]:g}"
    if path in model.derived_position:
        return f"{float(model.derived(model.p)[model.derived_position[path]]):g}"
    return f"{model.p[model.parameter_position[path]]:g}"


def note_rest(record: Recorder, options: Options, span: float) -> None:
    """Add a notice for every time from which on impacts that followed each other ever faster ended in contact."""
    if options.on_chattering != "rest":
        return
    times = list(dict.fromkeys(event.time for event in record.events))
    rested = -np.inf
    for first, last in zip(times, times[_CHATTER_INSTANTS - 1 :], strict=False):
        if last - first < _CHATTER_WINDOW * span and first > rested + _CHATTER_WINDOW * span:
            rested = last
            parts = dict.fromkeys(one.component for one in record.impacts if first <= one.time <= last)
            told = f"{last:.9g} s on, {', '.join(parts) or 'the model'}"
            record.notices.append(f"From {told} rests in contact: impacts followed each other ever faster.")


def note_sharing(record: Recorder, model: CompiledDae, now: Point) -> None:
    """Add one notice about elements that share an undetermined reaction."""
    for parts in sharing(model, now):
        text = (
            f"{', '.join(parts[:-1])} and {parts[-1]} hold the same motion: they share the reaction in proportion "
            "to what they can bear, because nothing else determines the split."
        )
        if text not in record.notices:
            record.notices.append(text)


def _is_source(now: Point, transition: CompiledTransition) -> bool:
    return int(now.d[transition.mode]) in transition.sources
