"""What a run was: events, energy balance and statistics as tables."""

from __future__ import annotations

from rich.console import Group, RenderableType
from rich.markup import escape
from rich.table import Table

from modelica_like.report.types import table
from modelica_like.solve.solution import Solution

_SHOWN = 20


def run_report(solution: Solution) -> RenderableType:
    """Return events, energy balance and statistics of a run."""
    parts: list[RenderableType] = [f"[bold]{escape(solution.model.name)}[/]  {_span(solution)}"]
    if solution.events:
        parts += ["", events_table(solution)]
    parts += ["", energy_table(solution), "", f"[dim]{statistics_line(solution)}[/]"]
    return Group(*parts)


def _span(solution: Solution) -> str:
    return f"{solution.time[0]:g} s to {solution.time[-1]:g} s"


def events_table(solution: Solution) -> Table:
    """Return the mode changes; of many only the first and the last."""
    made = table(f"{len(solution.events)} mode changes", "time in s>", "mode", "from", "to", "because of")
    events = list(solution.events)
    for k, event in enumerate(events):
        if len(events) > _SHOWN and k == _SHOWN // 2:
            made.add_row("…")
        if len(events) <= _SHOWN or k < _SHOWN // 2 or k >= len(events) - _SHOWN // 2:
            place = f"{event.source}".partition(" `")[0]
            made.add_row(f"{event.time:.9g}", escape(event.mode), event.before, event.after, escape(place))
    return made


def energy_table(solution: Solution) -> Table:
    """Return the energy balance: per component what came in, was stored, lost and delivered, in J."""
    balance = solution.energy()
    made = table("energy balance in J", "component", "in>", "stored>", "lost>", "from outside>")
    for path, item in balance.components.items():
        if max(abs(item.inflow), abs(item.stored), abs(item.lost), abs(item.source)) > 0:
            made.add_row(escape(path or solution.model.name), *(_energy(v) for v in (item.inflow, item.stored, item.lost, item.source)))
    return made


def _energy(value: float) -> str:
    return f"{value:.4f}" if abs(value) < 1e7 else f"{value:.6g}"


def statistics_line(solution: Solution) -> str:
    """Return steps, evaluations, events and seconds in one sentence."""
    counts = solution.statistics
    return (
        f"{counts.steps} steps, {counts.evaluations} evaluations, {counts.integrations} integrations, "
        f"{counts.events} mode changes in {counts.seconds:.3f} s"
    )
