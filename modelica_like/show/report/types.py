"""Descriptions of component types: tables generated from their declarations."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Mapping, Sequence

from rich.console import Group, RenderableType
from rich.padding import Padding
from rich.text import Text

from modelica_like.errors import UnknownName, did_you_mean
from modelica_like.language import Assembly, Component, Parameter
from modelica_like.language.inside import declarations, inside
from modelica_like.show.report.component_pages.source import Source
from modelica_like.show.report.declared import Notation, declared, filled
from modelica_like.show.report.statements import statements
from modelica_like.show.report.tables import Lines, Listed, table

_TERMINAL = Notation(
    code=str,
    text=str,
    symbol=lambda _: "",
    flow=lambda path, unit: f"{path.rpartition('.')[2]} [{unit}]",
    missing=lambda _: "",
)


def summary(kind: type[Component]) -> str:
    """Return the first sentence of a type's docstring."""
    return inspect.cleandoc(kind.__doc__ or "").partition("\n")[0]


def library_table(types: Mapping[str, type[Component]], words: Sequence[str] = (), group: str | None = None) -> Listed:
    """Return component types with their first sentence, sorted by module.

    Args:
        types: by name.
        words: that the name, the group or the text of a type must have, in any case of letters.
        group: name of a module, or of a folder of modules; all by default.

    Raises:
        UnknownName: there is no such group, or no such type.
    """
    groups = {name: kind.__module__.partition(".")[2] or kind.__module__ for name, kind in types.items()}
    search = sorted({word for path in groups.values() for word in path.split(".")})
    if group is not None and group not in search:
        raise UnknownName(
            f"There is no group '{group}'{did_you_mean(group, search) or '.'}", advice=f"There are {', '.join(search)}."
        )
    texts = {name: f"{name} {groups[name]} {kind.__doc__}".lower() for name, kind in types.items()}
    chosen = sorted((groups[name], name) for name, text in texts.items() if group in (None, *groups[name].split("."))
                    and all(word.lower() in text for word in words))  # fmt: skip
    if words and not chosen:
        where = f" of the group {group}" if group else ""
        raise UnknownName(
            f"No component type{where} has {' and '.join(map(repr, words))} in its name or text.",
            advice="Search for fewer or shorter words; `modelica-like library` lists all types.",
        )
    rows = ((name, home, summary(types[name])) for home, name in chosen)
    title = "1 component type" if len(chosen) == 1 else f"{len(chosen)} component types"
    result = table(title, "type*", "group", "what it is", rows=rows, name="types")
    # One line per type, so that the list can be searched; `describe` has the whole text.
    for column in result.columns:
        column.no_wrap = True
    for column, k in zip(result.columns, (1, 0), strict=False):
        column.min_width = max((len(name[k]) for name in chosen), default=0)
    return result


def describe(kind: type[Component]) -> RenderableType:
    """Return a page about one component type: text, declarations, parts, equations, events and energies."""
    text = inspect.cleandoc(kind.__doc__ or "")
    bases = [base.__name__ for base in kind.__mro__[1:] if issubclass(base, Component) and base is not Component]
    heading = Text.assemble((kind.__name__, "bold"), f"  {kind.__module__}", f"  ({', '.join(bases)})" if bases else "")
    tables = declared(kind, _TERMINAL)
    parts = [row for name in declarations(kind).parts for row in _part_rows(kind, name)]
    tables += [filled("parts", ("name", "type", "values", "description"), parts)] if parts else []
    tables_shown = [table(title, f"{first}*", *others, rows=rows) for title, (first, *others), rows in tables]
    lists = [Lines(title, lines) for title, lines in _lines(kind).items()]
    sections: list[RenderableType] = [heading, Text(text), *tables_shown, *lists]
    return Group(*(Padding(section, (0, 0, 1, 0), expand=False) for section in sections))


def describe_netlist(drive: Assembly) -> RenderableType:
    """Return a page about a netlist: its parameters, all parts of it and of its assemblies, and its connections."""
    names = (name for name, field in drive.fields.items() if isinstance(field, Parameter))
    parameters = [(name, str(value.given)) for name in names if (value := drive.value(name)) is not None]
    inner = [part for part in drive.walk() if part is not drive]
    parts = ((part.path, type(part).__name__, _given(part), summary(type(part))) for part in inner)
    joined = {**{name: " - ".join(ends) for name, ends in drive.chains.items()},
              **{name: " = ".join(ends) for name, ends in drive.wires.items()}}  # fmt: skip
    sections: list[RenderableType] = [
        Text.assemble((inside(drive).name, "bold"), f"  {inside(drive).description}"),
        *([table("parameters", "name*", "value", rows=parameters)] if parameters else []),
        table("parts", "name*", "type", "values", "what it is", rows=parts),
        Lines("connections", [f"{name}: {ends}" for name, ends in joined.items()]),
        *([Lines("outer connectors", [" = ".join(pair) for pair in drive.exposed])] if drive.exposed else []),
    ]
    return Group(*(Padding(section, (0, 0, 1, 0), expand=False) for section in sections))


def _part_rows(kind: type[Component], name: str) -> list[tuple[str, ...]]:
    part = declarations(kind).parts[name]
    which = "replaceable" if name in declarations(kind).replaceable else ""
    if isinstance(part, list):
        return [(f"{name}[{k}]", type(element).__name__, _given(element), which) for k, element in enumerate(part, 1)]
    return [(name, type(part).__name__, _given(part), which)]


def _given(part: Component) -> str:
    return ", ".join(f"{name} = {value.given}" for name, value in inside(part).values.items())


def _lines(kind: type[Component]) -> dict[str, list[str]]:
    """Return statements by title, and how the class makes parts that depend on its fields."""
    build = Source(kind).method("build")
    code = [] if build is None else ast.unparse(build.code).replace("self.", "").splitlines()
    return {"built of": code[1:], **statements(kind)} if code else statements(kind)
