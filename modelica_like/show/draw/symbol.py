"""The symbol of a component type, by itself."""

from __future__ import annotations

from modelica_like.language import Component
from modelica_like.show.draw.diagram import Port, alone
from modelica_like.show.draw.labels import VALUE, text_width
from modelica_like.show.draw.sheet import Line, Placed, Point, Sheet, box_size
from modelica_like.show.draw.svg import svg

_LEAD = 13.0
"""Length of a lead, which lies in the margin of the drawing."""


def symbol(kind: type[Component] | Component) -> str:
    """Draw the symbol of a component type as SVG, with a lead for each connector and signal that every instance has.

    The same type gives the same bytes on every machine.

    Args:
        kind: the type, or a part whose class is a text.
    """
    node = alone(kind)
    icon = node.icon
    half = (icon.width / 2, icon.height / 2) if icon else box_size(node)
    names = [text_width(port.name, VALUE) for port in node.ports.values()] if icon and icon.named else []
    beside = max(names, default=0.0)
    # A ground hangs below its connector.
    middle = (half[0] + beside, 0.0 if icon and icon.at_ports else half[1])
    part = Placed(node, half, (0.0, 0.0, 0.0, 0.0), {}, at=middle)
    lines = [_lead(part, port, _LEAD + beside) for port in node.ports.values()]
    return svg(
        Sheet([part], lines, 2 * middle[0], 2 * half[1]), (kind if isinstance(kind, type) else type(kind)).__name__
    )


def _lead(part: Placed, port: Port, long: float) -> Line:
    """Return the line of a port from outside to its symbol."""
    (half_x, half_y), icon = part.half, part.node.icon
    tips: dict[str, Point] = {
        "W": (-half_x, port.along), "E": (half_x, port.along), "N": (port.along, -half_y), "S": (port.along, half_y),
    }  # fmt: skip
    outwards: dict[str, Point] = {"W": (-long, 0.0), "E": (long, 0.0), "N": (0.0, -_LEAD), "S": (0.0, _LEAD)}
    inwards = {"W": "E", "E": "W", "N": "S", "S": "N"}
    hangs = icon is not None and icon.at_ports
    side, tip = ("N", (0.0, 0.0)) if hangs else (port.side, tips[port.side])
    tip = (part.at[0] + tip[0], part.at[1] + tip[1])
    line = Line(port.stroke, [[(tip[0] + outwards[side][0], tip[1] + outwards[side][1]), tip]])
    line.arrows += [(tip, inwards[side])] if port.signal < 0 else []
    return line
