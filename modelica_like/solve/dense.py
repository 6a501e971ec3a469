"""Dense output of a run: states at any time, as the integrator's own polynomials give them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from modelica_like.compile.compiled import Vector

if TYPE_CHECKING:
    from modelica_like.solve.between import Between
    from modelica_like.solve.looks import Looks

MOST_KEPT = 2**24
"""Largest count of numbers that a run keeps."""


class Dense(ABC):
    """Smooth pieces of a run in order of time.

    Attributes:
        begins: of the pieces in s, shape (m,).
        ends: shape (m,).
        d: modes and discrete values of each, shape (nd, m).
    """

    begins: Vector
    ends: Vector
    d: Vector

    @abstractmethod
    def points(self, pieces: Any, times: Vector) -> tuple[Vector, Vector]:
        """Return states and implicit unknowns within pieces at times, both ascending; shapes (nx, n), (nz, n)."""


@dataclass(frozen=True)
class Stretch:
    """A part of the looks of a call of IDAS; `last` is the last valid look."""

    looks: Looks
    begin: float
    end: float
    last: int
    d: Vector


class OfLooks(Dense):
    """Dense output of IDAS: a piece is what lies between two looks."""

    def __init__(self, between: Between, stretches: list[Stretch]) -> None:
        self._between, self._stretches = between, stretches
        knots = [_knots(one) for one in stretches]
        self.begins = np.concatenate([one[:-1] for one in knots]) if knots else np.zeros(0)
        self.ends = np.concatenate([one[1:] for one in knots]) if knots else np.zeros(0)
        self._owner = np.repeat(np.arange(len(knots)), [len(one) - 1 for one in knots])
        self.d = np.array([one.d for one in stretches]).T[:, self._owner] if knots else np.zeros((0, 0))

    def points(self, pieces: Any, times: Vector) -> tuple[Vector, Vector]:
        """Interpolate as results are interpolated."""
        owner = self._owner[pieces]
        cuts = np.flatnonzero(np.diff(owner, prepend=-1))
        parts = [
            self._between.ask(self._stretches[owner[begin]].looks, some, self._stretches[owner[begin]].last)
            for begin, some in zip(cuts, np.split(times, cuts[1:]), strict=True)
        ]
        self._between.fill()
        x, z = (np.concatenate([getattr(part, name) for part in parts], axis=1) for name in "xz")
        return x, z


def _knots(one: Stretch) -> Vector:
    inner = one.looks.times[(one.looks.times > one.begin) & (one.looks.times < one.end)]
    return np.concatenate([[one.begin], inner, [one.end]])


@dataclass
class Keeper:
    """Keeps the dense output of a run as far as there is room; what there is no room for is read and forgotten.

    Attributes:
        read: reads stretches that are forgotten; without it the rest of the run is not kept.
        stretches: so far.
        forgotten: whether some are.
    """

    read: Any = None
    stretches: Any = field(default_factory=list)
    forgotten: bool = False
    _count: int = 0

    def keep(self, stretch: Stretch) -> None:
        """Keep a stretch."""
        if (self.forgotten and self.read is None) or stretch.end <= stretch.begin:
            return
        looks = stretch.looks
        if not self.stretches or self.stretches[-1].looks is not looks:
            # States and their slopes.
            self._count += 2 * looks.numbers
        self.stretches.append(stretch)
        if self._count > MOST_KEPT:
            self.forget(self.stretches)
            self.stretches, self._count = [], 0

    def dense(self, loop: Any) -> Callable[[], Dense] | None:
        """Return what returns the dense output of the whole run of a loop; None if it was not kept."""
        dense, stretches = loop.dense, self.stretches
        return (lambda: dense(stretches)) if not self.forgotten else None

    def forget(self, stretches: Any) -> None:
        """Read what is not kept, or give up."""
        self.forgotten = True
        if self.read is not None:
            self.read(stretches)
