"""Panels of IDAS for the run-time: how far it goes ahead in one call, and how close its knots are."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from modelica_like.compile.cached import Cached
from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.compile.soon import time_resolution
from modelica_like.errors import StepFailed
from modelica_like.options import Options
from modelica_like.solve.idas import Grid, Integrator
from modelica_like.solve.initialize import Point

Progress = Callable[[float], None]

LOOKS = 8
"""Results of IDAS per piece; LOOKS in panels.c."""
_EVEN = tuple(Grid(pieces, LOOKS) for pieces in (1, 4, 16, 64, 256))
"""Grids of what goes on: few, because each needs an instance of IDAS."""
_GRADED = Grid(32, LOOKS, power=3)
"""Grid of what begins: its first piece is 30,000 times as short as the whole."""
_SMOOTH = 16
"""Largest number of even pieces in what begins."""
_WORTH = 16
"""Pieces of a panel at least: a start of IDAS costs as much as ten of them."""
_LARGEST = 2**22
"""Numbers in a call, limited by memory."""
_FINEST = 1e-12
"""Relative tolerance below which IDAS makes more noise than errors."""
_HALVED = 8.0
"""Error of a polynomial up to which it becomes precise in halves, in tolerances; HALVED in panels.c."""
_TELLING = 0.02
"""Smaller errors are rounding and noise, and tell nothing about lengths."""
_SHRINKS = 0.1
"""Of panels in which IDAS gives up."""
_MOST = 0.2
"""Of the last pieces of a panel, whose wishes for the next ones count less: IDAS makes some noise."""
_LONGER, _ROOM = 4.0, 1.5
"""Growth of panels without events, unless a rough piece has cut them: what comes behind one is lost; length of a panel
over that of the last segment with its modes."""
_BEHIND, _DOUBTED = 1.2, 2.0
"""Length of a panel over the time until a guard is zero if its rate stays: behind it, equations of old modes may take
ten times as many steps; and its growth where there was no event: what swings may turn before zero."""
_BEFORE, _FAR = 0.8, 50
"""The same length where that time is as long as so many pieces: another start of IDAS costs less than steps behind the
event, and the rate is known better nearer to it."""
_WIDEST = 10
"""Length of a graded panel over that of the widest piece its segment asks for, which the last one has."""
_SHORTEST = 100
"""Of a panel, in time resolutions."""
_FIRST_STEPS = {True: 1e-5, False: 1e-6}
"""Of a panel, in its length: of one that is a whole run, and of those that begin at events, about as long as their
segments."""
_FIRST = {True: 64, False: 256}
"""Pieces of a run, as far as one knows at its begin: of one with guards, and of one that is a single panel."""
_PANELS = 4
"""Panels of a run with guards, likewise."""
_MAX_FAILURES, _FEW_FAILURES = 40, 6
_SAME = 1e-3
"""Distance of two places at which IDAS gave up, relative to the panel, below which they are one."""


@dataclass
class Looks:
    """What the run-time makes of results of IDAS: pieces up to the first one that is not precise.

    Attributes:
        take: makes them of results (states and implicit unknowns, by rows), their places as shares of a span, its
            length in s, and tolerances (the absolute one in nominal values); returns how many, and of how many of those
            that IDAS was asked for.
        ends: of the pieces in s.
        wishes: how long they should have been in s; also that of the first one that is not precise.
        errors: of their polynomials in tolerances.
    """

    take: Callable[[Vector, Vector, Vector, float, float, float], tuple[int, int]]
    ends: Vector
    wishes: Vector
    errors: Vector


@dataclass
class _Segment:
    """Begin of a segment, how short its first pieces should have been and how long others, and its length, all in s."""

    begin: float
    finest: float
    widest: float = 0.0
    lasted: float = np.inf


class Panels:
    """Goes ahead with fixed modes by IDAS, as far as its polynomials are precise.

    What comes next is like what came last: the length of pieces follows from the error of the last ones, that of
    panels from the last segment with the same modes.

    Args:
        model: the compiled model, with states.
        options: tolerances.
        begin: start of the run in s.
        end: its end.

    Attributes:
        integrator: does the steps.
        notices: messages about relaxed tolerances.
        most: pieces of a panel.
        looks: to be set before the first panel; there are `most` pieces at most, each of which may become two.
    """

    looks: Looks

    def __init__(self, model: CompiledDae, options: Options, begin: float, end: float) -> None:
        self.model, self.options = model, options
        self._guarded = any(not transition.timed for transition in model.events.transitions)
        whole = not (model.events.transitions or model.events.delay_parts or model.edges.count)
        self.integrator = Integrator(model, options, whole=whole, first=_FIRST_STEPS[whole])
        self.notices: list[str] = []
        most = max(_LARGEST // (LOOKS * (len(model.states) + len(model.implicit))), 1)
        self._grids = [grid for grid in _EVEN if grid.pieces <= most]
        self.most = self._grids[-1].pieces
        self._length = (end - begin) / _FIRST[self._guarded]
        self._span = (end - begin) / _PANELS if self._guarded else np.inf
        self._switched = sorted({t.mode for t in model.events.transitions if self.felt[t.mode]})
        self._known: dict[bytes, _Segment] = {}
        self._modes, self._segment = b"", _Segment(begin, self._length)
        self._graded = self._cut = self._begins = self._foreseen = False
        self._behind, self._zero = _BEHIND, np.inf
        self._begin, self._ends = begin, list[float]()
        self._failures, self._failed_before, self._gave_up_at = 0, begin, -np.inf

    @property
    def felt(self) -> Any:
        """Marks of the entries of d that equations of motion read: events that change no other end no panel."""
        return self.model.once(Cached.FELT, lambda: _felt(self.model))

    def go_on(self, now: Point, limit: float, longest: float, soon: float) -> None:
        """Integrate from a consistent point up to a time at most, in pieces that are not longer than asked for.

        Args:
            now: the point.
            limit: the time in s.
            longest: length of pieces in s.
            soon: how long it takes until there may be an event, in s.

        Raises:
            StepFailed: IDAS gave up.
        """
        begins = self._learn(now)
        self._zero = now.t + soon
        if longest < np.inf:
            self._length, self._graded = min(self._length, longest), False
        while True:
            span, grid = self._plan(limit - now.t, _SHORTEST * time_resolution(now.t), soon, begins=begins)
            if pieces := self._integrate(now, span, grid):
                self._begin, self._ends = now.t, self.looks.ends[:pieces].tolist()
                if span == limit - now.t and not self._cut:
                    self._ends[-1] = self.looks.ends[pieces - 1] = limit
                return
            begins = True

    def _plan(self, left: float, least: float, soon: float, *, begins: bool) -> tuple[float, Grid]:
        """Return length in s and grid of a panel; of time there is so much left, and a panel has so much at least."""
        self._span = max(self._span, least)
        self._foreseen = not begins and self._behind * soon < self._span
        if begins and self._graded and _GRADED.pieces <= self._grids[-1].pieces:
            return (left if 1.1 * self._span >= left else self._span), _GRADED
        ahead = _BEFORE * soon if soon > _FAR * self._length else self._behind * soon
        span = self._span if begins else max(min(self._span, ahead), _WORTH * self._length)
        span = min(left if 1.1 * span >= left else span, self._grids[-1].pieces * self._length)
        return span, next(grid for grid in self._grids if grid.pieces * self._length >= span)

    def _integrate(self, now: Point, span: float, grid: Grid) -> int:
        """Return the number of pieces that are precise. If none is, the next panel is shorter.

        Raises:
            StepFailed: states change ever faster.
        """
        integrator, looks = self.integrator, self.looks
        try:
            x, z = integrator.run(now, span, grid, patient=False, partial=True, polish=False)
        except StepFailed:
            x = z = np.zeros((0, 0))
        if x.shape[1] < LOOKS:
            self._gave_up(now.t, span)
            return 0
        finest = max(1.0, _FINEST / integrator.rtol)
        relative, absolute = (finest * tolerance for tolerance in (integrator.rtol, integrator.atol))
        pieces, precise = looks.take(x.T, z.T, grid.shares, span, relative, absolute)
        if pieces and looks.errors[:pieces].min() > _HALVED:  # all of them are as short as jumps
            integrator.gave_up = integrator.too_fast(now)
            self._relax(now.t)
            return 0
        self._cut = precise < grid.pieces
        if not pieces:
            self._graded = True
            self._span = _GRADED.pieces * float(looks.wishes[0])
            self._length = self._span / _GRADED.pieces
        return pieces

    def _learn(self, now: Point) -> bool:
        """Choose the next panel by the last one, as far as it was used, or by the last segment with the same modes.

        Returns:
            Whether a segment begins.
        """
        modes, ends, segment = now.d[self._switched].tobytes(), self._ends, self._segment
        if now.t >= self._failed_before:
            self._failures = 0
        if ends and now.t == self._begin and modes == self._modes:
            return self._begins  # the run-time asks again, for a shorter one
        if ends:
            # Lists: of as few numbers, arrays cost more time.
            wishes = self.looks.wishes[: min(bisect_left(ends, now.t) + 1, len(ends))].tolist()
            recent = sorted(wishes[len(wishes) // 2 :])
            self._length = recent[int(_MOST * (len(recent) - 1))]
            segment.widest = max(segment.widest, *wishes)
            if self._begin == segment.begin:
                errors = self.looks.errors[: len(wishes)].tolist()
                telling = (wish for wish, error in zip(wishes, errors, strict=True) if error > _TELLING)
                segment.finest = min([ends[len(wishes) - 1] - self._begin, *telling])
            passed = ends[-1] - self._begin
            self._span = passed if self._cut else _LONGER * max(self._span, passed)
            self._behind *= _DOUBTED if self._foreseen and not self._cut and ends[-1] > self._zero else 1.0
        self._begins = not ends or now.t < ends[-1] - time_resolution(now.t) or modes != self._modes
        if self._begins:
            if now.t > segment.begin:
                segment.lasted = now.t - segment.begin
                self._known[self._modes] = segment
                self._begin_like(self._known.get(modes, segment))
            self._behind = _BEHIND
            self._segment = _Segment(now.t, self._length)
        self._modes = modes
        return self._begins

    def _begin_like(self, last: _Segment) -> None:
        self._length, most = last.finest, _WIDEST * last.widest
        self._graded = min(last.lasted, most) > _SMOOTH * last.finest
        if self._guarded:
            self._span = min(_ROOM * last.lasted, most) if self._graded else _ROOM * last.lasted

    def _gave_up(self, t: float, span: float) -> None:
        """Count failures on the way to one place: shorter panels start closer to it, an event may be before it.

        The last resort is a relaxed tolerance.

        Raises:
            StepFailed: that has been done already.
        """
        # Without events, nothing but a tolerance can help across the same place.
        place, self._gave_up_at = self._gave_up_at, self.integrator.reached
        at_once = self._gave_up_at - t <= _SAME * span  # its first steps are too long
        same = not self._guarded and not at_once and abs(self._gave_up_at - place) <= _SAME * span
        self._failures += _FEW_FAILURES if same else 1
        self._failed_before = max(self._failed_before, t + span)
        allowed = _MAX_FAILURES if self._guarded else _FEW_FAILURES
        if self._failures <= allowed and span > time_resolution(t):
            # What does not converge in the shortest one may in a longer one.
            shrinks = _SHRINKS**3 if at_once else _SHRINKS
            self._span = span * (shrinks if span > 2 * _SHORTEST * time_resolution(t) else _SHRINKS**-4)
            self._length, self._graded = self._span / _GRADED.pieces, True
            return
        self._relax(t)
        self._failures, self._span = 0, self._failed_before - t
        self._length = self._span / _GRADED.pieces

    def _relax(self, t: float) -> None:
        if not self.integrator.relax():
            raise self.integrator.gave_up
        self.notices.append(
            f"At {t:.9g} s the integrator gave up; from there on its tolerance is {self.integrator.rtol:g} "
            f"instead of {self.options.rtol:g}."
        )


def _felt(model: CompiledDae) -> Any:
    """Mark entries of d that continuous equations and delays read.

    Where edges of guards have been looked at in a whole panel, also what guards read. Where equations have corners in
    time, as tables have, also what time events read: those at the corners change nothing else.
    """
    felt = np.zeros(model.discrete_size, np.uint8)
    looked_at = (model.events.guards,) if model.edges.count > model.edges.slopes else ()
    for function in (model.equations.ode, model.equations.alg, model.events.delays, model.edges.function, *looked_at):
        felt[function.jac_sparsity(0, function.index_in("d")).get_triplet()[1]] = 1
    if model.edges.in_time:
        felt[model.events.moments.jac_sparsity(0, model.events.moments.index_in("d")).get_triplet()[1]] = 1
    if looked_at:
        felt[[transition.mode for transition in model.events.transitions if not transition.timed]] = 1
    return felt
