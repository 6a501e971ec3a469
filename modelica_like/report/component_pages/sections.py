"""Equations, events and energy terms in Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import groupby

from modelica_like.report.component_pages.markdown import cell, table
from modelica_like.report.component_pages.source import Event, Said, Term

_WIDE = 110
"""Characters of LaTeX beyond which a sum gets a line per term."""


def written(says: Iterable[Said]) -> str:
    """Return what is said, in this order: equations in blocks, events as tables, paragraphs as they stand."""
    parts: list[str] = []
    for _, group in groupby(says, type):
        many = list(group)
        parts += [one for one in many if isinstance(one, str) and one]
        parts += filter(None, [_equations([one for one in many if isinstance(one, Term)])])
        parts += filter(None, [_events([one for one in many if isinstance(one, Event)])])
    # Ends and source text that follow each other are one list and one text.
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
