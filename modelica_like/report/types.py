"""Descriptions of component types: tables generated from their declarations."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterable, Mapping, Sequence

from rich.console import Group, RenderableType
from rich.markup import escape
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from modelica_like.errors import ModelicaLikeError
from modelica_like.language import Component
from modelica_like.language.places import located
from modelica_like.report.declared import Listing, Notation, declared

_TERMINAL = Notation(
    code=str,
    text=str,
    symbol=lambda _: "",
    flow=lambda path, unit: f"{path.rpartition('.')[2]} [{unit}]",
    missing=lambda _: "",
)


def table(
    title: str, *columns: str, rows: Iterable[Sequence[str | Text]] = (), most: int = 10**9, rest: str = ""
) -> Table:
    """Return a table in the style of all reports.

    Args:
        title: above it.
        columns: headings; a trailing `>` marks numbers (right-aligned), `*` bold text.
        rows: cells without markup; there may be fewer than columns.
        most: largest number of rows; a last one then gives the number of others.
        rest: text after this number.
    """
    made = Table(
        title=escape(title), title_justify="left", title_style="bold", box=None, pad_edge=False, header_style="dim"
    )
    for column in columns:
        justify = "right" if column.endswith(">") else "left"
        made.add_column(Text(column.rstrip(">*")), justify=justify, style="bold" if column.endswith("*") else "")
    known = list(rows)
    for row in known[:most]:
        made.add_row(*map(Text.assemble, row))
    if len(known) > most:
        made.add_row(f"… {len(known) - most} more{rest}")
    return made


def summary(kind: type[Component]) -> str:
    """Return the first sentence of a type's docstring."""
    return inspect.cleandoc(kind.__doc__ or "").partition("\n")[0]


def library_table(types: Mapping[str, type[Component]]) -> Table:
    """Return all component types with their first sentence, sorted by module."""
    known = sorted(types.items(), key=lambda item: (item[1].__module__, item[0]))
    rows = ((name, kind.__module__.rpartition(".")[2], summary(kind)) for name, kind in known)
    made = table(f"{len(types)} component types", "type*", "module", "what it is", rows=rows)
    # One line per type, so that the list can be searched; `describe` has the whole text.
    for column in made.columns:
        column.no_wrap = True
        column.min_width = max(map(len, types), default=0) if column is made.columns[0] else None
    return made


def describe(kind: type[Component]) -> RenderableType:
    """Return a page about one component type: text, declarations, equations and events."""
    text = inspect.cleandoc(kind.__doc__ or "")
    bases = [base.__name__ for base in kind.__mro__[1:] if issubclass(base, Component) and base is not Component]
    heading = Text.assemble((kind.__name__, "bold"), f"  {kind.__module__}", f"  ({', '.join(bases)})" if bases else "")
    tables = declared(kind, _TERMINAL)
    if kind._class_parts:
        tables.append(Listing("parts", ("name", "type", ""), [_part_row(kind, name) for name in kind._class_parts]))
    made = [table(title, f"{first}*", *others, rows=rows) for title, (first, *others), rows in tables]
    sections: list[RenderableType] = [heading, Text(text), *made, _statements(kind)]
    return Group(*(Padding(section, (0, 0, 1, 0), expand=False) for section in sections))


def _part_row(kind: type[Component], name: str) -> tuple[str, ...]:
    part = kind._class_parts[name]
    what = f"{len(part)} {type(part[0]).__name__}" if isinstance(part, list) else type(part).__name__
    return name, what, "replaceable" if name in kind._replaceable else ""


def _statements(kind: type[Component]) -> RenderableType:
    try:
        component = kind()
        equations = [source.text for _, source in located(component.equations())]
        events = [source.text for _, source in located(component.events())]
    except ModelicaLikeError as error:
        return Text(f"equations depend on structural values: {error.what}", style="dim")
    lines = Text()
    for title, texts in (("equations", equations), ("events", events)):
        if texts:
            lines.append(f"{title}\n", style="bold").append("".join(f"  {_plain(text)}\n" for text in texts))
    return lines


def _plain(text: str) -> str:
    text = text.removeprefix("yield from ").removeprefix("yield ").replace("self.", "")
    if text.startswith("( ") and text.endswith(" )"):
        text = text[2:-2]
    # Join broken lines.
    return re.sub(r",? \)", ")", text.replace("( ", "("))
