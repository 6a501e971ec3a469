"""The page of a run."""

from __future__ import annotations

import json
import platform
import re
from collections.abc import Callable, Iterator, Sequence
from html import escape
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.analyse.optimize.result import Optimum
from modelica_like.arguments import checked
from modelica_like.errors import ModelicaLikeError
from modelica_like.fmi.export import tool
from modelica_like.language import Component
from modelica_like.runs.display import Display
from modelica_like.runs.signals import evaluated
from modelica_like.runs.solution import Solution
from modelica_like.runs.trajectories import Trajectories
from modelica_like.show.bands import mode_spans
from modelica_like.show.browser.page import HELPERS, joined_scripts, script_hash
from modelica_like.show.draw import schematic
from modelica_like.show.plot import for_page, quantity_of
from modelica_like.show.report.changes import Change, changes
from modelica_like.show.report.page.assessed import design_checks, ranking, small_motions
from modelica_like.show.report.page.best import best_design
from modelica_like.show.report.page.tables import details, table
from modelica_like.show.report.plausible import notes as plausible
from modelica_like.show.report.run import notices, statistics_line
from modelica_like.show.report.start import start_values
from modelica_like.style import with_unit
from modelica_like.writing import write_text

_FIRST, _MOST_EVENTS = 25, 400
"""Instants that are told at once, and after a click."""
_READ = "Move over a curve to read it, drag to zoom, double-click to see all."
_NO_CURVES = "Nothing moves here: choose curves by <code>--show</code>, such as '*.i'."
_KILO = 1e3
_SMALL = 5e-4
"""Share of the supply below which an energy is not listed."""


@checked
def save_report(
    drive: Component | None, run: Trajectories, path: str | Path, *, show: Sequence[str] = (),
    optimum: Optimum | None = None,
) -> None:  # fmt: skip
    """Write the report of a run as a page.

    Args:
        drive: the drive; None if only results are known.
        run: its run.
        path: the file.
        show: names, patterns or formulas of the curves; by default speeds, torques and forces of the parts, or what a
            circuit has.
        optimum: the search that this drive is the result of, told in a section of its own.

    Raises:
        UnknownName: nothing matches a pattern.
        OSError: the file cannot be written.
    """
    write_text(path, report(drive, run, show=show, optimum=optimum))


def report(
    drive: Component | None, run: Trajectories, *, show: Sequence[str] = (), optimum: Optimum | None = None
) -> str:
    """Return the report of a run as HTML: one file that loads nothing else.

    Args:
        drive: the drive; None if only results are known, those of an FMU or a table.
        run: its run.
        show: as of `save_report`.
        optimum: as of `save_report`.

    Raises:
        UnknownName: nothing matches a pattern.
    """
    folder, drawn = Path(__file__).parent, curves(run, show)
    # Of the parts that are not inside of others, the last one is closest to the load.
    paths = ([curve["path"] for curve in panel["curves"] if curve["path"]] for panel in drawn["panels"])
    ends = [min(reversed(some), key=lambda path: path.count(".")) for some in paths if some]
    left = escape(drawn.pop("left")).replace("--show", "<code>--show</code>")
    hint = f"{_READ} {left}" if drawn["panels"] else _NO_CURVES
    sections = [
        ("Best design", best_design(optimum) if optimum is not None else ""),
        ("Schematic", f'<div class="wide">{schematic(drive, background=False)}</div>' if drive else ""),
        ("What happens", _happens(drive, run)),
        ("Curves", f'<div id="curves"></div><p class="hint">{hint}</p>'),
        ("Energy", _attempt(lambda: _energy(drive, run)) if run.model.components else ""),
        *(_of_equations(drive, run, ends) if drive and isinstance(run, Solution) else ()),
    ]  # fmt: skip
    script = joined_scripts(HELPERS, folder / "page.js")
    data = json.dumps(drawn, ensure_ascii=False, separators=(",", ":")).replace("<", "\\u003c")
    parts = {
        "name": escape(run.model.name), "description": escape(getattr(drive, "description", "")), "data": data,
        "sections": "\n".join(f"<section><h2>{title}</h2>{body}</section>" for title, body in sections if body),
        "script": script, "hash": script_hash(script),
    }  # fmt: skip
    page = (folder / "page.html").read_text(encoding="utf-8")
    return re.sub(r"\{\{(\w+)\}\}", lambda match: parts[match[1]], page)


def _of_equations(drive: Component, run: Solution, ends: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Yield the sections of a run whose equations are known."""
    yield "Design checks", _attempt(lambda: design_checks(drive, run))
    yield "What matters", _attempt(lambda: ranking(run, ends))
    yield "Small motions at the end", _attempt(lambda: small_motions(drive, run))
    values = zip(run.model.flat_parameters, run.model.p, strict=True)
    rows = [(parameter.path, f"{value:.6g}", str(parameter.unit), parameter.description) for parameter, value in values]
    yield "Parameters", details(table(("parameter", "value>", "unit", "description"), rows))
    yield "Start", _attempt(lambda: _start(drive, run))
    packages = f"{tool()}, CasADi {ca.__version__}, Python {platform.python_version()}"
    options = f"rtol = {run.options.rtol:g}, atol = {run.options.atol:g}"
    lines = run.model.summary, f"{statistics_line(run)}; {options}.", f"{packages}."
    yield "How it was computed", "".join(f"<p>{escape(line)}</p>" for line in lines)
    yield "Netlist", _netlist(drive)


def _attempt(make: Callable[[], str]) -> str:
    """If a section cannot be made, it shows why; the others are not affected."""
    try:
        return make()
    except ModelicaLikeError as error:
        return f"<p>{escape(str(error))}</p>"


def _happens(drive: Component | None, run: Trajectories) -> str:
    """Events in words, grouped by time, and the notices of the run."""
    instants: dict[float, dict[str, list[Change]]] = {}
    for change in changes(run):
        if change.before == change.after and change.after:  # a kink of a curve
            continue
        instants.setdefault(change.time, {}).setdefault(change.path, []).append(change)
    lines = [
        f"<li><b>{time:.6g} s</b> {'; '.join(escape(_told(run, some)) for some in paths.values())}.</li>"
        for time, paths in list(instants.items())[:_MOST_EVENTS]
    ]
    lines += [f"<li>… {len(instants) - _MOST_EVENTS} more instants</li>"] if len(instants) > _MOST_EVENTS else []
    notes = (*notices(run), *(plausible(drive, run) if drive else ()))
    said = "".join(f'<p class="notice">{escape(sentence)}</p>' for sentence in notes)
    if len(lines) > _FIRST + 5:
        rest = details(f"<ul>{''.join(lines[_FIRST:])}</ul>", f"{len(instants) - _FIRST} more instants")
        return f"{said}<ul>{''.join(lines[:_FIRST])}</ul>{rest}"
    return said + (f"<ul>{''.join(lines)}</ul>" if lines else "<p>No mode changes.</p>")


def _told(run: Trajectories, some: Sequence[Change]) -> str:
    """Return the changes of one thing at an instant: `clutch becomes stuck (slip reached zero)`."""
    last = some[-1]
    why = ", ".join(dict.fromkeys(filter(None, (*(change.because for change in some), _slid(run, last)))))
    if not last.after:
        return f"{last.path}: {why}"
    discrete = next((d for d in run.model.flat_discretes if d.path == last.path), None)
    name = (last.owner if discrete is None or discrete.names else last.path) or run.model.name
    return f"{name} becomes {last.after.replace('_', ' ')}{f' ({why})' if why else ''}"


def _slid(run: Trajectories, change: Change) -> str:
    """Return the friction work of surfaces that begin to hold, since they held last."""
    if not isinstance(run, Solution):
        return ""
    modes = [(run.model.flat_discretes[hold.mode], hold.number) for hold in run.model.held.motions]
    held = {(mode.path, mode.names[number]) for mode, number in modes}
    if (change.path, change.after) not in held:
        return ""
    left = (event.time for event in run.events if event.time < change.time and (event.mode, event.before) in held and
            event.mode == change.path)  # fmt: skip
    begin = max(left, default=float(run.time[0]))
    lost = run.energy(begin, change.time)[change.owner].lost if change.time > begin else 0.0
    size, unit = (_KILO, "kJ") if lost >= 10.0 * _KILO else (1.0, "J")
    return f"{lost / size:.4g} {unit} of friction work" if lost > _SMALL * run.energy().supply else ""


def _energy(drive: Component | None, run: Trajectories) -> str:
    """Energy along the drive, and of each part, in kJ and percent of the supply."""
    balance = run.energy()
    total = balance.supply or 1.0
    flow = schematic(drive, background=False, run=run, flow=True, balance=balance) if drive and balance.supply else ""
    rows = [
        (row.component or "the drive", what, value)
        for row in balance
        for what, value in (
            ("brought in", max(row.source, 0.0)),
            ("taken out", max(-row.source, 0.0)),
            ("stored", row.stored),
            ("lost", row.lost),
        )
        if abs(value) > _SMALL * total
    ]
    order = {"brought in": 0, "taken out": 1, "stored": 2, "lost": 3}
    rows.sort(key=lambda row: (order[row[1]], -abs(row[2])))
    size, unit = (_KILO, "kJ") if total >= _KILO else (1.0, "J")
    lines = "".join(
        f'<tr><td>{escape(name)}</td><td>{what}</td><td class="number">{value / size:.5g}</td>'
        f'<td class="number">{round(value / total, 3) + 0.0:.1%}</td><td class="bar"><i class="{what.split()[0]}" '
        f'style="width:{100 * min(abs(value / total), 1.0):.1f}%"></i></td></tr>'
        for name, what, value in rows
    )
    heads = f'<tr><th>part</th><th></th><th class="number">{unit}</th><th class="number">share</th><th></th></tr>'
    closes = f"The balance closes to {balance.closure:.1e} of {balance.throughput:.5g} J."
    said = "".join(f'<p class="notice">{escape(sentence)}</p>' for sentence in balance.notices)
    along = f'<div class="wide">{flow}</div>' if flow else ""
    return f'{along}<table class="energy"><thead>{heads}</thead><tbody>{lines}</tbody></table><p>{closes}</p>{said}'


def _start(drive: Component, run: Solution) -> str:
    rows = start_values(drive, run.model, run.start)
    cells = [(row.path, f"{row.value:.6g}", row.unit, row.origin) for row in rows]
    return details(table(("variable", "value>", "unit", "where from"), cells))


def _netlist(drive: Component) -> str:
    origin = getattr(drive, "origin", "")
    if not origin or not Path(origin).is_file():
        return ""
    return details(f"<pre>{escape(Path(origin).read_text('utf-8'))}</pre>", Path(origin).name)


_POINTS = 1200
"""Number of drawn results, including those at events."""
_MOST_BANDS = 400


def curves(run: Trajectories, patterns: Sequence[str] = ()) -> dict[str, Any]:
    """Return times, panels of curves by unit, what is left out in words, modes as bands and events.

    Args:
        run: the run.
        patterns: names, patterns or formulas of the curves; by default as `for_page` says.

    Raises:
        UnknownName: nothing matches a pattern.
        UnitError: the units in a formula do not fit together.
    """
    signals, left = for_page(run, patterns)
    # Evenly spread results, and both sides of every event.
    count = len(run.time)
    spread = np.unique(np.linspace(0, count - 1, min(count, _POINTS)).round().astype(int))
    times = np.unique([event.time for event in run.events][:_POINTS])
    sides = np.concatenate([np.searchsorted(run.time, times, side) for side in ("left", "right")])
    beside = np.clip(np.concatenate([sides, sides - 1]), 0, count - 1)
    rows = np.unique(np.concatenate([spread, beside])).astype(np.intp)
    shown, curve = Display(run.model), evaluated(run, signals)
    panels: dict[str, dict[str, Any]] = {}
    for signal in signals:
        unit = signal.shown_in(shown)
        title = with_unit(quantity_of(signal), unit)
        values = signal.driving * shown.converted(curve[signal.name][rows], signal.unit, unit)
        curve_data = {
            "name": signal.label,
            "path": signal.name if signal.plain else "",
            "values": [float(f"{v:.6g}") for v in values],
        }
        panels.setdefault(title, {"title": title, "curves": []})["curves"].append(curve_data)
    hidden = {discrete.path for discrete in run.model.flat_discretes if discrete.hidden}
    modes = dict.fromkeys(event.mode for event in run.events if event.mode not in hidden)
    return {
        "times": [float(f"{t:.9g}") for t in run.time[rows]],
        "panels": list(panels.values()),
        "left": left,
        "modes": [{"name": mode, "bands": mode_spans(run, mode)[:_MOST_BANDS]} for mode in modes],
        "events": sorted({float(f"{event.time:.9g}") for event in run.events}),
    }
