"""Tables of a page."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table, or nothing without rows.

    Args:
        heads: headings; those that end with `>` are over numbers, with `!` over verdicts.
        rows: texts of the cells.
    """
    marks = [head[-1:] for head in heads]
    top = "".join(f"<th{_look(mark)}>{escape(head.rstrip('>!'))}</th>" for head, mark in zip(heads, marks, strict=True))
    lines = [
        "".join(f"<td{_look(mark, cell)}>{escape(cell)}</td>" for cell, mark in zip(row, marks, strict=True))
        for row in rows
    ]
    body = "".join(f"<tr>{line}</tr>" for line in lines)
    text = f"<table><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table>"
    return f'<div class="scroll">{text}</div>' if lines else ""


def details(inside: str, title: str = "show") -> str:
    """Return something that opens on a click, or nothing for nothing."""
    return f"<details><summary>{escape(title)}</summary>{inside}</details>" if inside else ""


def _look(mark: str, cell: str = "") -> str:
    name = {">": "number", "!": "kept" if cell == "ok" else "missed" if cell else ""}.get(mark, "")
    return f' class="{name}"' if name else ""
