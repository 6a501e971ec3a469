"""Answers about a place in a netlist or a sizing file: completions, explanations, definitions, symbols."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal, NamedTuple

from modelica_like.analyse.sizing.checks import arguments_of, design_checks, unit_of_kind, without_none
from modelica_like.analyse.sizing.json_schema import properties_of
from modelica_like.analyse.sizing.json_schema import schema as sizing_schema
from modelica_like.errors import ModelicaLikeError
from modelica_like.language.units import Unit, parse_unit
from modelica_like.lsp.names import Names, about_type, described, units_like
from modelica_like.lsp.text import Spot, Text, word_at
from modelica_like.netlist.json_schema import sections
from modelica_like.netlist.outline import Span
from modelica_like.netlist.read import is_modelica
from modelica_like.netlist.registry import find_type, library_types
from modelica_like.parsing import source_lines

_AFTER_NUMBER = re.compile(r"\s*[+-]?[\d.]+(?:[eE][+-]?\d+)?\s+(?P<unit>\S*)")
_MOST_SYMBOLS = 2000
Kind = Literal["section", "type", "value", "part", "end", "unit", "word"]
Place = tuple[Path, int, int, int]
"""File, line, column and length."""


class Word(NamedTuple):
    """A word that can stand at a place, with its description."""

    label: str
    about: str
    kind: Kind


class Item(NamedTuple):
    """A word, and what is written for it where; with quotes, if they are missing."""

    word: Word
    span: Span
    text: str


def complete(text: Text, offset: int) -> list[Item]:
    """Return the words that can stand at a place."""
    spot = text.spot(offset)
    words, items = [*_words(text, spot)], list[Item]()
    quoted = spot.role != "value" or text.text[spot.begin - 1 : spot.begin] in ("'", '"')
    for word in words:
        begin = spot.begin
        if word.kind in ("part", "end", "value"):
            begin += spot.prefix.rfind(".") + 1
        elif word.kind == "unit" and (match := _AFTER_NUMBER.fullmatch(spot.prefix)):
            begin += match.start("unit")
        written = word.label if quoted or word.label in ("true", "false") else f'"{word.label}"'
        items.append(Item(word, (begin, spot.whole[1]), written))
    return items


def explain(text: Text, offset: int) -> tuple[str, Span] | None:
    """Return what is known about the word at a place, as plain text, and its place."""
    begin, end = word_at(text, offset)
    spot, label = text.spot(begin), text.text[begin:end]
    if spot.role == "value" and spot.path[-1] == "is":
        begin, end = spot.whole
        label = text.text[begin:end]
    if spot.path == ("parts",) and (owner := Names(text).owner(label)):  # where it is declared
        return owner.about, (begin, end)
    about = next((word.about for word in _words(text, spot) if word.label == label and word.about), "")
    return (about, (begin, end)) if about and label else None


def _words(text: Text, spot: Spot) -> Iterable[Word]:
    if text.kind == "other":
        return ()
    if not spot.path:
        return _listed("section", _sections("sizing" if text.kind == "sizing" else "netlist"))
    if text.kind == "sizing":
        return _sizing_words(text, spot)
    return () if spot.role == "header" else _keys(text, spot) if spot.role == "key" else _values(text, spot)


@lru_cache(maxsize=2)
def _sections(kind: str) -> dict[str, str]:
    entries: dict[str, Any] = sizing_schema()["properties"] if kind == "sizing" else sections()
    return {name: entry.get("description", name) for name, entry in entries.items()}


def _listed(kind: Kind, words: Mapping[str, str]) -> Iterator[Word]:
    return (Word(label, about, kind) for label, about in words.items())


def _described(schemas: Mapping[str, Any]) -> Iterator[Word]:
    return (Word(name, f"{name}: {described(schema)}", "value") for name, schema in schemas.items())


def _keys(text: Text, spot: Spot) -> Iterator[Word]:
    (section, *path), names = spot.path, Names(text)
    before = ".".join([*path, *spot.prefix.split(".")[:-1]])
    if section == "parts" and path:
        owner = names.owner(before)
        schemas = owner.values if owner else {"is": {}, "count": {}}
        yield from _described({"is": {}, **schemas} | {"is": {"description": "type of the part"}})
    elif section in ("start", "guess", "display"):
        yield from _members(names, before, ends=False)
    elif section == "simulate":
        yield from _described(sections()["simulate"]["properties"])


def _members(names: Names, before: str, *, ends: bool) -> Iterator[Word]:
    """Yield the parts of the netlist, or what is in one of them: ends, or values."""
    if not before:
        types = ((name, names.type(kind)) for name, kind in names.parts().items())
        yield from (Word(name, owner.about if owner else "part", "part") for name, owner in types)
    elif owner := names.owner(before):
        yield from (Word(name, "part", "part") for name in owner.parts)
        yield from _listed("end", owner.ends()) if ends else _described(owner.values)


def _values(text: Text, spot: Spot) -> Iterator[Word]:
    (section, *path), names = spot.path, Names(text)
    if path[-1:] == ["is"]:
        written = text.text[slice(*spot.whole)]
        yield from (Word(name, about_type(kind), "type") for name, kind in library_types().items())
        files = (file.name for file in text.path.parent.glob("*.toml") if file.name != text.path.name)
        yield from (Word(f"./{name}", "", "type") for name in files)
        if written not in library_types() and (owner := names.type(written)):
            yield Word(written, owner.about, "type")
    elif section in ("series", "connect", "free", "expose"):
        yield from _members(names, spot.prefix.rpartition(".")[0], ends=True)
    elif section in ("parts", "start", "guess", "simulate", "parameters"):
        schema, unit = names.value(".".join(path))
        if section == "simulate":
            schema, unit = sections()["simulate"]["properties"].get(path[-1], {}), parse_unit("s")
        words = schema.get("enum", ["true", "false"] if isinstance(schema.get("default"), bool) else ())
        yield from (Word(word, schema.get("description", ""), "word") for word in words)
        yield from _units(unit, spot)
        own = path[-1] if section == "parameters" else ""
        formulas = {name: f"{name} = {value}" for name, value in names.parameters().items() if name != own}
        yield from _listed("word", formulas) if section != "simulate" and not _AFTER_NUMBER.match(spot.prefix) else ()


def _units(unit: Unit | None, spot: Spot) -> Iterator[Word]:
    if unit is not None and _AFTER_NUMBER.fullmatch(spot.prefix):
        yield from (Word(text, "", "unit") for text in units_like(unit))


def _sizing_words(text: Text, spot: Spot) -> Iterator[Word]:
    (section, *path), checks, read = spot.path, design_checks(), text.outline.read
    if section == "compare" and spot.role == "value":
        named = dict.fromkeys(path[1] for path in text.outline.by_path if path[0] == "checks" and len(path) > 1)
        yield from (Word(name, "check", "part") for name in named)
    elif section == "checks" and path[1:] == ["is"]:
        yield from (Word(name, inspect.cleandoc(check.__doc__ or ""), "type") for name, check in checks.items())
    elif section == "checks" and path and (entry := text.outline.by_path.get(("checks", path[0], "is"))):
        check = checks.get(read(entry.value))
        if check and spot.role == "key" and len(path) == 1:
            yield from _described(properties_of(check))
        elif check and spot.role == "value" and path[1] in arguments_of(check):
            yield from _units(unit_of_kind(without_none(arguments_of(check)[path[1]].kind)), spot)


def definition(text: Text, offset: int) -> Place | None:
    """Return the place of what the word at a place means: a type, a part, a parameter, a check."""
    begin, end = word_at(text, offset)
    spot, word = text.spot(begin), text.text[begin:end]
    if spot.path[-1:] == ("is",) and spot.role == "value":
        return _type_place(text, text.text[slice(*spot.whole)])
    first = re.split(r"[.\[]", spot.prefix + word)[0]
    first = spot.path[1] if spot.role == "key" and len(spot.path) > 1 else first
    paths = [("checks", word), ("parts", re.split(r"[^\w]", first)[-1]), ("parameters", word)]
    for path in paths if text.kind == "sizing" else paths[1:]:
        if (entry := text.outline.by_path.get(path)) and entry.names:
            place, stop = text.outline.inside(entry.names[-1])
            return (text.path, *text.outline.position(place), stop - place)
    return None


def _type_place(text: Text, name: str) -> Place | None:
    try:
        if text.kind == "netlist" and (name.endswith(".toml") or is_modelica(name)):
            return text.path.parent / name.partition(":")[0], 1, 1, 0
        of: Any = design_checks().get(name) if text.kind == "sizing" else find_type(name, text.path.parent)
        return (Path(inspect.getsourcefile(of) or ""), source_lines(of)[1], 1, 0) if of else None
    except (OSError, TypeError, ModelicaLikeError):
        return None  # its source is not there


@dataclass
class Symbol:
    """A section, or an entry of one, with those below it."""

    name: str
    about: str
    whole: Span
    span: Span
    inner: list[Symbol]


def symbols(text: Text) -> list[Symbol]:
    """Return the sections of a file with their entries, in their order; of very many the first."""
    tops: dict[str, Symbol] = {}
    known: set[tuple[str, str]] = set()
    for entry in text.outline.entries[:_MOST_SYMBOLS] if text.kind != "other" else ():
        name, whole = str(entry.path[0]), (entry.start, entry.end)
        first = text.outline.inside(entry.names[0]) if entry.names else whole
        top = tops.setdefault(name, Symbol(name, "", whole, first, []))
        top.whole = top.whole[0], max(top.whole[1], entry.end)
        inner = ".".join(map(str, entry.path[1:]))
        if len(entry.path) == 2 and entry.names and (name, inner) not in known:
            known.add((name, inner))
            value = text.outline.by_path.get((name, inner, "is"), entry).value
            place = text.outline.inside(entry.names[-1])
            top.inner.append(Symbol(inner, text.outline.read(value)[:80], whole, place, []))
    return [*tops.values()]
