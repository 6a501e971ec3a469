"""Places in files of sources and of data."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

SHOWN = 160
"""Characters of a text in a message."""
_IN_WORD = re.compile(r"\w")


@dataclass(frozen=True, slots=True)
class Source:
    """A place in a source file: a line of Python or of a netlist.

    Attributes:
        file: path of the file, as it was opened.
        line: line number, counted from one; zero if it is not known.
        text: the source text of the statement, on one line.
        column: where the key begins, counted in characters from one; zero if it is not known.
        length: of the key and its value, as far as they are on this line.
        path: of the key, such as `parts.hub.J`.
        statement: whole lines of the file, from this one to the end of the statement.
    """

    file: str
    line: int = 0
    text: str = ""
    column: int = field(default=0, compare=False, repr=False)
    length: int = field(default=0, compare=False, repr=False)
    path: str = field(default="", compare=False, repr=False)
    statement: str = field(default="", compare=False, repr=False)

    def __str__(self) -> str:
        place = Path(self.file).name + (f":{self.line}" if self.line else "")
        text = self.text if len(self.text) <= SHOWN else f"{self.text[: SHOWN - 1]}…"
        return f"{place} `{text}`" if text else place

    def spot(self, word: str) -> tuple[int, int, int] | None:
        """Return line, column and length of a word in key and value, or in the statement, if it is there once."""
        begin = max(self.column - 1, 0)
        for first, last in ((begin, begin + self.length), (0, len(self.statement))) if word else ():
            matches = [*_places(word, self.statement[first:last])]
            if len(matches) == 1:
                before = self.statement[: first + matches[0]]
                return self.line + before.count("\n"), len(before) - before.rfind("\n"), len(word)
        return None

    def as_json(self, word: str = "") -> dict[str, Any]:
        """Return the place, or that of a word in it, as data for JSON; what is not known is None."""
        line, column, length = self.spot(word) or (self.line, self.column, self.length)
        known = {"line": line, "column": column, "length": length, "path": self.path}
        return {"file": self.file or None, **{key: value or None for key, value in known.items()}}


def _places(word: str, text: str) -> Iterator[int]:
    """Yield where a word is in a text, not as a part of another word."""
    begin = text.find(word)
    while begin >= 0:
        end = begin + len(word)
        if not any(_IN_WORD.fullmatch(text[k : k + 1]) for k in (begin - 1, end) if k >= 0):
            yield begin
        begin = text.find(word, end)
