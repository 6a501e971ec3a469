"""Intervals of 95 % of what is sampled."""

from __future__ import annotations

import numpy as np

from modelica_like.compile.buffers import Vector
from modelica_like.errors import extra_module


def half_width(means: Vector) -> float:
    """Return the half width of the 95 % interval of the mean of independent means."""
    t = extra_module("scipy.stats", "analyse").t
    return float(t.ppf(0.975, len(means) - 1) * np.std(means, ddof=1) / np.sqrt(len(means)))


def clopper_pearson(count: float, runs: int) -> tuple[float, float]:
    """Return the 95 % interval of a probability (C. J. Clopper, E. S. Pearson, 1934), right for no event, too."""
    beta = extra_module("scipy.stats", "analyse").beta
    low = float(beta.ppf(0.025, count, runs - count + 1)) if count > 0 else 0.0
    high = float(beta.ppf(0.975, count + 1, runs - count)) if count < runs else 1.0
    return low, high
