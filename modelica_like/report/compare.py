"""Deviations between two trajectories of one system."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rich.console import Group, RenderableType
from rich.table import Table

from modelica_like.report.sources import trajectories
from modelica_like.report.types import table
from modelica_like.solve.curves import Curves, compare_solutions
from modelica_like.solve.trajectories import Trajectories

_SHOWN = 20

Source = str | Path | Trajectories


class Comparison(Curves):
    """Two trajectories, signal by signal and event by event, printed as tables."""

    def __rich__(self) -> RenderableType:
        return comparison_report(self)


def compare(
    a: Source, b: Source, *, signals: Sequence[str] = (), until: float | None = None, points: int = 500,
    tolerance: float | None = None,
) -> Comparison:  # fmt: skip
    """Compare two trajectories of one system by the names of their signals.

    Around events only the smooth pieces are compared: between the two times of a mode change nothing is compared, and
    the difference of the times is reported instead.

    Args:
        a: a netlist, an FMU, a system of FMUs (TOML or SSP), a CSV file, or a solution.
        b: the same, to compare with.
        signals: names or patterns (`*.w`); by default all continuous variables that both have.
        until: end time of simulations in s; by default that of `a`.
        points: number of equal intervals of simulations.
        tolerance: relative tolerance of simulations.

    Raises:
        UnknownName: nothing matches a pattern, or they have no signal in common.
        ValueOutOfRange: they have no time in common.
        ModelicaLikeError: a run fails.
    """
    first = trajectories(a, until, points, tolerance)
    second = trajectories(b, until if until is not None else float(first.time[-1]), points, tolerance)
    labels = _label(a), _label(b)
    return Comparison(**vars(compare_solutions(first, second, signals, labels)))


def _label(source: Source) -> str:
    return source.model.name if isinstance(source, Trajectories) else Path(source).name


def comparison_report(comparison: Comparison) -> RenderableType:
    """Return the deviations, the events and the largest of both."""
    parts: list[RenderableType] = [_deviation_table(comparison)]
    if comparison.events:
        parts += ["", _event_table(comparison)]
    if comparison.interpolated:
        parts += ["", "[dim]Their results have different times; the second is interpolated linearly.[/]"]
    return Group(*parts)


def _deviation_table(comparison: Comparison) -> Table:
    rows = [
        (
            row.signal,
            f"{row.largest:.3e}",
            "" if row.unit == "1" else row.unit,
            f"{row.relative:.1e}",
            f"{row.time:.6g}",
        )
        for row in comparison.deviations
    ]
    columns = "signal", "largest deviation>", "", "of the range>", "at time in s>"
    return table(" and ".join(comparison.labels), *columns, rows=rows, most=_SHOWN, rest=", that deviate less")


def _event_table(comparison: Comparison) -> Table:
    rows: list[tuple[str, ...]] = []
    for event in comparison.events:
        times = ("never" if t is None else f"{t:.9g}" for t in (event.first, event.second))
        rows.append((event.mode, event.after, *times, "" if event.difference is None else f"{event.difference:.1e}"))
    columns = "mode", "to", "first at s>", "second at s>", "difference in s>"
    return table("events", *columns, rows=rows, most=_SHOWN)
