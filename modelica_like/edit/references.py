"""Where a netlist names its parts and parameters: lines of ends, keys that are paths, names in formulas."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path as File

from modelica_like.edit.parts import fit, joins, owner_of
from modelica_like.edit.sheet import Sheet
from modelica_like.errors import ModelicaLikeError, UnitError
from modelica_like.language.formula import name_places, parse_formula
from modelica_like.language.units import read_quantity
from modelica_like.netlist.document import read_text
from modelica_like.netlist.further import head
from modelica_like.netlist.outline import Entry, Path, Span, Value

KEYED = ("start", "guess", "display")
"""Sections whose keys are paths."""


@dataclass(frozen=True, slots=True)
class Line:
    """A list of names: an entry of [series] or [connect], or what is `free`."""

    path: Path
    array: Value
    names: list[str]


@dataclass(frozen=True, slots=True)
class Key:
    """A key, or a header (no entry), that names a part: `name` stands at `span`, and may be a path in quotes."""

    entry: Entry | None
    path: Path
    span: Span
    name: str


def lines(sheet: Sheet, *sections: str) -> list[Line]:
    """Return the lists of names in sections."""
    listed: list[Line] = []
    for path, entry in sheet.tree.entries.items():
        items = entry.value.items
        if items is None or path[0] not in sections or len(path) != 1 + (path[0] != "free"):
            continue
        if all(map(sheet.tree.is_string, items)):
            listed.append(Line(path, entry.value, [sheet.tree.string(item) for item in items]))
    return listed


def exposed(sheet: Sheet) -> list[tuple[Entry, str]]:
    """Return the outer connectors with the ends they stand for."""
    entries = (entry for entry in sheet.tree.leaves("expose") if sheet.tree.is_string(entry.value))
    return [(entry, sheet.tree.string(entry.value)) for entry in entries]


def keys(sheet: Sheet, *sections: str) -> Iterator[Key]:
    """Yield what names a part in the keys and headers of sections."""
    for section in sheet.tree.sections:
        if len(section.path) > 1 and section.path[0] in sections:
            yield Key(None, section.path, section.names[1], str(section.path[1]))
    for path, entry in sheet.tree.entries.items():
        before = len(path) - len(entry.names)
        if path[0] in sections and before <= 1 < len(path):
            yield Key(entry, path, entry.names[1 - before], str(path[1]))


def is_path(key: Key) -> bool:
    """Return whether a key of [display] is a path, and no quantity."""
    return key.entry is None or "." in key.name or len(key.path) > 2


def formulas(sheet: Sheet, name: str = "") -> Iterator[tuple[Entry, str, list[Span]]]:
    """Yield the formulas, or those that use a part or parameter: the key, the text, where in it such paths stand."""
    for entry in sheet.tree.leaves("parameters", "parts", "start", "guess"):
        if not sheet.tree.is_string(entry.value) or name not in sheet.text[entry.value.start : entry.value.end]:
            continue
        text = sheet.tree.string(entry.value)
        places = [span for span in places_in(text) if name in ("", head(text[slice(*span)]))]
        if places and _takes_formula(sheet, entry):
            yield entry, text, places


def places_in(text: str) -> list[Span]:
    """Return where the paths stand in a formula; a quantity, or another text, has none."""
    with suppress(UnitError):  # a formula that begins with a quantity
        if read_quantity(text) is not None:
            return []
    try:
        parse_formula(text)
    except ModelicaLikeError:
        return []
    return name_places(text)


def _takes_formula(sheet: Sheet, entry: Entry) -> bool:
    """Return whether a text is the value of a field; types, texts of structural fields and modes are none."""
    path, name = entry.path, str(entry.path[-1]).rpartition(".")[2]
    if path[0] == "parameters":
        return True
    if path[0] == "parts" and (len(path) < 3 or path[-1] == "is"):
        return False
    owner = owner_of(sheet, path)
    return owner is None or name in owner.fields


def renamed(text: str, places: list[Span], rename: Callable[[str], str]) -> str:
    """Return a formula with other paths."""
    for start, end in reversed(places):
        text = text[:start] + rename(text[start:end]) + text[end:]
    return text


def in_other_files(sheet: Sheet, name: str) -> list[str]:
    """Return sentences about paths of a part in the sizing file."""
    sizing = sheet.data.get("sizing")
    if not isinstance(sizing, str):
        return []
    try:
        text = read_text(File(sheet.file).parent / sizing)
    except ModelicaLikeError:
        return []
    paths = sorted(set(re.findall(rf"(?<![\w.]){re.escape(name)}(?:\[\d+\])?\.[\w.]+", text)))
    return [f"'{sizing}' uses {', '.join(paths)}: change that there."] if paths else []


# -- lines that lose elements, or become several -------------------------------------------------------------------


def unused(sheet: Sheet, section: str, name: str) -> str:
    """Return the name for a new line of a section: this one, or with a number."""
    taken = sheet.table(section)
    numbered = (f"{name}_{k}" if k > 1 else name for k in range(1, len(taken) + 2))
    return next(candidate for candidate in numbered if candidate not in taken)


def drop_ends(sheet: Sheet, goes: Callable[[str], bool], *sections: str) -> list[str]:
    """Take ends out of [connect] or `free`, with the lines that join nothing then; return the ends."""
    dropped: list[str] = []
    for line in lines(sheet, *sections):
        gone = [k for k, end in enumerate(line.names) if goes(end)]
        kept = [end for end in line.names if not goes(end)]
        dropped += [line.names[k] for k in gone]
        if gone and (len(kept) > 1 and joins(sheet, kept) if line.path[0] == "connect" else kept):
            sheet.delete_items(line.array, gone)
        elif gone:
            sheet.delete([line.path])
            if len(kept) > 1:
                sheet.notes.append(f"{', '.join(kept)} are not connected any more.")
    return dropped


def cut(sheet: Sheet, line: Line, pieces: Sequence[Sequence[int]]) -> None:
    """Keep the first piece of a series in its line, write the others into lines of their own."""
    pieces = [piece for piece in pieces if len(piece) > 1]
    if not pieces:
        sheet.delete([line.path])
        return
    sheet.delete_items(line.array, {*range(len(line.names))} - {*pieces[0]})
    for k, piece in enumerate(pieces[1:], 2):
        key = unused(sheet, "series", f"{line.path[1]}_{k}")
        sheet.write(("series", key), [line.names[place] for place in piece])


def take_out(sheet: Sheet, goes: Callable[[str], bool]) -> None:
    """Take parts out of [series] and join their neighbours; where those do not fit, the series is cut."""
    for line in lines(sheet, "series"):
        kept = [k for k, name in enumerate(line.names) if not goes(name)]
        if len(kept) < len(line.names):
            _cut_misfits(sheet, line, kept, lambda before, after: after > before + 1)


def cut_misfits(sheet: Sheet, line: Line, name: str) -> None:
    """Cut a series beside a part that does not fit there."""
    places = range(len(line.names))
    _cut_misfits(sheet, line, places, lambda before, after: name in line.names[before : after + 1])


def _cut_misfits(sheet: Sheet, line: Line, kept: Sequence[int], doubtful: Callable[[int, int], bool]) -> None:
    pieces: list[list[int]] = [list(kept[:1])]
    for before, after in pairwise(kept):
        if doubtful(before, after) and not fit(sheet, line.names[before], line.names[after]):
            names = f"{line.names[before]} and {line.names[after]}"
            sheet.notes.append(f"{names} are not joined: their ends are of different kinds, or one has none.")
            pieces.append([])
        pieces[-1].append(after)
    if len(kept) < len(line.names) or len(pieces) > 1:
        cut(sheet, line, pieces)
