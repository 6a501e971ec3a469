"""All keys of a TOML text with their places, also of a text that is being written and not TOML yet."""

from __future__ import annotations

import re
import tomllib
from bisect import bisect_right
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

_MAX_DEPTH = 20
"""Of brackets, and number of names in a key."""
Path = tuple[str | int, ...]
"""Names of tables and keys from the top; the place in an array as a number, from zero."""
Span = tuple[int, int]
"""Begin and end in the text."""

# No possessive quantifier (`*+`) of a group: it is broken in Python before 3.11.5.
_STRING = r"""(?P<string>\"{3}(?:[^"\\]++|\\.|"(?!""))*(?:\"{3,5}|\Z) | '{3}(?:[^']++|'(?!''))*(?:'{3,5}|\Z)
        |"(?:[^"\\\n]++|\\.)*"? | '[^'\n]*+'?)"""
"""A text in quotes, also one that does not end."""
_TOKEN = re.compile(
    rf"""[ \t\r.\ufeff]*+(?:(?P<comment>\#[^\n]*+) | {_STRING} | (?P<open>[\[{{]) | (?P<close>[\]}}]) | (?P<newline>\n)
        | (?P<equals>=) | (?P<comma>,) | (?P<word>[^"'\#\[\]{{}}\n=.,\s]++) | (?P<other>.))""",
    re.VERBOSE | re.DOTALL,
)
_NEXT = re.compile(
    r"""[ \t]*+(?:(?:[\w.-]|"[^"\n]*+"|'[^'\n]*+')+[ \t]*+=
        |\[{1,2}(?!true\b|false\b|inf\b|nan\b)[A-Za-z_][\w.-]*+\]{1,2}[ \t]*+$)""",
    re.M | re.VERBOSE,
)
"""A line that begins a statement, though a bracket before it is still open."""
_NOT_PLAIN = re.compile(r"[\"'\\]")


@dataclass(slots=True, eq=False)
class Value:
    """A value as written, from `start` to `end`; a list has items, a table in braces entries."""

    start: int
    end: int
    items: list[Value] | None = None
    entries: list[Entry] | None = None


@dataclass(slots=True, eq=False)
class Entry:
    """A key with its value, an element of an array, or a header.

    Attributes:
        path: all names.
        names: places of the names in the key, with their quotes.
        start: of the key, or of the element.
        end: of all.
        value: empty where there is none yet.
        owner: where the key stands.
    """

    path: Path
    names: list[Span]
    start: int
    end: int
    value: Value
    owner: Section | Value

    @property
    def is_header(self) -> bool:
        """Whether it is one; its path has no number at the end."""
        return isinstance(self.owner, Section) and self.names is self.owner.names

    @property
    def is_statement(self) -> bool:
        """Whether it is a key with `=`, not within braces or brackets."""
        return isinstance(self.owner, Section) and bool(self.names) and self.value.start > self.names[-1][1]


@dataclass(slots=True, eq=False)
class Section:
    """A table with a header, or what stands before the first header.

    Attributes:
        path: its names.
        names: their places.
        start: of the line of the header.
        end: of this line, with its break.
        entries: keys of the table.
    """

    path: Path = ()
    names: list[Span] = field(default_factory=list[Span])
    start: int = 0
    end: int = 0
    entries: list[Entry] = field(default_factory=list[Entry])


class Outline:
    """The keys of a text, which need not be TOML, in their order.

    Args:
        text: all of it.

    Attributes:
        entries: of the text, up to the place where it is nested too deeply.
        sections: of the text; the first has no header.
        deep: this place, or zero.
    """

    def __init__(self, text: str) -> None:
        self.text = text
        walk = _Walk(text)
        self.deep = walk.run()
        self.entries = sorted(walk.entries, key=lambda entry: entry.start)
        self.sections = walk.sections

    @cached_property
    def by_path(self) -> dict[tuple[str, ...], Entry]:
        """The first entry of each path, with numbers as texts."""
        return {tuple(map(str, entry.path)): entry for entry in reversed(self.entries)}

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
        return [entry for entry in reversed(self.entries) if entry.start <= offset <= entry.end]

    def table(self, offset: int) -> Path:
        """Return the path of the last header before a place."""
        headers = (entry.owner for entry in reversed(self.entries) if entry.is_header and entry.end <= offset)
        return next((section.path for section in headers if isinstance(section, Section)), ())

    def inside(self, place: Span | Value) -> Span:
        """Return the place of a name or a value without its quotes, of which the last may be missing."""
        begin, end = (place.start, place.end) if isinstance(place, Value) else place
        quote = self.text[begin:end][:1]
        if quote not in ('"', "'"):
            return begin, end
        width = 3 if self.text.startswith(3 * quote, begin, end) else 1
        is_closed = end - begin >= 2 * width and self.text.endswith(width * quote, begin, end)
        return begin + width, max(end - width * is_closed, begin + width)

    def read(self, place: Span | Value) -> str:
        """Return the text at a place, without quotes."""
        return self.text[slice(*self.inside(place))]


class _Level:
    """A statement, a table in braces, or an array, and the entry that is being read there."""

    def __init__(self, kind: str, base: Path, owner: Section | Value) -> None:
        self.kind = kind
        self.base = base
        self.owner = owner
        self.count = 0
        self.clear()

    def clear(self) -> None:
        """Begin with the next entry."""
        self.names: list[Span] = []
        self.begin = -1
        self.end = 0
        self.valued = self.kind == "["
        self.value: Value | None = None


class _Walk:
    """Reads a text token by token."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.entries: list[Entry] = []
        self.sections = [Section()]
        self.elements: dict[Path, int] = {}
        self.levels = [_Level("", (), self.sections[0])]
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
        level.end = span[1]
        if not level.valued:
            level.names.append(span)
        elif level.value is None:
            level.value = Value(*span)
        else:
            level.value.end = span[1]

    _other = _string = _word

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
        self._word(span, level)
        kind, value = self.text[span[0]], level.value or Value(*span)
        value.items, value.entries = ([], None) if kind == "[" else (None, [])
        self.levels.append(_Level(kind, self._path(level), value))

    def _close(self, span: Span, level: _Level) -> None:
        if level.kind:
            self._finish(level)
            self.levels.pop()
            self._word(span, self.levels[-1])
        level.end = span[1]

    def _path(self, level: _Level) -> Path:
        names = (level.count,) if level.kind == "[" else map(self._name, level.names)
        return (*level.base, *names)

    def _name(self, span: Span) -> str:
        written = self.text[slice(*span)]
        if written[0] not in "\"'":
            return written
        try:
            return decoded(written)
        except tomllib.TOMLDecodeError:
            return written.strip(written[0])

    def _finish(self, level: _Level) -> None:
        """Store the entry of a level."""
        if level.names or level.value:
            value = level.value or Value(level.end, level.end)
            entry = Entry(self._path(level), level.names, level.begin, level.end, value, level.owner)
            self.entries.append(entry)
            if level.kind != "[" and level.owner.entries is not None:
                level.owner.entries.append(entry)
            elif isinstance(level.owner, Value) and level.owner.items is not None:
                level.owner.items.append(value)
        level.clear()

    def _end_statement(self) -> None:
        while len(self.levels) > 1:
            level = self.levels.pop()
            self.levels[-1].end = max(level.end, self.levels[-1].end)
            self._finish(level)
        (level,) = self.levels
        if self.header and level.names:
            self._end_header(level)
        else:
            self._finish(level)
        self.header = 0

    def _end_header(self, level: _Level) -> None:
        named: Path = ()
        path = named
        for k, name in enumerate(map(self._name, level.names), 1):
            named = path = (*path, name)
            if self.header > 1 and k == len(level.names):
                self.elements[path] = self.elements.get(path, -1) + 1
            if path in self.elements:
                path = (*path, self.elements[path])
        end = self.text.find("\n", level.end) + 1 or len(self.text)
        section = Section(path, level.names, self.text.rfind("\n", 0, level.begin) + 1, end)
        self.sections.append(section)
        self.entries.append(Entry(named, level.names, level.begin, level.end, Value(0, 0), section))
        level.clear()
        level.base, level.owner = path, section


def decoded(written: str) -> Any:
    """Return the value that TOML text is."""
    if written[0] in "\"'" and not _NOT_PLAIN.search(written, 1, len(written) - 1):
        return written[1:-1]  # the reader would take most of the time
    return tomllib.loads(f"x = {written}")["x"]
