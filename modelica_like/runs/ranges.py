"""Ranges of signals, as the scale of deviations."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from modelica_like.runs.trajectories import Trajectories

_NOISE = 1e-6


def ranges(solution: Trajectories, names: Iterable[str], least: float = _NOISE) -> dict[str, float]:
    """Return the range of each signal, largest minus smallest value.

    The slip of a stuck clutch is rounding noise without a range. So the range is at least a share of the largest value
    among the signals of its unit.

    Args:
        solution: the run.
        names: signals.
        least: that share.
    """
    spans = {name: float(np.ptp(solution[name])) for name in names}
    largest: dict[str, float] = {}
    for name in spans:
        unit = solution.unit_of(name)
        largest[unit] = max(largest.get(unit, 0.0), float(np.abs(solution[name]).max()))
    return {name: max(span, least * largest[solution.unit_of(name)]) or 1.0 for name, span in spans.items()}
