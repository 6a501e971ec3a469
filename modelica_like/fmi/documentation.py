"""documentation/index.html: what the FMU holds, readable without any tool."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from html import escape

from modelica_like.fmi.description import DISPLAY_UNITS
from modelica_like.fmi.interface import FmuVariable, Interface
from modelica_like.fmi.xml import unit_name

Listing = Sequence[tuple[str, str, Sequence[str]]]
"""Path and type of each component, and its equations as they were written."""

_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; color: #1f2937; max-width: 72rem; margin: 2rem auto; padding: 0 1rem; }
h1, h2 { font-weight: 600; } h2 { margin-top: 2.5rem; border-bottom: 1px solid #e5e7eb; }
table { border-collapse: collapse; width: 100%; } th { text-align: left; color: #6b7280; font-weight: 500; }
th, td { padding: .2rem .8rem .2rem 0; border-bottom: 1px solid #f0f2f5; vertical-align: top; }
code { font-family: ui-monospace, monospace; font-size: 13px; } td.number { text-align: right; }
""".strip()

_GROUPS = (
    ("Inputs", ("input",)),
    ("Outputs", ("output",)),
    ("Parameters", ("parameter",)),
    ("Parameters that follow from others", ("calculatedParameter",)),
    ("Local variables", ("local",)),
)


def index_page(interface: Interface, description: str, tool: str, equations: Listing) -> str:
    """Write the page.

    Args:
        interface: the FMI variables.
        description: one phrase about the drive.
        tool: name and version of the exporting tool.
        equations: the equations of every component, if they are known.
    """
    title = escape(interface.name)
    parts = [
        "<!DOCTYPE html>", '<html lang="en">', "<head>", '<meta charset="utf-8">', f"<title>{title}</title>",
        f"<style>\n{_STYLE}\n</style>", "</head>", "<body>", f"<h1>{title}</h1>",
        f"<p>{escape(description)}</p>" if description else "",
        f"<p>{len(interface.states)} continuous states, {len(interface.indicators)} event indicators. Made by "
        f"{escape(tool)} from an acausal model; the C sources are in <code>sources/</code>.</p>",
    ]  # fmt: skip
    for heading, causalities in _GROUPS:
        variables = [v for v in interface.variables if v.causality in causalities and v.slot[0] != "guard"]
        if variables:
            parts += [f"<h2>{heading}</h2>", _table(variables)]
    if equations:
        parts += ["<h2>Equations</h2>", *(_component(*equation) for equation in equations)]
    return "\n".join([*(part for part in parts if part), "</body>", "</html>", ""])


def _table(variables: Sequence[FmuVariable]) -> str:
    head = "<tr><th>name</th><th>start</th><th>unit</th><th>shown in</th><th>description</th></tr>"
    return "\n".join(["<table>", head, *map(_row, variables), "</table>"])


def _row(variable: FmuVariable) -> str:
    unit = unit_name(variable.unit) or ""
    start = "" if variable.start is None else f"{variable.start:.9g}"
    shown = ", ".join(DISPLAY_UNITS.get(unit, ()))
    cells = (f"<code>{escape(variable.name)}</code>", _known(unit), _known(shown), _known(variable.description))
    name, *rest = (f"<td>{cell}</td>" for cell in cells)
    return f'<tr>{name}<td class="number">{start}</td>{"".join(rest)}</tr>'


_known = cache(escape)


def _component(path: str, kind: str, lines: Sequence[str]) -> str:
    listed = "<br>\n".join(f"<code>{escape(line)}</code>" for line in lines)
    return f"<h3>{escape(path or kind)} <small>{escape(kind) if path else ''}</small></h3>\n<p>{listed}</p>"
