"""Lines of the keys of a TOML text, which the TOML reader of the standard library does not return."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property

from modelica_like.errors import NetlistError, Source
from modelica_like.netlist.outline import COMMON, Outline, Path, outline

_MAX_DEPTH = 20
_MAX_TEXT = 120

_KEY = re.compile(
    rf"""{COMMON} | (?P<equals>=) | (?P<dot>\.) | (?P<space>[ \t\r]++) | (?P<word>[^"'\#\[\]{{}}\n=.\s]++)
        | (?P<other>.)""",
    re.VERBOSE | re.DOTALL,
)
_VALUE = re.compile(rf"""{COMMON} | (?P<other>[^"'\#\[\]{{}}\n]++)""", re.VERBOSE | re.DOTALL)


@dataclass
class Lines:
    """Places of the keys of a TOML text.

    Attributes:
        file: path of the file, for messages.
        text: its lines.
        numbers: line, counted from one, of every path of keys.
        repeated: paths that occur twice, with both lines.
        ends: last line of the statements that have several, by the first.
    """

    file: str
    text: list[str] = field(default_factory=list)
    numbers: dict[Path, int] = field(default_factory=dict)
    repeated: list[tuple[Path, int, int]] = field(default_factory=list)
    ends: dict[int, int] = field(default_factory=dict)

    def source(self, *path: str) -> Source:
        """Return the place of a key (a last one with dots may also be several), or of the nearest table around it."""
        wanted = ".".join(path)
        if path and path not in self.numbers:
            path = (*path[:-1], *path[-1].split("."))
        while path and path not in self.numbers:
            path = path[:-1]
        return self.line(self.numbers[path], wanted) if path else Source(self.file, path=wanted)

    def within(self, *path: str) -> Source:
        """Return the place of a key that may be in a table in braces; see `source`."""
        source, entry = self.source(*path), self.outline.entry(path)
        line, column, length = self.outline.span(entry) if entry else (0, 0, 0)
        return replace(source, column=column, length=length) if line == source.line else source

    @cached_property
    def outline(self) -> Outline:
        """All keys of the text, with their places."""
        return outline("\n".join(self.text))

    def line(self, number: int, path: str = "") -> Source:
        """Return a line as a place, with its text, and the path of a key in it."""
        if not 0 < number <= len(self.text):
            return Source(self.file, number, path=path)
        line = self.text[number - 1]
        text, column = line.strip(), len(line) - len(line.lstrip()) + 1
        statement = "\n".join(self.text[number - 1 : self.ends.get(number, number)])
        return Source(self.file, number, _shortened(text), column, len(text), path, statement)

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
    for number, end, tokens in _statements(text, lines):
        if end > number:
            lines.ends[number] = end
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


def _statements(text: str, lines: Lines) -> Iterator[tuple[int, int, list[tuple[str, str]]]]:
    """Yield first and last line of each statement, and the tokens of its header, or of its key and the `=` after it."""
    number, first, depth, position = 1, 1, 0, 0
    tokens: list[tuple[str, str]] = []
    in_value = False
    while match := (_VALUE if in_value else _KEY).match(text, position):
        kind, token = match.lastgroup or "other", match.group()
        position = match.end()
        depth = max(depth + (kind == "open") - (kind == "close"), 0)
        if kind == "newline" and depth == 0:
            if tokens:
                yield first, number, tokens
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
        yield first, number, tokens
