"""Sections of a report that judge a run: design checks, what its end depends on, and its natural frequencies."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from pathlib import Path

import numpy as np

from modelica_like.analyse.linear.linearize import linearize
from modelica_like.analyse.sensitivity.derivatives import sensitivities
from modelica_like.analyse.sizing.run import size
from modelica_like.errors import NoGradient
from modelica_like.language import Component
from modelica_like.runs.solution import Solution
from modelica_like.show.draw import schematic
from modelica_like.show.report.analysis import shares
from modelica_like.show.report.page.tables import details, table

_PATIENCE = 3.0
"""Seconds of a run whose derivatives a page waits for; they take two to four times as long."""
_RANKED, _MOST_ENDS, _MOST_MODES = 12, 3, 20
_MOST_STATES = 600
"""States of a drive whose modes a page waits for: all of them take a time that grows with their cube, here 2 s."""
_MATTERS = 5e-4
"""Percent per percent below which a parameter does not matter."""
_ZERO = 0.01
"""Part of the largest value below which an end value has no percents."""


def design_checks(drive: Component, run: Solution) -> str:
    """Return the lines of the drive's sizing file that have a limit, and all others to open; nothing without a file.

    Raises:
        ModelicaLikeError: the file is wrong.
    """
    if not (path := getattr(drive, "sizing", "")):
        return ""
    sizing = size(path, {Path(getattr(drive, "origin", "")).resolve(): run})
    lines = [(check.name, line) for check in sizing.checks for line in check.result.lines(check.limits)]
    judged, others = (
        [(f"{name}.{line.name}", line.value, line.unit, line.verdict, line.description) for name, line in lines
         if bool(line.verdict) is limited]
        for limited in (True, False)
    )  # fmt: skip
    judged.sort(key=lambda row: row[3] == "ok")
    missed, heads = sizing.exceeded, ("line", "value>", "unit", "verdict!", "what it is")
    verdict = f"{len(judged)} limits, {missed or 'none'} missed: {escape(Path(path).name)}."
    said = f'<p class="notice">{verdict}</p>' if missed else f"<p>{verdict}</p>"
    return said + table(heads, judged) + details(table(heads, others), f"{len(others)} lines without a limit")


def ranking(run: Solution, ends: Sequence[str]) -> str:
    """Return by what percentage end values change for one percent of the parameters that matter most.

    Args:
        run: the run.
        ends: variables, the first ones of which that do not end at zero are taken; the lost energy is added.
    """
    if run.statistics.seconds > _PATIENCE:
        command = f"<code>modelica-like sensitivity … --of {escape(next(iter(ends), 'loss_energy'))}</code>"
        took = f"The run took {run.statistics.seconds:.1f} s, and its derivatives would take longer."
        return f"<p>{took} {command} ranks the parameters.</p>"
    balance = run.energy()
    # What an impact costs has no derivative.
    lossy = balance.lost > 0.0 and not any(row.impact for row in balance)
    moving = [name for name in ends if abs(run[name][-1]) > _ZERO * np.max(np.abs(run[name]))]
    names = [*moving[:_MOST_ENDS], *(["loss_energy"] if lossy else [])]
    if not names or not len(run.model.p):
        return ""
    try:
        sensitivity = sensitivities(run, names)
    except NoGradient as error:
        return f"<p>{escape(' '.join(filter(None, (error.what, error.why, error.advice))))}</p>"
    percents = np.nan_to_num(sensitivity.normalised)
    largest = np.max(np.abs(percents), axis=0)
    order = [int(k) for k in np.argsort(-largest)[:_RANKED] if largest[k] > _MATTERS]
    heads = ("one percent more of", "value>", "unit", *(f"{output.name}, %>" for output in sensitivity.outputs))
    rows = [
        (quantity.name, f"{quantity.value:.6g}", quantity.unit_text,
         *(f"{round(value, 3) + 0.0:.3f}" for value in percents[:, k]))
        for k in order for quantity in [sensitivity.parameters[k]]
    ]  # fmt: skip
    at_the_end = ", ".join(f"{o.name} = {o.value:.5g} {o.unit_text}".rstrip() for o in sensitivity.outputs)
    said = f"<p>Change in percent of what the run ends with: {escape(at_the_end)}.</p>"
    left = "".join(f"<p>{escape(note)}</p>" for note in sensitivity.notes())
    return (said + table(heads, rows) if rows else "") + details(
        left, f"{len(sensitivity.left_out)} without a derivative"
    )


def small_motions(drive: Component, run: Solution) -> str:
    """Return natural frequencies in the modes in which the run ends, with shapes.

    Raises:
        ModelicaLikeError: there is no linear model.
    """
    if len(run.model.states) > _MOST_STATES:
        return (
            f"<p>Not computed: all modes of {len(run.model.states)} states take long. <code>modelica-like modes</code> "
            "computes them.</p>"
        )
    modes = linearize(run).modes()
    rows = [
        (str(k), f"{mode.frequency:.4g}", f"{mode.damping:.3g}", shares(mode.stored), shares(mode.lost))
        for k, mode in enumerate(modes, 1)
        if mode.oscillates
    ]
    drawn = f'<div class="wide">{schematic(drive, background=False, modes=modes)}</div>' if rows else ""
    more = f"<p>… and {len(rows) - _MOST_MODES} more.</p>" if len(rows) > _MOST_MODES else ""
    return drawn + table(("mode", "frequency in Hz>", "damping>", "energy in", "lost in"), rows[:_MOST_MODES]) + more
