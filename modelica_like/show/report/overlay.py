"""Several runs of one system in one picture: variants, a family over a parameter, a measurement beside a run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from modelica_like.arguments import checked
from modelica_like.errors import UnknownName, ValueOutOfRange
from modelica_like.language.units import parse_unit, to_si
from modelica_like.runs.display import Display
from modelica_like.runs.signals import Signal, named, read_signals
from modelica_like.runs.trajectories import Trajectories
from modelica_like.show.bands import bands_of, listed, marks_of
from modelica_like.show.panels import Panel, draw_panels
from modelica_like.show.plot import usual
from modelica_like.show.report.sources import trajectories
from modelica_like.style import COLOURS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_USUAL = ("rad/s", "m/s", "N.m", "N", "A")
_MOST = 8
"""Signals that nobody has asked for."""


@checked
def overlay(
    runs: Mapping[str, str | Path | Trajectories], *patterns: str, title: str = "",
    display: Mapping[str, str] | None = None,
) -> Figure:  # fmt: skip
    """Draw runs of one system on top of each other, a panel per signal; tables of measurements as dots.

    Args:
        runs: by the name that the legend shows: solutions, netlists, FMUs, systems, or CSV files with a column `time`
            and titles such as `motor.w [rpm]`. The first one that is no table says names, units and signs.
        patterns: names, patterns or formulas of the signals; by default what was measured, or what one usually wants.
        title: heading; by default the name of the model.
        display: units by path, pattern or quantity, in addition to those of the netlist.

    Raises:
        ValueOutOfRange: there is no run.
        UnknownName: nothing matches a pattern, or the runs have nothing in common.
        UnitError: a measured column has another dimension than its variable, or a unit cannot be shown.
        ModelicaLikeError: a run fails.
    """
    if not runs:
        raise ValueOutOfRange("There is no run to draw.", advice='Give runs by name: overlay({"old": …, "new": …}).')
    sources = {label: trajectories(source) for label, source in runs.items()}
    first = next((run for run in sources.values() if not run.measured), next(iter(sources.values())))
    signals, left = (read_signals(first.model, patterns), []) if patterns else _common(first, list(sources.values()))
    shown, looks = Display(first.model, display), _looks(sources)
    panels: list[Panel] = []
    for signal in signals:
        curves = {label: curve for label, run in sources.items() if (curve := _curve(signal, run)) is not None}

        def draw(axes: Any, drawn: Signal = signal, curves: Mapping[str, Any] = curves) -> None:
            for label, curve in curves.items():
                values = drawn.driving * shown.converted(curve, drawn.unit, drawn.shown_in(shown))
                axes.plot(sources[label].time, values, label=label, **looks[label])

        panels.append(Panel(signal.label, signal.shown_in(shown), [] if panels else list(curves), draw))
    others = [run for run in sources.values() if run is not first and not run.measured]
    bands, notes = ([], []) if others else bands_of(first)
    marks, more = ([], []) if others else marks_of(first, [band.mode for band in bands])
    remarks = ["Events differ from run to run; they are not drawn."] if others and first.events else []
    remarks += [f"Not drawn: {listed(left)}; name them to draw them."] if left else []
    return draw_panels(title or first.model.name, first.time, panels, bands, marks, [*remarks, *notes, *more])


def _common(first: Trajectories, runs: Sequence[Trajectories]) -> tuple[list[Signal], list[str]]:
    """Return what was measured, or the usual signals that all runs have; also the names of those that are too many."""
    measured = [name for run in runs if run.measured for name in run.names]
    if measured:
        for name in measured:
            if name not in first:
                read_signals(first.model, [name])
        return named(first.model, list(dict.fromkeys(measured))), []
    signals = [signal for signal in usual(first, _USUAL) if all(signal.name in run for run in runs)]
    if not signals:
        raise UnknownName("The runs have no signals in common.", advice="Name the signals to draw.")
    return signals[:_MOST], [signal.name for signal in signals[_MOST:]]


def _curve(signal: Signal, run: Trajectories) -> Any:
    """Return a signal of a run in SI units; None if the run does not have it."""
    if not all(name in run for name in signal.formula.names()):
        return None
    if run.measured and signal.plain and (unit := run.unit_of(signal.name)) != "1":
        to_si(f"0 {unit}", parse_unit(signal.unit), signal.name)  # raises an error for another dimension
    return signal.values(run)


def _looks(runs: Mapping[str, Trajectories]) -> dict[str, dict[str, Any]]:
    """Return colours, and dots for what was measured; a large family gets a range of colours."""
    import matplotlib as mpl

    computed = [label for label, run in runs.items() if not run.measured]
    wide = mpl.colormaps["viridis"]
    colours = COLOURS if len(computed) < len(COLOURS) else [wide(k / len(computed)) for k in range(len(computed))]
    dots = {"linestyle": "", "marker": ".", "markersize": 3.5, "zorder": 1.9}
    looks: dict[str, dict[str, Any]] = {label: {"color": colours[k]} for k, label in enumerate(computed)}
    tables = [label for label in runs if label not in looks]
    return looks | {label: {"color": COLOURS[-1 - k % len(COLOURS)], **dots} for k, label in enumerate(tables)}
