"""Designs that a search tries, each once, and what is told of them."""

from __future__ import annotations

import itertools
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field

from modelica_like.analyse.optimize.terms import Bounded, Free
from modelica_like.compile.buffers import Vector
from modelica_like.errors import ModelicaLikeError

Progress = Callable[[int, int], None]
FEASIBLE = 1e-6
"""Excess of a limit, relative to the size of its output, that counts as none: ten times the precision of gradients."""


@dataclass(frozen=True, eq=False)
class Design:
    """A design that was run.

    Attributes:
        x: values of what is free in SI units, shape (free,).
        values: shape (cases, outputs).
        slopes: derivatives by x, shape (cases, outputs, free).
    """

    x: Vector
    values: Vector
    slopes: Vector = field(repr=False)


@dataclass(frozen=True, eq=False)
class Outcome:
    """Where a search ended.

    Attributes:
        x: values of what is free, in SI units.
        objective: the worst of all load cases, times its sign and over its size; or the sum of squares.
        excess: the largest excess of a limit over its size.
        prices: how much the objective changes by a limit's value, in SI units of both; shape (cases, limit rows).
        optimal: whether the conditions of an optimum hold.
        status: of the solver.
    """

    x: Vector
    objective: float
    excess: float
    prices: Vector
    optimal: bool
    status: str


class Designs(Bounded, ABC):
    """Runs designs, each once.

    Args:
        free: what may change.
        told: called after each design.

    Attributes:
        told: what counts designs; it may interrupt.
        designs: in the order in which they were tried.
        refusals: designs at which a run fails or has no derivative, and the reasons.
    """

    def __init__(self, free: tuple[Free, ...], told: Callable[[], None]) -> None:
        self.free, self.told = free, told
        self.designs: list[Design] = []
        self.refusals: list[tuple[Vector, ModelicaLikeError]] = []
        self._known: dict[bytes, Design | ModelicaLikeError] = {}

    @abstractmethod
    def run(self, x: Vector) -> tuple[Vector, Vector]:
        """Return values, shape (cases, outputs), and their derivatives by x, shape (cases, outputs, free).

        Raises:
            ModelicaLikeError: a run fails, or has no derivative.
        """

    def at(self, x: Vector) -> Design | None:
        """Return the design at values of what is free with its derivatives, None where a run is refused."""
        known = self._known.get(x.tobytes())
        if known is None:
            known = self._known[x.tobytes()] = self._tried(x.copy())
        return known if isinstance(known, Design) else None

    def known(self, x: Vector) -> list[Design]:
        """Return the design at values if it was run, in a list."""
        known = self._known.get(x.tobytes())
        return [known] if isinstance(known, Design) else []

    def know(self, designs: Iterable[Design]) -> None:
        """Take over designs that were run elsewhere; they were told there."""
        for design in designs:
            if not self.known(design.x):
                self._known[design.x.tobytes()] = design
                self.designs.append(design)

    def _tried(self, x: Vector) -> Design | ModelicaLikeError:
        try:
            design = Design(x, *self.run(x))
        except ModelicaLikeError as error:
            self.refusals.append((x, error))
            return error
        self.designs.append(design)
        self.told()
        return design

    def from_starts(self, starts: Sequence[Vector], search: Callable[[Vector], Outcome]) -> list[Outcome]:
        """Return where the searches from all starts end that can be run.

        Raises:
            ModelicaLikeError: none can be run; this is why the first one cannot.
        """
        usable = [x for x in starts if self.at(x) is not None]
        if not usable:
            raise self.refusals[0][1]
        return [search(x) for x in usable]

    @contextmanager
    def interruptible(self, measures: Callable[[Vector], tuple[float, float]], scale: float = 1.0) -> Iterator[None]:
        """Add the best design so far to an interrupt.

        Args:
            measures: returns objective and excess of the values of a design.
            scale: of the objective.
        """
        try:
            yield
        except KeyboardInterrupt as interrupt:
            interrupt.add_note(self._best_so_far(measures, scale))
            raise

    def _best_so_far(self, measures: Callable[[Vector], tuple[float, float]], scale: float) -> str:
        measured = [(*measures(design.values), design.x) for design in self.designs]
        if not measured:
            return "No design was finished."
        objective, excess, x = min(measured, key=lambda item: (max(item[1], FEASIBLE), item[0]))
        values = ", ".join(f"{name} = {value:.6g}" for name, value in self.named(x).items())
        within = "within all limits" if excess <= FEASIBLE else "exceeding a limit"
        reached = objective * scale
        return f"The best of {len(measured)} designs, {within}: {values}; the objective is {reached:.6g}."

    def remarks(self) -> Iterator[str]:
        """Yield how many designs were left out, and why."""
        if self.refusals:
            count, reason = len(self.refusals), self.refusals[0][1].what
            yield (
                f"{count} designs were left out, the first: {reason}"
                if count > 1
                else f"1 design was left out: {reason}"
            )


def better(outcomes: Sequence[Outcome]) -> Outcome:
    """Return the best outcome."""
    return min(outcomes, key=lambda outcome: (max(outcome.excess, FEASIBLE), outcome.objective))


def counted(progress: Progress | None, most: int) -> Callable[[], None]:
    """Return what counts designs; `most` is about how many there can be."""
    designs = itertools.count(1)
    if progress is None:
        return lambda: None
    return lambda: progress(next(designs), most)
