"""Sensitivities as ranking tables for the command line."""

from __future__ import annotations

from rich.console import Group, RenderableType
from rich.markup import escape

from modelica_like.analyse.sensitivity.derivatives import Sensitivities
from modelica_like.analyse.sensitivity.report import SHOWN, relative_text, unit_text
from modelica_like.report.types import table


def sensitivity_report(result: Sensitivities) -> RenderableType:
    """Return one ranking table per output, the most important parameters first."""
    parts: list[RenderableType] = []
    for output in result.outputs:
        title = f"{output.name} = {output.value:.9g} {unit_text(output.unit)}".rstrip()
        rows = [
            (one.name, f"{one.value:.6g}", unit_text(one.unit), f"{derivative:.6g}", relative_text(relative))
            for one, derivative, relative in result.ranking(output.name)
        ]
        columns = "parameter", "value>", "unit", "derivative>", "relative>"
        parts += [table(title, *columns, rows=rows, most=SHOWN), ""]
    parts += [
        f"{escape(name)}: {rows.shape[0]} times, see Sensitivities.series" for name, rows in result.series.items()
    ]
    parts.append(f"[dim]derivatives in SI units; relative: percent per percent; {result.method} method[/]")
    return Group(*parts)
