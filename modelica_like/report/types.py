"""What component types are: tables generated from their declarations, so that they cannot drift from the code."""

from __future__ import annotations

import inspect
import re
from collections.abc import Mapping

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
    code=lambda text: f"[bold]{escape(text)}[/]",
    text=escape,
    symbol=lambda _: "",
    flow=lambda path, unit: escape(f"{path.rpartition('.')[2]} [{unit}]"),
    missing=lambda _: "",
)


def table(title: str, *columns: str) -> Table:
    """Return an empty table in the style of all reports."""
    made = Table(title=title, title_justify="left", title_style="bold", box=None, pad_edge=False, header_style="dim")
    for column in columns:
        made.add_column(column, justify="right" if column.endswith(">") else "left")
        made.columns[-1].header = column.rstrip(">")
    return made


def summary(kind: type[Component]) -> str:
    """Return the first sentence of a type's docstring."""
    return inspect.cleandoc(kind.__doc__ or "").partition("\n")[0]


def library_table(types: Mapping[str, type[Component]]) -> Table:
    """Return all component types with their first sentence, sorted by module."""
    made = table(f"{len(types)} component types", "type", "module", "what it is")
    for name, kind in sorted(types.items(), key=lambda item: (item[1].__module__, item[0])):
        made.add_row(f"[bold]{name}[/]", kind.__module__.rpartition(".")[2], escape(summary(kind)))
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
    sections: list[RenderableType] = [heading, Text(text), *(_listed(one) for one in declared(kind, _TERMINAL))]
    if kind._class_parts:
        sections.append(
            _listed(Listing("parts", ("name", "type", ""), [_part_row(kind, name) for name in kind._class_parts]))
        )
    sections.append(_statements(kind))
    return Group(*(Padding(section, (0, 0, 1, 0), expand=False) for section in sections))


def _listed(listing: Listing) -> Table:
    made = table(listing.title, *listing.head)
    for row in listing.rows:
        made.add_row(*row)
    return made


def _part_row(kind: type[Component], name: str) -> tuple[str, ...]:
    part = kind._class_parts[name]
    what = f"{len(part)} {type(part[0]).__name__}" if isinstance(part, list) else type(part).__name__
    return f"[bold]{name}[/]", what, "replaceable" if name in kind._replaceable else ""


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
    # What was broken into lines.
    return re.sub(r",? \)", ")", text.replace("( ", "("))
