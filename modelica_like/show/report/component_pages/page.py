"""A component type as a page in Markdown, made from its declarations."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterable, Mapping, Sequence
from itertools import groupby
from pathlib import Path
from textwrap import dedent
from typing import NamedTuple

from modelica_like.language import Component
from modelica_like.language.inside import declarations, inside
from modelica_like.parsing import source_lines
from modelica_like.show.report.component_pages import latex_names as names
from modelica_like.show.report.component_pages.markdown import (
    cell,
    markdown,
    module_title,
    page_link,
    relative,
    source_link,
    table,
)
from modelica_like.show.report.component_pages.source import Event, Said, Source, Term
from modelica_like.show.report.declared import Notation, declared

_WIDE = 110
"""Characters of LaTeX beyond which a sum gets a line per term."""


_WITH_A_VALUE = 3
"""Equals signs in a line that gives a value: one for the part, one for its type, one for the value."""
_LONG = 700
"""Characters of Markdown beyond which a section is closed at first."""
_FEW = 5
"""Netlists that are listed at once."""
_FIRST = ("parameters", "inputs", "structure")
"""Listings of what is given to a part; they come first."""


class Example(NamedTuple):
    """A netlist in which a type occurs, its description, and the line of the part."""

    path: Path
    title: str
    line: str = ""


def page(kind: type[Component], file: Path, examples: Sequence[Example] = ()) -> str:
    """Return the page of a component type: symbol, an example line, what is given to it, then all the rest.

    Args:
        kind: the type.
        file: of the page; links are relative to it. Its symbol is beside it, see `symbol_file`.
        examples: netlists in which the type occurs.
    """
    source = Source(kind)
    equations, events = (written(source.says(name)) for name in ("equations", "events"))
    energy = written(source.energy())
    definitions = written(source.definitions())
    listings = {title: table("", head, rows) for title, head, rows in declared(kind, _notation(_optional(source)))}
    first = {title: listings.pop(title) for title in _FIRST if title in listings}
    lines = [example.line for example in examples if example.line]
    sections = [
        f"# {kind.__name__}",
        f"[All components](../README.md) · {module_title(kind.__module__)} · {source_link(kind, file)}",
        f"![symbol of {kind.__name__}]({symbol_file(file).name})",
        markdown(inspect.cleandoc(kind.__doc__ or "")),
        *([f"```toml\n{min(lines, key=simplicity)}\n```"] if lines else []),
        *(f"## {title.capitalize()}\n\n{text}" for title, text in {**first, **listings}.items()),
        *_parts(kind),
        _folded("Equations", equations and (f"{equations}\n\nwhere\n\n{definitions}" if definitions else equations)),
        _folded("Events", events),
        _folded("Energy", energy),
        *_example_links(examples, file),
        *_bases(kind, file),
    ]
    return "\n\n".join(section for section in sections if section) + "\n"


def symbol_file(file: Path) -> Path:
    """Return the file of a page's symbol."""
    return file.with_suffix(".svg")


def _folded(title: str, text: str) -> str:
    """Return a section that can be closed, and is at first where it is long."""
    if not text:
        return ""
    opened = "" if len(text) > _LONG else " open"
    name = title.lower().replace(" ", "-")
    return f'<details id="{name}" markdown="1"{opened}>\n<summary>{title}</summary>\n\n{text}\n\n</details>'


def simplicity(line: str) -> tuple[bool, bool, int]:
    """Plain values come before formulas, some values before none, and few before many."""
    formula = any(text and text[0].isalpha() for text in re.findall(r'= "([^"]*)"', line)[1:])
    return formula, line.count("=") < _WITH_A_VALUE, len(line)


def _notation(optional: Mapping[str, str]) -> Notation:
    return Notation(
        code=lambda text: f"`{text}`",
        text=cell,
        symbol=lambda path: f"${names.name(path)}$",
        flow=lambda path, unit: f"${names.name(path)}$ in {unit}",
        missing=lambda name: optional.get(name, "required"),
    )


def _optional(source: Source) -> dict[str, str]:
    """Return the note on optional parameters and on alternatives."""
    notes = dict.fromkeys(source.asked, "optional")
    for name, uses in source.uses.items():
        instead = [field for field in source.asked if all(use.get(field) is False for use in uses)]
        if instead and name not in notes:
            notes[name] = "required without " + ", ".join(f"`{x}`" for x in instead)
    return notes


def _parts(kind: type[Component]) -> list[str]:
    """Return the parts that the class declares, and how it builds others."""
    by_name = {name: part if isinstance(part, list) else [part] for name, part in declarations(kind).parts.items()}
    rows = ((f"`{name}`", page_link(type(e)), _values(e)) for name, part in by_name.items() for e in part)
    code = dedent("".join(source_lines(kind.build)[0])).strip() if kind.build is not Component.build else ""
    parts = [table("", ("part", "type", "values"), rows), code and f"```python\n{code}\n```"]
    return ["## Parts", *parts] if any(parts) else []


def _values(part: Component) -> str:
    given = ", ".join(f"{name} = {value.given}" for name, value in inside(part).values.items())
    return f"`{given}`" if given else ""


def _bases(kind: type[Component], file: Path) -> list[str]:
    """Return the docstrings of the bases, with the physics common to several types."""
    bases = [base for base in kind.__mro__[1:] if issubclass(base, Component) and base is not Component]
    texts = [
        f"**{base.__name__}** · {source_link(base, file)}\n\n{markdown(inspect.cleandoc(base.__doc__ or ''))}"
        for base in bases
    ]
    return [_folded("What it extends", "\n\n".join(texts))]


def _example_links(examples: Sequence[Example], file: Path) -> list[str]:
    if not examples:
        return []
    links = [f"- [{example.path.name}]({relative(example.path, file)}): {cell(example.title)}" for example in examples]
    more = _folded(f"{len(links) - _FEW} more netlists", "\n".join(links[_FEW:]))
    return ["## In netlists", "\n".join(links[:_FEW]), more]


# -- content of a class
# -------------------------------------------------------------------------------------------------


def written(says: Iterable[Said]) -> str:
    """Return the items: equations in blocks, events as tables, paragraphs unchanged."""
    parts: list[str] = []
    for _, group in groupby(says, type):
        many = list(group)
        parts += [item for item in many if isinstance(item, str) and item]
        parts += filter(None, [_equations([item for item in many if isinstance(item, Term)])])
        parts += filter(None, [_events([item for item in many if isinstance(item, Event)])])
    # Consecutive ends become one list, consecutive source texts one text.
    return "\n\n".join(parts).replace("`\n\n- `", "`\n- `").replace("\n```\n\n```python\n", "\n")


def _equations(terms: Sequence[Term]) -> str:
    if len(terms) == 1 and "\\cr\n" not in _broken(terms[0].right):
        return f"$$\n{terms[0].left} {terms[0].sign} {terms[0].right}{_condition(terms[0])}\n$$"
    if not terms:
        return ""
    lines = [rf"{term.left} &{term.sign} {_broken(term.right)}{_condition(term)}" for term in terms]
    return "$$\n\\begin{aligned}\n" + " \\cr\n".join(lines) + "\n\\end{aligned}\n$$"


def _condition(term: Term) -> str:
    return rf" \quad {term.where}" if term.where else ""


def _broken(right: str) -> str:
    """Break a long sum before its terms, outside of all brackets and case distinctions."""
    if len(right) <= _WIDE:
        return right
    pieces, depth = [""], 0
    for word in right.split(" "):
        if depth == 0 and word in ("+", "-") and len(pieces[-1]) > _WIDE // 2:
            pieces.append("")
        depth += word.count(r"\left") + word.count("{") + word.count(r"\begin")
        depth -= word.count(r"\right") + word.count("}") + word.count(r"\end")
        pieces[-1] += f"{word} "
    return " \\cr\n& \\quad ".join(piece.strip() for piece in pieces)


def _events(events: Sequence[Event]) -> str:
    several = len({event.mode for event in events}) > 1
    rows = (
        (
            f"`{event.mode}`" if several else "", event.source or "*at the start*", event.target, f"${event.when}$",
            event.resets, cell(event.notice), f"${event.where}$" if event.where else "",
        )
        for event in events
    )  # fmt: skip
    return table("", ("mode", "from", "to", "when", "sets", "notice", "where"), rows)
