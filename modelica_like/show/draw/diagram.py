"""Content of a schematic: parts with their ports, and the nets between them."""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeVar, cast

from modelica_like.language.component import Component
from modelica_like.language.declared import Connector, Declared
from modelica_like.language.equation import Connection
from modelica_like.language.expr import Symbol
from modelica_like.language.fields import Field, Input, Output
from modelica_like.language.icon import PLAIN, SIGNAL, Icon, Side, Stroke
from modelica_like.language.inside import declarations, inside
from modelica_like.language.places import located

_USUAL: dict[str, Side] = {
    "flange_b": "E", "n": "E", "port_b": "E", "flange_t": "E", "support": "S", "heat_port": "S",
}  # fmt: skip
_BESIDE = 9.0
"""Distance of ports at one place of a symbol, in 1/96 inch."""
_Entry = TypeVar("_Entry")
Notes = Callable[[Component], Sequence[str]]
_OPPOSITE: dict[Side, Side] = {"W": "E", "E": "W", "N": "N", "S": "S"}


@dataclass(eq=False)
class Port:
    """A connected connector or signal of a node.

    Attributes:
        name: path inside the node.
        node: whose it is.
        side: of the symbol.
        along: place along the side, from its middle.
        stroke: how its connections are drawn.
        signal: 1 for an output, -1 for an input, 0 for a connector.
        mark: icon drawn here, such as a ground.
        ground: the end that has this icon.
    """

    name: str
    node: Node
    side: Side
    along: float
    stroke: Stroke
    signal: int = 0
    mark: Icon | None = None
    ground: Port | None = None

    @property
    def way(self) -> Side:
        """Where its line leaves the node: signals enter from the west, ports in the south leave to the east."""
        if self.side in ("W", "E"):
            return self.side
        return "W" if self.signal < 0 or (self.side == "N" and not self.signal) else "E"


@dataclass(eq=False)
class Node:
    """A part, or an outer connector of an assembly (then without component).

    Attributes:
        name: its name.
        component: the part.
        icon: its symbol; none for a box.
        inside: content of an open assembly.
        ports: connected ports, by name.
        border: for an outer connector, its side of the box.
        turned: whether west and east are exchanged.
        notes: texts below the name, instead of a value.
    """

    name: str
    component: Component | None
    icon: Icon | None = None
    inside: Diagram | None = None
    ports: dict[str, Port] = field(default_factory=dict)
    border: Side | None = None
    turned: bool = False
    notes: Sequence[str] | None = None

    def turn(self) -> None:
        """Exchange west and east; signals stay, because they are read from left to right."""
        if self.inside:
            return
        for port in self.ports.values():
            if not port.signal:
                port.side = _OPPOSITE[port.side]
            if port.side in ("N", "S"):
                port.along = -port.along
        self.turned = not self.turned


@dataclass(eq=False)
class Net:
    """Ports that are joined."""

    ports: list[Port]

    @property
    def stroke(self) -> Stroke:
        """How it is drawn."""
        return self.ports[0].stroke


@dataclass(eq=False)
class Diagram:
    """Nodes and nets of an assembly."""

    nodes: list[Node]
    nets: list[Net]


def diagram(component: Component, depth: int, notes: Notes | None = None, *, open_ends: bool = False) -> Diagram:
    """Collect the content of a component's schematic.

    Args:
        component: a drive, or a part of one.
        depth: number of levels of open assemblies.
        notes: returns texts below the name of a part.
        open_ends: whether ends that are not connected are ports, too, and grounds without a line are drawn.
    """
    nodes = {
        name: Node(
            name, part, part.icon, diagram(part, depth - 1, notes) if _opens(part, depth) else None,
            notes=notes(part) if notes else None,
        )
        for name, part in component.parts.items()
    }  # fmt: skip
    outer = dict[str, Node]()
    nets = [Net([_port(end, component, nodes, outer) for end in ends]) for ends in _joined(component)]
    used = {port.node for net in nets for port in net.ports}
    for net in nets:
        _mark(net)
    kept = [node for node in nodes.values() if not _at_ports(node) or (open_ends and node not in used)]
    for node in kept if open_ends else ():
        for name, stroke, drives in ends_of(node):
            if name not in node.ports:
                node.ports[name] = Port(name, node, *_place(node.icon, name, drives), stroke, drives)
    picture = Diagram([*kept, *outer.values()], [net for net in nets if len(net.ports) > 1])
    for node in kept:
        if node.icon is None:
            _box(node)
    _orient(picture)
    for node in kept:
        _spread(node)
    for node in outer.values():
        (port,) = node.ports.values()
        node.border = _OPPOSITE[port.side]
    return picture


def ends_of(node: Node, *, optional: bool = False) -> Iterator[tuple[str, Stroke, int]]:
    """Yield the ends that a part always has, or the others: names, strokes, and 1 for outputs, -1 for inputs.

    Args:
        node: of the part.
        optional: the others: optional connectors, and inputs that have a value.
    """
    part = node.component
    for name, connector in part.connectors.items() if part else ():
        if connector.optional == optional:
            yield name, connector.stroke or PLAIN, 0
    for name, entry in part.fields.items() if part else ():
        if not isinstance(entry, Input | Output):
            continue
        if optional == (isinstance(entry, Input) and part is not None and part.given(name)):
            yield name, SIGNAL, 1 if isinstance(entry, Output) else -1


def _at_ports(node: Node) -> bool:
    return node.icon is not None and node.icon.at_ports


def alone(part: type[Component] | Component) -> Node:
    """Return a component type, or a part, as a node without a name, with the ends that it always has as ports."""
    if isinstance(part, Component):
        node = Node("", part, part.icon)
        ends = ends_of(node)
    else:
        known, node = declarations(part), Node("", None, part.icon)
        ends = _ends_always(known.connectors, known.fields)
    for name, stroke, drives in ends:
        node.ports[name] = Port(name, node, *_place(node.icon, name, drives), stroke, drives)
    if node.icon is None:
        _box(node)
    _spread(node)
    return node


def _ends_always(connectors: Mapping[str, Connector], fields: Mapping[str, Field]) -> Iterator[tuple[str, Stroke, int]]:
    yield from (
        (name, connector.stroke or PLAIN, 0) for name, connector in connectors.items() if not connector.optional
    )
    for name, entry in fields.items():
        if isinstance(entry, Input | Output):
            yield name, SIGNAL, 1 if isinstance(entry, Output) else -1


def _opens(part: Component, depth: int) -> bool:
    return depth > 0 and part.icon is None and bool(part.parts) and any(_joined(part))


def _joined(component: Component) -> Iterator[list[Connector | Symbol]]:
    """Yield each set of joined ports once."""
    sets: dict[int, dict[tuple[int, str], Connector | Symbol]] = {}
    number_of: dict[tuple[int, str], int] = {}
    for number, (statement, _) in enumerate(located(component.equations())):
        if isinstance(statement, Connection):
            new = {
                (id(end.owner), end.name) if isinstance(end, Symbol) else (id(end), ""): end for end in statement.ends
            }
            for old in sorted({number_of[end] for end in new if end in number_of}):
                new = sets.pop(old) | new
            number_of |= dict.fromkeys(new, number)
            sets[number] = new
    yield from (list(net.values()) for net in sets.values())


def _port(end: Connector | Symbol, scope: Component, nodes: dict[str, Node], outer: dict[str, Node]) -> Port:
    """The port of a part, or of a node for an outer connector."""
    names = [end.name if isinstance(end, Symbol) else inside(end).name]
    owner = cast("Declared", end.owner if isinstance(end, Symbol) else inside(end).owner)
    while owner is not scope:
        names.append(inside(owner).name)
        owner = cast("Declared", inside(owner).owner)
    *_, first = names
    inner = first in nodes and len(names) > 1
    node = nodes[first] if inner else outer.setdefault(first, Node(first, None))
    name = ".".join(reversed(names[: len(names) - inner]))
    if name not in node.ports:
        drives = 0
        if isinstance(end, Symbol):
            drives = 1 if isinstance(end.owner.fields[end.name], Output) else -1
        stroke = SIGNAL if isinstance(end, Symbol) else end.stroke or PLAIN
        side, along = _place(node.icon, name, drives)
        node.ports[name] = Port(name, node, side, along, stroke, drives)
    return node.ports[name]


def find_entry(entries: Mapping[str, _Entry], name: str) -> _Entry | None:
    """Return what a symbol says about a port; elements of an array, and ends within one, have the place of that."""
    return entries.get(name) or entries.get(re.split(r"[\[.]", name)[0])


def _place(icon: Icon | None, name: str, drives: int) -> tuple[Side, float]:
    given = find_entry(icon.ports, name) if icon else None
    if given is not None:
        return (given, 0.0) if isinstance(given, str) else given
    return _USUAL.get(name, "E" if drives > 0 else "W"), 0.0


def _mark(net: Net) -> None:
    """Draw grounds where they are used."""
    grounds = [port for port in net.ports if _at_ports(port.node)]
    if grounds:
        for port in net.ports:
            port.mark, port.ground = grounds[0].node.icon, grounds[0]
        net.ports.clear()


def _box(node: Node) -> None:
    """Distribute the ports of a box over its sides."""
    if node.inside:
        for outer in node.inside.nodes:
            if outer.border and outer.name in node.ports:
                node.ports[outer.name].side = outer.border
        return
    for port in node.ports.values():
        if port.side in ("N", "S"):
            port.side = "W"
    for side in ("W", "E"):
        there = [port for port in node.ports.values() if port.side == side]
        for k, port in enumerate(there):
            port.along = 18.0 * (k - (len(there) - 1) / 2)


def _spread(node: Node) -> None:
    """Draw ports at one place of a symbol side by side."""
    places: dict[tuple[Side, float], list[Port]] = {}
    for port in node.ports.values():
        places.setdefault((port.side, port.along), []).append(port)
    for there in places.values():
        for k, port in enumerate(there):
            port.along += _BESIDE * (k - (len(there) - 1) / 2)


def _orient(picture: Diagram) -> None:
    """Turn nodes so that power flows from west to east: from the first part on, nets are entered from the west."""
    nets_of: dict[Node, list[Net]] = {node: [] for node in picture.nodes}
    for net in picture.nets:
        for port in net.ports:
            nets_of[port.node].append(net)
    reached = set[Node]()
    for node in picture.nodes:
        for port in node.ports.values() if node.component is None else ():
            port.side = _OPPOSITE[port.side]
    for first in sorted(picture.nodes, key=_rank):
        if first in reached or (first.component is None and any(end.side == "W" for end in _ends(first))):
            continue
        reached.add(first)
        pending = deque([first])
        while pending:
            node = pending.popleft()
            for port in sorted(_ends(node), key=lambda x: x.side != "E"):
                for other in (other for net in nets_of[node] if port in net.ports for other in net.ports):
                    if other.node in reached or other.node.component is None or other.signal:
                        continue
                    if other.side == port.side and other.side in ("W", "E"):
                        other.node.turn()
                    reached.add(other.node)
                    pending.append(other.node)


def _rank(node: Node) -> int:
    """Outer connectors come first, then sources: all their connectors are in the east."""
    if node.component is None:
        return 0
    sides = {_place(node.icon, name, 0)[0] for name in node.component.connectors} - {"N", "S"}
    return 1 if sides == {"E"} else 2


def _ends(node: Node) -> list[Port]:
    """Ports that carry power along the drive."""
    return [port for port in node.ports.values() if not port.signal and port.side in ("W", "E")]
