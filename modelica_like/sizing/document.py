"""The plain data of one sizing file: read from TOML and checked for its form."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from modelica_like.errors import ModelicaLikeError, NetlistError, Source, UnknownName, did_you_mean
from modelica_like.netlist.document import parse_toml, read_text
from modelica_like.netlist.locate import Lines, locate

_ENTRIES = ("name", "description", "parameters", "checks", "compare")


@dataclass
class SizingDocument:
    """One sizing file.

    Attributes:
        lines: where its keys stand.
        name: what it is about.
        description: one sentence.
        parameters: numbers, quantities and formulas by name.
        checks: tables with `is`, by name.
        compare: names of checks whose results stand side by side, by heading.
    """

    lines: Lines
    name: str
    description: str = ""
    parameters: dict[str, Any] = field(default_factory=dict)
    checks: dict[str, dict[str, Any]] = field(default_factory=dict)
    compare: dict[str, list[str]] = field(default_factory=dict)


def read_document(path: Path) -> SizingDocument:
    """Read a sizing file and check its form.

    Raises:
        NetlistError: the file is missing, is not TOML, or has not the form of a sizing file.
    """
    if not path.exists():
        raise NetlistError(f"The sizing file '{path}' does not exist.")
    text = read_text(path)
    lines = locate(text, str(path))
    data = parse_toml(text, lines)
    document = SizingDocument(lines, path.stem)
    for key, value in data.items():
        _entry(document, key, value)
    if not document.checks:
        raise NetlistError(f"'{path.name}' has no checks.", where=Source(str(path)), advice="Declare them in [checks].")
    return document


def _entry(document: SizingDocument, key: str, value: Any) -> None:
    place = document.lines.source(key)
    if key not in _ENTRIES:
        hint = did_you_mean(key, _ENTRIES) or "."
        raise UnknownName(f"A sizing file has no entry '{key}'{hint} It has {', '.join(_ENTRIES)}.", where=place)
    kind = str if key in ("name", "description") else dict
    if not isinstance(value, kind):
        raise NetlistError(f"{key} must be a {'text' if kind is str else f'table: [{key}]'}.", where=place)
    for name, entry in value.items() if isinstance(value, dict) else ():
        _FORMS.get(key, _any)(document, name, entry)
    setattr(document, key, value)


def _any(document: SizingDocument, name: str, entry: Any) -> None:
    pass


def _check(document: SizingDocument, name: str, entry: Any) -> None:
    place = document.lines.source("checks", name)
    if not isinstance(entry, dict):
        raise NetlistError(f"checks.{name} must be a table: [checks.{name}].", where=place)
    if not isinstance(entry.get("is"), str):
        advice = 'Say which check it is, such as is = "bearing_life".'
        raise NetlistError(f"checks.{name} has no type.", where=place, advice=advice)


def _comparison(document: SizingDocument, name: str, entry: Any) -> None:
    if not isinstance(entry, list) or not all(isinstance(check, str) for check in entry):
        place = document.lines.source("compare", name)
        raise NetlistError(f"compare.{name} must be a list of names of checks.", where=place)


_FORMS = {"checks": _check, "compare": _comparison}


def placed(error: ModelicaLikeError, source: Source) -> ModelicaLikeError:
    """Return an error with a place in the sizing file, if it does not know one there."""
    if all(known.file != source.file for known in error.where):
        error.where = (*error.where, source)
    return error
