"""Connection sets and their equations."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import cached_property

from modelica_like.errors import FreeFlange, ModelicaLikeError, Source, WrongConnection
from modelica_like.flatten.checks import unit_of_field
from modelica_like.language.assembly import Assembly
from modelica_like.language.component import Component
from modelica_like.language.declared import Connector, Declared
from modelica_like.language.equation import Connection, FreeEnd
from modelica_like.language.expr import Symbol
from modelica_like.language.fields import Input, Output
from modelica_like.language.inside import inside
from modelica_like.language.units import ONE, Unit, same_dimension

End = tuple[int, bool]
"""A connector (its id) seen from inside or from outside (True) its component."""
_SHAFTS_OF_TWO_SETS = 4
_PARTNERS_OF = 20
"""Errors up to which the other end of a free one is looked for among all parts."""


@dataclass
class Wiring:
    """All connections of a model, collected from the root downwards."""

    parent: dict[End, End] = field(default_factory=dict)
    connectors: dict[End, Connector] = field(default_factory=dict)
    sources: dict[End, Source] = field(default_factory=dict)
    signals: list[tuple[Symbol, Symbol, Source]] = field(default_factory=list)
    driven: dict[tuple[int, str], Source] = field(default_factory=dict)
    freed: set[int] = field(default_factory=set)
    errors: list[ModelicaLikeError] = field(default_factory=list)
    inferred: dict[tuple[int, str], Unit] = field(default_factory=dict)

    def add(self, scope: Component, statement: Connection | FreeEnd) -> None:
        """Add the connections declared by a component."""
        ends = (statement.connector,) if isinstance(statement, FreeEnd) else statement.ends
        foreign = [end for end in ends if not _is_within(end, scope)]
        if foreign:
            self._refuse(
                f"{scope.label} connects {_name(foreign[0])} of a component that is not part of it.", statement.source,
                "Name parts as self.…, to use the copy of this owner.",
            )  # fmt: skip
        elif isinstance(statement, FreeEnd):
            self.freed.add(id(statement.connector))
        elif any(isinstance(end, Symbol) for end in ends):
            self._add_signals(scope, statement)
        else:
            self._join(scope, [end for end in ends if isinstance(end, Connector)], statement.source)

    def _join(self, scope: Component, ends: list[Connector], source: Source) -> None:
        for end in ends:
            if type(end) is not type(ends[0]):
                self.errors.append(_different_kinds(ends[0], end, source))
                # Their missing connection is a consequence, not another error.
                self.freed.update(id(e) for e in ends)
                return
        first, *others = (self._key(scope, end, source) for end in ends)
        for key in others:
            self.parent[self._root(key)] = self._root(first)

    def _refuse(self, what: str, where: Source | tuple[Source, ...], advice: str) -> None:
        self.errors.append(WrongConnection(what, where=where, advice=advice))

    def _key(self, scope: Component, connector: Connector, source: Source) -> End:
        inside(connector).used = True
        key = (id(connector), inside(connector).owner is not scope)
        self.parent.setdefault(key, key)
        self.connectors[key] = connector
        self.sources.setdefault(key, source)
        return key

    def _root(self, end: End) -> End:
        while self.parent[end] != end:
            self.parent[end] = self.parent[self.parent[end]]
            end = self.parent[end]
        return end

    def sets(self) -> Iterator[list[End]]:
        """Yield the connection sets."""
        groups: dict[End, list[End]] = {}
        for end in self.parent:
            groups.setdefault(self._root(end), []).append(end)
        yield from groups.values()

    def is_connected(self, connector: Connector) -> bool:
        """Return whether it is connected from outside its component."""
        return (id(connector), True) in self.parent

    def _add_signals(self, scope: Component, statement: Connection) -> None:
        signals = [end for end in statement.ends if isinstance(end, Symbol)]
        others = [end for end in statement.ends if not isinstance(end, Symbol)]
        wrong = [s for s in signals if not isinstance(s.owner.fields.get(s.name), Input | Output)]
        drivers = [] if wrong else _givers(scope, signals)
        if others:
            what = f"connect joins the signal {_name(signals[0])} with the connector {_name(others[0])}."
            advice = "Signals go to signals: use a sensor or a source between."
        elif wrong:
            what = f"connect joins {_name(wrong[0])}, which is neither an input nor an output."
            advice = "Connect one output with any number of inputs; a sensor turns a variable into a signal."
        elif len(drivers) != 1:
            count = f"{len(drivers)} outputs ({', '.join(map(_name, drivers))})" if drivers else "no output"
            what = f"The connection of {', '.join(map(_name, signals))} has {count}."
            advice = "Connect one output with any number of inputs."
        else:
            for sink in signals:
                if sink is not drivers[0]:
                    self._drive(sink, drivers[0], statement.source)
            return
        self._refuse(what, statement.source, advice)

    def _drive(self, sink: Symbol, driver: Symbol, source: Source) -> None:
        key = (id(sink.owner), sink.name)
        if key in self.driven:
            advice = "Keep one connection; add signals in a separate component."
            self._refuse(f"The input {_name(sink)} is connected twice.", (source, self.driven[key]), advice)
            return
        self.driven[key] = source
        self.signals.append((driver, sink, source))

    def check_signal_units(self) -> None:
        """Compare the units along signal connections, after all templates are known."""
        for driver, sink, source in self.signals:
            if not all((inside(symbol.owner).owner or symbol.owner).units_checked for symbol in (driver, sink)):
                continue
            units = [self.inferred.get((id(s.owner), s.name)) or unit_of_field(s.owner, s.name) for s in (driver, sink)]
            # In Modelica text, a signal without a unit takes any.
            if any(unit == ONE and not s.owner.units_checked for s, unit in zip((driver, sink), units, strict=True)):
                continue
            if not same_dimension(*units):
                what = f"{_name(driver)} is in {units[0]}, {_name(sink)} expects {units[1]}."
                self._refuse(what, source, "Give the source's parameters in that unit.")

    def check_free(self, component: Component) -> None:
        """Collect an error for every connector that must be connected and is not."""
        for name, connector in component.connectors.items():
            if connector.may_be_free or self.is_connected(connector) or id(connector) in self.freed:
                continue
            owner = inside(component).owner
            label, end, flow = component.label, f"{inside(component).name}.{name}", connector.domain.flow
            alike = [end for end in component.connectors.values() if type(end) is type(connector) and not end.optional]
            # Of three shafts of a planetary set none carries torque if one does not; with four, two others do.
            idle = f"{label} ({type(component).__name__})" if len(alike) < _SHAFTS_OF_TWO_SETS else "it"
            listed = isinstance(owner, Assembly)
            say = f'list it: free = ["{end}"]' if listed else f"yield free(self.{end})"
            operation = {"operation": "free", "end": end} if listed else None
            partner = self._partner(component, connector) if listed else ""
            if partner:
                operation = {"operation": "connect", "first": end, "second": partner}
            self.errors.append(
                FreeFlange(
                    f"{label}.{name} is free, so {idle} carries no {flow}.",
                    where=component.place_of(),
                    advice=f"Connect it{partner and ' to '}{partner}, or {say}." if owner else "Connect it in a drive.",
                    operation=operation,
                )
            )

    def _partner(self, component: Component, connector: Connector) -> str:
        """Return the only end of other parts to which a free one can be meant to be connected, or an empty text.

        It is on the other side of its part, has no connection, and no path of connected parts leads there already. An
        end that may be free is not meant, unless nothing of its part is connected.
        """
        owner, network, side = inside(component).owner, self._networks.get(id(component)), side_of(connector)
        # A connection that was refused may be the one that is missing.
        is_known = len(self.errors) < _PARTNERS_OF and all(isinstance(error, FreeFlange) for error in self.errors)
        if not isinstance(owner, Component) or not side or not is_known:
            return ""
        ends = [
            f"{inside(part).name}.{name}"
            for part in owner.walk()
            if part is not component and inside(part).owner is owner
            and (network is None or self._networks.get(id(part)) != network)
            for name, end in part.connectors.items()
            if type(end) is type(connector) and side_of(end) == -side
            and not (end.optional or self.is_connected(end) or id(end) in self.freed)
            and not (end.may_be_free and id(part) in self._networks)
        ]  # fmt: skip
        return ends[0] if len(ends) == 1 else ""

    @cached_property
    def _networks(self) -> dict[int, int]:
        """The identity of one part of its network, by that of each connected part."""
        above: dict[int, int] = {}

        def top(part: int) -> int:
            while above.setdefault(part, part) != part:
                above[part] = part = above[above[part]]
            return part

        for ends in self.sets():
            first, *others = (id(inside(self.connectors[end]).owner) for end in ends)
            for other in others:
                above[top(other)] = top(first)
        return {part: top(part) for part in above}


def side_of(connector: Connector) -> int:
    """Return 1 for the outlet of its part, -1 for the inlet, 0 for what is both or none."""
    kind, name = type(inside(connector).owner), inside(connector).name
    if not issubclass(kind, Component):
        return 0
    return (name in kind.outlet.split()) - (name in kind.inlet.split())


def _is_within(end: Connector | Symbol, scope: Component) -> bool:
    node: Declared | None = end.owner if isinstance(end, Symbol) else end
    while node is not None and node is not scope:
        node = inside(node).owner
    return node is scope


def _givers(scope: Component, ends: Iterable[Connector | Symbol]) -> list[Symbol]:
    """Return what gives a connection its signal: an own input, a part's output, or an own output without these."""
    kinds = [(end, end.owner is scope, end.owner.fields[end.name]) for end in ends if isinstance(end, Symbol)]
    first = [end for end, outer, field in kinds if isinstance(field, Input if outer else Output)]
    return first or [end for end, _, field in kinds if isinstance(field, Output)]


def taken(scope: Component, connection: Connection) -> list[str]:
    """Return the own signals that a connection determines, and the own connectors in it."""
    connectors = [
        inside(end).name for end in connection.ends if isinstance(end, Connector) and inside(end).owner is scope
    ]
    givers = [id(giver) for giver in _givers(scope, connection.ends)]
    signals = [end for end in connection.ends if isinstance(end, Symbol) and end.owner is scope]
    return connectors + [signal.name for signal in signals if id(signal) not in givers]


def _name(end: Connector | Symbol) -> str:
    return end.label if isinstance(end, Connector) else ".".join(filter(None, (end.owner.path, end.name)))


def _different_kinds(first: Connector, second: Connector, source: Source) -> WrongConnection:
    kinds = [f"{type(c).__name__} ({', '.join(f.unit_text for f in c.fields.values())})" for c in (first, second)]
    converter = first.domain.converters.get(type(second).__name__)
    between = f"{converter} goes between." if converter else "Join connectors of one kind."
    first_one, second_one = kinds
    article = "an" if first_one.startswith(tuple("AEIOU")) else "a"
    advice, word, instead = _fitting(first, second)
    return WrongConnection(
        f"connect({first.label}, {second.label}): {article} {first_one} cannot join a {second_one}. {between}",
        where=source, advice=advice, word=word, instead=instead,
    )  # fmt: skip


def _fitting(first: Connector, second: Connector) -> tuple[str, str, str]:
    """Return the connection that is meant where a part has one other end of the kind; the wrong end, the right one."""
    for end, other in ((first, second), (second, first)):
        owner = inside(other).owner
        connectors = owner.connectors.values() if isinstance(owner, Component) else ()
        ends = [connector for connector in connectors if type(connector) is type(end) and not connector.optional]
        if len(ends) == 1:
            meant = [end.label, ends[0].label] if end is first else [ends[0].label, end.label]
            return f'To join them, write in [connect]: joint = ["{meant[0]}", "{meant[1]}"]', other.label, ends[0].label
    return "", "", ""
