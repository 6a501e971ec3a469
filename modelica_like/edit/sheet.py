"""The text of a netlist with changes to it: only what a change names is written anew."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from itertools import groupby
from pathlib import Path as File
from typing import Any

from modelica_like.edit.tree import Tree, joined
from modelica_like.errors import Source
from modelica_like.netlist import spell
from modelica_like.netlist.document import parse_toml, plain
from modelica_like.netlist.locate import Lines, locate
from modelica_like.netlist.outline import Entry, Outline, Path, Section, Value

_ORDER = ("parameters", "parts", "series", "connect", "expose", "start", "guess", "simulate", "display")
"""Sections, as they follow each other in a new netlist."""


class Sheet:
    """A netlist's text with its changes, which `commit` makes all at once."""

    def __init__(self, text: str, file: str, files: Mapping[File, str] | None = None) -> None:
        self.file = file
        self.files = dict(files or {})
        self.notes: list[str] = []
        self._reset(text)

    def _reset(self, text: str) -> None:
        self.text = text
        self._changes: list[tuple[int, int, str]] = []
        self._sections: dict[str, list[str]] = {}
        for name in ("lines", "data", "tree", "given"):
            self.__dict__.pop(name, None)
        _ = self.data  # what is not TOML has no tree

    @cached_property
    def lines(self) -> Lines:
        """Lines of the keys."""
        return locate(plain(self.text), self.file)

    @cached_property
    def data(self) -> dict[str, Any]:
        """Plain data of the text."""
        return parse_toml(plain(self.text), self.lines)

    @cached_property
    def tree(self) -> Tree:
        """Positions in the text."""
        outline = self.lines.outline  # of the text as it is read
        return Tree(outline if outline.text == self.text else Outline(self.text))

    @cached_property
    def given(self) -> dict[tuple[str, str], Path]:
        """Keys by section and path in it; those of the whole text have the section ""."""
        paths = {(str(path[0]), joined(path[1:])): path for path in self.tree.entries}
        return paths | {("", joined(path)): path for path in self.tree.entries}

    def table(self, name: str) -> dict[str, Any]:
        """Return a section, empty if there is none or it is no table."""
        table = self.data.get(name)
        return table if isinstance(table, dict) else {}

    def source(self, path: Path) -> Source:
        """Return the line of a key."""
        return self.lines.source(*(str(name) for name in path if isinstance(name, str)))

    @property
    def _break(self) -> str:
        return "\r\n" if "\r\n" in self.text else "\n"

    def change(self, start: int, end: int, text: str) -> None:
        """Replace a piece of the text by another."""
        self._changes.append((start, end, text))

    def commit(self) -> None:
        """Make all changes."""
        for name, lines in self._sections.items():
            self._add_section(name, lines)
        if not self._changes:
            return
        pieces: list[str] = []
        position = 0
        for start, end, text in sorted(self._changes, key=lambda change: change[:1]):
            pieces += [self.text[position:start], text.replace("\n", self._break)]
            position = max(position, end)
        self._reset("".join([*pieces, self.text[position:]]))

    # -- values ------------------------------------------------------------------------------------------------------

    def write(self, path: Path, value: Any) -> None:
        """Give a key another value, or write it where its table stands."""
        entry = self.tree.entries.get(path)
        old = self.text[entry.value.start : entry.value.end] if entry else ""
        self.put(path, spell.value(value, like=old))

    def put(self, path: Path, text: str) -> None:
        """Write a value as text; see `write`."""
        if (entry := self.tree.entries.get(path)) is not None:
            self.change(entry.value.start, entry.value.end, text)
        else:
            self._insert(path, text)

    def _insert(self, path: Path, value: str) -> None:
        depth = next(d for d in range(len(path) - 1, -1, -1) if path[:d] in self.tree.homes)
        home = self.tree.homes[path[:depth]]
        if depth == 0 and len(path) > 1:
            line = f"{spell.key(*map(str, path[1:]))} = {value}\n"
            self._sections.setdefault(str(path[0]), []).append(line)
            return
        pair = f"{spell.key(*map(str, path[home.depth :]))} = {value}"
        if isinstance(home.owner, Section):
            self._insert_line(home.owner, home.after, pair)
        elif home.after is None:
            self.change(home.owner.start, home.owner.end, f"{{ {pair} }}")
        else:
            self.change(home.after.value.end, home.after.value.end, f", {pair}")

    def _insert_line(self, section: Section, after: Entry | None, line: str) -> None:
        if after is not None:
            position = self.tree.line_end(after.value.end)
            line = self.tree.indent(after.start) + line
        elif not section.path and len(self.tree.sections) > 1:
            position = self.tree.above(self.tree.sections[1]) or self.tree.sections[1].start  # a file's first comment
            line += "" if self.text[position : position + 1] == "\n" else "\n"
        else:
            position = section.end or len(self.text)
        self._put_lines(position, line + "\n")

    def _put_lines(self, position: int, lines: str) -> None:
        is_open = 0 < position == len(self.text) and not self.text.endswith("\n")
        self.change(position, position, f"\n{lines[:-1]}" if is_open else lines)

    def _add_section(self, name: str, lines: Sequence[str]) -> None:
        rank = _ORDER.index(name) if name in _ORDER else len(_ORDER)
        later = (s for s in self.tree.sections[1:] if s.path[0] in _ORDER and _ORDER.index(str(s.path[0])) >= rank)
        following = next(later, None)
        position = len(self.text) if following is None else self.tree.above(following)
        before = self.text[:position].rstrip(" \t\r")
        text = f"[{spell.key(name)}]\n{''.join(lines)}"
        gap = "\n" if before.strip("\ufeff") and not before.endswith(("\n\n", "\n\r\n")) else ""
        self._put_lines(position, gap + text + ("" if following is None else "\n"))

    def put_behind(self, path: Path, lines: str) -> None:
        """Write lines behind those of the key at a path, or behind its table and what is in it, as other tables."""
        sections = [section for section in self.tree.sections if section.path[: len(path)] == path]
        if sections:
            last = sections[-1].entries[-1] if sections[-1].entries else None
        else:
            last = self.tree.entries.get(path) or self.tree.homes[path].after
        end = last.value.end if last else sections[-1].end - 1
        self._put_lines(self.tree.line_end(end), "\n" + lines if sections else lines)

    # -- removals ----------------------------------------------------------------------------------------------------

    def delete(self, paths: Iterable[Path]) -> None:
        """Remove keys and tables; comments on lines of their own stay, except between the lines of a table."""
        gone = set(paths)

        def depth(path: Path) -> int:
            """Return the length of the path that goes with this one, zero if none does."""
            return next((length for length in range(1, len(path) + 1) if path[:length] in gone), 0)

        for section in self.tree.sections:
            if depth(section.path):
                self._delete_section(section)
        by_owner: dict[int, list[Entry]] = {}
        for path, entry in self.tree.entries.items():
            length = depth(path)
            around = any(path[:k] in self.tree.entries for k in range(length, len(path)))
            if length and not around and not (isinstance(entry.owner, Section) and depth(entry.owner.path)):
                by_owner.setdefault(id(entry.owner), []).append(entry)
        for entries in by_owner.values():
            self._delete_entries(entries)

    def _delete_section(self, section: Section) -> None:
        end = section.end
        if section.entries:
            end = self.tree.line_end(section.entries[-1].value.end)
        following = self.tree.line_end(end)
        is_blank = end < len(self.text) and not self.text[end:following].strip()
        self.change(section.start, following if is_blank else end, "")

    def _delete_entries(self, entries: Sequence[Entry]) -> None:
        owner = entries[0].owner
        if isinstance(owner, Section):
            for entry in entries:
                self.change(self.tree.line_start(entry.start), self.tree.line_end(entry.value.end), "")
            return
        names = {id(entry) for entry in entries}
        gone = [k for k, entry in enumerate(owner.entries or []) if id(entry) in names]
        self._delete_run([(entry.start, entry.value.end) for entry in owner.entries or []], gone)

    def delete_items(self, array: Value, gone: Iterable[int]) -> None:
        """Remove elements of a list by their places, from zero."""
        self._delete_run([(item.start, item.end) for item in array.items or []], sorted(set(gone)))

    def _delete_run(self, spans: Sequence[tuple[int, int]], gone: Sequence[int]) -> None:
        for _, run in groupby(enumerate(gone), lambda pair: pair[1] - pair[0]):
            places = [place for _, place in run]
            first, last = places[0], places[-1]
            start, end = spans[first][0], spans[last][1]
            if self.tree.has_own_lines(start, end):
                self.change(self.tree.line_start(start), self.tree.line_end(end), "")
            elif first:
                self.change(spans[first - 1][1], end, "")
            else:
                self.change(start, spans[last + 1][0] if last + 1 < len(spans) else end, "")

    # -- lists -------------------------------------------------------------------------------------------------------

    def insert_item(self, array: Value, place: int, text: str) -> None:
        """Write a text into a list, before the element that has this place."""
        items = array.items or []
        if not items:
            self.change(array.start + 1, array.start + 1, spell.quoted(text))
            return
        nearest = items[max(place - 1, 0)]
        written = spell.quoted(text, like=self.text[nearest.start : nearest.end])
        if not self.tree.has_own_lines(nearest.start, nearest.end):
            position = nearest.end if place else nearest.start
            self.change(position, position, f", {written}" if place else f"{written}, ")
            return
        line = f"{self.tree.indent(nearest.start)}{written},\n"
        if place and not self.text[nearest.end : self.tree.line_end(nearest.end)].lstrip().startswith(","):
            self.change(nearest.end, nearest.end, ",")
        position = self.tree.line_end(nearest.end) if place else self.tree.line_start(nearest.start)
        self.change(position, position, line)

    def rewrite(self, value: Value, text: str) -> None:
        """Replace a text by another in the same quotes."""
        written, old = self.text[value.start : value.end], self.tree.string(value)
        place = value.start + written.find(old)
        if old and written.count(old) == 1 and spell.quoted(text) == f'"{text}"':
            self.change(place, place + len(old), text)
        else:
            self.change(value.start, value.end, spell.quoted(text, like=written))

    def rename(self, span: tuple[int, int], name: str) -> None:
        """Replace a name in a key or a header."""
        old = self.text[span[0] : span[1]]
        bare = spell.key(name)
        self.change(*span, spell.quoted(name, like=old) if old[:1] in ("'", '"') or bare != name else name)
