"""Icons of FMUs and of their terminals, drawn the same in every run."""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import Any

_INK = "#1f2937"
_STEEL = "#9aa5b4"
_LIGHT = "#e5e9ef"
_COLOURS = {"rotational": "#6b7280", "translational": "#2f7d4f", "electrical": "#1d4ed8", "thermal": "#c2410c"}


def icon_name(kind: str) -> str:
    """Return the file name, without suffix, of the icon for a kind of terminal."""
    return next((family for family in _COLOURS if family in kind), "terminal")


def terminal_icon(family: str, suffix: str) -> bytes:
    """Draw the icon of a terminal: a disc for shafts, a square for slides and pins, a flame's colour for heat.

    Args:
        family: as `icon_name` returns it.
        suffix: `png` or `svg`.
    """
    from matplotlib.patches import Circle, Rectangle

    def draw(axes: Any) -> None:
        colour = _COLOURS.get(family, _STEEL)
        style = {"facecolor": colour, "edgecolor": _INK, "linewidth": 3}
        if family == "rotational":
            axes.add_patch(Circle((50, 50), 44, **style))
            axes.add_patch(Circle((50, 50), 16, facecolor="white", edgecolor=_INK, linewidth=3))
        else:
            axes.add_patch(Rectangle((8, 8), 84, 84, **style))

    return _drawn(draw, suffix)


def drive_icon(suffix: str) -> bytes:
    """Draw the icon of an FMU: two discs of a clutch on a shaft that leaves to the right."""
    from matplotlib.patches import FancyBboxPatch, Rectangle

    def draw(axes: Any) -> None:
        frame = {"boxstyle": "round,pad=0,rounding_size=10", "facecolor": "white", "edgecolor": _INK, "linewidth": 3}
        axes.add_patch(FancyBboxPatch((4, 4), 92, 92, **frame))
        parts = [(12, 44, 76, 12, _STEEL), (18, 26, 22, 48, _LIGHT), (48, 20, 7, 60, _STEEL), (58, 20, 7, 60, _STEEL)]
        for x, y, width, height, colour in parts:
            axes.add_patch(Rectangle((x, y), width, height, facecolor=colour, edgecolor=_INK, linewidth=2.5))

    return _drawn(draw, suffix)


def _drawn(draw: Callable[[Any], None], suffix: str) -> bytes:
    import matplotlib as mpl
    from matplotlib.figure import Figure

    figure = Figure(figsize=(1.28, 1.28), dpi=100)
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(0, 100), ylim=(0, 100))
    axes.set_axis_off()
    draw(axes)
    buffer = io.BytesIO()
    metadata = {"Software": None} if suffix == "png" else {"Date": None, "Creator": None}
    # Names inside an SVG are random unless they are salted.
    with mpl.rc_context({"svg.hashsalt": "fmu"}):
        figure.savefig(buffer, format=suffix, metadata=metadata, transparent=True)
    return buffer.getvalue()
