"""Open ends of a drive: adaptors that make them causal, and the FMI 3 terminals they become."""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from typing import Literal

from modelica_like.compile.compiled import CompiledTerminal
from modelica_like.errors import ExportError
from modelica_like.fmi.xml import Element, document, element
from modelica_like.language import Assembly, Component, Connector, Equations, connect
from modelica_like.language.declared import unknown
from modelica_like.language.equation import FreeEnd
from modelica_like.language.inside import declarations, inside
from modelica_like.netlist.registry import library_types

Takes = Literal["flow", "potential"]

_FAMILIES = ("rotational", "translational", "electrical", "thermal")
_WIDTH = 100.0
_MARGIN = 10.0


def with_open_ends(drive: Component, ends: Sequence[str] = (), takes: Takes = "flow") -> Component:
    """Return a drive whose open ends have adaptors.

    Open ends are the connectors that the drive itself has (a netlist's `expose`), and free connectors of parts that are
    named in `ends`. The adaptor of `gear.shaft` is the part `gear_shaft`, that of an own connector `shaft` is
    `shaft_end`. A single component becomes a drive with one part, and all its connectors are open.

    Args:
        drive: the drive, which is not changed.
        ends: paths of free connectors.
        takes: quantity from outside: the `flow` (torque, force, current, heat flow) or the `potential`.

    Raises:
        UnknownName: there is no such connector.
        ExportError: no library has an adaptor for one.
    """
    if drive.connectors and not drive.parts:
        name = type(drive).__name__.lower()
        alone = Assembly(type(drive).__name__, parts={name: drive})
        return with_open_ends(alone, [f"{name}.{end}" for end in drive.connectors], takes)
    paths = tuple(dict.fromkeys([*drive.connectors, *ends]))
    if not paths:
        return drive
    adaptors = {path: adaptor_for(connector_at(drive, path), takes) for path in paths}
    twin = drive.copy()
    inside(twin).name = inside(drive).name
    pairs = {
        path: (path.replace(".", "_") if "." in path else f"{path}_end", end) for path, (_, end) in adaptors.items()
    }
    twin.__class__ = _opened(type(drive), pairs)
    for path, (kind, _) in adaptors.items():
        setattr(twin, pairs[path][0], kind())
    return twin


def _opened(kind: type[Component], pairs: Mapping[str, tuple[str, str]]) -> type[Component]:
    """A drive of the same class that also connects its open ends."""

    class Opened(kind):  # type: ignore[misc, valid-type]
        def equations(self) -> Equations:
            ends = {id(connector_at(self, path)): path for path in pairs}
            for statement in super().equations():
                # Ends that were declared free are no longer free.
                if not (isinstance(statement, FreeEnd) and id(statement.connector) in ends):
                    yield statement
            for path, (part, end) in pairs.items():
                yield connect(connector_at(self, path), self.parts[part].connectors[end])

    Opened.__name__, Opened.__qualname__ = kind.__name__, kind.__qualname__
    return Opened


def connector_at(drive: Component, path: str) -> Connector:
    """Return the connector at a path.

    Raises:
        UnknownName: there is none.
    """
    owner_path, _, name = path.rpartition(".")
    owner = drive.find(owner_path)
    if name not in owner.connectors:
        raise unknown("connector", owner.label, name, list(owner.connectors))
    return owner.connectors[name]


def adaptor_for(connector: Connector, takes: Takes) -> tuple[type[Component], str]:
    """Return the type of the adaptor for a connector, and the name of its end.

    Raises:
        ExportError: no library has one.
    """
    for kind in library_types().values():
        ends = {name: c for name, c in declarations(kind).connectors.items() if type(c) is type(connector)}
        if kind.terminal is not None and kind.terminal.takes == takes and len(ends) == 1:
            return kind, next(iter(ends))
    raise ExportError(
        f"{connector.label} cannot be opened: no library has an adaptor for a {type(connector).__name__} that takes "
        f"its {takes}.",
        advice="Write one: a component with that connector, inputs and outputs, and `terminal = Terminal(…)`.",
    )


def icon_name(kind: str) -> str:
    """Return the name of the picture for a kind of terminal."""
    return next((family for family in _FAMILIES if family in kind), "terminal")


def terminals_and_icons(terminals: Sequence[CompiledTerminal], icon: bytes) -> str:
    """Write terminalsAndIcons.xml: the icon of the FMU, and its terminals along the right side.

    Args:
        terminals: of the FMU.
        icon: its picture as PNG.
    """
    wide, high = struct.unpack(">II", icon[16:24])
    height = max(_WIDTH * high / wide, 1.5 * _MARGIN * (len(terminals) + 1))
    top = Element("fmiTerminalsAndIcons", {"fmiVersion": "3.0"})
    picture = element(top, "GraphicalRepresentation")
    element(picture, "CoordinateSystem", x1=0.0, y1=0.0, x2=_WIDTH, y2=height, suggestedScalingFactorTo_mm=0.1)
    space = (height - _WIDTH * high / wide) / 2
    element(picture, "Icon", x1=0.0, y1=space, x2=_WIDTH, y2=height - space)
    if terminals:
        group = element(top, "Terminals")
        for place, end in enumerate(terminals, 1):
            terminal = element(group, "Terminal", name=end.name, matchingRule="plug", terminalKind=end.kind)
            for member, variable in end.members:
                element(
                    terminal, "TerminalMemberVariable", variableName=variable, memberName=member, variableKind="signal"
                )
            middle = height * place / (len(terminals) + 1)
            element(
                terminal, "TerminalGraphicalRepresentation", defaultConnectionColor="0 0 0",
                defaultConnectionStrokeSize=1.0, x1=_WIDTH - _MARGIN, y1=middle - _MARGIN / 2, x2=_WIDTH,
                y2=middle + _MARGIN / 2, iconBaseName=icon_name(end.kind),
            )  # fmt: skip
    return document(top)
