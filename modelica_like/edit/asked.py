"""Names in what is asked of a drive: [optimize] and [tolerances]."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from modelica_like.edit.sheet import Sheet
from modelica_like.edit.tree import joined
from modelica_like.language.formula import name_places
from modelica_like.netlist.further import head
from modelica_like.netlist.outline import Span, Value

_SECTIONS = ("optimize", "tolerances")
_TEXTS = {"minimize", "maximize", "subject_to"}
"""Entries of [optimize] whose texts are outputs."""


def rename(sheet: Sheet, change: Callable[[str], str]) -> None:
    """Give every path there what `change` makes of it."""
    for span, path in _keys(sheet):
        if (new := change(path)) != path:
            sheet.rename(span, new)
    for value, text in _texts(sheet):
        new = text
        for start, end in reversed(name_places(text)):
            new = new[:start] + change(new[start:end]) + new[end:]
        if new != text:
            sheet.rewrite(value, new)


def users(sheet: Sheet, name: str) -> list[str]:
    """Return sentences about what there is of a part or parameter."""
    keys = [f"[{joined(path[:1])}] names {name}" for path in _paths_of_keys(sheet, name)]
    texts = [
        f"'{text}' still uses {name}"
        for _, text in _texts(sheet)
        if any(head(text[start:end]) == name for start, end in name_places(text))
    ]
    return [f"{what}: change that there." for what in dict.fromkeys([*keys, *texts])]


def _paths_of_keys(sheet: Sheet, name: str) -> Iterator[tuple[str | int, ...]]:
    for entry_path, index in _places(sheet):
        if head(str(entry_path[index])) == name:
            yield entry_path


def _places(sheet: Sheet) -> Iterator[tuple[tuple[str | int, ...], int]]:
    """Yield the paths of entries that have a key of the drive, and where in them it stands."""
    for path in sheet.tree.entries:
        section, *inner = path
        if section == "tolerances" and inner and inner[0] != "correlated":
            yield path, 1
        elif section == "optimize" and len(inner) > 1 and inner[0] in ("free", "choose"):
            yield path, 2
        elif section == "optimize" and len(inner) > 2 and inner[0] == "for" and inner[2] != "name":
            yield path, 3


def _keys(sheet: Sheet) -> Iterator[tuple[Span, str]]:
    """Yield the names of parts and parameters in keys, with their places."""
    for path, index in _places(sheet):
        entry = sheet.tree.entries[path]
        before = len(path) - len(entry.names)
        if before <= index:
            yield entry.names[index - before], str(path[index])


def _texts(sheet: Sheet) -> Iterator[tuple[Value, str]]:
    """Yield the texts that are outputs of the drive, or its parameters."""
    for entry in sheet.tree.leaves(*_SECTIONS):
        path = entry.path
        if (path[0] == "optimize" and path[1] in _TEXTS) or (path[0] == "tolerances" and path[-1] == "of"):
            for value in [entry.value] if entry.value.items is None else entry.value.items:
                if sheet.tree.is_string(value):
                    yield value, sheet.tree.string(value)
