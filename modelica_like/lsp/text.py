"""A text that is being written: what kind of file it is, and what stands at a place in it."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path as File
from typing import Literal

from modelica_like.netlist.json_schema import sections
from modelica_like.netlist.outline import Entry, Outline, Path, Span

_SIZING = ("name", "description", "parameters", "checks", "compare")
_IN_PATH = re.compile(r"[\w.*-]")


@dataclass(frozen=True)
class Spot:
    """What is written at a place.

    Attributes:
        role: the name of a section, a key, or a value.
        path: of the table around a key, or of the value; a new element of an array has the number `+`.
        prefix: what stands before the place.
        whole: place of the name or value, also behind the place asked for.
        begin: of the prefix.
    """

    role: Literal["header", "key", "value"]
    path: tuple[str, ...]
    prefix: str
    whole: Span
    begin: int


class Text:
    """A file as an editor shows it.

    Args:
        path: of the file.
        text: all of it.
    """

    def __init__(self, path: File, text: str) -> None:
        self.path = path
        self.text = text.removeprefix("\ufeff").replace("\r\n", "\n")

    @cached_property
    def outline(self) -> Outline:
        """Its keys."""
        return Outline(self.text)

    @cached_property
    def lines(self) -> list[str]:
        """Its lines."""
        return self.text.split("\n")

    @cached_property
    def kind(self) -> Literal["netlist", "sizing", "new", "other"]:
        """Whether it is a netlist, a sizing file, the begin of one, or none of these."""
        names = {str(entry.path[0]) for entry in self.outline.entries}
        if "parts" in names or "checks" in names:
            return "netlist" if "parts" in names else "sizing"
        # The last one may not be complete.
        known = (*sections(), *_SIZING)
        return "new" if all(any(word.startswith(name) for word in known) for name in names) else "other"

    def spot(self, offset: int) -> Spot:
        """Return what stands at a place."""
        before = len(self.text[:offset].rstrip(" \t"))
        for entry in self.outline.entries if self.text[before - 1 : before] == "=" else ():
            if entry.end == before:
                return Spot("value", _words(entry.path), "", (offset, offset), offset)
        for entry in self.outline.at(offset):
            if spot := self._within(entry, offset):
                return spot
        begin = offset
        while begin and _IN_PATH.match(self.text[begin - 1]):
            begin -= 1
        if self.text[:begin].endswith("["):
            return Spot("header", (), self.text[begin:offset], (begin, offset), begin)
        return Spot("key", _words(self.outline.table(offset)), self.text[begin:offset], (begin, offset), begin)

    def _within(self, entry: Entry, offset: int) -> Spot | None:
        """Return what stands at a place in an entry; None if that is behind a comma, or between names."""
        path = _words(entry.path)
        for k, (begin, end) in enumerate(map(self.outline.inside, entry.names)):
            if begin <= offset <= end:
                table = path[: len(path) - len(entry.names) + k]
                role = "header" if entry.is_header else "key"
                return Spot(role, table, self.text[begin:offset], (begin, end), begin)
        value = entry.value
        begin, end = self.outline.inside(value)
        if not begin or not begin <= offset <= end:
            return None
        if value.items is None and value.entries is None:
            return Spot("value", path, self.text[begin:offset], (begin, end), begin)
        closed = end > begin + 1 and self.text[end - 1] in "]}"
        if not begin < offset < end + (not closed):
            return None
        if value.items is None:
            return Spot("key", path, "", (offset, offset), offset)
        return Spot("value", (*path, "+"), "", (offset, offset), offset)


def _words(path: Path) -> tuple[str, ...]:
    return tuple(map(str, path))


def word_at(text: Text, offset: int) -> Span:
    """Return the place of the name around a place."""
    begin = end = offset
    while begin and re.match(r"\w", text.text[begin - 1]):
        begin -= 1
    while end < len(text.text) and re.match(r"\w", text.text[end]):
        end += 1
    return begin, end
