"""Data for the script of a report: curves by quantity, modes as bands, events."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from modelica_like.runs.display import Display
from modelica_like.runs.signals import evaluated
from modelica_like.runs.trajectories import Trajectories
from modelica_like.show.bands import mode_spans
from modelica_like.show.plot import for_page, quantity_of
from modelica_like.style import with_unit

_POINTS = 1200
"""Number of drawn results, including those at events."""
_MOST_BANDS = 400


def curves(run: Trajectories, patterns: Sequence[str] = ()) -> dict[str, Any]:
    """Return times, panels of curves by unit, what is left out in words, modes as bands and events.

    Args:
        run: the run.
        patterns: names, patterns or formulas of the curves; by default as `for_page` says.

    Raises:
        UnknownName: nothing matches a pattern.
        UnitError: the units in a formula do not fit together.
    """
    signals, left = for_page(run, patterns)
    # Evenly spread results, and both sides of every event.
    count = len(run.time)
    spread = np.unique(np.linspace(0, count - 1, min(count, _POINTS)).round().astype(int))
    times = np.unique([event.time for event in run.events][:_POINTS])
    sides = np.concatenate([np.searchsorted(run.time, times, side) for side in ("left", "right")])
    beside = np.clip(np.concatenate([sides, sides - 1]), 0, count - 1)
    rows = np.unique(np.concatenate([spread, beside])).astype(np.intp)
    shown, curve = Display(run.model), evaluated(run, signals)
    panels: dict[str, dict[str, Any]] = {}
    for signal in signals:
        unit = signal.shown_in(shown)
        title = with_unit(quantity_of(signal), unit)
        values = signal.driving * shown.converted(curve[signal.name][rows], signal.unit, unit)
        curve_data = {
            "name": signal.label,
            "path": signal.name if signal.plain else "",
            "values": [float(f"{v:.6g}") for v in values],
        }
        panels.setdefault(title, {"title": title, "curves": []})["curves"].append(curve_data)
    hidden = {discrete.path for discrete in run.model.flat_discretes if discrete.hidden}
    modes = dict.fromkeys(event.mode for event in run.events if event.mode not in hidden)
    return {
        "times": [float(f"{t:.9g}") for t in run.time[rows]],
        "panels": list(panels.values()),
        "left": left,
        "modes": [{"name": mode, "bands": mode_spans(run, mode)[:_MOST_BANDS]} for mode in modes],
        "events": sorted({float(f"{event.time:.9g}") for event in run.events}),
    }
