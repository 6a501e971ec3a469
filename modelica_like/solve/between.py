"""Results between looks: interpolated for many panels at once, as precisely as IDAS computed the looks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from modelica_like.compile.compiled import Vector
from modelica_like.solve.idas import Integrator
from modelica_like.solve.looks import EXPONENTS, PRECISE, SCHEMES, Looks, Scheme

_TOGETHER = 64
_DEEPEST = 10


@dataclass
class Piece:
    """Results between the looks of one panel.

    Attributes:
        looks: the panel.
        times: shape (n,), in s.
        last: the last look that means something, because of an event before the next.
        x: states, shape (nx, n), to be filled in.
        z: implicit unknowns, shape (nz, n).
    """

    looks: Looks
    times: Vector
    last: int
    x: Vector
    z: Vector


class Between:
    """Collects results that are wanted, and fills them in later.

    Args:
        integrator: tells tolerances, and solves for implicit unknowns.
        closer: looks into an interval of some looks, where interpolation is not precise.
    """

    def __init__(self, integrator: Integrator, closer: Callable[[Looks, int], Looks]) -> None:
        self._integrator, self._closer = integrator, closer
        self._pieces: list[Piece] = []

    @property
    def many(self) -> bool:
        """Whether results should be filled in before more come."""
        return len(self._pieces) >= _TOGETHER

    def ask(self, looks: Looks, times: Vector, last: int) -> Piece:
        """Return arrays for results at times between looks, which `fill` fills in."""
        x, z = (np.empty((len(part), len(times))) for part in (looks.x, looks.z))
        self._pieces.append(Piece(looks, times, last, x, z))
        return self._pieces[-1]

    def fill(self, *, precisely: bool = True) -> None:
        """Fill in all results; not `precisely`, nothing is integrated again.

        Raises:
            StepFailed: where interpolation is not precise, IDAS gave up.
        """
        self._fill(self._pieces, 0 if precisely else _DEEPEST)
        self._pieces = []

    def _fill(self, pieces: list[Piece], depth: int) -> None:
        if not pieces:
            return
        parts: list[tuple[Piece, Any, Piece]] = []
        for number, k in interpolate(self._integrator, pieces) if depth < _DEEPEST else ():
            whole = pieces[number]
            those = whole.looks.intervals(whole.times) == k
            looks = whole.looks.within(k) or self._closer(whole.looks, k)
            part = Piece(looks, whole.times[those], looks.count, whole.x[:, those], whole.z[:, those])
            parts.append((whole, those, part))
        if depth == _DEEPEST:
            interpolate(self._integrator, pieces)
        self._fill([part for *_, part in parts], depth + 1)
        for whole, those, part in parts:
            whole.x[:, those], whole.z[:, those] = part.x, part.z


def interpolate(integrator: Integrator, pieces: list[Piece]) -> list[tuple[int, int]]:
    """Fill in results; return where they are not precise, as numbers of pieces and intervals."""
    looks = [one.looks for one in pieces]
    counts, lengths = np.array([one.count for one in looks]), [len(one.times) for one in pieces]
    owner = np.repeat(np.arange(len(pieces)), lengths)
    offset = (np.cumsum(counts + 1) - counts - 1)[owner]
    widths, last = np.array([one.width for one in looks])[owner], np.array([one.last for one in pieces])[owner]
    times = np.concatenate([one.times for one in pieces])
    k: Any = np.concatenate([one.looks.intervals(one.times) for one in pieces])
    place: Any = offset + k
    x, slopes = (np.concatenate(part, axis=1) for part in ([p.x for p in looks], [p.seen[2] for p in looks]))
    z, begins = (np.concatenate(part, axis=-1) for part in ([p.z for p in looks], [p.times for p in looks]))
    share = (times - begins[place]) / widths
    found, left = x[:, place] + share * (x[:, place + 1] - x[:, place]), np.ones(len(times), bool)
    for scheme in SCHEMES:
        those = np.flatnonzero(left & (counts[owner] + 1 >= scheme.nodes))
        if len(those):
            first = scheme.first(k[those], np.maximum(last[those], scheme.nodes - 1))
            nodes: Any = (offset[those] + first)[:, None] + np.arange(scheme.nodes)
            base = np.take(x, place[those], axis=1)
            data = np.take(x, nodes, axis=1) - base[:, :, None]
            if scheme.slopes:
                data = np.concatenate([data, widths[those, None] * np.take(slopes, nodes, axis=1)], axis=2)
            change, doubt = _change(scheme, data, k[those] - first, share[those])
            found[:, those] = base + change
            left[those] = ~(doubt <= PRECISE * integrator.weights(base)).all(axis=0)
    guess = z[:, place] + share * (z[:, place + 1] - z[:, place])
    d = np.array([one.d for one in looks])[owner].T
    implicit = integrator.polished(times, found, guess, d)
    ends = np.cumsum(lengths)
    for piece, end, length in zip(pieces, ends, lengths, strict=True):
        piece.x[:], piece.z[:] = found[:, end - length : end], implicit[:, end - length : end]
    return sorted({(int(number), int(interval)) for number, interval in zip(owner[left], k[left], strict=True)})


def _change(scheme: Scheme, data: Vector, number: Any, share: Vector) -> tuple[Vector, Vector]:
    """Changes of states since the beginnings of their intervals, and how doubtful they are; shapes (nx, n)."""
    powers, weights = np.vander(share, len(EXPONENTS), increasing=True), np.empty((len(share), len(EXPONENTS)))
    for one in range(scheme.nodes - 1):
        those = number == one
        weights[those] = powers[those] @ scheme.precise[one]
    return np.einsum("ink,nk->in", data, weights), np.abs(np.einsum("ink,nk->in", data, scheme.doubt[number]))
