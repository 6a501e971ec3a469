"""Lines of the keys of a TOML text, which the TOML reader of the standard library does not return."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

from modelica_like.errors import NetlistError, Source

_MAX_DEPTH = 20
_MAX_TEXT = 120
Path = tuple[str, ...]

# No possessive quantifier (`*+`) of a group: it is broken in Python before 3.11.5.
STRING = r"""(?P<string>\"{3}(?:[^"\\]++|\\.|"(?!""))*(?:\"{3,5}|\Z) | '{3}(?:[^']++|'(?!''))*(?:'{3,5}|\Z)
        |"(?:[^"\\\n]++|\\.)*"? | '[^'\n]*+'?)"""
"""A text in quotes, also one that does not end."""
_COMMON = rf"""(?P<comment>\#[^\n]*+) | {STRING} | (?P<open>[\[{{]) | (?P<close>[\]}}]) | (?P<newline>\n)"""
_KEY = re.compile(
    rf"""{_COMMON} | (?P<equals>=) | (?P<dot>\.) | (?P<space>[ \t\r]++) | (?P<word>[^"'\#\[\]{{}}\n=.\s]++)
        | (?P<other>.)""",
    re.VERBOSE | re.DOTALL,
)
_VALUE = re.compile(rf"""{_COMMON} | (?P<other>[^"'\#\[\]{{}}\n]++)""", re.VERBOSE | re.DOTALL)


@dataclass
class Lines:
    """Places of the keys of a TOML text.

    Attributes:
        file: path of the file, for messages.
        text: its lines.
        numbers: line, counted from one, of every path of keys.
        repeated: paths that occur twice, with both lines.
    """

    file: str
    text: list[str] = field(default_factory=list)
    numbers: dict[Path, int] = field(default_factory=dict)
    repeated: list[tuple[Path, int, int]] = field(default_factory=list)

    def source(self, *path: str) -> Source:
        """Return the place of a key (a last one with dots may also be several), or of the nearest table around it."""
        if path and path not in self.numbers:
            path = (*path[:-1], *path[-1].split("."))
        while path and path not in self.numbers:
            path = path[:-1]
        return self.line(self.numbers[path]) if path else Source(self.file)

    def line(self, number: int) -> Source:
        """Return a line as a place, with its text."""
        exists = 0 < number <= len(self.text)
        return Source(self.file, number, _shortened(self.text[number - 1].strip()) if exists else "")

    def add(self, path: Path, number: int, *, table: bool = False) -> None:
        """Store a key.

        Args:
            path: its names.
            number: of the line.
            table: whether it may occur again, as part of the names of its keys.
        """
        if not path:  # not TOML: it has no key
            return
        if path in self.numbers and not table:
            self.repeated.append((path, self.numbers[path], number))
        self.numbers.setdefault(path, number)
        for length in range(1, len(path)):
            self.numbers.setdefault(path[:length], number)


def _shortened(text: str) -> str:
    text = "".join(character if character.isprintable() else " " for character in text)
    return text if len(text) <= _MAX_TEXT else text[: _MAX_TEXT - 3] + "..."


def locate(text: str, file: str) -> Lines:
    """Find the lines of all keys; the text need not be valid TOML.

    Raises:
        NetlistError: brackets or keys are nested too deeply.
    """
    lines = Lines(file, text.split("\n"))
    table: Path = ()
    closed: set[Path] = set()  # tables that cannot be opened again: headers, and keys with a value
    for number, tokens in _statements(text, lines):
        kinds = [kind for kind, _ in tokens]
        if kinds[:1] == ["open"]:
            table = _keys(tokens)
            is_element = kinds[:2] == ["open", "open"]
            lines.add(table, number, table=is_element or table not in closed)
            closed.add(table)
        elif kinds[-1:] == ["equals"]:
            path = (*table, *_keys(tokens))
            lines.add(path, number)
            closed.add(path)
    return lines


def _keys(tokens: list[tuple[str, str]]) -> Path:
    return tuple(text.strip("\"'") for kind, text in tokens if kind in ("word", "string"))


def _statements(text: str, lines: Lines) -> Iterator[tuple[int, list[tuple[str, str]]]]:
    """Yield the first line of each statement with the tokens of its header, or of its key and the `=` after it."""
    number, first, depth, position = 1, 1, 0, 0
    tokens: list[tuple[str, str]] = []
    in_value = False
    while match := (_VALUE if in_value else _KEY).match(text, position):
        kind, token = match.lastgroup or "other", match.group()
        position = match.end()
        depth = max(depth + (kind == "open") - (kind == "close"), 0)
        if kind == "newline" and depth == 0:
            if tokens:
                yield first, tokens
            tokens, in_value = [], False
        elif not in_value and kind not in ("space", "comment", "newline"):
            first = first if tokens else number
            tokens.append((kind, token))
            in_value = kind == "equals"
        if depth > _MAX_DEPTH or len(tokens) > 2 * _MAX_DEPTH:
            raise NetlistError(
                "Brackets or keys are nested too deeply for a netlist.", where=Source(lines.file, number)
            )
        number += token.count("\n")
    if tokens:
        yield first, tokens
