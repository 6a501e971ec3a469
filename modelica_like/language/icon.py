"""Symbols of components and lines of connections in schematics."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

Side = Literal["W", "E", "N", "S"]
"""West (power in), east (power out), north, south."""


@dataclass(frozen=True, slots=True)
class Figure:
    """A coloured shape of a symbol, drawn for white paper, or a text.

    Attributes:
        data: SVG path data; of a text empty.
        line: colour of the outline or of the letters, `#rrggbb`, empty for none.
        fill: colour of the area, empty for none.
        shade: `across` or `along` for an area that looks like a cylinder lying or standing, `round` like a ball: as
            bright as `fill` in the middle, as dark as `line` outside.
        width: of the outline.
        dashes: lengths of dashes and gaps, empty for a solid line.
        text: letters; `%name` of a parameter is its value.
        at: middle of the text.
        size: width and height that the text may have.
        turn: degrees by which the text is turned clockwise.
    """

    data: str = ""
    line: str = ""
    fill: str = ""
    shade: Literal["", "across", "along", "round"] = ""
    width: float = 1.0
    dashes: str = ""
    text: str = ""
    at: tuple[float, float] = (0.0, 0.0)
    size: tuple[float, float] = (0.0, 0.0)
    turn: float = 0.0


@dataclass(frozen=True, slots=True)
class Icon:
    """The symbol of a component, around (0, 0), with y downwards, in units of 1/96 inch.

    Attributes:
        width: of the symbol.
        height: of the symbol.
        paper: SVG path data of areas in the colour of the paper, with an outline.
        solid: of filled areas with an outline.
        lines: of thin lines.
        heavy: of thick lines.
        text: letters in the middle.
        ports: sides of connectors and signals, `"W"`, or side and place along it, `("W", -14)`. Without an entry,
            inputs and connectors named flange_a, p or port_a are in the west, outputs and the second ends in the east,
            supports and heat ports in the south.
        key: parameters; the first given one is written below the name.
        named: whether names are written at the ports.
        at_ports: whether the symbol is drawn at each connected connector, like a ground, instead of as a part.
        figures: coloured shapes, in this order.
        tips: where the lines of ports end inside, if not at the side.
    """

    width: float
    height: float
    paper: str = ""
    solid: str = ""
    lines: str = ""
    heavy: str = ""
    text: str = ""
    ports: Mapping[str, Side | tuple[Side, float]] = field(default_factory=dict[str, Side | tuple[Side, float]])
    key: tuple[str, ...] = ()
    named: bool = False
    at_ports: bool = False
    figures: tuple[Figure, ...] = ()
    tips: Mapping[str, tuple[float, float]] = field(default_factory=dict[str, tuple[float, float]])


@dataclass(frozen=True, slots=True)
class Stroke:
    """Line style of the connections of a connector type.

    Attributes:
        name: carried quantity, for legends.
        colour: on light paper, `#rrggbb`.
        dark: on dark paper.
        width: in 1/96 inch.
        dashed: whether the line is dashed.
        weight: priority of short and straight lines.
    """

    name: str
    colour: str
    dark: str
    width: float = 2.0
    dashed: bool = False
    weight: int = 4


SIGNAL = Stroke("signal", "#7c3aed", "#b794f6", 1.5, dashed=True, weight=1)
PLAIN = Stroke("connection", "#1f2937", "#d7dde6")
