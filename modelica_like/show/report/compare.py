"""Deviations between two trajectories of one system."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.console import Group, RenderableType
from rich.markup import escape

from modelica_like.arguments import checked
from modelica_like.runs.curves import Curves, compare_solutions
from modelica_like.runs.trajectories import Trajectories
from modelica_like.show.report.sources import trajectories
from modelica_like.show.report.tables import Listed, Shown, table

_SHOWN = 20
_STARTS = 5

Source = str | Path | Trajectories


class Comparison(Curves):
    """Two trajectories, signal by signal and event by event, printed as tables."""

    def __rich__(self) -> RenderableType:
        return comparison_report(self)


@checked
def compare(
    a: Source, b: Source, *, signals: Sequence[str] = (), until: float | None = None, points: int = 500,
    tolerance: float | None = None, values: Mapping[str, Any] | None = None, option: str = "",
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
        values: to set in netlists by path, and in FMUs as numbers; tables and solutions stay as they are.
        option: of the command line that gave the values, which messages name as their place.

    Raises:
        UnknownName: nothing matches a pattern, or they have no signal in common.
        ValueOutOfRange: they have no time in common.
        UnitError: no signal has the same unit in both.
        ModelicaLikeError: a run fails.
    """
    first = trajectories(a, until, points, tolerance, values, option)
    second = trajectories(b, until if until is not None else float(first.time[-1]), points, tolerance, values, option)
    labels = _label(a), _label(b)
    return Comparison(**vars(compare_solutions(first, second, signals, labels)))


def _label(source: Source) -> str:
    return source.model.name if isinstance(source, Trajectories) else Path(source).name


def comparison_report(comparison: Comparison) -> RenderableType:
    """Return the deviations, the events and the largest of both."""
    rows = [
        (row.signal, float(row.largest), "" if row.unit == "1" else row.unit, float(row.relative), float(row.time))
        for row in comparison.deviations
    ]
    parts: list[RenderableType] = [table(
        " and ".join(comparison.labels), "signal", "largest deviation>.3e", "unit", "of the range>.1e",
        "at time in s>.6g", rows=rows, name="deviations", most=_SHOWN, rest=", that deviate less",
    )]  # fmt: skip
    if comparison.events:
        parts += ["", _event_table(comparison)]
    if starts := comparison.starts:
        shown = [f"{row.signal} at {row.first:g} and {row.second:g} {row.unit}".removesuffix(" 1") for row in starts]
        more = f", and {len(shown) - _STARTS} more" if len(shown) > _STARTS else ""
        parts += ["", f"[yellow]They start differently: {escape(', '.join(shown[:_STARTS]) + more)}.[/]"]
    if comparison.unlike:
        shown = [f"{name} in {mine} and {other}" for name, mine, other in comparison.unlike]
        more = f", and {len(shown) - _STARTS} more" if len(shown) > _STARTS else ""
        parts += ["", f"[yellow]Not compared: {escape(', '.join(shown[:_STARTS]) + more)}.[/]"]
    if comparison.interpolated:
        parts += ["", "[dim]Their results have different times; the second is interpolated linearly.[/]"]
    return Group(*parts)


def _event_table(comparison: Comparison) -> Listed:
    rows: list[tuple[Any, ...]] = []
    for event in comparison.events:
        times = (Shown("never", None) if t is None else float(t) for t in (event.first, event.second))
        rows.append((event.mode, event.after, *times, Shown("", None) if (d := event.difference) is None else float(d)))
    columns = "mode", "to", "first at s>.9g", "second at s>.9g", "difference in s>.1e"
    return table("events", *columns, rows=rows, most=_SHOWN)
