"""Spelling of values and names in TOML: blanks inside of braces, quotes where TOML needs them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, cast

from modelica_like.errors import NetlistError

_BARE = re.compile(r"[A-Za-z0-9_-]+")
_ESCAPES = {"\b": r"\b", "\t": r"\t", "\n": r"\n", "\f": r"\f", "\r": r"\r", '"': r"\"", "\\": r"\\"}
_SPECIAL = re.compile(r'[\x00-\x1f\x7f"\\]')
_SURROGATE = re.compile(r"[\ud800-\udfff]")


def key(*names: str) -> str:
    """Return names as a key, joined by dots; those that are no bare keys of TOML stand in quotes."""
    return ".".join(name if _BARE.fullmatch(name) else quoted(name) for name in names)


def quoted(text: str, like: str = "") -> str:
    """Return a text in quotes.

    Args:
        text: to be quoted.
        like: another text as written: its single quotes are used if they can be.

    Raises:
        NetlistError: no file can hold one of its characters.
    """
    if _SURROGATE.search(text):
        raise NetlistError(f"{text!r} has half of a character, which no file can hold.")
    if like.startswith("'") and "'" not in text and not _SPECIAL.search(text.replace('"', "").replace("\\", "")):
        return f"'{text}'"
    return '"' + _SPECIAL.sub(lambda match: _ESCAPES.get(match.group(), f"\\u{ord(match.group()):04x}"), text) + '"'


def value(entry: Any, like: str = "") -> str:
    """Return a number, a text, a list or a table as TOML.

    Args:
        entry: plain data.
        like: what stood there before, as written.
    """
    if isinstance(entry, str):
        return quoted(entry, like)
    if isinstance(entry, bool):
        return "true" if entry else "false"
    if isinstance(entry, Mapping):
        pairs = cast("Mapping[str, Any]", entry).items()
        return "{ " + ", ".join(f"{key(name)} = {value(inner)}" for name, inner in pairs) + " }" if pairs else "{}"
    if isinstance(entry, list):
        items = cast("list[Any]", entry)
        if items and isinstance(items[0], dict):
            return "[\n" + "".join(f"    {value(item)},\n" for item in items) + "]"
        return f"[{', '.join(map(value, items))}]"
    # Numbers of NumPy are subclasses that are written otherwise.
    return int.__repr__(entry) if isinstance(entry, int) else float.__repr__(entry)


def document(sections: Mapping[str, Mapping[str, Any]]) -> str:
    """Return sections that have entries as TOML; what stands at the top has the name ""."""
    texts: list[str] = []
    for name, entries in sections.items():
        lines = "".join(f"{key(inner)} = {value(entry)}\n" for inner, entry in entries.items())
        texts += [f"[{key(name)}]\n{lines}" if name else lines] if entries else []
    return "\n".join(texts)
