"""Where everything stands in a TOML text: sections, keys, values, elements of lists, by position.

A reader of TOML that keeps positions, for texts that the reader of the standard library has accepted.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from modelica_like.netlist.outline import STRING

Path = tuple[str | int, ...]
"""Names of tables and keys from the top; the place in an array of tables as a number, from zero."""
Span = tuple[int, int]

_BLANK = re.compile(r"(?:[ \t\r\n\ufeff]+|#[^\n]*)*")
_NAME = re.compile(rf"[A-Za-z0-9_-]+|{STRING}", re.VERBOSE | re.DOTALL)
_SCALAR = re.compile(rf"{STRING}|[^,\]}}\#\r\n]+", re.VERBOSE | re.DOTALL)
_NOT_PLAIN = re.compile(r"[\"'\\]")
_GAP = re.compile(r"[ \t]*")


@dataclass(slots=True)
class Value:
    """A value as written, from `start` to `end`; a list has items, an inline table entries."""

    start: int
    end: int
    items: list[Value] | None = None
    entries: list[Entry] | None = None


@dataclass(slots=True)
class Entry:
    """A key with its value; `names` tells where the names of the key stand, without those of tables around it."""

    path: Path
    names: list[Span]
    value: Value
    owner: Section | Value

    @property
    def start(self) -> int:
        """Where the key begins."""
        return self.names[0][0]


@dataclass(slots=True)
class Section:
    """A table with a header, whose line goes from `start` to `end`, or what stands before the first header."""

    path: Path
    names: list[Span]
    start: int
    end: int
    entries: list[Entry] = field(default_factory=list)


@dataclass(slots=True)
class Home:
    """Where another key of a table is to be written: without its first `depth` names, behind the key `after`."""

    owner: Section | Value
    depth: int
    after: Entry | None = None


class Tree:
    """The parts of a TOML text."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.sections: list[Section] = [Section((), [], 0, 0)]
        self.entries: dict[Path, Entry] = {}
        self.homes: dict[Path, Home] = {(): Home(self.sections[0], 0)}
        self._elements: dict[Path, int] = {}
        self._at = 0
        self._read()

    def _read(self) -> None:
        while self._skip() < len(self.text):
            if self.text[self._at] == "[":
                self.sections.append(self._header())
                path = self.sections[-1].path
                self.homes[path] = Home(self.sections[-1], len(path))
            else:
                self._entry(self.sections[-1].path, self.sections[-1])

    def _skip(self) -> int:
        self._at = self._after(_BLANK)
        return self._at

    def _after(self, pattern: re.Pattern[str]) -> int:
        match = pattern.match(self.text, self._at)
        return match.end() if match else self._at

    def _header(self) -> Section:
        start = self.text.rfind("\n", 0, self._at) + 1
        is_element = self.text.startswith("[[", self._at)
        self._at += 1 + is_element
        names, spans = self._key()
        path: Path = ()
        for k, name in enumerate(names, 1):
            path = (*path, name)
            if is_element and k == len(names):
                self._elements[path] = self._elements.get(path, -1) + 1
            if path in self._elements:
                path = (*path, self._elements[path])
        end = self.text.find("\n", self._at) + 1 or len(self.text)
        self._at = end
        return Section(path, spans, start, end)

    def _key(self) -> tuple[list[str], list[Span]]:
        names: list[str] = []
        spans: list[Span] = []
        while not spans or self.text[self._at] == ".":
            self._at += bool(spans)
            start = self._at = self._after(_GAP)
            self._at = self._after(_NAME)
            spans.append((start, self._at))
            name = self.text[start : self._at]
            names.append(decoded(name) if name[0] in "\"'" else name)
            self._at = self._after(_GAP)
        return names, spans

    def _entry(self, above: Path, owner: Section | Value) -> None:
        names, spans = self._key()
        self._at += 1  # the equals sign
        self._at = self._after(_GAP)
        path = (*above, *names)
        entry = Entry(path, spans, self._value(path), owner)
        self.entries[path] = entry
        if owner.entries is not None:
            owner.entries.append(entry)
        for depth in range(len(above), len(path)):
            home = self.homes.setdefault(path[:depth], Home(owner, len(above)))
            if home.owner is owner:
                home.after = entry

    def _value(self, path: Path) -> Value:
        start, opening = self._at, self.text[self._at]
        if opening not in "[{":
            end = self._after(_SCALAR)
            self._at = start + len(self.text[start:end].rstrip())
            return Value(start, self._at)
        value = Value(start, start, [], None) if opening == "[" else Value(start, start, None, [])
        if opening == "{":
            self.homes[path] = Home(value, len(path))
        self._at += 1
        while self.text[self._skip()] not in "]}":
            if value.items is not None:
                value.items.append(self._value((*path, len(value.items))))
            else:
                self._entry(path, value)
            after = self._skip()
            self._at = after + (self.text[after] == ",")
        self._at += 1
        value.end = self._at
        return value

    # -- lines -------------------------------------------------------------------------------------------------------

    def line_start(self, position: int) -> int:
        """Return where the line of a position begins."""
        return self.text.rfind("\n", 0, position) + 1

    def line_end(self, position: int) -> int:
        """Return where the next line begins, or the text ends."""
        return self.text.find("\n", position) + 1 or len(self.text)

    def indent(self, position: int) -> str:
        """Return the blanks at the beginning of a line, if nothing else stands before a position."""
        before = self.text[self.line_start(position) : position]
        return before if before.isspace() else ""

    def has_own_lines(self, start: int, end: int) -> bool:
        """Return whether nothing but commas and comments stands beside what goes from `start` to `end`."""
        before, after = self.text[self.line_start(start) : start], self.text[end : self.line_end(end)]
        return not before.strip() and re.fullmatch(r"\s*,?\s*(#.*)?\n?", after) is not None

    def above(self, section: Section) -> int:
        """Return where the comment that stands directly above a header begins, or the header."""
        start = section.start
        while start and self.text[self.line_start(start - 1) : start].lstrip().startswith("#"):
            start = self.line_start(start - 1)
        return start

    def leaves(self, *tables: str) -> Iterator[Entry]:
        """Yield the keys in tables of the top, in their order, without those that are tables themselves."""
        for path, entry in self.entries.items():
            if path[0] in tables and len(path) > 1 and entry.value.entries is None:
                yield entry

    def string(self, value: Value) -> str:
        """Return the text that a value is."""
        return decoded(self.text[value.start : value.end])

    def is_string(self, value: Value) -> bool:
        """Return whether a value is a text."""
        return self.text[value.start] in "\"'"


def decoded(written: str) -> Any:
    """Return the value that TOML text is."""
    if written[0] in "\"'" and not _NOT_PLAIN.search(written, 1, len(written) - 1):
        return written[1:-1]  # the reader would take most of the time
    return tomllib.loads(f"x = {written}")["x"]


def joined(path: Path) -> str:
    """Return a path with dots, as messages and start values have it: `row[1].J`."""
    return "".join(f"[{name + 1}]" if isinstance(name, int) else f".{name}" for name in path).lstrip(".")
