"""Pictures of a calibration."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np

from modelica_like.errors import ValueOutOfRange
from modelica_like.style import COLOURS, picture

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from modelica_like.analyse.calibration.calibrate import Calibration

_CONFIDENCE = 0.95
_POINTS = 200
_ROOM = 1.35
"""Half widths of a panel, relative to those of the ellipse."""


def ellipses(result: Calibration) -> Figure:
    """Draw the confidence ellipses of all pairs of determined parameters; see `Calibration.plot`."""
    known = [k for k in range(len(result.names)) if np.isfinite(result.covariance[k, k])]
    pairs = list(combinations(known, 2))
    if not pairs:
        raise ValueOutOfRange(
            f"The data determine {len(known)} of {len(result.names)} parameters: there is no pair to draw.",
            advice="print() of the result has the intervals.",
        )
    radius = np.sqrt(2.0 * _quantile(len(result.residuals) - result.rank))
    with picture(f"{result.model.name}: 95 % confidence", len(pairs), 3.2 * len(pairs), width=5.0, sharex=False) as (
        figure,
        axes,
    ):
        for panel, (i, j) in zip(axes, pairs, strict=True):
            _ellipse(panel, result, [i, j], radius)
    return figure


def _quantile(freedom: int) -> float:
    """Return the quantile of F for two values, or of the normal distribution where nothing scatters."""
    from scipy.stats import chi2, f

    return float(f.ppf(_CONFIDENCE, 2, freedom)) if freedom > 0 else float(chi2.ppf(_CONFIDENCE, 2)) / 2.0


def _ellipse(panel: Any, result: Calibration, pair: list[int], radius: float) -> None:
    values, half = result.values[pair], result.confidence[pair]
    sizes, axes = np.linalg.eigh(result.covariance[np.ix_(pair, pair)])
    turn = np.linspace(0.0, 2.0 * np.pi, _POINTS)
    circle = np.vstack([np.cos(turn), np.sin(turn)])
    x, y = values[:, None] + radius * axes @ (np.sqrt(np.maximum(sizes, 0.0))[:, None] * circle)
    panel.plot(x, y, color=COLOURS[0])
    panel.errorbar(*values, xerr=half[0], yerr=half[1], fmt="o", color=COLOURS[1], capsize=3, markersize=4)
    for limit, curve, value in ((panel.set_xlim, x, values[0]), (panel.set_ylim, y, values[1])):
        room = _ROOM * float(np.abs(curve - value).max()) or 1.0
        limit(value - room, value + room)
    units = [unit if unit not in ("1", "*") else "" for unit in (result.units[k] for k in pair)]
    texts = [f"{result.names[k]} in {unit}" if unit else result.names[k] for k, unit in zip(pair, units, strict=True)]
    panel.set_xlabel(texts[0])
    panel.set_ylabel(texts[1])
