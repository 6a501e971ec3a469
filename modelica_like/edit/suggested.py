"""Operations that only problems suggest: a word is written rightly, an end is left free, a value is given."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from modelica_like.arguments import checked
from modelica_like.edit import values
from modelica_like.edit.references import lines
from modelica_like.edit.sheet import Sheet
from modelica_like.errors import NetlistError
from modelica_like.netlist import spell
from modelica_like.netlist.outline import Outline

_TITLES = {
    "replace": "Write '{new}'", "set": "Give {path} a value", "free": "Leave {end} free",
    "connect": "Connect {first} to {second}", "insert": "Put a {kind} between {between[0]} and {between[1]}",
}  # fmt: skip


def title(suggestion: Mapping[str, Any]) -> str:
    """Return what an editor or a page writes on the button that applies a suggestion."""
    return _TITLES[suggestion["operation"]].format(**suggestion)


@checked
def respell(sheet: Sheet, line: int, column: int, length: int, old: str, new: str) -> None:
    """Write another word at a place.

    Args:
        sheet: the netlist.
        line: of the word, from one.
        column: of its first character, from one.
        length: of the word as it is written.
        old: the word.
        new: what is written there.

    Raises:
        NetlistError: the word is not there.
    """
    outline, mark = Outline(sheet.text), sheet.text.startswith("\ufeff") and line == 1
    begin = outline.offset(max(line, 1), max(column, 1) + mark)
    if sheet.text[begin : begin + length] != old:
        raise NetlistError(f"There is no '{old}' at line {line}, column {column}.", advice="Check the netlist again.")
    sheet.change(begin, begin + length, new)
    sheet.commit()


@checked
def free(sheet: Sheet, end: str) -> None:
    """Leave an end free: it is listed in `free`."""
    line = next(iter(lines(sheet, "free")), None)
    if line is None:
        sheet.write(("free",), [end])
    elif end not in line.names:
        sheet.insert_item(line.array, len(line.names), end)
    sheet.commit()


@checked
def give(sheet: Sheet, path: str, unit: str, value: Any = None) -> None:
    """Give a value to a part.

    Args:
        sheet: the netlist.
        path: of the value.
        unit: of its field.
        value: as in `set`; without it, `…` is written, which no reader takes.
    """
    if value is not None:
        values.set(sheet, path, value)
        return
    name, _, inner = path.partition(".")
    written = "…" if unit in ("1", "*") else f"… {unit}"
    sheet.put((*values.table_of(sheet, name), *inner.split(".")), spell.quoted(written))
    sheet.commit()
