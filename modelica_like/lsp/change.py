"""Changes of a netlist's text by the operations of edit, as places with what is written there."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import Any

from modelica_like.edit import apply
from modelica_like.errors import ModelicaLikeError, UnknownName
from modelica_like.lsp.text import Text, word_at
from modelica_like.netlist.outline import Span

Edit = tuple[Span, str]
"""A place in the text, and what is written there."""
_WORD = re.compile(r"\w+|\W")


def renamed(text: Text, offset: int, name: str) -> list[Edit]:
    """Return the changes that give the part or the parameter at a place another name; see `edit.rename`.

    Args:
        text: a netlist.
        offset: of the place.
        name: the new name.

    Raises:
        UnknownName: there is no part or parameter.
        ModelicaLikeError: the new name cannot be one, or the text is not TOML.
    """
    old = text.text[slice(*word_at(text, offset))]
    keys = text.outline.by_path if text.kind == "netlist" and old else ()
    if ("parts", old) in keys or ("parameters", old) in keys:
        new = apply(text.text, {"op": "rename", "old": old, "new": name}, file=text.path).text
        edits = [*_edits(text.text, new)]
        if not edits or any(begin <= offset <= end for (begin, end), _ in edits):
            return edits
    raise UnknownName("There is no part or parameter of this netlist.")


def applied(text: Text, suggestion: Mapping[str, Any]) -> list[Edit]:
    """Return the changes of a suggestion, none if the text has changed so that it does not fit."""
    with suppress(ModelicaLikeError):
        return [*_edits(text.text, apply(text.text, suggestion, file=text.path).text)]
    return []


def _edits(old: str, new: str) -> Iterator[Edit]:
    """Yield the differences of two texts: words, if as many lines with as many words differ, else lines."""
    before, after = old.splitlines(keepends=True), new.splitlines(keepends=True)
    first = _equal(before, after)
    last = _equal(before[first:][::-1], after[first:][::-1])
    position = sum(map(len, before[:first]))
    before, after = before[first : len(before) - last], after[first : len(after) - last]
    if len(before) != len(after):
        before, after = ["".join(before)], ["".join(after)]
    for line, changed in zip(before, after, strict=True):
        words, others = _WORD.findall(line), _WORD.findall(changed)
        if len(words) != len(others):
            start = _equal(words, others)
            end = _equal(words[start:][::-1], others[start:][::-1])
            words = [*words[:start], "".join(words[start : len(words) - end]), *words[len(words) - end :]]
            others = [*others[:start], "".join(others[start : len(others) - end]), *others[len(others) - end :]]
        place = position
        for word, other in zip(words, others, strict=True):
            if word != other:
                yield (place, place + len(word)), other
            place += len(word)
        position += len(line)


def _equal(before: list[str], after: list[str]) -> int:
    """Return how many elements at the beginning are equal."""
    return next((k for k, (one, other) in enumerate(zip(before, after, strict=False)) if one != other),
                min(len(before), len(after)))  # fmt: skip
