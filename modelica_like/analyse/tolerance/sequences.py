"""How often a run has other mode changes than the one in the middle of all distributions, and which."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from modelica_like.analyse.sensitivity.function import first_difference
from modelica_like.analyse.tolerance.intervals import clopper_pearson
from modelica_like.compile.buffers import Vector
from modelica_like.errors import ModelicaLikeError

Changes = list[tuple[str, str, str]]
LOOKED = 512
"""Runs whose mode changes are looked at: a share of 7 % is known within 2.5 %. Other runs leave only their outputs."""
_TOLD = 3


@dataclass(frozen=True)
class OtherSequence:
    """Runs whose mode changes begin to differ in the same way from those of the middle.

    Attributes:
        what: the first change that differs.
        share: of the runs.
        low: lower end of its 95 % interval.
        high: upper end.
    """

    what: str
    share: float
    low: float
    high: float


def other_sequences(sequence_at: Callable[[Vector], Changes], middle: Vector, points: Vector) -> list[OtherSequence]:
    """Return which mode changes runs have that the run in the middle has not, the most frequent first.

    Args:
        sequence_at: returns the mode changes of a run.
        middle: means of the parameters.
        points: parameters of the runs to look at, shape (runs, parameters); those that fail do not count.
    """
    expected, counts, runs = sequence_at(middle), Counter[str](), 0
    for point in points:
        try:
            sequence = sequence_at(point)
        except ModelicaLikeError:
            continue  # sampling tells about runs that fail
        runs += 1
        if sequence != expected:
            place, what = first_difference(expected, sequence)
            counts[f"as mode change {place}, {what}"] += 1
    return [OtherSequence(what, n / runs, *clopper_pearson(n, runs)) for what, n in counts.most_common()]


def sentences(others: Sequence[OtherSequence]) -> list[str]:
    """Return what to tell about them."""
    if not others:
        return []
    each = [f"{other.what} (in {_per_cent(other.share)}, {_between(other)})" for other in others[:_TOLD]]
    if len(others) > _TOLD:
        rest = sum(other.share for other in others[_TOLD:])
        each.append(f"{len(others) - _TOLD} others (in {_per_cent(rest)} together)")
    share = _per_cent(sum(other.share for other in others))
    return [f"The mode sequence is another one than at the means in {share} of runs: {'; '.join(each)}."]


def _per_cent(share: float) -> str:
    return f"{100.0 * share:.3g} %"


def _between(other: OtherSequence) -> str:
    return f"{100.0 * other.low:.3g} to {100.0 * other.high:.3g} %"
