"""What component types are: tables generated from their declarations, so that they cannot drift from the code."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterable, Mapping

from rich.console import Group, RenderableType
from rich.markup import escape
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from modelica_like.errors import ModelicaLikeError
from modelica_like.language import Component, Connector, Discrete, Input, Output, Parameter, Variable
from modelica_like.language.fields import Field
from modelica_like.language.places import located


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
    sections: list[RenderableType] = [heading, Text(text)]
    for title, sort in (
        ("parameters", Parameter), ("inputs", Input), ("outputs", Output), ("variables", Variable),
        ("discrete values", Discrete),
    ):  # fmt: skip
        fields = [field for field in kind._class_fields.values() if sort_of(field) is sort]
        if fields:
            sections.append(_fields(title, fields))
    sections += [made for made in (_structure(kind), _connectors(kind), _modes(kind), _parts(kind)) if made.row_count]
    sections.append(_statements(kind))
    return Group(*(Padding(section, (0, 0, 1, 0), expand=False) for section in sections))


def sort_of(field: Field) -> type[Field]:
    """Return the sort of a declaration: parameter, input, output, variable or discrete value."""
    return next(sort for sort in (Parameter, Input, Output, Variable, Discrete) if isinstance(field, sort))


def _fields(title: str, fields: Iterable[Field]) -> Table:
    made = table(title, "name", "unit", "default", "range", "description")
    for field in fields:
        default = "" if field.default is None else str(field.default)
        made.add_row(
            f"[bold]{field.name}[/]", field.unit_text, escape(default), value_range(field), escape(field.description)
        )
    return made


def value_range(field: Field) -> str:
    """Return the permitted values, or nothing."""
    low = "" if field.min is None else f"{field.min:g}"
    high = "" if field.max is None else f"{field.max:g}"
    return f"{low} … {high}".strip() if low or high else ""


def _structure(kind: type[Component]) -> Table:
    made = table("structure", "name", "default")
    for name, default in kind._structural.items():
        known = isinstance(default, bool | int | float | str | tuple | None)
        made.add_row(f"[bold]{name}[/]", escape(str(default)) if known else "required")
    return made


def _connectors(kind: type[Component]) -> Table:
    made = table("connectors", "name", "type", "potential, flow", "", "description")
    for name, connector in kind._class_connectors.items():
        fields = ", ".join(f"{field.name} [{field.unit_text}]" for field in connector.fields.values())
        made.add_row(
            f"[bold]{name}[/]",
            type(connector).__name__,
            escape(fields),
            freedom(connector),
            escape(connector.description),
        )
    return made


def freedom(connector: Connector) -> str:
    """Tell whether a connector may stay unconnected."""
    return "optional" if connector.optional else "may be free" if connector.may_be_free else ""


def _modes(kind: type[Component]) -> Table:
    made = table("modes", "name", "one of", "start", "description")
    for name, mode in kind._class_modes.items():
        made.add_row(f"[bold]{name}[/]", ", ".join(mode.names), mode.start, escape(mode.description))
    return made


def _parts(kind: type[Component]) -> Table:
    made = table("parts", "name", "type", "")
    for name, part in kind._class_parts.items():
        what = f"{len(part)} {type(part[0]).__name__}" if isinstance(part, list) else type(part).__name__
        made.add_row(f"[bold]{name}[/]", what, "replaceable" if name in kind._replaceable else "")
    return made


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
