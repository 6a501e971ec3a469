"""A component type as a page in Markdown, made from its declarations alone."""

from __future__ import annotations

import inspect
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from modelica_like.errors import LanguageError
from modelica_like.language import Component
from modelica_like.report.component_pages import latex_names as names
from modelica_like.report.component_pages.markdown import cell, markdown, module_title, relative, source_link, table
from modelica_like.report.component_pages.named_calls import any_table
from modelica_like.report.component_pages.sections import written
from modelica_like.report.component_pages.statements import Statements, statements
from modelica_like.report.component_pages.variants import value_for, variants
from modelica_like.report.declared import Notation, declared, has_default


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
    try:
        optional, mathematics = _said(kind, structure_of(kind, examples))
    except LanguageError as error:
        optional, mathematics = {}, [f"The equations depend on structural values: {error.what}"]
    sections = [
        f"# {kind.__name__}",
        f"[All components](../README.md) · {module_title(kind.__module__)} · {source_link(kind, file)}",
        markdown(inspect.cleandoc(kind.__doc__ or "")),
        *(table(title.capitalize(), head, rows) for title, head, rows in declared(kind, _notation(optional))),
        *mathematics,
        *_example_links(examples, file),
        *_bases(kind, file),
    ]
    return "\n\n".join(section for section in sections if section) + "\n"


def _notation(optional: Mapping[str, str]) -> Notation:
    return Notation(
        code=lambda text: f"`{text}`",
        text=cell,
        symbol=lambda path: f"${names.name(path)}$",
        flow=lambda path, unit: f"${names.name(path)}$ in {unit}",
        missing=lambda name: optional.get(name, "required"),
    )


def _said(kind: type[Component], structure: Mapping[str, Any]) -> tuple[dict[str, str], list[str]]:
    said = statements(kind, structure)
    others = variants(kind, structure, said)
    return _optional(kind, said, others), written(structure, said, others)


def structure_of(kind: type[Component], examples: Sequence[Example]) -> dict[str, Any]:
    """Return structural values of an example for a type that has no equations without any.

    Tables that are only looked up along straight lines need none.
    """
    if not examples:
        return {}
    given = {name: examples[0].structure[name] for name in kind._structural if name in examples[0].structure}
    plain = {name: value for name, value in given.items() if name not in any_table(kind)}
    if all(has_default(default) or name in any_table(kind) for name, default in kind._structural.items()):
        plain = {}
    try:
        statements(kind, plain)
    except LanguageError:
        return given
    return plain


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


def _bases(kind: type[Component], file: Path) -> list[str]:
    """Return what the bases say: there stands the physics that several types share."""
    bases = [base for base in kind.__mro__[1:] if issubclass(base, Component) and base is not Component]
    texts = [
        f"### {base.__name__}\n\n{source_link(base, file)}\n\n{markdown(inspect.cleandoc(base.__doc__ or ''))}"
        for base in bases
    ]
    return ["## What it extends", *texts] if texts else []


def _example_links(examples: Sequence[Example], file: Path) -> list[str]:
    if not examples:
        return []
    links = (f"- [{one.path.name}]({relative(one.path, file)}): {cell(one.title)}" for one in examples)
    return ["## In netlists\n\n" + "\n".join(links)]
