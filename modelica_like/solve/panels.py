"""Panels of IDAS for the run-time: how far it goes ahead in one call, and how close its knots are."""

from __future__ import annotations

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

_PARTS = 4
"""Of a piece, between knots of its polynomial; PARTS_OF_PIECE in panels.c."""
_LOOKS = 2 * _PARTS
"""Results of IDAS per piece: those between knots tell how far its polynomial is off."""
_EVEN = tuple(Grid(pieces, _LOOKS) for pieces in (1, 4, 16, 64, 256))
"""Grids of what goes on: few, because each needs an instance of IDAS."""
_GRADED = Grid(32, _LOOKS, power=3)
"""Grid of what begins: its first piece is 30,000 times as short as the whole."""
_SMOOTH = 16
"""Largest number of even pieces in what begins."""
_WORTH = 16
"""Pieces of a panel at least: a start of IDAS costs as much as ten of them."""
_LARGEST = 2**22
"""Numbers in a call, limited by memory."""
_PRECISE, _AIM = 1.0, 0.3
"""Largest error of a polynomial in tolerances, and the one to aim at: the error of IDAS is about one."""
_FINEST = 1e-12
"""Relative tolerance below which IDAS makes more noise than errors."""
_ORDER = 5
"""Of that error, in the length of a piece."""
_HALVED = 8.0
"""Largest error of a piece that becomes precise in halves: what is smooth is 32 times as precise there."""
_TELLING = 0.02
"""Smaller errors are rounding and noise, and tell nothing about lengths."""
_SHRINKS, _GROWS = 0.1, 30.0
"""Limits of a change of that length."""
_MOST = 0.2
"""Of the last pieces of a panel, whose wishes for the next ones count less: IDAS makes some noise."""
_LONGER, _ROOM = 4.0, 1.5
"""Growth of panels without events, unless a rough piece has cut them: what comes behind one is lost; length of a panel
over that of the last segment with its modes."""
_SHORTEST = 100
"""Of a panel, in time resolutions."""
_FIRST_STEPS = {True: 1e-5, False: 1e-6}
"""Of a panel, in its length: of one that is a whole run, and of those that begin at events, about as long as their
segments."""
_FIRST = 256, 16
"""Pieces and panels of a run, as far as one knows at its begin."""
_MAX_FAILURES, _FEW_FAILURES = 40, 6
_SAME = 1e-3
"""Distance of two places at which IDAS gave up, relative to the panel, below which they are one."""


_BETWEEN = np.array([[35, 140, -70, 28, -5], [-5, 60, 90, -20, 3], [3, -20, 90, 60, -5], [-5, 28, -70, 140, 35]]) / 128
"""Weights of the five knots of a piece in its polynomial, in the middles between them."""


@dataclass
class _Segment:
    """Begin of a segment in s, how short its first pieces should have been, and how long it lasted, both in s."""

    begin: float
    finest: float
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
    """

    def __init__(self, model: CompiledDae, options: Options, begin: float, end: float) -> None:
        self.model, self.options = model, options
        self._guarded = any(not transition.timed for transition in model.events.transitions)
        whole = not (model.events.transitions or model.events.delay_parts or model.edges.count)
        self.integrator = Integrator(model, options, whole=whole, first=_FIRST_STEPS[whole])
        self.notices: list[str] = []
        most = max(_LARGEST // (_LOOKS * (len(model.states) + len(model.implicit))), 1)
        self._grids = [grid for grid in _EVEN if grid.pieces <= most]
        self._length, self._span = ((end - begin) / count for count in _FIRST)
        if not self._guarded:
            self._span = np.inf
        self._switched = sorted({t.mode for t in model.events.transitions if self.felt[t.mode]})
        self._known: dict[bytes, _Segment] = {}
        self._modes, self._segment = b"", _Segment(begin, self._length)
        self._graded = self._cut = self._begins = False
        self._begin, self._ends, self._wishes = begin, np.zeros(0), np.zeros(0)
        self._telling = self._halved = np.zeros(0, bool)
        self._failures, self._failed_before, self._gave_up_at = 0, begin, -np.inf

    @property
    def felt(self) -> Any:
        """Marks of the entries of d that equations of motion read: events that change no other end no panel."""
        return self.model.once(Cached.FELT, lambda: _felt(self.model))

    def go_on(self, now: Point, limit: float, longest: float = np.inf) -> tuple[Vector, Vector]:
        """Integrate from a consistent point up to a time at most, in pieces that are not longer than asked for.

        Returns:
            Ends of the pieces in s, and knots: states and implicit unknowns, shape (4 pieces + 1, nx + nz).

        Raises:
            StepFailed: IDAS gave up.
        """
        begins = self._learn(now)
        if longest < np.inf:
            self._length, self._graded = min(self._length, longest), False
        while True:
            span, grid = self._plan(limit - now.t, _SHORTEST * time_resolution(now.t), begins=begins)
            looks = self._looks(now, span, grid)
            good = self._judge(now, span, grid, looks)
            if good:
                ends = now.t + span * grid.ends[:good]
                if span == limit - now.t and good == grid.pieces:
                    ends[-1] = limit
                self._begin, (self._ends, knots) = now.t, self._pieces(now.t, ends, looks)
                return self._ends, knots
            begins = True

    def _pieces(self, t: float, ends: Vector, looks: Vector) -> tuple[Vector, Vector]:
        """Return ends and knots of the pieces; those that are not precise have become two, with all looks as knots."""
        halved = self._halved[: len(ends)]
        taken = np.ones((len(ends), _LOOKS), bool)
        taken[~halved, 1::2] = False
        middles = 0.5 * (np.append(t, ends[:-1]) + ends)
        both = np.stack([middles, ends], axis=1)
        kept = np.stack([halved, np.ones(len(ends), bool)], axis=1)
        self._wishes = np.repeat(self._wishes[: len(ends)], 1 + halved)
        self._telling = np.repeat(self._telling[: len(ends)], 1 + halved)
        return both[kept], looks[: len(ends) * _LOOKS + 1][np.append(taken.ravel(), True)]

    def _plan(self, left: float, least: float, *, begins: bool) -> tuple[float, Grid]:
        """Return length in s and grid of a panel; of time there is so much left, and a panel has so much at least."""
        self._span = max(self._span, least)
        if begins and self._graded and _GRADED.pieces <= self._grids[-1].pieces:
            return (left if 1.1 * self._span >= left else self._span), _GRADED
        span = self._span if begins else max(self._span, _WORTH * self._length)
        span = min(left if 1.1 * span >= left else span, self._grids[-1].pieces * self._length)
        return span, next(grid for grid in self._grids if grid.pieces * self._length >= span)

    def _looks(self, now: Point, span: float, grid: Grid) -> Vector:
        """Return states and implicit unknowns at the start and the grid, shape (looks + 1, nx + nz).

        They are fewer if IDAS gave up.
        """
        y = np.concatenate([now.x, now.z])[None]
        try:
            x, z = self.integrator.run(now, span, grid, patient=False, partial=True, polish=False)
        except StepFailed:
            return y
        return np.concatenate([y, np.concatenate([x, z]).T])

    def _judge(self, now: Point, span: float, grid: Grid, looks: Vector) -> int:
        """Return the number of pieces that are precise, and note how long they should be.

        If none is, the next panel is shorter.

        Raises:
            StepFailed: states change ever faster.
        """
        count, t = (len(looks) - 1) // _LOOKS, now.t
        if not count:
            self._gave_up(t, span)
            return 0
        errors = np.nan_to_num(self._errors(looks, count), nan=np.inf)
        lengths = span * np.diff(grid.ends[:count], prepend=0.0)
        with np.errstate(divide="ignore"):  # a straight line has none
            self._telling = errors > _TELLING
            self._wishes = lengths * np.clip((_AIM / errors) ** (1 / _ORDER), _SHRINKS, _GROWS)
        precise = errors <= _HALVED
        self._halved = errors > _PRECISE
        rough = ~precise & (lengths > time_resolution(t))  # what happens in a shorter time is a jump
        good = int(np.argmax(rough)) if rough.any() else count
        if good and not precise[:good].any():
            self.integrator.gave_up = self.integrator.too_fast(now)
            self._relax(t)
            return 0
        self._cut = good < count
        if not good:
            self._graded = True
            self._span = _GRADED.pieces * float(self._wishes[0])
            self._length = self._span / _GRADED.pieces
        return good

    def _errors(self, looks: Vector, count: int) -> Vector:
        """Return errors of the polynomials of pieces, in tolerances and in the norm of IDAS; shape (pieces,)."""
        stride, width = looks.strides
        shape = count, _LOOKS + 1, len(self.model.states)
        pieces = np.lib.stride_tricks.as_strided(looks, shape, (_LOOKS * stride, stride, width), writeable=False)
        relative, absolute = self.integrator.tolerances
        relative, absolute = (tolerance * max(1.0, _FINEST / relative) for tolerance in (relative, absolute))
        weights = 0.5 * relative * (np.abs(pieces[:, 0]) + np.abs(pieces[:, -1])) + absolute
        # Term by term: a product of matrices would depend on the processor.
        between = sum(_BETWEEN[:, k, None] * pieces[:, 2 * k, None] for k in range(_PARTS + 1))
        doubts = np.abs(between - pieces[:, 1::2]).max(axis=1)
        return np.sqrt(np.mean((doubts / weights) ** 2, axis=1))

    def _learn(self, now: Point) -> bool:
        """Choose the next panel by the last one, as far as it was used, or by the last segment with the same modes.

        Returns:
            Whether a segment begins.
        """
        modes, ends, segment = now.d[self._switched].tobytes(), self._ends, self._segment
        if now.t >= self._failed_before:
            self._failures = 0
        if len(ends) and now.t == self._begin and modes == self._modes:
            return self._begins  # the run-time asks again, for a shorter one
        if len(ends):
            wishes = self._wishes[: int(np.searchsorted(ends, now.t)) + 1]
            recent = np.sort(wishes[len(wishes) // 2 :])
            self._length = float(recent[int(_MOST * (len(recent) - 1))])
            if self._begin == segment.begin:
                telling = wishes[self._telling[: len(wishes)]]
                segment.finest = float(telling.min(initial=ends[len(wishes[:-1])] - self._begin))
            passed = float(ends[-1] - self._begin)
            self._span = passed if self._cut else _LONGER * max(self._span, passed)
        self._begins = not len(ends) or now.t < ends[-1] - time_resolution(now.t) or modes != self._modes
        if self._begins:
            if now.t > segment.begin:
                segment.lasted = now.t - segment.begin
                self._known[self._modes] = segment
                self._begin_like(self._known.get(modes, segment))
            self._segment = _Segment(now.t, self._length)
        self._modes = modes
        return self._begins

    def _begin_like(self, last: _Segment) -> None:
        self._length = last.finest
        self._graded = last.lasted > _SMOOTH * last.finest
        if self._guarded:
            self._span = _ROOM * last.lasted

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
