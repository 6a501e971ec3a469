"""Panels of pictures: curves, modes as bands, events as numbers with their text below."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

from modelica_like.compile.compiled import Vector
from modelica_like.solve.recorder import Event
from modelica_like.solve.style import numbered, picture, text_width, with_unit
from modelica_like.solve.trajectories import Trajectories

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_MOST_EVENTS, _MOST_BANDS, _MOST_HELD = 30, 8, 16
_HELD, _FIRST, _OTHERS = "#7fc097", "#dbe1e8", ("#f4b183", "#9dc3e6", "#ffe08a", "#cdb5e6", "#e8a9b8", "#c9b79c")
_HATCHES = ("", "////", "....", "xxxx")
_MOST_NAMES = 12
_HEIGHT, _ROW = 1.5, 0.19
_BESIDE = 1.25
"""Inches that the labels of the vertical axis and the margins take."""
_LETTER = 0.064
"""Inches that a letter of the text below takes at most on average."""
_SHORT = 1e-5
"""Part of the run that is too short to be drawn."""


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


@dataclass(frozen=True)
class Bands:
    """Time spans of the values of one mode.

    Attributes:
        mode: path.
        spans: beginning, end, name.
        names: all names of the mode in the order of their declaration, those that hold a motion.
    """

    mode: str
    spans: tuple[tuple[float, float, str], ...]
    names: tuple[str, ...] = ()
    held: frozenset[str] = frozenset()


Mark = tuple[float, str]
"""Time and text of an instant."""


def bands_of(run: Trajectories, wanted: Sequence[str] = ()) -> tuple[list[Bands], list[str]]:
    """Return modes as bands, and what to tell about the others.

    Args:
        run: the run.
        wanted: paths of modes; by default all that change, or of many only those that hold a motion.
    """
    holds = getattr(run.model, "holds", ())
    held: dict[str, set[str]] = {}
    for one in holds:
        mode = run.model.flat_discretes[one.mode]
        held.setdefault(mode.path, set()).add(mode.names[one.number])
    paths = list(wanted) or list(dict.fromkeys(event.mode for event in run.events))
    if not wanted and len(paths) > _MOST_BANDS and any(path in held for path in paths):
        paths = [path for path in paths if path in held]
    most = len(paths) if wanted else _MOST_HELD
    left = [f"No bands: {listed(paths[most:])}."] if paths[most:] else []
    names = {one.path: tuple(one.names) for one in run.model.flat_discretes}
    least = _SHORT * float(run.time[-1] - run.time[0])
    spans = {path: tuple(one for one in mode_spans(run, path) if one[1] - one[0] > least) for path in paths[:most]}
    return [Bands(p, some, names.get(p, ()), frozenset(held.get(p, ()))) for p, some in spans.items()], left


def mode_spans(run: Trajectories, mode: str) -> tuple[tuple[float, float, str], ...]:
    """Return when a mode has which value: beginning, end, name."""
    changes = [event for event in run.events if event.mode == mode]
    begin, end = float(run.time[0]), float(run.time[-1])
    times = [begin, *(event.time for event in changes), end]
    if changes:
        names = [*(event.before for event in changes), changes[-1].after]
    else:
        number = int(run[mode][0])
        names = [next((one.names[number] for one in run.model.flat_discretes if one.path == mode and one.names), "")]
    return tuple(span for span in zip(times, times[1:], names, strict=False) if span[1] > span[0])


def marks_of(run: Trajectories, banded: Sequence[str]) -> tuple[list[Mark], list[str]]:
    """Return the instants with their mode changes as text, and what to tell about those that are left out.

    Args:
        run: the run.
        banded: modes that are drawn as bands; with many events they come first, and of them those that change seldom.
    """
    by_mode: dict[str, list[Event]] = {}
    for event in run.events:
        by_mode.setdefault(event.mode, []).append(event)
    seen, left = set[str](), dict[str, int]()
    kept: list[Event] = []
    for mode, events in sorted(by_mode.items(), key=lambda item: (item[0] not in banded, len(item[1]))):
        times = seen | {_told(event.time) for event in events}
        if len(times) <= _MOST_EVENTS:
            seen = times
            kept += events
        else:
            left[mode] = len(events)
    instants: dict[str, tuple[float, dict[str, str]]] = {}
    for event in sorted(kept, key=lambda event: event.time):
        changes = instants.setdefault(_told(event.time), (event.time, {}))[1]
        changes[event.mode.removesuffix(".mode")] = event.after
    marks = [(time, ", ".join(f"{mode}: {name}" for mode, name in what.items())) for time, what in instants.values()]
    counts = listed([f"{mode} {count}\u00d7" for mode, count in left.items()])
    return marks, [f"Not numbered: {counts}."] if left else []


def listed(names: Sequence[str]) -> str:
    """Return names as a text; of many only the first, and the number of the others."""
    shown = [*names[:_MOST_NAMES], *([f"{len(names) - _MOST_NAMES} others"] if len(names) > _MOST_NAMES else [])]
    return ", ".join(shown)


def _told(time: float) -> str:
    """Return a time as it is written; instants that read the same are one."""
    return f"{time:.5g}"


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
    told = [f"{k}  {_told(t)} s  {text}" for k, (t, text) in enumerate(marks, 1)]
    wrapped = [(one, _wrapped(told, (width - 0.2) / one - 0.3)) for one in (1, 2, 3)]
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

    made = {n: {"facecolor": c, "hatch": h, "linewidth": 0.0, "edgecolor": "#ffffff"} for n, (c, h) in looks.items()}
    for row, band in enumerate(bands):
        for name in dict.fromkeys(span[2] for span in band.spans):
            # One collection for all spans of a name: a chopper has thousands.
            places = [(begin, end - begin) for begin, end, other in band.spans if other == name]
            axes.broken_barh(places, (row - 0.36, 0.72), label=name, **made[name])
    axes.set_yticks(np.arange(len(bands)), [band.mode.removesuffix(".mode") for band in bands], fontsize=8)
    axes.set_ylim(len(bands) - 0.5, -0.5)
    axes.grid(visible=False)
    axes.tick_params(axis="y", length=0)
    handles = [Patch(label=name, **look) for name, look in made.items()]
    axes.legend(handles=handles, loc="center left", bbox_to_anchor=(1.01, 0.5), borderaxespad=0.0)
