"""Panels of IDAS for the run-time: how far it goes ahead in one call, and how close its knots are."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.compile.soon import time_resolution
from modelica_like.errors import StepFailed
from modelica_like.options import Options
from modelica_like.solve.idas import Integrator
from modelica_like.solve.initialize import Point

Progress = Callable[[float], None]

PARTS = 4
"""Of a piece, between knots of its polynomial; PARTS_OF_PIECE in panels.c."""
_LOOKS = 2 * PARTS
"""Results of IDAS per piece: those between knots tell how far its polynomial is off."""
_SIZES = 1, 4, 16, 64, 256
"""Pieces of a call: few different numbers, because each needs an instance of IDAS."""
_LARGEST = 2**22
"""Numbers in a call, limited by memory."""
_PRECISE, _AIM = 2.0, 0.5
"""Largest error of a polynomial in tolerances, and the one to aim at: the error of IDAS is about one."""
_ORDER = 5
"""Of that error, in the length of a piece."""
_SHRINKS, _GROWS = 0.1, 30.0
"""Limits of a change of that length."""
_LONGER = 4.0
"""Growth of panels without events."""
_FIRST = 256
"""Pieces of a run, as far as one knows at its begin."""
_FIRST_SPAN = 16
"""First panel of a run with events, as a part of it."""
_ROOM = 1.5
"""Length of a panel over that of the last segment with its modes."""
_WORTH = 16
"""Pieces of a panel at least: a start costs as much as ten of them."""
_MOST = 0.8
"""Of the pieces of a panel, by whose errors the next lengths are chosen."""
_MAX_FAILURES, _FEW_FAILURES = 40, 6
_SAME = 1e-3
"""Distance of two places at which IDAS gave up, relative to the panel, below which they are one."""


def _nodes(degree: int) -> Vector:
    """Differences at the looks between knots, from all looks of a piece; shape (PARTS, looks)."""
    knots, looks = np.arange(0, _LOOKS + 1, 2), np.arange(1, _LOOKS, 2)
    powers = np.arange(degree + 1)
    interpolate = (looks[:, None] / _LOOKS) ** powers @ np.linalg.inv((knots[:, None] / _LOOKS) ** powers)
    differences = np.zeros((len(looks), _LOOKS + 1))
    differences[:, knots] = interpolate
    differences[np.arange(len(looks)), looks] = -1.0
    return differences


_DIFFERENCES = _nodes(PARTS)


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
        self._guarded = any(not transition.timed for transition in model.transitions)
        whole = not (model.transitions or model.delay_parts or model.edges.count)
        self.integrator = Integrator(model, options, whole=whole)
        self.notices: list[str] = []
        self._length = (end - begin) / _FIRST
        self._span = (end - begin) / _FIRST_SPAN if self._guarded else np.inf
        self._known: dict[bytes, tuple[float, float]] = {}
        self._modes, self._since = b"", begin
        self._begin, self._width, self._errors = begin, 0.0, np.zeros(0)
        self._ends, self._cut = begin, False
        self._failures, self._failed_before, self._gave_up_at = 0, begin, -np.inf

    @property
    def felt(self) -> Any:
        """Marks of the entries of d that equations of motion read: ticks that change no other are passed over."""
        return self.model.once("felt", lambda: _felt(self.model))

    def go_on(self, now: Point, limit: float) -> tuple[float, Vector]:
        """Integrate from a consistent point up to a time at most.

        Returns:
            Width of a part in s, and knots: states and implicit unknowns, shape (parts + 1, nx + nz).

        Raises:
            StepFailed: IDAS gave up.
        """
        self._learn(now)
        while True:
            span, pieces = self._plan(now.t, limit)
            looks = self._looks(now, span, pieces)
            good = self._judge(now.t, span / pieces, looks)
            if good:
                self._ends = now.t + good * span / pieces
                return span / pieces / PARTS, looks[: good * _LOOKS + 1 : 2].copy()

    def _plan(self, t: float, limit: float) -> tuple[float, int]:
        """Return length in s and number of pieces of a panel."""
        most = max(_LARGEST // (_LOOKS * (len(self.model.states) + len(self.model.implicit))), 1)
        sizes = [size for size in _SIZES if size <= most]
        pieces = max(self._span / self._length, _WORTH)
        fitting = [size for size in sizes if size <= pieces][-1]
        if t + 1.1 * fitting * self._length < limit:
            return fitting * self._length, fitting
        return limit - t, next((size for size in sizes if size * self._length >= limit - t), sizes[-1])

    def _looks(self, now: Point, span: float, pieces: int) -> Vector:
        """Return states and implicit unknowns at equal distances, shape (looks + 1, nx + nz): fewer if IDAS gave up."""
        y = np.concatenate([now.x, now.z])[None]
        try:
            x, z = self.integrator.run(
                now, span, _LOOKS * pieces, patient=not self._guarded, partial=True, polish=False
            )
        except StepFailed:
            return y
        return np.concatenate([y, np.concatenate([x, z]).T])

    def _judge(self, t: float, length: float, looks: Vector) -> int:
        """Return the number of pieces that are precise; if none is, the next panel is other."""
        count, nx = (len(looks) - 1) // _LOOKS, len(self.model.states)
        if not count:
            self._gave_up(t, length)
            return 0
        stride, width = looks.strides
        shape = count, _LOOKS + 1, nx
        blocks = np.lib.stride_tricks.as_strided(looks, shape, (_LOOKS * stride, stride, width), writeable=False)
        sizes = np.abs(blocks[:, 0]) + np.abs(blocks[:, -1])
        rtol, atol = self.integrator.tolerances
        errors = np.abs(_DIFFERENCES @ blocks).max(axis=1) / (0.5 * rtol * sizes + atol)
        self._errors = np.sqrt(np.mean(errors**2, axis=1))  # the norm of IDAS
        self._begin, self._width = t, length
        rough = ~(self._errors <= _PRECISE)
        good = int(np.argmax(rough)) if rough.any() else count
        if not good and length <= time_resolution(t):
            return 1  # nothing is known of what happens in so short a time
        self._cut = good < count
        if not good:
            self._adapt(float(self._errors[0]))
            self._span = 0.0
        return good

    def _adapt(self, error: float) -> None:
        factor = (_AIM / error) ** (1 / _ORDER) if 0 < error < np.inf else _SHRINKS if error else _GROWS
        self._length = self._width * min(max(factor, _SHRINKS), _GROWS)

    def _learn(self, now: Point) -> None:
        """Choose the next panel by the last one, as far as it was used, or by the last segment with the same modes."""
        errors = self._errors[: max(int((now.t - self._begin) / self._width + 0.5) + 1, 1)] if self._width else ()
        if len(errors):
            # Where IDAS starts, with a low order, it makes some noise.
            self._adapt(float(np.sort(errors)[int(_MOST * (len(errors) - 1))]))
        self._width = 0.0
        modes = now.d.tobytes()
        if now.t >= self._ends and modes == self._modes:
            used = self._ends - self._begin
            self._span = _LONGER * (used if self._cut else max(self._span, used))
        elif self._modes:
            lasted = now.t - self._since
            self._known[self._modes] = lasted, self._length
            expected, self._length = self._known.get(modes, (lasted, self._length))
            if self._guarded:
                self._span = _ROOM * expected
            self._since = now.t
        self._modes = modes
        if now.t >= self._failed_before:
            self._failures = 0

    def _gave_up(self, t: float, length: float) -> None:
        """Count failures on the way to one place: shorter panels start closer to it, an event may be before it.

        The last resort is a relaxed tolerance.

        Raises:
            StepFailed: that has been done already.
        """
        # Without events, nothing but a tolerance can help across the same place.
        place, self._gave_up_at = self._gave_up_at, self.integrator.reached
        same = not self._guarded and abs(self._gave_up_at - place) <= _SAME * length
        self._failures += _FEW_FAILURES if same else 1
        self._failed_before = max(self._failed_before, t + length)
        allowed = _MAX_FAILURES if self._guarded else _FEW_FAILURES
        if self._failures <= allowed and length > time_resolution(t):
            self._length = _SHRINKS * length
            self._span = 0.0
            return
        if not self.integrator.relax():
            raise self.integrator.gave_up
        self._failures, self._length = 0, length
        self.notices.append(
            f"At {t:.9g} s the integrator gave up; from there on its tolerance is {self.integrator.rtol:g} "
            f"instead of {self.options.rtol:g}."
        )


def _felt(model: CompiledDae) -> Any:
    """Mark entries of d that continuous equations, state events and delays read, and the modes of these events."""
    felt = np.zeros(model.discrete_size, np.uint8)
    felt[[one.mode for one in model.transitions if not one.timed]] = 1
    for function in (model.ode, model.alg, model.guards, model.delays, model.edges.function):
        felt[function.jac_sparsity(0, function.index_in("d")).get_triplet()[1]] = 1
    return felt
