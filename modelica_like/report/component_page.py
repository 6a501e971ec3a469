"""A component type as a page in Markdown, made from its declarations alone."""

from __future__ import annotations

import ast
import inspect
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from textwrap import dedent
from typing import Any

from modelica_like.errors import LanguageError
from modelica_like.language import Component, Connector, Discrete, Input, Output, Parameter, Variable
from modelica_like.language.fields import Field
from modelica_like.netlist.registry import library_types
from modelica_like.report import latex_names as names
from modelica_like.report.named_calls import any_table
from modelica_like.report.statements import Event, Part, Statements, Term, statements, value_for, variants
from modelica_like.report.types import freedom, sort_of, value_range

_SECTIONS = (
    ("Parameters", Parameter), ("Inputs", Input), ("Outputs", Output), ("Variables", Variable),
    ("Discrete values", Discrete),
)  # fmt: skip
_WIDE = 110
"""Characters of LaTeX beyond which a sum gets a line per term."""


@dataclass(frozen=True)
class Example:
    """A netlist in which a type occurs.

    Attributes:
        path: the file.
        title: its description.
        structure: values it gives to structural fields.
    """

    path: Path
    title: str
    structure: Mapping[str, Any]


def page(kind: type[Component], file: Path, examples: Sequence[Example] = ()) -> str:
    """Return the page of a component type.

    Args:
        kind: the type.
        file: where the page will be; links are relative to it.
        examples: netlists in which it occurs; the first gives structural fields without default their values.
    """
    structure = _structure_of(kind, examples)
    try:
        said = statements(kind, structure)
        others = variants(kind, structure, said)
        optional, mathematics = _optional(kind, said, others), _mathematics(structure, said, others)
    except LanguageError as error:
        optional, mathematics = {}, [f"The equations depend on structural values: {error.what}"]
    sections = [
        f"# {kind.__name__}",
        f"[All components](../README.md) · {_module(kind)} · {source_link(kind, file)}",
        _markdown(inspect.cleandoc(kind.__doc__ or "")),
        *_declarations(kind, optional),
        *mathematics,
        *_example_links(examples, file),
        *_bases(kind, file),
    ]
    return "\n\n".join(section for section in sections if section) + "\n"


def _structure_of(kind: type[Component], examples: Sequence[Example]) -> dict[str, Any]:
    """Return structural values of an example for a type that has no equations without any."""
    plain = [name for name in kind._structural if name not in any_table(kind)]
    if not examples or all(_has_default(kind._structural[name]) for name in plain):
        return {}
    return {name: examples[0].structure[name] for name in plain if name in examples[0].structure}


def _optional(kind: type[Component], said: Statements, others: Mapping[str, Statements]) -> dict[str, str]:
    """Return what to say of parameters that need no value, or not always."""
    told = dict.fromkeys(said.asked, "optional")
    for name in kind._class_fields:
        instead = [
            asked for asked in said.asked if (one := others.get(value_for(asked))) and name not in one.parameters
        ]
        if name in said.parameters and instead and name not in told:
            told[name] = "required without " + ", ".join(f"`{one}`" for one in instead)
    return told


def source_link(kind: type, file: Path) -> str:
    """Return a link to the line where a class begins, relative to a page."""
    source = Path(inspect.getsourcefile(kind) or "")
    line = inspect.getsourcelines(kind)[1]
    return f"[{source.name}:{line}]({_relative(source, file.resolve())}#L{line})"


def _module(kind: type[Component]) -> str:
    return kind.__module__.rpartition(".")[2].replace("_", " ")


def _markdown(words: str) -> str:
    return words.replace("<", "&lt;").replace("*", r"\*")


def _cell(words: str) -> str:
    return _markdown(words).replace("|", r"\|").replace("\n", " ")


def _table(title: str, head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table under a heading, without the columns that are empty; nothing if there are no rows."""
    rows = list(rows)
    if not rows:
        return ""
    kept = [k for k in range(len(head)) if any(row[k] for row in rows)]
    lines = [[head[k] for k in kept], ["---"] * len(kept), *([row[k] for k in kept] for row in rows)]
    return (f"## {title}\n\n" if title else "") + "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _bases(kind: type[Component], file: Path) -> list[str]:
    """Return what the bases say: there stands the physics that several types share."""
    bases = [base for base in kind.__mro__[1:] if issubclass(base, Component) and base is not Component]
    texts = [
        f"### {base.__name__}\n\n{source_link(base, file)}\n\n{_markdown(inspect.cleandoc(base.__doc__ or ''))}"
        for base in bases
    ]
    return ["## What it extends", *texts] if texts else []


# -- declarations ------------------------------------------------------------------------------------------------------


def _declarations(kind: type[Component], optional: Mapping[str, str]) -> list[str]:
    connectors = (_connector_row(name, connector) for name, connector in kind._class_connectors.items())
    fields = list(kind._class_fields.values())
    modes = kind._class_modes.items()
    described = _structure_descriptions(kind)
    structure = (
        (f"`{name}`", f"`{default}`" if _has_default(default) else "required", _cell(described.get(name, "")))
        for name, default in kind._structural.items()
    )
    return [
        _table("Connectors", ("name", "type", "potential, flow", "", "description"), connectors),
        *(_field_table(title, [f for f in fields if sort_of(f) is sort], optional) for title, sort in _SECTIONS),
        _table("Structure", ("name", "default", "description"), structure),
        _table(
            "Modes",
            ("name", "one of", "start", "description"),
            ((f"`{n}`", ", ".join(mode.names), mode.start, _cell(mode.description)) for n, mode in modes),
        ),
    ]


def _has_default(default: Any) -> bool:
    return isinstance(default, bool | int | float | str | tuple | None)


def _connector_row(name: str, connector: Connector) -> tuple[str, ...]:
    fields = ", ".join(
        f"${names.name(f'{name}.{field.name}')}$ in {field.unit_text}" for field in connector.fields.values()
    )
    return f"`{name}`", type(connector).__name__, fields, freedom(connector), _cell(connector.description)


def _field_table(title: str, fields: Sequence[Field], optional: Mapping[str, str]) -> str:
    rows = (
        (
            f"`{field.name}`",
            f"${names.name(field.name)}$",
            _cell(field.unit_text),
            _default(field, optional),
            value_range(field),
            _cell(field.description),
        )
        for field in fields
    )
    return _table(title, ("name", "symbol", "unit", "default", "range", "description"), rows)


def _default(field: Field, optional: Mapping[str, str]) -> str:
    if field.default is not None:
        return _cell(f"{field.default:.9g}" if isinstance(field.default, float) else str(field.default))
    return optional.get(field.name, "required") if isinstance(field, Parameter | Input) else ""


def _structure_descriptions(kind: type[Component]) -> dict[str, str]:
    """Return the texts below the structural fields in the class bodies."""
    found: dict[str, str] = {}
    for base in reversed(kind.__mro__):
        if issubclass(base, Component) and base is not Component:
            body = ast.parse(dedent(inspect.getsource(base))).body[0]
            assert isinstance(body, ast.ClassDef)
            for declared, below in zip(body.body, body.body[1:], strict=False):
                if isinstance(declared, ast.AnnAssign) and isinstance(declared.target, ast.Name):
                    found[declared.target.id] = _text_of(below)
    return found


def _text_of(statement: ast.stmt) -> str:
    """Return the text that a statement consists of, or nothing."""
    value = statement.value if isinstance(statement, ast.Expr) else None
    words = value.value if isinstance(value, ast.Constant) else ""
    return inspect.cleandoc(words) if isinstance(words, str) else ""


# -- mathematics -------------------------------------------------------------------------------------------------------


def _mathematics(structure: Mapping[str, Any], said: Statements, others: Mapping[str, Statements]) -> list[str]:
    written_for = ", ".join(f"`{name} = {value}`" for name, value in structure.items())
    parts = [
        _parts("Parts", said.parts),
        "## Connections\n\n" + "\n".join(f"- {_joined(ends)}" for ends in said.connections) if said.connections else "",
        f"Written for {written_for}." if written_for else "",
        "## Equations\n\n" + _equations(said.equations) if said.equations else "",
        _definitions(said.definitions),
        _events("## Events\n\n", said.events),
        "## Energy\n\n" + _equations(said.energy.values()) if said.energy else "",
    ]
    for what, other in others.items():
        parts += [f"## With {what}", *_variant(other)]
    return parts


def _parts(title: str, parts: Iterable[Part]) -> str:
    rows = ((f"`{part.name}`", _page_link(part.kind), f"`{part.values}`" if part.values else "") for part in parts)
    return _table(title, ("part", "type", "values"), rows)


def _page_link(kind: type[Component]) -> str:
    """Return a link from one page to another."""
    known = library_types().get(kind.__name__) is kind
    return f"[{kind.__name__}](../{place(kind).as_posix()})" if known else kind.__name__


def place(kind: type[Component]) -> Path:
    """Return the file of a page, from the folder of all pages: `friction/Clutch.md`."""
    return Path(kind.__module__.rpartition(".")[2]) / f"{kind.__name__}.md"


def _joined(ends: Iterable[str]) -> str:
    return " = ".join(f"`{end}`" for end in ends)


def _variant(said: Statements) -> list[str]:
    return [
        _parts("", said.parts),
        "\n".join(f"- {_joined(ends)}" for ends in said.connections),
        _equations((*said.equations, *said.energy.values())) if said.equations or said.energy else "",
        _definitions(said.definitions),
        _events("", said.events),
    ]


def _equations(terms: Iterable[Term]) -> str:
    lines = [rf"{term.left} &{term.sign} {_broken(term.right)}" for term in terms]
    return "$$\n\\begin{aligned}\n" + " \\cr\n".join(lines) + "\n\\end{aligned}\n$$"


def _broken(right: str) -> str:
    """Break a long sum before its terms, outside of all brackets and case distinctions."""
    if len(right) <= _WIDE:
        return right
    pieces, depth = [""], 0
    for word in right.split(" "):
        if depth == 0 and word[:1] in "+-" and len(pieces[-1]) > _WIDE // 2:
            pieces.append("")
        depth += word.count(r"\left") + word.count("{") + word.count(r"\begin")
        depth -= word.count(r"\right") + word.count("}") + word.count(r"\end")
        pieces[-1] += f"{word} "
    return " \\cr\n& \\quad ".join(piece.strip() for piece in pieces)


def _definitions(terms: Sequence[Term]) -> str:
    """Return the definitions, each with its description."""
    if not terms:
        return ""
    return "where\n\n" + "\n\n".join(map(_defined, terms))


def _defined(term: Term) -> str:
    told = f"{term.description[:1].upper()}{term.description[1:]}:\n\n" if term.description else ""
    if "\\cr\n" in _broken(term.right):
        return _markdown(told) + _equations([term])
    return f"{_markdown(told)}$$\n{term.left} {term.sign} {term.right}\n$$"


def _events(heading: str, events: Sequence[Event]) -> str:
    if not events:
        return ""
    several = len({event.mode for event in events}) > 1
    rows = (
        (
            f"`{event.mode}`" if several else "",
            event.source or "*at the start*",
            event.target,
            f"${event.when}$",
            "; ".join(f"${reset}$" for reset in event.resets),
            _cell(event.notice),
        )
        for event in events
    )
    return heading + _table("", ("mode", "from", "to", "when", "sets", "notice"), rows)


def _example_links(examples: Sequence[Example], file: Path) -> list[str]:
    if not examples:
        return []
    links = (f"- [{one.path.name}]({_relative(one.path, file)}): {_cell(one.title)}" for one in examples)
    return ["## In netlists\n\n" + "\n".join(links)]


def _relative(target: Path, page: Path) -> str:
    """Return the path of a file as a link of a page."""
    return Path(os.path.relpath(target, page.parent)).as_posix()
