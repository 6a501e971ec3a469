"""What a hand can take in a schematic: parts, ends and lines, with their names in data attributes."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from itertools import pairwise
from xml.sax.saxutils import quoteattr

from modelica_like.show.draw.diagram import _OPPOSITE, Node, Port, _place, ends_of
from modelica_like.show.draw.sheet import Line, Placed, Point

_RADIUS, _APART = 4.5, 10.0
"""Of the circle of an end, and distance of two ends at one place, in 1/96 inch."""
_WIDE = 14.0
"""Width of the invisible line that a pointer meets."""


def end_name(port: Port) -> str:
    """Return how a netlist names an end; an outer connector has only its name."""
    return f"{port.node.name}.{port.name}" if port.node.component else port.name


def part_attributes(node: Node, about: str) -> str:
    """Return the attributes of the group of a part.

    Args:
        node: of the part.
        about: its name and type, for readers of screens.
    """
    return f' class="part" data-part={quoteattr(node.name)} tabindex="0" role="button" aria-label={quoteattr(about)}'


def line_handle(at: Point, line: Line) -> str:
    """Return a wide invisible line over a net, which names its ends."""
    data = " ".join(
        f"M{at[0] + x1:g} {at[1] + y1:g} L{at[0] + x2:g} {at[1] + y2:g}"
        for path in line.paths for (x1, y1), (x2, y2) in pairwise(path) if (x1, y1) != (x2, y2)
    )  # fmt: skip
    ends = quoteattr(" ".join(map(end_name, line.ports)))
    look = f'd="{data}" fill="none" stroke="transparent" stroke-width="{_WIDE:g}"'
    return f'<path class="wire" data-ends={ends} tabindex="0" role="button" aria-label={ends} {look}/>'


def end_handles(part: Placed, joined: Collection[Port]) -> Iterator[str]:
    """Yield circles at the ends of a part, around its middle: ends that are joined, open, or optional.

    Args:
        part: with its place.
        joined: the ports that have a line.
    """
    taken = dict[Point, None]()
    for port in part.node.ports.values():
        place = _at(part, port.side, port.along)
        taken[place] = None
        state = "joined" if port in joined or port.ground else "open"
        extra = f" data-ground={quoteattr(end_name(port.ground))}" if port.ground else ""
        yield _circle(end_name(port), place, state, port.stroke.colour, extra)
    for name, stroke, drives in ends_of(part.node, optional=True):
        if name in part.node.ports or part.node.component is None:
            continue
        side, along = _place(part.node.icon, name, drives)
        side = _OPPOSITE[side] if part.node.turned and not drives else side
        while (place := _at(part, side, along)) in taken:
            along += _APART
        taken[place] = None
        yield _circle(f"{part.node.name}.{name}", place, "optional", stroke.colour)


def _at(part: Placed, side: str, along: float) -> Point:
    half_x, half_y = part.half
    across = {"W": -half_x, "E": half_x, "N": -half_y, "S": half_y}[side]
    x, y = (across, along) if side in ("W", "E") else (along, across)
    return round(x, 2), round(y, 2)


def _circle(end: str, at: Point, state: str, colour: str, extra: str = "") -> str:
    name = quoteattr(end)
    return (
        f'<circle class="end {state}" data-end={name}{extra} cx="{at[0]:g}" cy="{at[1]:g}" r="{_RADIUS:g}" '
        f'stroke="{colour}" tabindex="0" role="button" aria-label={name}><title>{quoteattr(end)[1:-1]}</title></circle>'
    )
