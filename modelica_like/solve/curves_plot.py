"""Picture of a comparison: both trajectories over each other, and what lies between them."""

from __future__ import annotations

from collections.abc import Sequence
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING

from modelica_like.errors import UnknownName
from modelica_like.solve.style import COLOURS, STYLE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from modelica_like.solve.curves import Curves

_MOST = 4


def plot_curves(curves: Curves, patterns: Sequence[str] = ()) -> Figure:
    """Draw signals of both, and below each the difference relative to its range.

    Raises:
        UnknownName: nothing fits the patterns.
    """
    import matplotlib as mpl
    from matplotlib.figure import Figure

    names = [row.signal for row in curves.deviations if not patterns or _fits(row.signal, patterns)]
    names = names if patterns else names[:_MOST]
    if not names:
        raise UnknownName(f"Neither has a signal '{patterns[0]}'.")
    first, second = curves.first, curves.second
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(8.0, 0.8 + 2.6 * len(names)), layout="constrained", dpi=150)
        ratios = [2.0, 1.0] * len(names)
        panels = figure.subplots(2 * len(names), 1, sharex=True, squeeze=False, height_ratios=ratios)[:, 0]
        for name, upper, lower in zip(names, panels[::2], panels[1::2], strict=True):
            unit = curves[name].unit.replace(".", "\N{MIDDLE DOT}")
            upper.plot(first.time, first[name], color=COLOURS[0], label=curves.labels[0])
            upper.plot(second.time, second[name], "--", color=COLOURS[1], label=curves.labels[1])
            upper.set_ylabel(name if unit == "1" else f"{name} in {unit}")
            scale = curves[name].largest / curves[name].relative if curves[name].relative else 1.0
            times, difference = curves.difference(name)
            lower.plot(times, difference / scale, color="#444444", linewidth=1.0)
            lower.set_ylabel("difference\n/ range")
        panels[0].legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2)
        panels[-1].set_xlabel("time in s")
        figure.align_ylabels(panels)
    return figure


def _fits(name: str, patterns: Sequence[str]) -> bool:
    return any(name == pattern or fnmatchcase(name, pattern) for pattern in patterns)
