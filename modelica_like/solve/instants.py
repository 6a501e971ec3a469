"""Transitions at one instant: fire them until none is left."""

from __future__ import annotations

import sys
from collections import deque

import numpy as np

from modelica_like.compile.compiled import CompiledDae, CompiledTransition, Vector
from modelica_like.errors import Chattering, LimitPassed
from modelica_like.language.transition import NAME_IN_NOTICE
from modelica_like.options import Options
from modelica_like.solve.endless import SWITCHING, chattering, not_settled
from modelica_like.solve.guards import Guards
from modelica_like.solve.initialize import (
    Point,
    Strike,
    call,
    check_singular,
    chosen_modes,
    holding,
    meet,
    refuse_contradiction,
    share,
    sharing,
    solve_implicit,
    variable_slopes,
)
from modelica_like.solve.penetration import check_turned_back
from modelica_like.solve.recorder import IMPACT, Recorder

_CHATTER_INSTANTS = 25
_TOGETHER = 6
"""Rounds at one instant in which all transitions fire together."""
_ALONE = 6
"""Further rounds per holdable motion, in which only one fires."""
_CHATTER_WINDOW = 1e-6
_CONVERGES = 0.9
"""Length of a crowd of instants over the one before: rebounds come to their end, chattering does not."""
_GIVEN_BACK = 1e-3
"""Current, over the largest one, that is none where modes return: it ends within the time resolution."""
SAME_TIME = 1e-12
"""Relative distance of two equal times."""


def just_after(t: float) -> float:
    """Return the latest time that counts as equal."""
    return t + (SAME_TIME * t if t > 1.0 else SAME_TIME if t > -1.0 else -SAME_TIME * t)


class Instants:
    """Fires the transitions of a run and records them as events.

    Args:
        model: the compiled model.
        options: with the limits of rounds and events.
        guards: the state events.
        record: of the events.
        span: length of the run in s.
    """

    def __init__(self, model: CompiledDae, options: Options, guards: Guards, record: Recorder, span: float) -> None:
        self.model = model
        self.options = options
        self.guards = guards
        self.record = record
        self.span = span
        self._struck: Point | None = None
        self._entered: set[int] = set()
        self._impacts = 0
        self._instants: deque[float] = deque(maxlen=_CHATTER_INSTANTS)
        self._crowd = 0.0
        self._round = 0
        self._modes = [one.mode for one in model.ideal.elements] if model.ideal else []
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

    def settle(self, now: Point, wanting: list[CompiledTransition], *, begins: bool = False) -> None:
        """Fire transitions until none is left and no discrete variable changes; `now` becomes the point after.

        Without transitions, nothing happens unless the run `begins`. All of them fire together. Surfaces that hold each
        other may then cycle, so after some rounds only the first one fires (K. G. Murty's least-index rule, which
        ends if the solution is unique).

        Raises:
            Chattering: transitions do not end, or events follow each other ever faster.
            LimitPassed: a transition ends the run.
            NoValidModes: ideal elements have no valid combination of modes.
            SingularAtStart: the equations have no unique solution after it.
        """
        changes = bool(self.model.update_rows)
        ideal, earlier = self._modes, now.d
        if not (wanting or (begins and (changes or ideal))):
            return
        noted, first, begun = len(self.record.events), wanting, now.copy()
        if not begins:
            meet(self.model, now)  # the integration leaves the conditions of ideal elements within its tolerances
        if self._instants and now.t - self._instants[-1] >= _CHATTER_WINDOW * self.span:
            self._crowd = 0.0
        self._struck, self._entered = None, set()
        wanting = self._share_anew(now, wanting)
        alone = self.options.iterations + _ALONE * (len(self.model.holds) + len(ideal))
        for number in range(alone):
            self._round = number
            if ideal and not (wanting or changes) and meet(self.model, now):
                wanting = self.guards.wanting(now)
            if not (wanting or changes):
                break
            before = now.d
            if wanting:
                self._fire(now, wanting if number < _TOGETHER else [min(wanting, key=self._number)])
                self._solve(now)
                self._stop_motions(now, before)
                if ideal:
                    back = number and np.array_equal(now.d[ideal], earlier[ideal])
                    meet(self.model, now, keep=_GIVEN_BACK if back else 0.0)
                    earlier = before
            jumping = call(self.model, self.model.guards, now) if self.model.update_rows else None
            changes = self._update(now)
            wanting = [*self.due(now), *self.guards.wanting(now, jumping if changes else None)]
        else:
            raise self._endless(now, alone, changes=changes)
        refuse_contradiction(self.model, now)
        note_sharing(self.record, self.model, now)
        check_turned_back(self.model, first, begun, now)
        if len(self.record.events) > noted:
            self._limit(now)

    def _limit(self, now: Point) -> None:
        """Note an instant with events; too many, or too many in a short time, end the run."""
        self._instants.append(now.t)
        length = now.t - self._instants[0]
        if len(self._instants) == _CHATTER_INSTANTS and length < _CHATTER_WINDOW * self.span:
            if self.options.on_chattering != "rest" or 0 < self._crowd * _CONVERGES <= length:
                raise self._chattering("Events follow each other ever faster")
            self._crowd = max(length, sys.float_info.min)
            self._instants.clear()
        if len(self.record.events) > self.options.max_events:
            raise self._chattering(f"There were more than {self.options.max_events} events")

    def _share_anew(self, now: Point, wanting: list[CompiledTransition]) -> list[CompiledTransition]:
        """Let others take more before one of several holding elements breaks away; return the remaining transitions."""
        if not any(now.d[one.entries].any() for one in self.model.circuits):
            return wanting
        share(self.model, now)
        solve_implicit(self.model, now)
        soon = self.guards.at(now)[2]
        positions = self.guards.positions
        return [one for one in wanting if one.timed or soon[positions[id(one)]] > 0]

    def _fire(self, now: Point, wanting: list[CompiledTransition]) -> None:
        """Fire transitions together; of one mode only the one declared first."""
        chosen: dict[int, CompiledTransition] = {}
        for transition in sorted(wanting, key=self._number):
            if _is_source(now, transition):
                chosen.setdefault(transition.mode, transition)
        targets: list[tuple[int, float]] = []
        resets = any(transition.resets for transition in chosen.values())
        values = call(self.model, self.model.resets, now) if resets else ()
        x, d = now.x.copy(), now.d.copy()
        for transition in chosen.values():
            self._note(now, transition.mode, transition.target, self._number(transition))
            if transition.fails:
                raise limit_passed(self.model, now, transition)
            d[transition.mode] = transition.target
            for reset in transition.resets:
                if reset.kind == "state":
                    self._struck = None
                    x[reset.index] = values[reset.value] / reset.factor
                elif reset.kind == "discrete":
                    d[reset.index] = values[reset.value]
                else:
                    targets.append((reset.target, values[reset.value]))
        now.x, now.d = x, d
        if targets:
            self._project(now, targets)

    def _solve(self, now: Point) -> None:
        share(self.model, now)
        solve_implicit(self.model, now)
        check_singular(self.model, now)

    def _update(self, now: Point) -> bool:
        """Evaluate the discrete equations once; return whether something changes."""
        rows = self.model.update_rows
        if not rows:
            return False
        values, targets = call(self.model, self.model.updates, now), list[tuple[int, float]]()
        x, d = now.x.copy(), now.d.copy()
        for value, row in zip(values.tolist(), rows, strict=True):
            reset = row.reset
            if reset.kind == "discrete":
                d[reset.index] = value
            elif value != np.inf:
                self._struck = None
                if reset.kind == "state":
                    x[reset.index] = value / reset.factor
                else:
                    targets.append((reset.target, value))
        if not (targets or (d != now.d).any() or (x != now.x).any()):
            return False
        now.x, now.d = x, d
        if targets:
            self._project(now, targets)
        self._solve(now)
        return True

    def _endless(self, now: Point, rounds: int, *, changes: bool) -> Chattering:
        """Return the error of an instant whose iteration does not end."""
        found = not_settled(self.model, now, rounds) if changes else None
        return found or self._chattering(SWITCHING.format(rounds))

    def _stop_motions(self, now: Point, before: Vector) -> None:
        """Stop newly held motions; friction that breaks away in the impact takes the mode of a start."""
        holds = self.model.holds
        begun = {k for k, one in enumerate(holds) if now.d[one.mode] == one.number != before[one.mode]}
        entering = [k for k in holding(self.model, now) if k in begun] if begun else []
        if not entering:
            return
        strike = Strike(self.model, now, entering, resting=self._crowd > 0)
        if strike.hard:
            # All impacts at this instant are solved together, from the speeds before the first.
            self._entered.update(entering)
            if self._struck is None:
                self._struck, self._impacts = now.copy(), len(self.record.impacts)
            self._hold_again(now, self._struck)
            strike = Strike(self.model, now, self._entered, resting=self._crowd > 0)
        strike.run()
        self._entered.difference_update(strike.knocked)
        if strike.impacts:
            self.record.impacts[self._impacts :] = strike.impacts
        if strike.loose:
            self._choose_again(now, list(dict.fromkeys(holds[k].mode for k in strike.loose)))

    def _hold_again(self, now: Point, struck: Point) -> None:
        """Take the speeds before the first impact at this instant again, and hold what has met since, nothing else.

        Finite forces may have released a motion: they act after the impact. Others may have come to rest by an impact
        that is now solved anew.
        """
        now.x = struck.x.copy()
        for k, one in enumerate(self.model.holds):
            mode = int(now.d[one.mode])
            if k in self._entered:
                mode = one.number
            elif mode == one.number:
                mode = int(struck.d[one.mode])
            if mode == now.d[one.mode]:
                continue
            self._note(now, one.mode, mode, IMPACT)
            now.d[one.mode] = mode
        share(self.model, now)
        solve_implicit(self.model, now)

    def _choose_again(self, now: Point, modes: list[int]) -> None:
        starts, chosen = call(self.model, self.model.discrete_starts, now), now.copy()
        chosen.d[modes] = starts[modes]
        chosen.d = chosen_modes(self.model, chosen)
        for mode in modes:
            if chosen.d[mode] != now.d[mode]:
                self._note(now, mode, int(chosen.d[mode]), IMPACT)
                now.d[mode] = chosen.d[mode]
        share(self.model, now)
        solve_implicit(self.model, now)
        check_singular(self.model, now)

    def _project(self, now: Point, targets: list[tuple[int, float]]) -> None:
        """Change the states as little as possible, so that dependent variables take new values."""
        nodes = [self.model.reset_nodes[k] for k, _ in targets]
        present = call(self.model, self.model.variables, now)[nodes]
        slopes = variable_slopes(self.model, now, nodes)
        change = np.array([value for _, value in targets]) - present
        now.x = now.x + np.linalg.lstsq(slopes, change, rcond=None)[0]

    def _number(self, transition: CompiledTransition) -> int:
        return self._numbers[id(transition)]

    def _note(self, now: Point, number: int, target: int, transition: int) -> None:
        self.record.note(self.model, float(now.t), number, (int(now.d[number]), target), transition, self._round)

    def _chattering(self, why: str) -> Chattering:
        return chattering(self.model, self.record.events, why, self.options.on_chattering)


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
