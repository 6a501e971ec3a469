"""Results between looks, interpolated for many panels at once with the precision of IDAS."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from modelica_like.compile.compiled import Vector
from modelica_like.errors import StepFailed
from modelica_like.solve.idas import Integrator
from modelica_like.solve.looks import EXPONENTS, PRECISE, SCHEMES, Looks

_TOGETHER = 64
_DEEPEST = 10


@dataclass
class Piece:
    """Results between the looks of one panel.

    Attributes:
        looks: the panel.
        times: shape (n,), in s.
        last: the last valid look, because of an event before the next.
        x: states, shape (nx, n), to be filled in.
        z: implicit unknowns, shape (nz, n).
    """

    looks: Looks
    times: Vector
    last: int
    x: Vector
    z: Vector


class Between:
    """Collects requested results, and fills them in later.

    Args:
        integrator: for tolerances and implicit unknowns.
        closer: integrates an interval with closer looks, where interpolation is not precise.
    """

    def __init__(self, integrator: Integrator, closer: Callable[[Looks, int], Looks]) -> None:
        self._integrator, self._closer = integrator, closer
        self._pieces: list[Piece] = []

    @property
    def many(self) -> bool:
        """Whether to fill in results before requesting more."""
        return len(self._pieces) >= _TOGETHER

    def ask(self, looks: Looks, times: Vector, last: int) -> Piece:
        """Return arrays for results at times between looks, for `fill` to fill in."""
        if not len(times):
            return Piece(looks, times, last, looks.x[:, :0], looks.z[:, :0])
        x, z = (np.empty((len(part), len(times))) for part in (looks.x, looks.z))
        self._pieces.append(piece := Piece(looks, times, last, x, z))
        return piece

    def now(self, looks: Looks, times: Vector, last: int) -> Piece:
        """Return results at times between looks at once."""
        x, z = (np.empty((len(part), len(times))) for part in (looks.x, looks.z))
        piece = Piece(looks, times, last, x, z)
        self._fill([piece], 0, precisely=True)
        return piece

    def fill(self, *, precisely: bool = True) -> None:
        """Fill in all results; without `precisely`, those that IDAS does not reach a second time become nan.

        Raises:
            StepFailed: where interpolation is not precise, IDAS gave up.
        """
        self._fill(self._pieces, 0, precisely)
        self._pieces = []

    def _fill(self, pieces: list[Piece], depth: int, precisely: bool) -> None:
        if not pieces:
            return
        parts: list[tuple[Piece, Any, Piece]] = []
        left = interpolate(self._integrator, pieces)
        for number, k in left if depth < _DEEPEST else ():
            whole = pieces[number]
            those = whole.looks.intervals(whole.times) == k
            try:
                looks = whole.looks.closer.get(k) or whole.looks.within(k) or self._closer(whole.looks, k)
                whole.looks.closer[k] = looks
            except StepFailed:
                if precisely:
                    raise
                whole.x[:, those] = np.nan
                continue
            some = Piece(looks, whole.times[those], looks.count, whole.x[:, those], whole.z[:, those])
            parts.append((whole, those, some))
        self._fill([some for *_, some in parts], depth + 1, precisely)
        for whole, those, some in parts:
            whole.x[:, those], whole.z[:, those] = some.x, some.z


def interpolate(integrator: Integrator, pieces: list[Piece]) -> list[tuple[int, int]]:
    """Fill in results; return pieces and intervals where they are not precise."""
    looks, lengths = [one.looks for one in pieces], [len(one.times) for one in pieces]
    counts = np.array([one.count for one in looks])
    owner = np.repeat(np.arange(len(pieces)), lengths)
    times, x = np.concatenate([one.times for one in pieces]), np.concatenate([one.x for one in looks], axis=1)
    z = np.concatenate([one.z for one in looks], axis=1)
    begins, widths = np.array([(one.times[0], one.width) for one in looks]).T
    passed = (times - begins[owner]) / widths[owner]
    k: Any = np.minimum(passed.astype(int), counts[owner] - 1)
    place: Any = (np.cumsum(counts + 1) - counts - 1)[owner] + k
    share = passed - k
    new = np.append(True, place[1:] > place[:-1])
    cell: Any = np.cumsum(new) - 1
    changes, left = _cells(integrator, pieces, x, owner[new], k[new])
    powers = np.vander(share, len(EXPONENTS), increasing=True)
    found = x[:, place] + np.einsum("np,inp->in", powers, changes[:, cell])
    guess = z[:, place] + share * (z[:, place + 1] - z[:, place])
    implicit = (
        integrator.polished(times, found, guess, np.array([one.d for one in looks])[owner].T) if len(z) else guess
    )
    for piece, end, length in zip(pieces, np.cumsum(lengths), lengths, strict=True):
        piece.x[:], piece.z[:] = found[:, end - length : end], implicit[:, end - length : end]
    return list(zip(owner[new][left].tolist(), k[new][left].tolist(), strict=True))


def _cells(integrator: Integrator, pieces: list[Piece], x: Vector, owner: Any, k: Any) -> tuple[Vector, Any]:
    """Return polynomials for the changes of states within intervals, and which ones are not precise.

    Args:
        integrator: for the tolerances.
        pieces: all of them.
        x: states at all looks of all pieces, shape (nx, looks).
        owner: pieces of the intervals, shape (intervals,).
        k: their numbers there.
    """
    looks = [one.looks for one in pieces]
    slopes = np.concatenate([one.seen[2] for one in looks], axis=1)
    counts, widths = (np.array(part) for part in ([one.count for one in looks], [one.width for one in looks]))
    offset: Any = (np.cumsum(counts + 1) - counts - 1)[owner]
    last = np.array([one.last for one in pieces])[owner]
    base = x[:, offset + k]
    changes, left = np.zeros((*base.shape, len(EXPONENTS))), np.ones(len(k), bool)
    changes[:, :, 1] = x[:, offset + k + 1] - base
    for scheme in SCHEMES:
        those = np.flatnonzero(left & (counts[owner] + 1 >= scheme.nodes))
        if not len(those):
            continue
        first = scheme.first(k[those], np.maximum(last[those], scheme.nodes - 1))
        nodes: Any = (offset[those] + first)[:, None] + np.arange(scheme.nodes)
        data = np.take(x, nodes, axis=1) - base[:, those, None]
        if scheme.slopes:
            data = np.concatenate([data, widths[owner[those], None] * np.take(slopes, nodes, axis=1)], axis=2)
        number = k[those] - first
        for one in set(number.tolist()):
            changes[:, those[number == one]] = data[:, number == one] @ scheme.precise[one].T
        doubt = np.abs(np.einsum("ink,nk->in", data, scheme.doubt[number]))
        left[those] = ~(doubt <= PRECISE * integrator.weights(base[:, those])).all(axis=0)
    return changes, left
