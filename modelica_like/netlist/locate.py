"""Lines of the keys of a TOML text, which the TOML reader of the standard library does not tell."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

from modelica_like.errors import NetlistError, Source

_MAX_DEPTH = 20
_MAX_TEXT = 120
Path = tuple[str, ...]

_TOKEN = re.compile(
    r"""(?P<comment>\#[^\n]*)
    |(?P<string>\"{3}(?:[^"\\]|\\.|"(?!""))*+(?:\"{3,5}|\Z) | '{3}(?:[^']|'(?!''))*+(?:'{3,5}|\Z)
        |"(?:[^"\\\n]|\\.)*+"? | '[^'\n]*+'?)
    |(?P<open>[\[{]) | (?P<close>[\]}]) | (?P<newline>\n) | (?P<equals>=) | (?P<comma>,) | (?P<dot>\.)
    |(?P<word>[^\s"'\#\[\]{}=,.]+) | (?P<space>[ \t\r\f\v]+) | (?P<other>.)""",
    re.VERBOSE | re.DOTALL,
)


@dataclass
class Lines:
    """Where each key of a TOML text stands.

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
        known = 0 < number <= len(self.text)
        return Source(self.file, number, _shortened(self.text[number - 1].strip()) if known else "")

    def add(self, path: Path, number: int, *, table: bool = False) -> None:
        """Remember a key; a table may be mentioned more than once, as part of the names of its keys."""
        if path in self.numbers and not table:
            self.repeated.append((path, self.numbers[path], number))
        self.numbers.setdefault(path, number)
        for length in range(1, len(path)):
            self.numbers.setdefault(path[:length], number)


def _shortened(text: str) -> str:
    text = "".join(character if character.isprintable() else " " for character in text)
    return text if len(text) <= _MAX_TEXT else text[: _MAX_TEXT - 3] + "..."


def locate(text: str, file: str) -> Lines:
    """Find the lines of all keys; the text need not be right TOML.

    Raises:
        NetlistError: brackets or keys are nested deeper than any netlist is.
    """
    lines = Lines(file, text.split("\n"))
    table: Path = ()
    tables: set[Path] = set()
    for number, tokens in _statements(text, lines):
        kinds = [kind for kind, _ in tokens]
        if kinds[:1] == ["open"]:
            table = _keys(tokens)
            is_element = kinds[:2] == ["open", "open"]
            lines.add(table, number, table=is_element or table not in tables)
            tables.add(table)
        elif "equals" in kinds:
            _add_assignment(lines, table, tokens, number)
    return lines


def _add_assignment(lines: Lines, table: Path, tokens: list[tuple[str, str]], number: int) -> None:
    """Remember the key of `key = value`, and the keys of a value `{ key = value, ... }` on the same line."""
    equals = [index for index, (kind, _) in enumerate(tokens) if kind == "equals"]
    outer = (*table, *_keys(tokens[: equals[0]]))
    lines.add(outer, number)
    seen: set[Path] = set()
    depth = 0
    for index, (kind, _) in enumerate(tokens):
        depth += (kind == "open") - (kind == "close")
        if depth != 1 or kind != "equals" or tokens[equals[0] + 1][1] != "{":
            continue
        start = max(k for k in range(index) if tokens[k][0] in ("open", "comma"))
        inner = _keys(tokens[start + 1 : index])
        if inner in seen:
            lines.repeated.append(((*outer, *inner), number, number))
        seen.add(inner)


def _keys(tokens: list[tuple[str, str]]) -> Path:
    return tuple(text.strip("\"'") for kind, text in tokens if kind in ("word", "string"))


def _statements(text: str, lines: Lines) -> Iterator[tuple[int, list[tuple[str, str]]]]:
    """Yield the first line and the tokens of each statement: a header or an assignment."""
    number, first, depth, dots = 1, 1, 0, 0
    tokens: list[tuple[str, str]] = []
    for match in _TOKEN.finditer(text):
        kind, token = match.lastgroup or "other", match.group()
        if kind in ("space", "comment"):
            continue
        depth = max(depth + (kind == "open") - (kind == "close"), 0)
        dots = dots + 1 if kind == "dot" else dots if kind in ("word", "string") else 0
        if max(depth, dots) > _MAX_DEPTH:
            raise NetlistError("Brackets or keys are nested too deep for a netlist.", where=Source(lines.file, number))
        if kind == "newline" and depth == 0:
            if tokens:
                yield first, tokens
            tokens = []
        elif kind != "newline":
            first = first if tokens else number
            tokens.append((kind, token))
        number += token.count("\n")
    if tokens:
        yield first, tokens
