"""What is written beside symbols."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from modelica_like.draw.diagram import Node

if TYPE_CHECKING:
    from modelica_like.draw.sheet import Placed

NAME, VALUE = 12.5, 11.0
"""Sizes of letters in 1/96 inch."""
_NARROW, _WIDE = set("fijlrt.,:;|'()[]1I "), set("mwMW@%")
_LONGEST = 24


@dataclass(frozen=True, slots=True)
class Text:
    """Something written.

    Attributes:
        text: what.
        at: where its anchor and its base line are.
        size: of the letters.
        anchor: what of it is there.
    """

    text: str
    at: tuple[float, float]
    size: float
    anchor: Literal["start", "middle", "end"] = "middle"

    @property
    def box(self) -> tuple[float, float, float, float]:
        """West, north, east and south of its room."""
        wide = text_width(self.text, self.size)
        west = self.at[0] - wide * {"start": 0.0, "middle": 0.5, "end": 1.0}[self.anchor]
        return west, self.at[1] - self.size, west + wide, self.at[1] + 2.0


def text_width(text: str, size: float) -> float:
    """Width of a text in a sans-serif font, rather too wide than too narrow."""
    return size * sum(0.36 if letter in _NARROW else 0.92 if letter in _WIDE else 0.6 for letter in text)


def labels(node: Node) -> list[tuple[str, float]]:
    """Return what is written below a symbol: its name, and one value."""
    written = [(_shortened(node.name), NAME)]
    if node.icon and node.component:
        for key in node.icon.key:
            value = node.component.value(key) if key in node.component.fields else None
            if value is not None and value.number is not None:
                written.append((_shortened(f"{key} = {_told(value.given)}"), VALUE))
                break
    return written


def texts(part: Placed) -> Iterator[Text]:
    """Yield what is written around the middle of a part: names of ports, its own name, and a value."""
    node, (half_x, half_y) = part.node, part.half
    if part.sheet or node.border:
        return
    for port in node.ports.values():
        if port.mark or port.side not in ("W", "E") or not (node.icon is None or node.icon.named):
            continue
        # Inside a box, beside a symbol above its line.
        east, outside = port.side == "E", node.icon is not None
        shift = (half_x + (4.0 if outside else -5.0)) * (1 if east else -1)
        at = shift, port.along + (-4.0 if outside else 4.0)
        yield Text(port.name, at, VALUE, "end" if east != outside else "start")
    low = -half_y - 3.0 if part.above else part.room[3]
    for text, size in reversed(labels(node)):
        yield Text(text, (0.0, low - 3.0), size)
        low -= size + 4.0


def _told(given: object) -> str:
    number, _, unit = str(given).partition(" ")
    try:
        text = f"{float(number):.5g} {unit}".rstrip()
    except ValueError:
        text = str(given)
    return text.replace(".m", "·m").replace("m2", "m²").replace("m3", "m³").replace("*", "·")


def _shortened(text: str) -> str:
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 1]}…"
