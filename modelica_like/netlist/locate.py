"""Lines of the keys of a TOML text, which the TOML reader of the standard library does not return."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from modelica_like.errors import NetlistError, Source
from modelica_like.netlist.outline import Outline

_MAX_TEXT = 120
Path = tuple[str, ...]
"""Of a key; elements of arrays have none of their own."""


@dataclass
class Lines:
    """Places of the keys of a TOML text.

    Attributes:
        file: path of the file, for messages.
        text: its lines.
        numbers: line, counted from one, of every path of keys.
        repeated: paths that occur twice, with both lines.
        ends: last line of every statement, by the first.
        outline: all keys, with their places.
    """

    file: str
    text: list[str] = field(default_factory=list)
    numbers: dict[Path, int] = field(default_factory=dict)
    repeated: list[tuple[Path, int, int]] = field(default_factory=list)
    ends: dict[int, int] = field(default_factory=dict)
    outline: Outline = field(default_factory=lambda: Outline(""))

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
        source, known = self.source(*path), self.outline.by_path
        entry = known.get(path) or known.get((*path[:-1], *path[-1].split(".")))
        line, column = self.outline.position(entry.start) if entry else (0, 0)
        if entry is None or line != source.line:
            return source
        return replace(source, column=column, length=len(self.outline.text[entry.start : entry.end].partition("\n")[0]))

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
    keys = Outline(text)
    lines = Lines(file, text.split("\n"), outline=keys)
    if keys.deep:
        place = Source(file, keys.position(keys.deep)[0])
        raise NetlistError("Brackets or keys are nested too deeply for a netlist.", where=place)
    closed: set[Path] = set()  # tables that cannot be opened again: headers, and keys with a value
    for entry in keys.entries:
        path, number = tuple(name for name in entry.path if isinstance(name, str)), keys.position(entry.start)[0]
        if entry.is_header:
            is_element = text.startswith("[[", entry.start)
            lines.add(path, number, table=is_element or path not in closed)
            closed.add(path)
        elif entry.is_statement:
            lines.ends[number] = keys.position(entry.end)[0]
            lines.add(path, number)
            closed.add(path)
    return lines
