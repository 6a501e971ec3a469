"""A run once more, as a chain of smooth steps and jumps whose derivatives are exact.

The mode sequence of a solution is given. Each smooth segment is integrated again by collocation over its known
interval, without looking for events; each event is a jump at its known time. Where the guard or the moment puts the
event a little earlier or later, the states are carried there and back at the rates before and after (the saltation of
M. A. Aizerman, F. R. Gantmakher, 1958), so the chain has the first derivatives of the run with its moving events.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.analyse.replay.jumps import Jump, Work, event_time, make_jump
from modelica_like.analyse.replay.kinks import Kinks
from modelica_like.analyse.replay.start import start_slopes
from modelica_like.analyse.replay.steps import StepFunctions
from modelica_like.analyse.slopes import Sizes
from modelica_like.compile.buffers import Vector
from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import LanguageError, StepFailed, ValueOutOfRange
from modelica_like.initialize import Point, StartKind, initialize
from modelica_like.solve.recorder import Event, Segment
from modelica_like.solve.solution import Solution

_ITERATIONS = 12
_CONVERGED = 1e-2
_ABSOLUTE = 1e-2
_ORDERS = 0.75
_SHRINK, _GROW, _SAFETY = 0.2, 8.0, 0.8
_SMALLEST = 1e-14
_FINEST, _COARSEST = 1e-13, 1e-3
_AHEAD = 2e-13
"""How far before an event a segment ends, relative to the time."""
_RELOCATIONS = 6
_TRIALS = 40
_FIRST = 1e-3
"""First step behind an event, relative to the last one before: a law can begin there with an infinite slope."""


@dataclass(frozen=True)
class Step:
    """A smooth step from `before` over `h` seconds with the solved stages W."""

    before: Point
    after: Point
    h: float
    stages: Vector
    quadratures: Vector

    def inside(self, nodes: Vector) -> list[Point]:
        """Return the points at the stages but the last, which is the end."""
        nx, stages = len(self.before.x), self.stages.reshape(len(nodes), -1)
        return [
            Point(self.before.t + c * self.h, w[:nx], w[nx:], self.before.d)
            for c, w in zip(nodes[:-1], stages[:-1], strict=True)
        ]


Move = Step | Jump


@dataclass(frozen=True)
class Tolerances:
    """How precisely to integrate again: relative to the states, or to a hundredth of their nominal values.

    What a step can estimate is the error of order s that its s stages leave; its end is of order 2 s - 1. The estimate
    may therefore be larger than the error that is wanted: by the power `_ORDERS`, where the orders alone would allow
    (s + 1)/(2 s), because for stiff motions the end loses order.
    """

    rtol: float = 1e-8

    def __post_init__(self) -> None:
        if not _FINEST <= self.rtol <= _COARSEST:
            raise ValueOutOfRange(
                f"The precision of a replay, {self.rtol:g}, is out of range: "
                f"it must be between {_FINEST:g} and {_COARSEST:g}."
            )

    def norm(self, error: Vector, before: Point, after: Point, nominals: Vector) -> float:
        """Estimated error of a step over what is allowed."""
        scale = np.maximum(np.abs(before.x), np.abs(after.x)) + _ABSOLUTE * nominals
        return float(np.linalg.norm(error / scale)) / (len(error) ** 0.5 * self.rtol**_ORDERS)


@dataclass(eq=False)
class Replay:
    """The chain: start, then moves from node to node.

    Attributes:
        model: the compiled model.
        nodes: the points between the moves; the first is the start after its events.
        moves: steps and jumps; move k leads from node k to node k + 1.
        start_x: derivatives of the first node's states by (p, u), shape (nx, np + nu).
        start_d: derivatives of its discrete values, shape (nd, np + nu).
        quadratures: integrals over the run of the integrands it was made with.
    """

    model: CompiledDae
    functions: StepFunctions
    nodes: list[Point]
    moves: list[Move]
    start_x: Vector
    start_d: Vector
    quadratures: Vector
    tolerances: Tolerances
    _jumps: list[int] = field(default_factory=list)

    @property
    def jumps(self) -> Iterator[tuple[int, Jump]]:
        """Positions and jumps."""
        return ((k, move) for k, move in enumerate(self.moves) if isinstance(move, Jump))

    def probe(self, node: int, t: float) -> Step:
        """Return the step from a node to a time before the next one."""
        return solve_step(self.functions, self.nodes[node], t - self.nodes[node].t, None, self.tolerances)


def replay(
    solution: Solution, quadratures: Any = None, name: str = "", *, start: StartKind | None = None,
    stops: Sequence[float] | Vector = (), tolerances: Tolerances | None = None,
) -> Replay:  # fmt: skip
    """Integrate a run again, with its mode sequence given.

    Args:
        solution: the run.
        quadratures: what to integrate along it, an SX column in the model's `arguments`.
        name: tells these quadratures from others in the model's cache.
        start: kind of start of the run; by default what the netlist says.
        stops: times that are to be nodes, in s.
        tolerances: how precisely.

    Raises:
        NoGradient: an event of the run has no derivative.
        StepFailed: a step did not converge.
        LanguageError: the model has no states.
    """
    model = solution.model
    if not model.states:
        raise LanguageError(
            f"{model.name} has no states: nothing develops over time, so there is no run to differentiate.",
            advice="Compare runs with other parameter values instead.",
        )
    integrands = ca.SX(0, 1) if quadratures is None else quadratures
    maker = _Maker(solution, StepFunctions(model, integrands, name), tolerances or Tolerances(), np.sort(stops))
    maker.start(start or model.settings.get("start", "given"))
    for number, segment in enumerate(solution.segments):
        if number:
            maker.jump(number)
        maker.smooth(segment)
    return maker.result()


class _Maker:
    def __init__(self, solution: Solution, functions: StepFunctions, tolerances: Tolerances, stops: Vector) -> None:
        self.solution = solution
        self.model = solution.model
        self.functions = functions
        self.tolerances = tolerances
        self.kinks = Kinks(solution.model, solution.segments)
        # A step could begin and end on the same side of a kink that the run has passed twice in between.
        self.stops = np.union1d(stops, self.kinks.seen())
        self.nodes: list[Point] = []
        self.moves: list[Move] = []
        self.h = np.inf
        self.span = float(solution.segments[-1].times[-1] - solution.segments[0].times[0])
        self.events: list[list[Event]] = [[] for _ in solution.segments]
        for event in solution.events:
            self.events[event.segment].append(event)

    def start(self, kind: StartKind) -> None:
        """The first node, and how it depends on parameters."""
        size = Sizes.of(self.model)
        t0 = float(self.solution.segments[0].times[0])
        point = initialize(self.model, t0, kind) if self.events[0] else self.solution.segments[0].start
        begin_x, begin_d = start_slopes(self.model, point, kind)
        whole = np.concatenate([begin_x, np.eye(size.fixed), begin_d])
        work = Work.at(self.model, point)
        work.share()
        self.start_x, self.start_d = begin_x, work.d @ whole
        if self.events[0]:
            jump = make_jump(self.model, point, tuple(self.events[0]), point, self.functions.integrands, first=True)
            whole = np.concatenate([begin_x, np.eye(size.fixed), self.start_d])
            self.start_x, self.start_d = jump.x @ whole, jump.d @ whole
            point = jump.after
        self.nodes.append(point)

    def jump(self, number: int) -> None:
        """Event before a segment."""
        events = tuple(self.events[number])
        begin = self.solution.segments[number - 1].start
        for _ in range(_RELOCATIONS):
            when = event_time(self.model, self.nodes[-1], events, begin)
            if when.trigger is None or not self._relocate(when.trigger.shift):
                break
        made = make_jump(self.model, self.nodes[-1], events, begin, self.functions.integrands, first=False)
        self._append(made, made.after)
        self.h = _FIRST * min(self.h, self.span)

    def _relocate(self, late: float) -> bool:
        """End the segment just before its event, if it does not yet: behind it, slopes can be different ones.

        What is left of the shift spoils derivatives by its product with the rates of the fastest motion.
        """
        last, small = self.moves[-1] if self.moves else None, _AHEAD * max(1.0, abs(self.nodes[-1].t))
        if late == 0.0 or 0.0 < late <= 2.0 * small or not isinstance(last, Step):
            return False
        h = last.h + late - small
        made = None
        if h > 0.0:
            made, _ = try_step(self.functions, last.before, h, last, self.tolerances)
            if made is None:
                return False
        self.nodes.pop()
        self.moves.pop()
        if made is not None:
            self._append(made, made.after)
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
        while (here := self.nodes[-1]).t < end:
            left = end - here.t
            h = left if self.h >= 0.999 * left else min(self.h, 0.5 * left) if self.h > 0.5 * left else self.h
            if h < _SMALLEST * max(1.0, abs(here.t)) and h < left:
                raise _stuck(here)
            made, error = try_step(self.functions, here, h, before, self.tolerances)
            factor = max(_SHRINK, min(_GROW, _SAFETY * (error + 1e-16) ** self._exponent))
            if made is not None and error <= 1.0:
                if h == left:
                    made.after.t = end
                self.h = max(self.h, h * factor) if h == left else h * factor
                before = self._up_to_kink(made)
                self._append(before, before.after)
            else:
                self.h = h * min(factor, 0.7)
                before = None if made is None else before

    def _up_to_kink(self, step: Step) -> Step:
        """Shorten a step so that it ends just before the first kink of the equations within it."""
        begin = self.kinks.at(step.before)
        for _ in range(self.kinks.count):
            passed = self._passed(step, begin)
            shorter = None if passed is None else self._first_kink(step, begin, *passed)
            if shorter is None:
                break
            step = shorter
        return step

    def _passed(self, step: Step, begin: Vector) -> tuple[int, float, float] | None:
        """Which kink lies behind the step at the first of its stages, how far in, and its function there."""
        for point in [*step.inside(self.functions.tableau.nodes), step.after]:
            values = self.kinks.at(point)
            passed = np.flatnonzero(self.kinks.passed(begin, values))
            if passed.size:
                return int(passed[0]), point.t - step.before.t, float(values[passed[0]])
        return None

    def _first_kink(self, step: Step, begin: Vector, number: int, high: float, f_high: float) -> Step | None:
        """Find where a kink is (Illinois) up to `high`; the step returned ends on its near side."""
        low, f_low = 0.0, float(begin[number])
        found: Step | None = None
        small = _AHEAD * max(1.0, abs(step.before.t))
        for _ in range(_TRIALS):
            if high - low <= small:
                break
            h = min(max(high - f_high * (high - low) / (f_high - f_low), low + 0.5 * small), high - 0.5 * small)
            made, _ = try_step(self.functions, step.before, h, step, self.tolerances)
            if made is None:
                return found
            f = float(self.kinks.at(made.after)[number])
            if f * f_low > 0.0:
                low, f_low, found, f_high = h, f, made, 0.5 * f_high
            else:
                high, f_high, f_low = h, f, 0.5 * f_low
        return found

    @property
    def _exponent(self) -> float:
        return -1.0 / (len(self.functions.tableau.nodes) + 1)

    def _append(self, move: Move, node: Point) -> None:
        self.moves.append(move)
        self.nodes.append(node)

    def result(self) -> Replay:
        """The chain."""
        total = np.zeros(self.functions.nq)
        for move in self.moves:
            total += move.quadratures if isinstance(move, Step) else move.late
        return Replay(
            self.model, self.functions, self.nodes, self.moves, self.start_x, self.start_d, total, self.tolerances
        )


def solve_step(functions: StepFunctions, point: Point, h: float, last: Step | None, tolerances: Tolerances) -> Step:
    """Make a step of a given length.

    Raises:
        StepFailed: it did not converge.
    """
    made, _ = try_step(functions, point, h, last, tolerances)
    if made is None:
        raise _stuck(point)
    return made


def try_step(
    functions: StepFunctions, point: Point, h: float, last: Step | None, tolerances: Tolerances
) -> tuple[Step | None, float]:
    """Make a step; return it and its error relative to the tolerances, or None if it did not converge."""
    model, nx, nz = functions.model, functions.nx, functions.nz
    theta = model.p, model.u, point.d
    if functions.linear:
        begin = _unchanged(functions, point)
        W, error, quadratures = functions.whole(point.t, h, point.x, begin, *theta, point.z)
    else:
        W = _solved(functions, point, h, last, tolerances.rtol)
        if W is None:
            return None, np.inf
        error, quadratures = functions.finish(point.t, h, point.x, W, *theta, point.z)
    after = Point(point.t + h, W[-nx - nz : W.size - nz].copy(), W[W.size - nz :].copy(), point.d)
    norm = tolerances.norm(error, point, after, model.nominals)
    return (Step(point, after, h, W, quadratures), norm) if norm < np.inf else (None, np.inf)


def _solved(functions: StepFunctions, point: Point, h: float, last: Step | None, rtol: float) -> Vector | None:
    """The stages by Newton's method, or None if it does not converge."""
    model = functions.model
    W = _predicted(functions, point, h, last)
    scale = np.concatenate([np.abs(point.x) + _ABSOLUTE * model.nominals, 1.0 + np.abs(point.z)])
    weights = np.concatenate([rtol * scale] * len(functions.tableau.nodes))
    size = np.inf
    for _ in range(_ITERATIONS):
        correction = functions.newton(point.t, h, point.x, W, model.p, model.u, point.d)[0]
        W = W + correction
        before, size = size, float(np.abs(correction / weights).max(initial=0.0))
        if not np.isfinite(size):
            return None
        # Newton's method converges quadratically: the next correction is far below this one.
        if size <= _CONVERGED or size * size <= _CONVERGED * before < np.inf:
            return W
    return None


def _predicted(functions: StepFunctions, point: Point, h: float, last: Step | None) -> Vector:
    """Stages to begin with: the polynomial of the step before, or no change."""
    if last is None:
        return _unchanged(functions, point)
    tableau = functions.tableau
    return tableau.continued(last.stages.reshape(len(tableau.nodes), -1), h / last.h).ravel()


def _unchanged(functions: StepFunctions, point: Point) -> Vector:
    return np.concatenate([point.x, point.z] * len(functions.tableau.nodes))


def _stuck(point: Point) -> StepFailed:
    return StepFailed(
        f"The replay of the run did not get on at t = {point.t:.9g} s: its steps do not converge.",
        advice="Look for a function without a slope there, or for a mode that should have changed.",
    )
