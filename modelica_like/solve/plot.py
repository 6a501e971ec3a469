"""Pictures of trajectories."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from modelica_like.errors import NetlistError
from modelica_like.solve.display import QUANTITIES, Display
from modelica_like.solve.recorder import Event
from modelica_like.solve.style import COLOURS, picture, with_unit
from modelica_like.solve.trajectories import Trajectories, matching
from modelica_like.writing import check_writable, write_bytes

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_USUAL = ("rad/s", "N.m", "m/s", "N")
_MOST = 6
_MOST_EVENTS = 40


def plot(
    solution: Trajectories, patterns: Sequence[str] = (), *, title: str = "", display: Mapping[str, str] | None = None
) -> Figure:
    """Draw trajectories over time, one panel per unit, with events as dotted lines.

    Args:
        solution: the run.
        patterns: names or patterns (`*.w`) of the curves; by default speeds, torques and forces of the parts.
        title: heading; by default the name of the model.
        display: units by path, pattern or quantity, in addition to those of the netlist, such as {"speed": "rpm"}.

    Raises:
        UnknownName: nothing matches a pattern.
        UnitError: a variable cannot be shown in a unit.
    """
    shown = Display(solution.model, display)
    groups: dict[str, list[str]] = {}
    for name in chosen(solution, patterns):
        groups.setdefault(shown.of(name), []).append(name)
    count = max(len(groups), 1)
    with picture(title or solution.model.name, count, 0.8 + 2.1 * count) as (figure, rows):
        for axes, (unit, names) in zip(rows, groups.items(), strict=False):
            _draw(axes, solution, unit, names, shown)
        _mark_events(rows, solution.events)
        rows[-1].set_xlabel("time in s")
        rows[-1].set_xlim(solution.time[0], solution.time[-1])
    return figure


def check_picture(path: Path) -> None:
    """Raise an error before a run if a picture cannot be written.

    Raises:
        NetlistError: matplotlib does not support the format.
        OSError: it cannot be written there.
    """
    from matplotlib.backend_bases import FigureCanvasBase

    known = FigureCanvasBase.get_supported_filetypes()
    if path.suffix.lower().lstrip(".") not in known:
        raise NetlistError(f"'{path.name}': a picture can be {', '.join(sorted(known))}.")
    check_writable(path)


def save_plot(figure: Figure, path: Path, **options: Any) -> None:
    """Write a picture; the ending of the file chooses the format.

    Args:
        figure: the picture.
        path: the file.
        options: of matplotlib's `savefig`.

    Raises:
        NetlistError: matplotlib does not support the format.
        OSError: the file cannot be written.
    """
    check_picture(path)
    # In memory first: not every format reports a full disk.
    write_bytes(path, picture_bytes(figure, path.suffix[1:].lower(), **options))


def picture_bytes(figure: Figure, kind: str, **options: Any) -> bytes:
    """Return a picture in a format of matplotlib, such as `png`.

    Args:
        figure: the picture.
        kind: the format.
        options: of matplotlib's `savefig`.
    """
    content = io.BytesIO()
    figure.savefig(content, format=kind, **options)
    return content.getvalue()


def chosen(solution: Trajectories, patterns: Sequence[str]) -> list[str]:
    """Return the names that match the patterns, or a default choice without patterns.

    Raises:
        UnknownName: nothing matches a pattern.
    """
    return matching(solution.model, patterns) if patterns else _usual(solution)


def _usual(solution: Trajectories) -> list[str]:
    """Choose speeds, torques and forces of parts, without curves at rest; coinciding curves are drawn once."""
    names: list[str] = []
    for unit in _USUAL:
        curves: dict[bytes, str] = {}
        shown = (v for v in solution.model.flat_variables if v.kind in ("local", "output") and str(v.unit) == unit)
        for path, values in solution.together(*(variable.path for variable in shown)).items():
            if np.any(values):
                scale = float(np.abs(values).max())
                curves.setdefault(np.round(values / scale, 6).tobytes() + f"{scale:.6g}".encode(), path)
        names += list(curves.values())[:_MOST]
    return names


def quantity(unit: str) -> str:
    """Return the quantity of a unit, for titles."""
    return QUANTITIES.get(unit, "value")


def _draw(axes: Axes, solution: Trajectories, unit: str, names: Sequence[str], shown: Display) -> None:
    for k, (name, values) in enumerate(solution.together(*names).items()):
        style = "-" if k < len(COLOURS) else "--"
        axes.plot(solution.time, shown.values(name, values), style, label=name, color=COLOURS[k % len(COLOURS)])
    axes.set_ylabel(with_unit(shown.quantity(names[0]), unit))
    axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))


def _mark_events(panels: Sequence[Axes], events: Sequence[Event]) -> None:
    if len(events) > _MOST_EVENTS:
        return
    for axes in panels:
        for event in events:
            axes.axvline(event.time, color="#999999", linewidth=0.8, linestyle=":", zorder=0)
    for event in _spaced(events, 0.025 * float(np.ptp(panels[0].dataLim.intervalx))):
        text = f"{event.mode.rpartition('.')[0]} {event.after}"
        panels[0].annotate(
            text, (event.time, 1.0), xycoords=("data", "axes fraction"), xytext=(2, 1), textcoords="offset points",
            rotation=25, ha="left", va="bottom", fontsize=7, color="#666666",
        )  # fmt: skip


def _spaced(events: Sequence[Event], gap: float) -> list[Event]:
    """Return the last event of each instant, if there is space for a label."""
    shown: list[Event] = []
    for event in {event.time: event for event in events}.values():
        if not shown or event.time - shown[-1].time > gap:
            shown.append(event)
    return shown
