"""The plain data of one sizing file: read from TOML and checked for its form."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from modelica_like.errors import ModelicaLikeError, NetlistError, Source, raise_together_or_one
from modelica_like.netlist.document import parse_toml, read_text
from modelica_like.netlist.locate import Lines, locate
from modelica_like.netlist.sections import Reader, as_text, each, read_sections, whole


@dataclass
class SizingDocument:
    """One sizing file: parameters, tables of checks, and names of checks to compare, by heading."""

    lines: Lines
    name: str
    description: str = ""
    parameters: dict[str, Any] = field(default_factory=dict)
    checks: dict[str, dict[str, Any]] = field(default_factory=dict)
    compare: dict[str, list[str]] = field(default_factory=dict)


def read_document(path: Path) -> SizingDocument:
    """Read a sizing file and check its form."""
    if not path.exists():
        raise NetlistError(f"The sizing file '{path}' does not exist.")
    return parse_document(read_text(path), path)


def parse_document(text: str, path: Path) -> SizingDocument:
    """Read the text of a sizing file and check its form."""
    lines = locate(text, str(path))
    errors: list[ModelicaLikeError] = []
    sections = read_sections(parse_toml(text, lines), "A sizing file", _READERS, lines, errors)
    if errors:
        raise raise_together_or_one(errors)
    document = SizingDocument(lines, **{"name": path.stem, **sections})
    if not document.checks:
        raise NetlistError(f"'{path.name}' has no checks.", where=Source(str(path)), advice="Declare them in [checks].")
    return document


def _check(key: str, entry: Any) -> dict[str, Any]:
    if not isinstance(entry, dict):
        raise NetlistError(f"{key} must be a table: [{key}].")
    if not isinstance(entry.get("is"), str):
        raise NetlistError(f"{key} has no type.", advice='Say which check it is, such as is = "bearing_life".')
    return entry


def _comparison(key: str, entry: Any) -> list[str]:
    if not isinstance(entry, list) or not all(isinstance(check, str) for check in entry):
        raise NetlistError(f"{key} must be a list of names of checks.")
    return entry


_READERS: Mapping[str, Reader] = {
    "name": whole(as_text), "description": whole(as_text), "parameters": each(lambda _, value: value),
    "checks": each(_check), "compare": each(_comparison),
}  # fmt: skip


def placed(error: ModelicaLikeError, source: Source) -> ModelicaLikeError:
    """Return an error with a place in the sizing file, if it has none there."""
    if all(place.file != source.file for place in error.where):
        error.where = (*error.where, source)
    return error
