"""Texts at symbols."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from modelica_like.show.draw.diagram import Node

NAME, VALUE = 12.5, 11.0
"""Sizes of letters in 1/96 inch."""
_NARROW, _WIDE = set("fijlrt.,:;|'()[]1I "), set("mwMW@%")
_LONGEST = 24
Box = tuple[float, float, float, float]
"""West, north, east, south."""


@dataclass(frozen=True, slots=True)
class Text:
    """A text on the sheet.

    Attributes:
        text: what.
        at: where its anchor and its base line are.
        size: of the letters.
        anchor: start, middle or end.
    """

    text: str
    at: tuple[float, float]
    size: float
    anchor: Literal["start", "middle", "end"] = "middle"

    @property
    def box(self) -> Box:
        """The space that it takes."""
        wide = text_width(self.text, self.size)
        west = self.at[0] - wide * {"start": 0.0, "middle": 0.5, "end": 1.0}[self.anchor]
        return west, self.at[1] - self.size, west + wide, self.at[1] + 2.0


def meet(box: Box, other: Box) -> bool:
    """Whether two boxes overlap."""
    return box[0] < other[2] and other[0] < box[2] and box[1] < other[3] and other[1] < box[3]


def text_width(text: str, size: float) -> float:
    """Width of a text in a sans-serif font, slightly overestimated."""
    return size * sum(0.36 if letter in _NARROW else 0.92 if letter in _WIDE else 0.6 for letter in text)


def labels(node: Node) -> list[tuple[str, float]]:
    """Return the texts below a symbol: its name if it has one, and one value or its notes."""
    written = [(_shortened(node.name), NAME)] if node.name else []
    if node.notes is not None:
        return written + [(note, VALUE) for note in node.notes]
    if node.icon and node.component:
        for key in node.icon.key:
            value = node.component.value(key) if key in node.component.fields else None
            if value is not None and value.number is not None:
                written.append((_shortened(f"{key} = {told(value.given)}"), VALUE))
                break
    return written


def told(given: object) -> str:
    """Return a given value as it stands in pictures."""
    number, _, unit = str(given).partition(" ")
    try:
        text = f"{float(number):.5g} {unit}".rstrip()
    except ValueError:
        text = str(given)
    return text.replace(".m", "·m").replace("m2", "m²").replace("m3", "m³").replace("*", "·")


def _shortened(text: str) -> str:
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 1]}…"
