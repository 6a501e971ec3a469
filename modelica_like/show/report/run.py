"""A run as text: events, energies and statistics as tables; for a co-simulation also couplings and steps."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.console import Group, RenderableType
from rich.markup import escape

from modelica_like.errors import MissingValue
from modelica_like.language.transition import NAME_IN_NOTICE
from modelica_like.language.units import parse_unit
from modelica_like.runs.display import Display
from modelica_like.runs.signals import Signal, evaluated, read_signals
from modelica_like.runs.solution import Solution
from modelica_like.runs.trajectories import Trajectories
from modelica_like.show.report.changes import changes
from modelica_like.show.report.tables import Listed, Shown, table

if TYPE_CHECKING:
    from modelica_like.fmi.cosimulation.solution import CosimSolution

_SHOWN = 20


def run_report(
    solution: Trajectories, *, energy: bool = True, debug: bool = False, display: Mapping[str, str] | None = None,
    show: Sequence[str] = (),
) -> RenderableType:  # fmt: skip
    """Return events, values, energy balance and statistics of a run.

    Args:
        solution: the run.
        energy: whether to show the energy balance.
        debug: whether to show the source line of every event's transition.
        display: units by quantity, in addition to those of the netlist, such as {"energy": "kJ"}.
        show: names, patterns and formulas whose extremes are told.
    """
    parts = _head(solution, notices(solution), debug=debug)
    parts += ["", values_table(solution, show, display)] if show else []
    if energy:
        parts += ["", energy_table(solution, display), f"[dim]{closure_line(solution)}[/]"]
        parts += [f"[bold]{escape(notice)}[/]" for notice in solution.energy().notices]
    parts += ["", f"[dim]{statistics_line(solution)}[/]"]
    return Group(*parts)


def _head(solution: Trajectories, notices: Iterable[str], *, debug: bool = False) -> list[RenderableType]:
    span = f"{solution.time[0]:g} s to {solution.time[-1]:g} s"
    parts: list[RenderableType] = [f"[bold]{escape(solution.model.name)}[/]  {span}"]
    parts += ["", events_table(solution, debug=debug)] if solution.events else []
    ended = [str(solution.ended)] if solution.ended else []
    return parts + [f"[bold]{escape(notice)}[/]" for notice in [*notices, *ended]]


def events_table(solution: Trajectories, *, debug: bool = False) -> Listed:
    """Return the mode changes; of many only the first and the last. `debug` shows the lines of their transitions."""
    columns = 6 if debug else 5
    rows = [
        (
            float(change.time),
            change.path,
            change.before,
            change.after,
            change.because,
            f"{change.source}".partition(" `")[0],
        )[:columns]
        for change in changes(solution)
    ]
    heads = ("time in s>.9g", "mode", "from", "to", "because", "declared in")[:columns]
    return table(_mode_changes(len(rows)), *heads, rows=rows, name="events", most=_SHOWN, ends=True)


def values_table(solution: Trajectories, words: Sequence[str], display: Mapping[str, str] | None = None) -> Listed:
    """Return first and last value and extremes of what names, patterns and formulas stand for.

    Raises:
        UnknownName: nothing matches.
    """
    shown, signals = Display(solution.model, display), read_signals(solution.model, words)
    values, rows = evaluated(solution, signals), list[tuple[Any, ...]]()
    extremes = _extremes(solution, signals)
    for signal in signals:
        unit = signal.shown_in(shown)
        first, last, *shown_values = shown.converted(
            np.array([*values[signal.name][[0, -1]], *extremes[signal.name][0]]), signal.unit, unit
        )
        low, high = extremes[signal.name][1]
        named = "" if unit in ("1", "*") else unit
        rows.append((signal.name, named, *map(float, (first, last, shown_values[0], low, shown_values[1], high))))
    heads = "first>.6g", "last>.6g", "smallest>.6g", "smallest at s>.6g", "largest>.6g", "largest at s>.6g"
    title = "values" if isinstance(solution, Solution) else "values at the results"
    return table(title, "name", "unit", *heads, rows=rows, name="values", most=_SHOWN, rest=", which --csv writes")


def _extremes(solution: Trajectories, signals: Sequence[Signal]) -> dict[str, tuple[list[float], list[float]]]:
    """Return smallest and largest value with their times; of runs without equations those of the results."""
    if isinstance(solution, Solution):
        kinds = ("min", "max")
        numbers = solution.read(*(f"{kind}({signal.name})" for signal in signals for kind in kinds))
        pairs = zip(signals, numbers[::2], numbers[1::2], strict=True)
        return {signal.name: ([low, high], [low.time, high.time]) for signal, low, high in pairs}
    curves, time = evaluated(solution, signals), solution.time
    places = {name: [int(np.argmin(curve)), int(np.argmax(curve))] for name, curve in curves.items()}
    return {name: (curves[name][k].tolist(), time[k].tolist()) for name, k in places.items()}


def notices(solution: Trajectories) -> list[str]:
    """Return the notices of a run and its events: one sentence for each kind of event, with the time of the first.

    Of inputs a sentence tells the largest value; of a run that has not kept what happens between its results, the
    least that it can be.
    """
    notes: dict[tuple[str, str], str] = {}
    for event in (e for e in solution.events if e.transition >= 0):
        notice, (component, dot, _) = (
            solution.model.events.transitions[event.transition].notice,
            event.mode.rpartition("."),
        )
        ends = solution.model.events.transitions[event.transition].ends
        if notice and not ends and (component, notice) not in notes:
            path = component + dot
            values = NAME_IN_NOTICE.sub(lambda name, path=path: _largest(solution, path + name[1]), notice)
            notes[component, notice] = f"At {event.time:.9g} s {component or solution.model.name} {values}."
    return [*solution.notices, *notes.values()]


def _largest(solution: Trajectories, path: str) -> str:
    try:
        return f"{solution.read(f'max({path})')[0]:g}"
    except MissingValue:
        return f"at least {solution[path].max():g}"


def energy_table(solution: Trajectories, display: Mapping[str, str] | None = None) -> Listed:
    """Return the energy balance; of many components only those with the largest exchange."""
    balance = solution.energy()
    # Without impacts there is no column for them.
    collides = any(row.impact for row in balance)
    columns = ["component", "in>", "from outside>", "stored>", "lost>", *["of it in impacts>"][: int(collides)]]
    unit = Display(solution.model, display).of_quantity("J")
    size = parse_unit(unit).factor
    rows = {
        row.component: [
            value / size for value in (row.inflow, row.source, row.stored, row.lost, *[row.impact][: int(collides)])
        ]
        for row in balance
    }
    active = [name for name, values in rows.items() if any(values)]
    largest = sorted(active, key=lambda name: max(map(abs, rows[name])), reverse=True)
    # Those shown keep the order of the drive, and stand before those that are not.
    active = [name for some in (largest[:_SHOWN], largest[_SHOWN:]) for name in active if name in some]
    totals = [balance.source, balance.stored, balance.lost, *[sum(row.impact for row in balance)][: int(collides)]]
    return table(
        f"energy balance in {unit}", *columns, most=_SHOWN,
        rows=[(name or solution.model.name, *map(_energy, rows[name])) for name in active],
        total=("total", Shown("", None), *(_energy(value / size) for value in totals)),
    )  # fmt: skip


def closure_line(solution: Trajectories) -> str:
    """Return how well the energy balance closes."""
    balance = solution.energy()
    return f"The energy balance closes to {balance.closure:.1e} of {balance.throughput:.6g} J."


def _energy(value: float) -> Shown:
    return Shown(f"{value:.4f}" if abs(value) < 1e7 else f"{value:.6g}", float(value))


def statistics_line(solution: Trajectories) -> str:
    """Return steps, evaluations, events and seconds in one sentence."""
    counts, chosen = solution.statistics, sum(event.mode.endswith("].choice") for event in solution.events)
    choices = f" ({chosen} of them choices of states)" if chosen else ""
    return (
        f"{counts.steps} steps, {counts.evaluations} evaluations, {counts.integrations} integrations, "
        f"{_mode_changes(counts.events)}{choices} in {counts.seconds:.3f} s"
    )


def _mode_changes(count: int) -> str:
    return "1 mode change" if count == 1 else f"{count} mode changes"


def cosimulation_report(solution: CosimSolution) -> RenderableType:
    """Return mode changes, energies at the couplings and communication steps of a run."""
    parts = _head(solution, solution.notices)
    if solution.couplings:
        rows = [
            (coupling.name, float(coupling.throughput), float(coupling.residual),
             float(coupling.residual / coupling.throughput) if coupling.throughput else Shown("", None),
             float(coupling.mismatch))
            for coupling in solution.couplings
        ]  # fmt: skip
        heads = "coupling", "through>.6g", "created>.3g", "share>.1e", "mismatch>.3g"
        parts += ["", table("energy at the couplings in J", *heads, rows=rows)]
    parts += ["", f"[dim]{steps_line(solution)}[/]"]
    return Group(*parts)


def steps_line(solution: CosimSolution) -> str:
    """Return the numbers of communication steps."""
    sizes = f"{solution.shortest:.3g} s"
    if solution.longest > solution.shortest * (1 + 1e-6):
        sizes += f" to {solution.longest:.3g} s"
    back = f", {solution.rejected} rejected" if solution.rejected else ""
    return f"{solution.steps} communication steps of {sizes}{back}, {solution.statistics.seconds:.2f} s"
