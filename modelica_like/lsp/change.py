"""Changes of a netlist's text: a new name for a part or a parameter, and what a suggestion says."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

from modelica_like.errors import DuplicateName, ModelicaLikeError, NetlistError, UnknownName
from modelica_like.language.formula import CONSTANTS, name_places
from modelica_like.language.units import read_quantity
from modelica_like.lsp.names import Names
from modelica_like.lsp.text import Text, word_at
from modelica_like.netlist.further import head
from modelica_like.netlist.outline import Entry, Span

Edit = tuple[Span, str]
"""A place in the text, and what is written there."""
_DECLARED = ("parts", "parameters")
_ASKED = ("optimize", "tolerances")
_NAME = re.compile(r"[A-Za-z_]\w*")


def renamed(text: Text, offset: int, name: str) -> list[Edit]:
    """Return the changes that give the part or the parameter at a place another name, wherever this file uses it.

    Args:
        text: a netlist.
        offset: of the place.
        name: the new name.

    Raises:
        UnknownName: there is no part or parameter.
        NetlistError: the new name is no name.
        DuplicateName: it is in use.
    """
    declared = {path[1] for path in text.outline.by_path if path[0] in _DECLARED and len(path) > 1}
    old = text.text[slice(*word_at(text, offset))]
    places = _uses(text, old) if old in declared and text.kind == "netlist" else []
    if not any(begin <= offset <= end for begin, end in places):
        raise UnknownName("There is no part or parameter of this netlist.")
    if not _NAME.fullmatch(name):
        raise NetlistError(
            f"'{name}' is no name.", advice="A name has letters, digits and _, and begins with no digit."
        )
    if name in declared or name in CONSTANTS:
        raise DuplicateName(f"'{name}' is already in use.")
    return [(place, name) for place in places]


def _uses(text: Text, name: str) -> list[Span]:
    """Return where a part or a parameter is named; each place once."""
    return [*dict.fromkeys(place for entry in text.outline.entries for place in _in_entry(text, entry, name))]


def _in_entry(text: Text, entry: Entry, name: str) -> Iterator[Span]:
    section, read = entry.path[0], text.outline.read
    if section in _ASKED:
        yield from _in_question(text, entry, name)
        return
    index = 1 - (len(entry.path) - len(entry.names))  # of a part's name among the names of the key
    if section in (*_DECLARED, "start", "guess", "display") and 0 <= index < len(entry.names):
        begin, _ = entry.names[index]
        if head(read(entry.names[index])) == name:
            yield begin, begin + len(name)
    value, (begin, _) = read(entry.value), entry.value
    if not begin or text.text[begin] in "[{":
        return
    if section in ("series", "connect", "free", "expose") and head(value) == name:
        yield begin, begin + len(name)
    elif section in (*_DECLARED, "start", "guess") and name in value and _is_formula(text, entry):
        for match in re.finditer(rf"(?<![\w.])(?<!\d ){re.escape(name)}(?!\w)(?!\s*\()", value):
            yield begin + match.start(), begin + match.end()


def _in_question(text: Text, entry: Entry, name: str) -> Iterator[Span]:
    """Yield the places in [optimize] and [tolerances]: keys that are paths, and texts that are outputs."""
    read = text.outline.read
    for begin, end in entry.names:
        if head(read((begin, end))) == name:
            yield begin, begin + len(name)
    value, (begin, _) = read(entry.value), entry.value
    if begin and text.text[begin] not in "[{" and text.text[begin - 1] in "\"'":
        for start, end in name_places(value):
            if head(value[start:end]) == name:
                yield begin + start, begin + start + len(name)


def _is_formula(text: Text, entry: Entry) -> bool:
    """Tell whether a value may use names: no number, no cell of a table, no name of a type or a mode, no other text."""
    (begin, _), schema = entry.value, Names(text).value(".".join(entry.path[1:]))[0]
    if not entry.names or text.text[begin - 1] not in "\"'" or {"enum", "const", "type"} & schema.keys():
        return False
    try:
        return entry.path[-1] != "is" and read_quantity(text.outline.read(entry.value)) is None
    except ModelicaLikeError:
        return True  # a number with something that is no unit


def applied(text: Text, suggestion: Mapping[str, Any]) -> list[Edit]:
    """Return the changes of a suggestion; a value that must be given is written as `…`, which no reader takes."""
    outline = text.outline
    if suggestion["operation"] == "replace":
        begin = outline.offset(suggestion["line"], suggestion["column"])
        span = begin, begin + suggestion["length"]
        return [(span, suggestion["new"])] if outline.read(span) == suggestion["old"] else []
    if suggestion["operation"] == "free":
        end, entry = suggestion["end"], outline.by_path.get(("free",))
        if entry is None:
            return [((0, 0), f'free = ["{end}"]\n')]
        last = outline.text.rfind("]", *entry.value)
        elements = any(path[:1] == ("free",) and len(path) > 1 for path in outline.by_path)
        return [((last, last), f'{", " if elements else ""}"{end}"')] if last >= 0 else []
    part, _, name = suggestion["path"].partition(".")
    unit = "" if suggestion["unit"] in ("1", "*") else f" {suggestion['unit']}"
    written, entry = f'{name} = "…{unit}"', outline.by_path.get(("parts", part))
    if entry is None:
        return []
    if entry.is_header:
        return [((entry.end, entry.end), f"\n{written}")]
    last = outline.text.rfind("}", *entry.value)
    end = len(outline.text[:last].rstrip())
    return [((end, end), f", {written}")] if last >= 0 else []
