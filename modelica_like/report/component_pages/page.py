"""A component type as a page in Markdown, made from its declarations alone."""

from __future__ import annotations

import inspect
from collections.abc import Mapping, Sequence
from pathlib import Path
from textwrap import dedent
from typing import NamedTuple

from modelica_like.language import Component
from modelica_like.report.component_pages import latex_names as names
from modelica_like.report.component_pages.markdown import (
    cell,
    markdown,
    module_title,
    page_link,
    relative,
    source_link,
    table,
)
from modelica_like.report.component_pages.sections import written
from modelica_like.report.component_pages.source import Source
from modelica_like.report.declared import Notation, declared


class Example(NamedTuple):
    """A netlist in which a type occurs, and its description."""

    path: Path
    title: str


def page(kind: type[Component], file: Path, examples: Sequence[Example] = ()) -> str:
    """Return the page of a component type.

    Args:
        kind: the type.
        file: where the page will be; links are relative to it.
        examples: netlists in which it occurs.
    """
    source = Source(kind)
    equations, events = (written(source.says(name)) for name in ("equations", "events"))
    energy = written(source.energy())
    definitions = written(source.definitions())
    sections = [
        f"# {kind.__name__}",
        f"[All components](../README.md) · {module_title(kind.__module__)} · {source_link(kind, file)}",
        markdown(inspect.cleandoc(kind.__doc__ or "")),
        *(table(title.capitalize(), head, rows) for title, head, rows in declared(kind, _notation(_optional(source)))),
        *_parts(kind),
        equations and f"## Equations\n\n{equations}",
        definitions and f"where\n\n{definitions}",
        events and f"## Events\n\n{events}",
        energy and f"## Energy\n\n{energy}",
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


def _optional(source: Source) -> dict[str, str]:
    """Return what to say of parameters that need no value, or only where others have none."""
    told = dict.fromkeys(source.asked, "optional")
    for name, uses in source.uses.items():
        instead = [asked for asked in source.asked if all(use.get(asked) is False for use in uses)]
        if instead and name not in told:
            told[name] = "required without " + ", ".join(f"`{one}`" for one in instead)
    return told


def _parts(kind: type[Component]) -> list[str]:
    """Return the parts that the class declares, and how it builds others."""
    found = {name: part if isinstance(part, list) else [part] for name, part in kind._class_parts.items()}
    rows = ((f"`{name}`", page_link(type(one)), _values(one)) for name, part in found.items() for one in part)
    code = dedent(inspect.getsource(kind.build)).strip() if kind.build is not Component.build else ""
    parts = [table("", ("part", "type", "values"), rows), code and f"```python\n{code}\n```"]
    return ["## Parts", *parts] if any(parts) else []


def _values(part: Component) -> str:
    given = ", ".join(f"{name} = {value.given}" for name, value in part._values.items())
    return f"`{given}`" if given else ""


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
