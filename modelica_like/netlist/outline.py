"""All keys of a TOML text with their places, also of a text that is being written and not TOML yet."""

from __future__ import annotations

import re
from bisect import bisect_right
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

_MAX_DEPTH = 20
"""Of brackets, and number of names in a key."""
Path = tuple[str, ...]
Span = tuple[int, int]
"""Begin and end in the text."""

# No possessive quantifier (`*+`) of a group: it is broken in Python before 3.11.5.
STRING = r"""(?P<string>\"{3}(?:[^"\\]++|\\.|"(?!""))*(?:\"{3,5}|\Z) | '{3}(?:[^']++|'(?!''))*(?:'{3,5}|\Z)
        |"(?:[^"\\\n]++|\\.)*"? | '[^'\n]*+'?)"""
"""A text in quotes, also one that does not end."""
_TOKEN = re.compile(
    rf"""[ \t\r.]*+(?:(?P<comment>\#[^\n]*+) | {STRING} | (?P<open>[\[{{]) | (?P<close>[\]}}]) | (?P<newline>\n)
        | (?P<equals>=) | (?P<comma>,) | (?P<word>[^"'\#\[\]{{}}\n=.,\s]++) | (?P<other>.))""",
    re.VERBOSE | re.DOTALL,
)
_NEXT = re.compile(
    r"[ \t]*+(?:[\w.\"-]++[ \t]*+=|\[{1,2}(?!true\b|false\b|inf\b|nan\b)[A-Za-z_][\w.-]*+\]{1,2}[ \t]*+$)", re.M
)
"""A line that begins a statement, though a bracket before it is still open."""


class Entry(NamedTuple):
    """A header, a key with its value, or an element of an array.

    Attributes:
        path: names, with elements of arrays by their number from zero.
        names: places of the names in the key, without quotes.
        begin: of the key, or of the element.
        value: of the value, without quotes; empty for a header, and where there is none yet.
        end: of all.
        is_header: whether it is one.
        is_statement: whether it is a key with `=`, not within braces or brackets.
    """

    path: Path
    names: tuple[Span, ...]
    begin: int
    value: Span
    end: int
    is_header: bool = False
    is_statement: bool = False


@dataclass
class Outline:
    """Keys of a text in their order.

    Attributes:
        text: all of it.
        entries: of the text, up to the place where it is nested too deeply.
        deep: this place, or zero.
    """

    text: str
    entries: list[Entry]
    deep: int = 0

    @cached_property
    def by_path(self) -> dict[Path, Entry]:
        """The first entry of each path."""
        return {entry.path: entry for entry in reversed(self.entries)}

    @cached_property
    def _begins(self) -> list[int]:
        return [0, *(match.end() for match in re.finditer("\n", self.text))]

    def position(self, offset: int) -> tuple[int, int]:
        """Return line and column, both from one."""
        line = bisect_right(self._begins, offset)
        return line, offset - self._begins[line - 1] + 1

    def offset(self, line: int, column: int) -> int:
        """Return the offset of a line and a column, both from one."""
        begin = self._begins[min(line, len(self._begins)) - 1]
        return min(begin + column - 1, len(self.text))

    def at(self, offset: int) -> list[Entry]:
        """Return the entries around a place, the innermost first."""
        return [entry for entry in reversed(self.entries) if entry.begin <= offset <= entry.end]

    def table(self, offset: int) -> Path:
        """Return the path of the last header before a place."""
        headers = (entry for entry in reversed(self.entries) if entry.is_header and entry.end <= offset)
        return next((entry.path for entry in headers), ())

    def read(self, span: Span) -> str:
        """Return the text at a place."""
        return self.text[slice(*span)]


class _Level:
    """A statement, a table in braces, or an array, and the entry that is being read there."""

    def __init__(self, kind: str, base: Path) -> None:
        self.kind = kind
        self.base = base
        self.count = 0
        self.clear()

    def clear(self) -> None:
        """Begin with the next entry."""
        self.names: list[Span] = []
        self.begin = -1
        self.end = 0
        self.valued = self.kind == "["
        self.value: list[Span] = []


class _Walk:
    """Reads a text token by token."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.entries: list[Entry] = []
        self.table: Path = ()
        self.elements: dict[Path, int] = {}
        self.levels = [_Level("", ())]
        self.header = 0
        """Brackets of a header that is being read."""

    def run(self) -> int:
        """Go through the text; return the place from which it is nested too deeply, or zero."""
        for match in _TOKEN.finditer(self.text):
            kind = match.lastgroup or "other"
            if kind == "newline":
                if len(self.levels) == 1 or self.header or _NEXT.match(self.text, match.end()):
                    self._end_statement()
            elif kind != "comment":
                level, span = self.levels[-1], match.span(kind)
                if level.begin < 0 and kind not in ("close", "comma"):
                    level.begin = span[0]
                getattr(self, f"_{kind}")(span, level)
                if max(len(self.levels), self.header, len(level.names)) > _MAX_DEPTH:
                    return span[0]
        self._end_statement()
        return 0

    def _word(self, span: Span, level: _Level) -> None:
        (level.value if level.valued else level.names).append(span)
        level.end = span[1]

    _other = _word

    def _string(self, span: Span, level: _Level) -> None:
        text = self.text[slice(*span)]
        quotes = 3 if text[:3] in ('"""', "'''") else 1
        closed = len(text) >= 2 * quotes and text.endswith(text[:quotes])
        inner = span[0] + quotes, max(span[1] - quotes * closed, span[0] + quotes)
        (level.value if level.valued else level.names).append(inner)
        level.end = span[1]

    def _equals(self, span: Span, level: _Level) -> None:
        level.valued, level.end = True, span[1]

    def _comma(self, span: Span, level: _Level) -> None:
        if level.kind:
            self._finish(level)
            level.count += 1

    def _open(self, span: Span, level: _Level) -> None:
        if not level.valued:
            self.header += 1
            return
        level.value.append(span)
        self.levels.append(_Level(self.text[span[0]], self._path(level)))

    def _close(self, span: Span, level: _Level) -> None:
        if level.kind:
            self._finish(level)
            self.levels.pop()
            level = self.levels[-1]
            level.value.append(span)
        level.end = span[1]

    def _path(self, level: _Level) -> Path:
        names = (str(level.count),) if level.kind == "[" else tuple(self.text[slice(*name)] for name in level.names)
        return (*level.base, *names)

    def _finish(self, level: _Level) -> None:
        """Store the entry of a level."""
        if level.names or level.value:
            value = (level.value[0][0], level.value[-1][1]) if level.value else (level.end, level.end)
            kinds = self.header > 0, level.valued and not level.kind
            path, names = self._path(level), tuple(level.names)
            self.entries.append(Entry(path, names, level.begin, (0, 0) if self.header else value, level.end, *kinds))
        level.clear()

    def _end_statement(self) -> None:
        while len(self.levels) > 1:
            level = self.levels.pop()
            self.levels[-1].end = max(level.end, self.levels[-1].end)
            self._finish(level)
        (level,) = self.levels
        if self.header:
            level.base = ()
            table = self._path(level)
            if self.header > 1:
                self.elements[table] = self.elements.get(table, -1) + 1
                table = (*table, str(self.elements[table]))
            self._finish(level)
            level.base = table
        self._finish(level)
        self.header = 0


def outline(text: str) -> Outline:
    """Return the keys of a text, which need not be TOML."""
    walk = _Walk(text)
    deep = walk.run()
    return Outline(text, sorted(walk.entries, key=lambda entry: entry.begin), deep)
