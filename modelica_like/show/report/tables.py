"""Tables of all reports: printed with few digits, handed on as data with all of them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from contextlib import suppress
from typing import Any, NamedTuple

from rich.console import Group
from rich.markup import escape
from rich.padding import Padding
from rich.protocol import rich_cast
from rich.table import Table
from rich.text import Text

_LARGEST = 10**9


class Shown(NamedTuple):
    """A cell whose text does not follow from its value by the format of its column."""

    text: str
    value: Any


class Listed(Table):
    """A table that knows its values.

    Attributes:
        name: of the table as data.
        records: its rows, those left out included: value by heading.
    """

    def __init__(self, title: str, name: str, records: list[dict[str, Any]]) -> None:
        super().__init__(
            title=escape(title), title_justify="left", title_style="bold", box=None, pad_edge=False, header_style="dim"
        )
        self.name = name
        self.records = records


class Lines(Text):
    """Lines below a title; as data a list of texts."""

    def __init__(self, title: str, lines: Sequence[str]) -> None:
        super().__init__("\n".join([title, *(f"  {line}" for line in lines)]))
        self.stylize("bold", 0, len(title))
        self.name = title
        self.records = list(lines)


def table(
    title: str, *columns: str, rows: Iterable[Sequence[Any]] = (), total: Sequence[Any] = (), name: str = "",
    most: int = _LARGEST, rest: str = "", ends: bool = False,
) -> Listed:  # fmt: skip
    """Return a table in the style of all reports.

    Args:
        title: above it.
        columns: headings; a `>` and a format behind it mark numbers (`time in s>.9g`, right-aligned), `*` bold text.
        rows: cells without markup; there may be fewer than columns.
        total: a last row below a line.
        name: of the table as data; by default the title without its unit.
        most: largest number of rows; a row then gives the number of others.
        rest: text after this number.
        ends: whether the rows left out are those in the middle, not the last ones.
    """
    heads, marks, formats = zip(*(column.rstrip("*").partition(">") for column in columns), strict=True)
    assert len(set(heads)) == len(heads), "a heading is a key of the rows as data"
    listed = list(rows)
    records = [dict(zip(heads, map(_value, row, marks), strict=False)) for row in [*listed, *filter(None, [total])]]
    result = Listed(title, name or title.partition(" in ")[0], records)
    for column, head, mark in zip(columns, heads, marks, strict=True):
        result.add_column(Text(head), justify="right" if mark else "left", style="bold" if column[-1:] == "*" else "")
    lines = [tuple(map(_cell, row, formats)) for row in listed]
    left_out = len(lines) - most
    if left_out > 0:
        at = most // 2 if ends else most
        lines[at : at + left_out] = [(Text("…" if ends else f"… {left_out} more{rest}"),)]
    for line in lines:
        result.add_row(*line)
    if total:
        result.add_section()
        result.add_row(*map(_cell, total, formats), style="bold")
    return result


def _cell(cell: Any, spec: str) -> Text:
    if isinstance(cell, Shown):
        return Text(cell.text)
    return cell if isinstance(cell, Text) else Text(format(cell, spec) if isinstance(cell, float) else str(cell))


def _value(cell: Any, mark: str) -> Any:
    """Return a cell as JSON has it: without infinities, and with numbers for their texts in a column of numbers."""
    value = cell.value if isinstance(cell, Shown) else cell.plain if isinstance(cell, Text) else cell
    if mark and isinstance(value, str):
        with suppress(ValueError):
            value = float(value)
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    return value


def as_data(*shown: Any) -> dict[str, Any]:
    """Return what reports show as data for JSON: `tables`, rows of values by heading, and `text`, the sentences.

    Args:
        shown: reports: tables, texts with markup, groups of them.
    """
    tables: dict[str, list[Any]] = {}
    texts: list[str] = []
    for item in map(rich_cast, shown):
        if isinstance(item, Group | Padding):
            inner = as_data(*(item.renderables if isinstance(item, Group) else (item.renderable,)))
            for name, records in inner["tables"].items():
                tables.setdefault(name, []).extend(records)
            texts += inner["text"]
        elif isinstance(item, Listed | Lines):
            tables.setdefault(item.name, []).extend(item.records)
        else:
            text = item if isinstance(item, Text) else Text.from_markup(str(item))
            texts += [text.plain] if text.plain.strip() else []
    return {"tables": tables, "text": texts}
