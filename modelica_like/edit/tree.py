"""Where everything stands in a netlist that is edited: sections, keys, values, elements of lists."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from modelica_like.netlist.outline import Entry, Outline, Path, Section, Value, decoded


@dataclass(slots=True)
class Home:
    """Where another key of a table is to be written: without its first `depth` names, behind the key `after`."""

    owner: Section | Value
    depth: int
    after: Entry | None = None


class Tree:
    """The parts of a TOML text.

    Args:
        outline: of a text that is TOML.

    Attributes:
        sections: tables with a header, behind what stands before the first.
        entries: keys by path.
        homes: where keys are added, by path of the table.
    """

    def __init__(self, outline: Outline) -> None:
        self.text = outline.text
        self.sections = outline.sections
        self.entries: dict[Path, Entry] = {}
        self.homes = {section.path: Home(section, len(section.path)) for section in self.sections}
        for entry in outline.entries:
            path = entry.path
            if entry.value.entries is not None:
                self.homes[path] = Home(entry.value, len(path))
            if entry.names and not entry.is_header:
                self.entries[path] = entry
                self._enter(entry)

    def _enter(self, entry: Entry) -> None:
        above = len(entry.path) - len(entry.names)
        for depth in range(above, len(entry.path)):
            home = self.homes.setdefault(entry.path[:depth], Home(entry.owner, above))
            if home.owner is entry.owner:
                home.after = entry

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


def joined(path: Path) -> str:
    """Return a path with dots, as messages and start values have it: `row[1].J`."""
    return "".join(f"[{name + 1}]" if isinstance(name, int) else f".{name}" for name in path).lstrip(".")
