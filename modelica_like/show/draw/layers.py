"""Layers of a schematic: columns from west to east, and the order in each."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise

import casadi as ca

from modelica_like.language.icon import SIGNAL
from modelica_like.show.draw.diagram import Diagram, Net, Node, Port

_ROUNDS = 12
"""Number of sweeps that order all columns, from west to east and back in turn."""
_MOVED = 1.0
"""Crossings that two nodes which exchange their places must save: a picture that changes while one works with it is
read again, and a crossing is not worth that alone."""
Heights = Mapping[str, float]
"""Where nodes were in an earlier picture, by name, from north to south."""


@dataclass(eq=False)
class Slot:
    """A place in a layer: a node, or a net that passes.

    Attributes:
        node: the node.
        net: the net.
    """

    node: Node | None = None
    net: Net | None = None


@dataclass(frozen=True, eq=False)
class End:
    """Where a net meets a channel, the space between two layers.

    Attributes:
        slot: the node or passing net it comes from.
        port: the port of the node.
    """

    slot: Slot
    port: Port | None = None


@dataclass(eq=False)
class Channel:
    """The space between two layers.

    Attributes:
        nets: the nets in it, with their ends in the layer before and in the layer after.
    """

    nets: dict[Net, tuple[list[End], list[End]]] = field(default_factory=dict["Net", "tuple[list[End], list[End]]"])


@dataclass(eq=False)
class Layers:
    """Columns of slots; channel k lies before column k, the last one after all columns."""

    columns: list[list[Slot]]
    channels: list[Channel]


def layered(diagram: Diagram, before: Heights | None = None) -> Layers:
    """Assign every node to a column, let long nets pass between nodes, and order columns so that few lines cross.

    Args:
        diagram: nodes and nets.
        before: nodes that are known from an earlier picture keep their order, unless the lines gain much.
    """
    column_of = _columns(diagram)
    layers = Layers(
        [[] for _ in range(max(column_of.values(), default=-1) + 1)],
        [Channel() for _ in range(max(column_of.values(), default=-1) + 2)],
    )
    slots = {node: Slot(node) for node in diagram.nodes}
    for node in diagram.nodes:
        layers.columns[column_of[node]].append(slots[node])
    for net in diagram.nets:
        met: dict[int, tuple[list[End], list[End]]] = defaultdict(lambda: ([], []))
        for port in net.ports:
            east = port.way == "E"
            met[column_of[port.node] + east][not east].append(End(slots[port.node], port))
        for k in range(min(met), max(met)):
            passing = Slot(net=net)
            layers.columns[k].append(passing)
            met[k][1].append(End(passing))
            met[k + 1][0].append(End(passing))
        for k, ends in met.items():
            layers.channels[k].nets[net] = ends
    _order(layers, before or {})
    return layers


def _columns(diagram: Diagram) -> dict[Node, int]:
    """Shortest total length by a linear programme; lines that would close a cycle, signals first, may run backwards."""
    nodes = diagram.nodes
    place = {node: k for k, node in enumerate(nodes)}
    if not nodes:
        return {}
    x = ca.SX.sym("x", len(nodes))
    after = dict[Node, set[Node]]()
    steps: list[ca.SX] = []
    cost = ca.SX(0)
    spans: list[tuple[ca.SX, int]] = []
    for net in sorted(diagram.nets, key=lambda w: -w.stroke.weight):
        west, east = ([port.node for port in net.ports if port.way == way] for way in ("E", "W"))
        for a in west:
            for b in east:
                if a is not b and not _reaches(after, b, a):
                    after.setdefault(a, set()).add(b)
                    steps.append(x[place[b]] - x[place[a]])
        spans.append((ca.vertcat(*[x[place[port.node]] for port in net.ports]), net.stroke.weight))
    low, high = ca.SX.sym("low", len(spans)), ca.SX.sym("high", len(spans))
    bounds: list[ca.SX] = []
    for k, (inside, weight) in enumerate(spans):
        cost += weight * (high[k] - low[k])
        bounds += [inside - low[k], high[k] - inside]
    for node in nodes:
        if node.border:
            others = [place[n] for n in nodes if n.border != node.border]
            steps += [(x[k] - x[place[node]]) * (1 if node.border == "W" else -1) for k in others]
    solution = solve_lp(
        ca.vertcat(x, low, high), cost + 1e-3 * ca.sum1(x), [(ca.vertcat(*steps), 1.0), (ca.vertcat(*bounds), 0.0)]
    )
    columns = [round(float(value)) for value in solution[: len(nodes)]]
    return {node: value - min(columns) for node, value in zip(nodes, columns, strict=True)}


def solve_lp(x: ca.SX, cost: ca.SX, least: list[tuple[ca.SX, float | ca.DM]]) -> list[float]:
    """Minimize a linear cost of x ≥ 0.

    Args:
        x: the unknowns.
        cost: the cost.
        least: linear expressions and their lower bounds.
    """
    g = ca.vertcat(*[expression for expression, _ in least])
    low = ca.vertcat(*[ca.DM.ones(expression.shape[0]) * bound for expression, bound in least])
    problem = {"x": x, "f": cost, "g": g}
    options = {"highs": {"output_flag": False}, "print_time": False, "error_on_fail": True}
    solution = ca.qpsol("schematic", "highs", problem, options)(lbg=low, ubg=ca.inf, lbx=0)
    return [float(value) for value in ca.vertsplit(solution["x"])]


def _reaches(after: dict[Node, set[Node]], start: Node, goal: Node) -> bool:
    pending, seen = [start], set[Node]()
    while pending:
        node = pending.pop()
        if node is goal:
            return True
        if node not in seen:
            seen.add(node)
            pending.extend(after.get(node, ()))
    return False


def _order(layers: Layers, before: Heights) -> None:
    """Order each column by the mean place of its neighbours, back and forth; keep the best order."""
    orders: list[tuple[float, list[list[Slot]]]] = []
    given = [list(column) for column in layers.columns]
    signals = [sorted(column, key=_signals_first) for column in given]
    for begin in ([[_as_before(column, before) for column in given]] if before else []) + [given, signals]:
        layers.columns[:] = [list(column) for column in begin]
        for k in range(_ROUNDS):
            east = k % 2 == 0
            numbers = range(len(layers.columns))
            for n in numbers if east else reversed(numbers):
                _sort(layers, n, east)
                layers.columns[n] = _as_before(layers.columns[n], before)
            _swap(layers, before)
            places = _places(layers)
            cost = sum(_crossings_in(channel, places) for channel in layers.channels)
            cost += _MOVED * sum(_moved(column, before) for column in layers.columns)
            orders.append((cost, [list(column) for column in layers.columns]))
    layers.columns[:] = min(orders, key=lambda candidate: candidate[0])[1]


def _as_before(column: list[Slot], before: Heights) -> list[Slot]:
    """Return a column whose known nodes have their earlier order, in the places that they have."""
    known = [slot for slot in column if slot.node and slot.node.name in before]
    ordered = iter(sorted(known, key=lambda slot: before[slot.node.name] if slot.node else 0.0))
    return [next(ordered) if slot in known else slot for slot in column]


def _moved(column: list[Slot], before: Heights) -> int:
    """Return the number of pairs of known nodes that have changed their order."""
    heights = [before[slot.node.name] for slot in column if slot.node and slot.node.name in before]
    return sum(b < a for k, a in enumerate(heights) for b in heights[k + 1 :])


def _signals_first(slot: Slot) -> bool:
    if slot.node is None:
        return slot.net is None or slot.net.stroke is not SIGNAL
    return any(not port.signal for port in slot.node.ports.values())


def _sort(layers: Layers, n: int, east: bool) -> None:
    """Order column n by the places in the column before (or after)."""
    places = _places(layers, n)
    channel = layers.channels[n if east else n + 1]
    wanted: dict[Slot, list[tuple[float, int]]] = defaultdict(list)
    for net, (before, after) in channel.nets.items():
        ends, others = (after, before) if east else (before, after)
        for end in ends:
            near = others or [e for e in ends if e is not end]
            for other in near:
                # A port above the middle of its node wants its node lower.
                offset = (end.port.along if end.port else 0.0) * 0.01
                wanted[end.slot].append((places[other.slot] + _port_shift(other) - offset, net.stroke.weight))
    column = layers.columns[n]
    mean = {
        slot: sum(place * weight for place, weight in h) / sum(weight for _, weight in h) for slot, h in wanted.items()
    }
    fixed = [slot for slot in column if slot not in mean]
    movable = sorted((slot for slot in column if slot in mean), key=lambda slot: mean[slot])
    kept = {column.index(slot): slot for slot in fixed}
    ordered = iter(movable)
    layers.columns[n] = [kept[k] if k in kept else next(ordered) for k in range(len(column))]


def _port_shift(end: End) -> float:
    if end.port is None:
        return 0.0
    up = {"N": -0.4, "S": 0.4}.get(end.port.side, 0.0)
    return up + 0.004 * end.port.along


def _places(layers: Layers, near: int | None = None) -> dict[Slot, float]:
    """Places of slots in their columns; with a number only in that column and its neighbours, where its lines end."""
    columns = layers.columns if near is None else layers.columns[max(near - 1, 0) : near + 2]
    return {slot: float(k) for column in columns for k, slot in enumerate(column)}


def _crossings_in(channel: Channel, places: dict[Slot, float]) -> float:
    lines = [
        (places[a.slot] + _port_shift(a), places[b.slot] + _port_shift(b), net)
        for net, (before, after) in channel.nets.items()
        for a in before or after[:1]
        for b in after or before[:1]
    ]
    count = 0.0
    for k, (a, b, net) in enumerate(lines):
        for c, d, other in lines[k + 1 :]:
            if net is not other and (a - c) * (b - d) < 0:
                count += 1.0 + 0.1 * min(net.stroke.weight, other.stroke.weight)
    # Nets with both ends on one side enclose the slots between.
    return count + sum(0.05 * abs(a - b) for a, b, _ in lines)


def _swap(layers: Layers, before: Heights) -> None:
    """Exchange neighbours as long as crossings decrease, by more than it costs to move."""
    for n, column in enumerate(layers.columns):
        near = (layers.channels[n], layers.channels[n + 1])
        places = _places(layers, n)
        now = sum(_crossings_in(channel, places) for channel in near) + _MOVED * _moved(column, before)
        better = True
        while better:
            better = False
            for a, b in pairwise(range(len(column))):
                column[a], column[b] = column[b], column[a]
                places[column[a]], places[column[b]] = float(a), float(b)
                changed = sum(_crossings_in(channel, places) for channel in near) + _MOVED * _moved(column, before)
                if changed < now - 1e-9:
                    now, better = changed, True
                else:
                    column[a], column[b] = column[b], column[a]
                    places[column[a]], places[column[b]] = float(a), float(b)
