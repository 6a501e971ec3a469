"""Places on the sheet: parts in their columns, connections as horizontal and vertical lines."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise, permutations

import casadi as ca

from modelica_like.language.icon import Stroke
from modelica_like.show.draw.diagram import Diagram, Net, Node, Port
from modelica_like.show.draw.labels import VALUE, Box, Text, labels, text_width
from modelica_like.show.draw.layers import Channel, End, Heights, Layers, Slot, layered, solve_lp

Point = tuple[float, float]

_GAP, _PASSING, _TRACK, _CHANNEL = 20.0, 9.0, 11.0, 26.0
"""Distances between parts, around passing lines, between vertical lines, and beside them."""
_ELBOW, MARK = 13.0, 18.0
"""Space of a line around a corner of a symbol, and of a ground."""
FRAME, TITLE = 14.0, 24.0
"""Space inside the frame of an open assembly, and of its title."""
_FEW = 6
"""Largest number of vertical lines of which all orders are tried."""


@dataclass(eq=False)
class Placed:
    """A node with the space around the middle of its symbol.

    Attributes:
        node: the node.
        half: half the size of the symbol.
        room: west, north, east and south of the middle.
        exits: height at which the line of a port leaves.
        sheet: the inside of an open assembly.
        above: whether texts are above the symbol, because a line leaves below.
        at: place of the middle.
    """

    node: Node
    half: Point
    room: Box
    exits: dict[Port, float]
    sheet: Sheet | None = None
    above: bool = False
    at: Point = (0.0, 0.0)


@dataclass(eq=False)
class Line:
    """Horizontal and vertical lines of a net.

    Attributes:
        stroke: how they are drawn.
        paths: corners of each.
        dots: where three or more meet.
        arrows: tips at inputs, and the direction they point to.
        ports: joined ports.
        tips: where it meets the symbols.
    """

    stroke: Stroke
    paths: list[list[Point]] = field(default_factory=list)
    dots: list[Point] = field(default_factory=list)
    arrows: list[tuple[Point, str]] = field(default_factory=list)
    ports: list[Port] = field(default_factory=list)
    tips: dict[Port, Point] = field(default_factory=dict)


@dataclass(eq=False)
class Sheet:
    """A drawing.

    Attributes:
        parts: placed parts.
        lines: of the nets.
        width: from west to east.
        height: from north to south.
    """

    parts: list[Placed]
    lines: list[Line]
    width: float
    height: float

    def everything(self, at: Point = (0.0, 0.0)) -> Iterator[tuple[Point, Placed | Line]]:
        """Yield all parts and lines, those of open assemblies too, with the origin of their sheet."""
        for line in self.lines:
            yield at, line
        for part in self.parts:
            yield at, part
            if part.sheet:
                yield from part.sheet.everything((at[0] + inner_origin(part)[0], at[1] + inner_origin(part)[1]))


def inner_origin(part: Placed) -> Point:
    """Where the inside of an open assembly begins."""
    return part.at[0] - part.half[0], part.at[1] - part.half[1] + TITLE


def texts(part: Placed) -> Iterator[Text]:
    """Yield the texts around the middle of a part: names of ports, its own name, and a value."""
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


def sheet(diagram: Diagram, before: Heights | None = None) -> Sheet:
    """Place the parts and nets of a diagram.

    Args:
        diagram: what to place.
        before: heights of nodes in an earlier picture, whose order is kept.
    """
    layers = layered(diagram, before)
    placed = {node: _measure(node) for node in diagram.nodes}
    heights = _heights(layers, placed)
    _straighten(layers, heights, placed)
    lines = {net: Line(net.stroke, ports=net.ports) for net in diagram.nets}
    line_of = {port: lines[net] for net in diagram.nets for port in net.ports}
    x = 0.0
    for k, column in enumerate([*layers.columns, []]):
        tracks, width = _tracks(layers.channels[k], heights, placed)
        if 0 < k < len(layers.columns) or layers.channels[k].nets:
            _route(layers.channels[k], heights, placed, tracks, (x, x + width), lines)
            x += width
        there = [placed[slot.node] for slot in column if slot.node]
        west, east = (max((side * t.room[k] for t in there), default=0.0) for k, side in ((0, -1.0), (2, 1.0)))
        for slot in column:
            if slot.node:
                item = placed[slot.node]
                item.at = x + west, heights[slot]
                _lead(item, (x, x + west + east), line_of)
            elif slot.net:
                lines[slot.net].paths.append([(x, heights[slot]), (x + west + east, heights[slot])])
        x += west + east
    return _fitted(Sheet(list(placed.values()), list(lines.values()), x, 0.0))


def _fitted(drawing: Sheet) -> Sheet:
    """Move everything so that it begins at zero."""
    tops = [part.at[1] + part.room[1] for part in drawing.parts]
    tops += [y for line in drawing.lines for path in line.paths for _, y in path]
    bottoms = [part.at[1] + part.room[3] for part in drawing.parts]
    bottoms += [y for line in drawing.lines for path in line.paths for _, y in path]
    top = min(tops, default=0.0)
    for part in drawing.parts:
        part.at = part.at[0], part.at[1] - top
    for line in drawing.lines:
        line.paths = [[(x, y - top) for x, y in path] for path in line.paths]
        line.dots = [(x, y - top) for x, y in line.dots]
        line.tips = {port: (x, y - top) for port, (x, y) in line.tips.items()}
        line.arrows = [((x, y - top), way) for (x, y), way in line.arrows]
    drawing.height = max(bottoms, default=0.0) - top
    return drawing


def _measure(node: Node) -> Placed:
    """Find the space that a node needs, and the exits of its ports."""
    if node.border:
        (port,) = node.ports.values()
        return Placed(node, (0.0, 0.0), (0.0, -4.0, 0.0, 4.0), {port: 0.0})
    inner = sheet(node.inside) if node.inside else None
    if inner:
        half = inner.width / 2, (inner.height + TITLE + FRAME) / 2
        for part in inner.parts:
            if part.node.border and part.node.name in node.ports:
                node.ports[part.node.name].along = part.at[1] + TITLE - half[1]
    elif node.icon:
        half = node.icon.width / 2, node.icon.height / 2
    else:
        half = box_size(node)
    exits, north, south = dict[Port, float](), half[1], half[1]
    west = east = half[0]
    for port in node.ports.values():
        if port.side == "N":
            north += _ELBOW
            exits[port] = -north
        elif port.side == "S" and not port.mark:
            south += _ELBOW
            exits[port] = south
        elif port.side in ("W", "E"):
            exits[port] = port.along
            if port.mark:
                west, east = (west + MARK, east) if port.side == "W" else (west, east + MARK)
                south = max(south, port.along + MARK)
    if any(port.mark and port.side == "S" for port in node.ports.values()):
        south += MARK
    written = [] if inner else labels(node)
    wide = max((text_width(text, size) for text, size in written), default=0.0) / 2
    name_side = 8.0 + max((text_width(port.name, VALUE) for port in node.ports.values()), default=0.0)
    if node.icon and node.icon.named:
        west, east = west + name_side, east + name_side
    low = sum(size + 4.0 for _, size in written)
    sides = {port.side for port in exits}
    above = "S" in sides and "N" not in sides
    north, south = (north + low, south) if above else (north, south + low)
    return Placed(node, half, (-max(west, wide) - 2, -north, max(east, wide) + 2, south), exits, inner, above)


def box_size(node: Node) -> Point:
    """Return half the size of a box with the names of its ports inside."""
    wide = {
        side: max((text_width(port.name, VALUE) for port in node.ports.values() if port.side == side), default=0.0)
        for side in ("W", "E")
    }
    low = max((abs(port.along) for port in node.ports.values()), default=0.0)
    return max(26.0, (wide["W"] + wide["E"]) / 2 + 14.0), max(18.0, low + 12.0)


def _heights(layers: Layers, placed: dict[Node, Placed]) -> dict[Slot, float]:
    """Shortest total length of vertical lines, by a linear programme."""
    slots = [slot for column in layers.columns for slot in column]
    if not slots:
        return {}
    place = {slot: k for k, slot in enumerate(slots)}
    y, middle = ca.SX.sym("y", len(slots)), ca.SX.sym("middle")
    apart: list[tuple[ca.SX, float]] = []
    for column in layers.columns:
        for a, b in pairwise(column):
            low, high = (placed[end.node].room if end.node else (0.0, 0.0, 0.0, 0.0) for end in (a, b))
            gap = _GAP if a.node and b.node else _PASSING
            apart.append((y[place[b]] - y[place[a]], low[3] - high[1] + gap))
    spans: list[tuple[list[ca.SX], int]] = []
    for channel in layers.channels:
        for net, (before, after) in channel.nets.items():
            ends = [y[place[end.slot]] + _offset(end, placed) for end in (*before, *after)]
            passing = sum(end.slot.net is not None for end in (*before, *after))
            # Kinks go to parts with several shafts on a side.
            chain = 1 + all(_single(end) for end in (*before, *after))
            spans.append((ends, net.stroke.weight * (1 + passing) * chain))
            # Of several branches, the one that continues stays straight.
            through = [other for other, end in zip(ends, (*before, *after), strict=True) if _goes_on(end)]
            if 1 < len(through) < len(ends):
                spans.append((through, net.stroke.weight))
    low, high, off = (
        ca.SX.sym(name, n) for name, n in (("low", len(spans)), ("high", len(spans)), ("off", len(slots)))
    )
    least = list(apart)
    cost = 1e-3 * ca.sum1(off)
    for k, (ends, weight) in enumerate(spans):
        cost += weight * (high[k] - low[k])
        least += [(end - low[k], 0.0) for end in ends] + [(high[k] - end, 0.0) for end in ends]
    least += [(off - (y - middle), 0.0), (off - (middle - y), 0.0)]
    # All unknowns are positive: add the space above.
    base = 1e4
    solution = solve_lp(ca.vertcat(y, middle, low, high, off), cost, [*least, (y - base, 0.0)])
    return {slot: round(value, 3) for slot, value in zip(slots, solution[: len(slots)], strict=True)}


def _straighten(layers: Layers, heights: dict[Slot, float], placed: dict[Node, Placed]) -> None:
    """Lines that turn into the outermost symbol of a column from outside need no other corner."""
    for channel in layers.channels:
        for before, after in channel.nets.values():
            if len(before) != 1 or len(after) != 1:
                continue
            for end, other in ((before[0], after[0]), (after[0], before[0])):
                port = end.port
                if port is None or port.side not in ("N", "S"):
                    continue
                column = next(c for c in layers.columns if end.slot in c)
                outermost = column[0 if port.side == "N" else -1] is end.slot
                alone = sum(p.side == port.side for p in port.node.ports.values()) == 1
                wanted = heights[other.slot] + _offset(other, placed) - heights[end.slot]
                away = wanted < _offset(end, placed) if port.side == "N" else wanted > _offset(end, placed)
                clear = port.side == "N" or placed[port.node].above
                if outermost and alone and away and clear:
                    placed[port.node].exits[port] = wanted


def _single(end: End) -> bool:
    """Whether the part has one connector on this side."""
    ports = end.slot.node.ports.values() if end.slot.node else ()
    return sum(not port.signal and end.port is not None and port.side == end.port.side for port in ports) <= 1


def _goes_on(end: End) -> bool:
    node = end.slot.node
    return node is None or sum(not port.signal and port.mark is None for port in node.ports.values()) > 1


def _offset(end: End, placed: dict[Node, Placed]) -> float:
    return placed[end.port.node].exits[end.port] if end.port else 0.0


def _ends(
    channel: Channel, heights: dict[Slot, float], placed: dict[Node, Placed]
) -> dict[Net, tuple[list[float], ...]]:
    return {
        net: tuple([round(heights[end.slot] + _offset(end, placed), 3) for end in side] for side in sides)
        for net, sides in channel.nets.items()
    }


def _tracks(channel: Channel, heights: dict[Slot, float], placed: dict[Node, Placed]) -> tuple[list[Net], float]:
    """Order of the vertical lines of a channel, and its width."""
    ends = _ends(channel, heights, placed)
    bent = [net for net, sides in ends.items() if len({*sides[0], *sides[1]}) > 1]
    if len(bent) <= _FEW:
        best = min(permutations(bent), key=lambda order: _cost(order, ends))
    else:
        best = tuple[Net, ...]()
        for net in bent:
            tried = [(*best[:k], net, *best[k:]) for k in range(len(best) + 1)]
            best = min(tried, key=lambda order: _cost(order, ends))
    return list(best), _CHANNEL + max(0, len(best) - 1) * _TRACK


def _cost(order: Sequence[Net], ends: dict[Net, tuple[list[float], ...]]) -> float:
    """Number of crossings, plus a hundred for each pair of overlapping lines."""
    total = 0.0
    for k, net in enumerate(order):
        before, after = ends[net]
        for other in order[k + 1 :]:
            low, high = min(map(min, filter(None, ends[other]))), max(map(max, filter(None, ends[other])))
            total += sum(low < y < high for y in after)
            all_ends = [*before, *after]
            total += sum(min(all_ends) < y < max(all_ends) for y in ends[other][0])
            total += 100.0 * sum(abs(a - b) < 4.0 for a in after for b in ends[other][0])
    return total


def _route(
    channel: Channel, heights: dict[Slot, float], placed: dict[Node, Placed], tracks: list[Net],
    room: tuple[float, float], lines: dict[Net, Line],
) -> None:  # fmt: skip
    """Draw the nets of a channel."""
    west, east = room
    for net, (before, after) in _ends(channel, heights, placed).items():
        line = lines[net]
        if net not in tracks:
            line.paths.append([(west, (*before, *after)[0]), (east, (*before, *after)[0])])
            continue
        x = (west + east) / 2 + _TRACK * (tracks.index(net) - (len(tracks) - 1) / 2)
        ys = sorted({*before, *after})
        line.paths.append([(x, ys[0]), (x, ys[-1])])
        line.paths += [[(west, y), (x, y)] for y in before] + [[(x, y), (east, y)] for y in after]
        for y in ys:
            if (y in before) + (y in after) + (y != ys[0]) + (y != ys[-1]) > 2:
                line.dots.append((x, y))


def _lead(part: Placed, room: tuple[float, float], lines: dict[Port, Line]) -> None:
    """Draw the lines from the symbol to the edge of its column."""
    (x, y), (half_x, half_y) = part.at, part.half
    for port in part.node.ports.values():
        line = lines.get(port)
        if line is None:  # a ground is drawn there
            continue
        edge = room[0] if port.way == "W" else room[1]
        exit_y = y + part.exits[port]
        if port.side in ("W", "E"):
            symbol = x + (half_x if port.side == "E" else -half_x)
            path = [(edge, exit_y), (symbol, exit_y)]
        else:
            px = x + port.along
            path = [(edge, exit_y), (px, exit_y), (px, y + (half_y if port.side == "S" else -half_y))]
        line.paths.append(path)
        line.tips[port] = path[-1]
        if port.signal < 0 and not part.sheet and not part.node.border:
            line.arrows.append((path[-1], {"W": "E", "E": "W", "N": "S", "S": "N"}[port.side]))
