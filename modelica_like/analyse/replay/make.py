"""Repeats a run in steps that can be differentiated: the chain of a replay is made here."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.analyse.replay.chain import Move, Replay
from modelica_like.analyse.replay.jumps import Work, make_jump
from modelica_like.analyse.replay.kinks import Kinks
from modelica_like.analyse.replay.start import product, start_slopes
from modelica_like.analyse.replay.step import CLOSE, Step, shortened, stuck, try_step
from modelica_like.analyse.replay.steps import StepFunctions
from modelica_like.analyse.replay.tangents import Tangents
from modelica_like.analyse.replay.tolerances import ABSOLUTE, Tolerances
from modelica_like.analyse.replay.when import Coincidence, event_time
from modelica_like.compile.buffers import Vector
from modelica_like.compile.compiled import TERMINAL, CompiledTransition
from modelica_like.errors import LanguageError, NoGradient
from modelica_like.native.start import initialize
from modelica_like.runs.solution import Solution
from modelica_like.solve.initialize import Point, StartKind, holding
from modelica_like.solve.initialize.slopes import Sizes, Slopes, slopes
from modelica_like.solve.recorder import Event, Segment

_SHRINK, _GROW, _SAFETY = 0.2, 8.0, 0.8
_SMALLEST = 1e-14
_RELOCATIONS = 6
_ALIKE = 1e-2
"""Difference of the states at the end of a run and of its repetition, over their largest values."""
_FIRST = 1e-3
"""First step behind an event, relative to the last one before: a law can begin there with an infinite slope."""

_LEAST = 1e-7
"""Steps, relative to the run, that are not shortened for the derivatives: these may jump there."""


def replay(
    solution: Solution, quadratures: Any = None, name: str = "", *, start: StartKind | None = None,
    stops: Sequence[float] | Vector = (), tolerances: Tolerances | None = None,
) -> Replay:  # fmt: skip
    """Integrate a run again, with its mode sequence given.

    Args:
        solution: the run.
        quadratures: what to integrate along it, an SX column in the model's `arguments`.
        name: identifies these quadratures in the model's cache.
        start: kind of start of the run; by default that of the netlist.
        stops: times that are to be nodes, in s.
        tolerances: of the steps.

    Raises:
        NoGradient: an event of the run has no derivative, or its end is an event, or the states at the end differ.
        StepFailed: a step did not converge.
        LanguageError: the model has no states.
    """
    model = solution.model
    if not model.states:
        raise LanguageError(
            f"{model.name} has no states, so there is no run to differentiate.",
            advice="Compare runs with other parameter values instead.",
        )
    if TERMINAL in model.discrete_position:
        raise NoGradient(f"No gradient: {model.name} changes at the end of a run, by terminal().")
    if (ended := solution.ended) is not None:
        raise NoGradient(
            f"No gradient: {ended.component} ends the run at {ended.time:.9g} s, and this time depends on parameters.",
            advice="End the run before, or compare other values by a sweep, which has the numbers at each end.",
        )
    model.refuse_delays(NoGradient, f"No gradient of {model.name}")
    integrands = ca.SX(0, 1) if quadratures is None else quadratures
    chain = Replay(StepFunctions(model, integrands, name, tolerances or Tolerances()))
    maker = _Maker(solution, chain, stops)
    maker.start(start or model.settings.get("start", "given"))
    for number, segment in enumerate(solution.segments):
        if number:
            maker.jump(number)
        maker.smooth(segment)
    _check_end(solution, chain.nodes[-1])
    return chain


def _check_end(solution: Solution, end: Point) -> None:
    """Refuse derivatives of another run: both integrate the same equations, so one of them has gone over something."""
    model, x = solution.model, np.hstack([segment.x for segment in solution.segments])
    allowed = _ALIKE * (np.abs(x).max(axis=1) + ABSOLUTE * model.equations.nominals)
    apart = np.abs(end.x - x[:, -1]) / allowed
    if not apart.max() <= 1.0:
        k = int(np.argmax(apart))
        raise NoGradient(
            f"No gradient of {model.name}: the run ends with {model.states[k]} = {x[k, -1]:.6g}, its repetition for "
            f"the derivatives with {end.x[k]:.6g}.",
            why="Either it depends on its last digits, or one of them has gone over a narrow pulse.",
            advice="Repeat both with smaller tolerances, or compare runs with other values.",
        )


def _sparse(matrix: Vector) -> ca.DM:
    return ca.sparsify(ca.DM(matrix))


class _Maker:
    def __init__(self, solution: Solution, chain: Replay, stops: Sequence[float] | Vector) -> None:
        self.solution, self.model, self.chain = solution, solution.model, chain
        self.kinks = Kinks(solution.model, solution.segments, chain.functions.quadratures)
        # A step could begin and end on the same side of a kink that the run has passed twice in between.
        self.stops = np.union1d(stops, self.kinks.seen())
        self.h = np.inf
        self.tangents = Tangents(self.model, chain.functions.tolerances)
        self.span = float(solution.segments[-1].times[-1] - solution.segments[0].times[0])
        self.events: list[list[Event]] = [[] for _ in solution.segments]
        for event in solution.events:
            self.events[event.segment].append(event)

    def start(self, kind: StartKind) -> None:
        """The first node and its derivatives by the parameters."""
        size = Sizes.of(self.model)
        t0 = float(self.solution.segments[0].times[0])
        changes = self.events[0] or self.model.events.update_rows
        point = initialize(self.model, t0, kind) if changes else self.solution.segments[0].start
        begin_x, begin_d = start_slopes(self.model, point, kind)
        whole = ca.vertcat(begin_x, ca.DM.eye(size.fixed), begin_d)
        chances: tuple[Coincidence, ...] = ()
        start_x, start_d = begin_x, begin_d
        if size.d:
            work = Work.at(self.model, point)
            work.resting.update(holding(self.model, point))
            work.differentiate_shares()
            chances = work.chances()
            start_d = _sparse(product(work.d, whole))
        if changes:
            self.chain.ticks += self._ticks(point.copy())
            integrands = self.chain.functions.integrands
            jump = make_jump(self.model, point, tuple(self.events[0]), point, integrands, first=True)
            chances += jump.chances
            whole = ca.vertcat(start_x, ca.DM.eye(size.fixed), start_d)
            start_x, start_d, point = _sparse(product(jump.x, whole)), _sparse(product(jump.d, whole)), jump.after
        self.chain.start_x, self.chain.start_d = start_x, start_d
        by = [product(chance.by[None], whole)[0] for chance in chances]
        self.chain.chances += [
            replace(chance, by=np.pad(row, (size.x, size.d))) for chance, row in zip(chances, by, strict=True)
        ]
        self.chain.nodes.append(point)
        self.tangents.begin(start_x, start_d)

    def _ticks(self, before: Point) -> Iterator[tuple[CompiledTransition, Slopes]]:
        """Yield the clocks that tick at the start: the only timed transitions that lead to where they come from."""
        fired = [self.model.events.transitions[event.transition] for event in self.events[0] if event.transition >= 0]
        for transition in fired:
            if transition.timed and transition.target in transition.sources:
                yield transition, slopes(self.model, before, "moments", [transition.index])

    def _append(self, move: Move) -> None:
        self.chain.append(move)
        self.tangents.carry(move)

    def jump(self, number: int) -> None:
        """Event before a segment."""
        events = tuple(self.events[number])
        begin = self.solution.segments[number - 1].start
        for _ in range(_RELOCATIONS):
            when = event_time(self.model, self.chain.nodes[-1], events, begin)
            if when.trigger is None or not self._relocate(when.trigger.shift):
                break
        jump = make_jump(self.model, self.chain.nodes[-1], events, begin, self.chain.functions.integrands, first=False)
        self._append(jump)
        self.h = _FIRST * min(self.h, self.span)

    def _relocate(self, late: float) -> bool:
        """End the segment just before its event, because slopes can differ behind it.

        The remaining shift times the rates of the fastest motion is an error of the derivatives.
        """
        last, small = self.chain.moves[-1] if self.chain.moves else None, CLOSE * max(1.0, abs(self.chain.nodes[-1].t))
        if late == 0.0 or 0.0 < late <= 2.0 * small or not isinstance(last, Step):
            return False
        h = last.h + late - small
        step = None
        if h > 0.0:
            step, _ = try_step(self.chain.functions, last.before, h, last)
            if step is None:
                return False
        self.chain.nodes.pop()
        self.chain.moves.pop()
        self.tangents.go_back()
        if step is not None:
            self._append(step)
        return True

    def smooth(self, segment: Segment) -> None:
        """Steps over a segment."""
        begin, end = float(segment.times[0]), float(segment.times[-1])
        inner = self.stops[(self.stops > begin) & (self.stops < end)]
        for stop in [*inner, end] if end > begin else []:
            self._advance(float(stop))

    def _advance(self, end: float) -> None:
        """Steps up to a time, as long as their error allows."""
        before = None
        while (here := self.chain.nodes[-1]).t < end:
            left = end - here.t
            h = left if self.h >= 0.999 * left else min(self.h, 0.5 * left) if self.h > 0.5 * left else self.h
            if h < _SMALLEST * max(1.0, abs(here.t)) and h < left:
                raise stuck(here)
            step, error = try_step(self.chain.functions, here, h, before)
            if step is not None and error <= 1.0 and h > _LEAST * self.span:
                error = max(error, self.tangents.error(step))
            order = len(self.chain.functions.tableau.nodes) + 1
            factor = max(_SHRINK, min(_GROW, _SAFETY * (error + 1e-16) ** (-1.0 / order)))
            if step is not None and error <= 1.0:
                if h == left:
                    step.after.t = end
                self.h = max(self.h, h * factor) if h == left else h * factor
                before = self._up_to_kink(step)
                self._append(before)
            else:
                self.h = h * min(factor, 0.7)
                before = None if step is None else before

    def _up_to_kink(self, step: Step) -> Step:
        """Shorten a step so that it ends just before the first kink of the equations within it."""
        begin, last = self.kinks.at(step.before), -1
        for _ in range(self.kinks.count):
            passed = self._passed(step, begin)
            if passed is None:
                break
            last, high = passed
            value = lambda point, k=last: float(self.kinks.at(point)[k])  # noqa: E731
            shorter = shortened(step, value, (0.0, float(begin[last])), high)
            if shorter is None:
                break
            step = shorter
        for number in self.kinks.reached(begin, step.after, last):
            chance = self.kinks.jump(step.after, number, begin, self.chain.functions.integrands)
            self.chain.silent += [] if chance is None else [(step.after, chance)]
        return step

    def _passed(self, step: Step, begin: Vector) -> tuple[int, tuple[float, float]] | None:
        """Which kink is passed at the first of the step's stages, how far in, and its function there."""
        for point in [*step.inside(), step.after]:
            values = self.kinks.at(point)
            passed = np.flatnonzero(self.kinks.passed(begin, values))
            if passed.size:
                return int(passed[0]), (point.t - step.before.t, float(values[passed[0]]))
        return None
