"""Equations, events and energy terms in Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from modelica_like.report.component_pages.markdown import cell, markdown, page_link, table
from modelica_like.report.component_pages.statements import Event, Part, Statements, Term

_WIDE = 110
"""Characters of LaTeX beyond which a sum gets a line per term."""


def written(structure: Mapping[str, Any], said: Statements, others: Mapping[str, Statements]) -> list[str]:
    """Return what a type says, section by section.

    Args:
        structure: values of structural fields for which it is written.
        said: what it says.
        others: what it says with one thing more, by what that is.
    """
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
    rows = ((f"`{part.name}`", page_link(part.kind), f"`{part.values}`" if part.values else "") for part in parts)
    return table(title, ("part", "type", "values"), rows)


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
        return markdown(told) + _equations([term])
    return f"{markdown(told)}$$\n{term.left} {term.sign} {term.right}\n$$"


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
            cell(event.notice),
        )
        for event in events
    )
    return heading + table("", ("mode", "from", "to", "when", "sets", "notice"), rows)
