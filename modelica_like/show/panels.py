"""Panels of pictures: curves, bands, and numbers with their text below."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

from modelica_like.compile.compiled import Vector
from modelica_like.show.bands import Bands, Mark, told
from modelica_like.style import numbered, picture, text_width, with_unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_HELD, _FIRST, _OTHERS = "#7fc097", "#dbe1e8", ("#f4b183", "#9dc3e6", "#ffe08a", "#cdb5e6", "#e8a9b8", "#c9b79c")
_HATCHES = ("", "////", "....", "xxxx")
_HEIGHT, _ROW = 1.5, 0.19
_BESIDE = 1.25
"""Inches that the labels of the vertical axis and the margins take."""
_LETTER = 0.064
"""Inches that a letter of the text below takes at most on average."""


@dataclass(frozen=True)
class Panel:
    """Curves with one vertical axis.

    Attributes:
        quantity: that is drawn.
        unit: in which it is shown.
        labels: of the curves; without them there is no legend.
        draw: draws the curves into axes.
    """

    quantity: str
    unit: str
    labels: Sequence[str]
    draw: Callable[[Any], None]


def draw_panels(
    title: str, time: Vector, panels: Sequence[Panel], bands: Sequence[Bands], marks: Sequence[Mark],
    notes: Sequence[str],
) -> Figure:  # fmt: skip
    """Draw panels over time, one above the other, with bands, numbers and notes.

    Args:
        title: heading.
        time: in s.
        panels: of curves.
        bands: drawn below them, a row each.
        marks: instants, numbered above them and listed below.
        notes: sentences below.
    """
    states = _looks(bands)
    legend = max((text_width(label, 8.0) for panel in panels for label in (*panel.labels, *states)), default=0.0) + 0.4
    width = max(8.0, 5.5 + legend)
    count = max(len(panels), 1) + bool(bands)
    heights = [_HEIGHT] * max(len(panels), 1) + [_ROW * max(len(bands), len(states) * 0.8) + 0.1] * bool(bands)
    reach = float(time[0]), float(time[-1])
    texts = [f"{k}  {told(t)} s  {text}" for k, (t, text) in enumerate(marks, 1)]
    wrapped = [(step, _wrapped(texts, (width - 0.2) / step - 0.3)) for step in (1, 2, 3)]
    _, listed = min(wrapped, key=lambda pair: -(-len(pair[1]) // pair[0]))
    below = [listed, _wrapped(notes, width - 0.5)]
    with picture(title, count, 0.85 + sum(heights), width=width, below=below, height_ratios=heights) as (figure, rows):
        for axes, panel in zip(rows, panels, strict=False):
            panel.draw(axes)
            label = with_unit(panel.quantity, panel.unit)
            label = label if text_width(label, 9.0) < _HEIGHT else label.replace(" in ", "\nin ")
            longest = max(text_width(line, 9.0) for line in label.split("\n"))
            axes.set_ylabel(label, fontsize=9.0 * min(1.0, _HEIGHT / max(longest, 1e-9)))
            axes.margins(y=0.08)
            if panel.labels:
                axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), borderaxespad=0.0)
        if bands:
            _draw_bands(rows[-1], bands, states)
        for axes in rows:
            for t, _ in marks:
                axes.axvline(t, color="#999999", linewidth=0.7, linestyle=":", zorder=0.5)
        rows[-1].set_xlabel("time in s")
        rows[-1].set_xlim(*reach)
        figure.align_ylabels(rows[: len(panels)])
        shares = [(t - reach[0]) / (reach[1] - reach[0]) for t, _ in marks]
        numbered(rows[0], shares, width - _BESIDE - legend)
    return figure


def _wrapped(texts: Sequence[str], room: float) -> list[str]:
    """Break texts into lines that have room, in inches."""
    return [line for text in texts for line in wrap(text, int(room / _LETTER), subsequent_indent="      ")]


def _looks(bands: Sequence[Bands]) -> dict[str, tuple[str, str]]:
    """Return a colour and a hatch for each drawn name: green if it holds a motion, grey if it is a mode's first."""
    held = frozenset[str]().union(*(band.held for band in bands))
    first = {name for band in bands for name in band.names[:1]} - held
    drawn = {name for band in bands for _, _, name in band.spans}
    ordered = sorted(bands, key=lambda band: not band.held)
    names = dict.fromkeys(name for band in ordered for name in (*band.names, *(span[2] for span in band.spans)))
    kinds = {name: 0 if name in held else 1 if name in first else 2 for name in names if name in drawn}
    colours, counts, looks = ((_HELD,), (_FIRST,), _OTHERS), [0, 0, 0], dict[str, tuple[str, str]]()
    for name, kind in kinds.items():
        cycle, k = divmod(counts[kind], len(colours[kind]))
        looks[name] = colours[kind][k], _HATCHES[cycle % len(_HATCHES)]
        counts[kind] += 1
    return looks


def _draw_bands(axes: Any, bands: Sequence[Bands], looks: dict[str, tuple[str, str]]) -> None:
    from matplotlib.patches import Patch

    styles = {n: {"facecolor": c, "hatch": h, "linewidth": 0.0, "edgecolor": "#ffffff"} for n, (c, h) in looks.items()}
    for row, band in enumerate(bands):
        for name in dict.fromkeys(span[2] for span in band.spans):
            # One collection for all spans of a name: a chopper has thousands.
            places = [(begin, end - begin) for begin, end, other in band.spans if other == name]
            axes.broken_barh(places, (row - 0.36, 0.72), label=name, **styles[name])
    axes.set_yticks(np.arange(len(bands)), [band.mode.removesuffix(".mode") for band in bands], fontsize=8)
    axes.set_ylim(len(bands) - 0.5, -0.5)
    axes.grid(visible=False)
    axes.tick_params(axis="y", length=0)
    handles = [Patch(label=name, **look) for name, look in styles.items()]
    axes.legend(handles=handles, loc="center left", bbox_to_anchor=(1.01, 0.5), borderaxespad=0.0)
