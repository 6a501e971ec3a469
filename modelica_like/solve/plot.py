"""Pictures of trajectories."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from modelica_like.errors import NetlistError, UnknownName, did_you_mean
from modelica_like.solve.display import QUANTITIES, Display
from modelica_like.solve.style import COLOURS, picture, with_unit
from modelica_like.writing import check_writable, write_bytes

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from modelica_like.compile.compiled import CompiledDae
    from modelica_like.solve.curves import Curves
    from modelica_like.solve.recorded import RecordedModel
    from modelica_like.solve.recorder import Event
    from modelica_like.solve.trajectories import Trajectories

_USUAL = ("rad/s", "N.m", "m/s", "N")
_MOST = 6
_MOST_EVENTS = 40
_MOST_CURVES = 4


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


def plot_curves(curves: Curves, patterns: Sequence[str] = ()) -> Figure:
    """Draw signals of both, and below each the difference relative to its range.

    Args:
        curves: two trajectories.
        patterns: of the signals; by default those that deviate most.

    Raises:
        UnknownName: nothing matches a pattern.
    """
    names = [row.signal for row in curves.deviations]
    names = fitting(names, patterns, "Neither has a signal") if patterns else names[:_MOST_CURVES]
    first, second = curves.first, curves.second
    with picture("", 2 * len(names), 0.8 + 2.6 * len(names), height_ratios=[2.0, 1.0] * len(names)) as (figure, rows):
        for name, upper, lower in zip(names, rows[::2], rows[1::2], strict=True):
            upper.plot(first.time, first[name], color=COLOURS[0], label=curves.labels[0])
            upper.plot(second.time, second[name], "--", color=COLOURS[1], label=curves.labels[1])
            upper.set_ylabel(with_unit(name, curves[name].unit))
            scale = curves[name].largest / curves[name].relative if curves[name].relative else 1.0
            times, difference = curves.difference(name)
            lower.plot(times, difference / scale, color="#444444", linewidth=1.0)
            lower.set_ylabel("difference\n/ range")
        rows[0].legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2)
        rows[-1].set_xlabel("time in s")
        figure.align_ylabels(rows)
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
    content = io.BytesIO()
    figure.savefig(content, format=path.suffix[1:].lower(), **options)
    write_bytes(path, content.getvalue())


def chosen(solution: Trajectories, patterns: Sequence[str]) -> list[str]:
    """Return the names that match the patterns, or a default choice without patterns.

    Raises:
        UnknownName: nothing matches a pattern.
    """
    return matching(solution.model, patterns) if patterns else _usual(solution)


def matching(model: CompiledDae | RecordedModel, patterns: Sequence[str]) -> list[str]:
    """Return the variables and modes of a model that match patterns, before a run.

    Raises:
        UnknownName: nothing matches a pattern.
    """
    return fitting((*model.position, *model.discrete_position), patterns, f"{model.name} has no variable")


def fitting(known: Sequence[str], patterns: Sequence[str], missing: str) -> list[str]:
    """Return the names that match patterns; `missing` begins the message about a pattern without a match.

    Raises:
        UnknownName: nothing matches a pattern.
    """
    names: dict[str, None] = {}
    for pattern in patterns:
        some = [name for name in known if name == pattern or fnmatchcase(name, pattern)]
        if not some:
            raise UnknownName(f"{missing} '{pattern}'{did_you_mean(pattern, known) or '.'}")
        names.update(dict.fromkeys(some))
    return list(names)


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


def unit_of(solution: Trajectories, name: str) -> str:
    """Return the coherent SI unit of a variable; that of a mode is `1`."""
    model = solution.model
    if name in model.position:
        return str(model.flat_variables[model.position[name]].unit)
    return str(model.flat_discretes[model.discrete_position[name]].unit)


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
