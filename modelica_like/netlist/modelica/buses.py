"""Expandable connectors: buses, whose variables are those that connections anywhere name.

Buses that are joined have the same variables. Each of these has one source, an output of a part or an input of a class,
and is an input of every bus that has it: the source drives them all, in the lowest class that has them in it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace

from modelica_like.errors import ModelicaTextError, Source
from modelica_like.netlist.modelica import fold
from modelica_like.netlist.modelica.causal import Pair, bus_of, connections, parts_below, variable_at
from modelica_like.netlist.modelica.instance import DEEPEST, Given, Instance, Member
from modelica_like.netlist.modelica.members import part_at, parts_in, sizes
from modelica_like.netlist.modelica.signals import drives, is_inner, kept
from modelica_like.netlist.modelica.tree import Declaration, Expr, Modification
from modelica_like.netlist.modelica.types import Basic, basic_type
from modelica_like.netlist.modelica.wiring import groups
from modelica_like.netlist.modelica.written import MEMORY

_NO_PLACE = Source("")


def join_buses(root: Instance) -> None:
    """Find the variables of all expandable connectors in an instance, and what drives them.

    Raises:
        ModelicaTextError: a variable has no source, or several.
    """
    instances = {instance.path: instance for instance in (root, *(part for part, _ in parts_below(root)))}
    buses = {bus.path: bus for instance in instances.values() for bus in _buses_in(instance)}
    if buses:
        _Buses(instances, buses).run()


def bus_equations(instance: Instance) -> Iterator[tuple[Expr, Expr, Source]]:
    """Yield the equations between variables of buses and own signals of an instance."""
    for path, other, source in instance.bus_equations:
        left, right = variable_at(instance, path), variable_at(instance, other)
        if left.kind == "condition":
            right = Expr("condition", right.args)
        elif _truth_of_bus(instance, path):  # the value itself, also one that is true for an instant only
            left, right = kept(path), Expr("condition", right.args)
        elif right.kind == "condition":
            right = Expr("if", (right, fold.number(1), fold.number(0)))
        yield left, right, source


def _buses_in(instance: Instance) -> Iterator[Instance]:
    """Yield the expandable connectors of an instance, and those within them."""
    for _, part in parts_in(instance):
        if isinstance(part, Instance) and part.text.expandable:
            yield part
            yield from _buses_in(part)


def _is_bus(instance: Instance, end: str) -> bool:
    part = part_at(instance, end)
    return isinstance(part, Instance) and part.text.expandable


def _truth_of_bus(instance: Instance, path: str) -> bool:
    bus = part_at(instance, _above(path)) if "." in path else None
    return isinstance(bus, Instance) and f"{_last(path)}{MEMORY}" in bus.lent


def _within(instance: Instance, end: str) -> str:
    return f"{instance.path}.{end}".lstrip(".")


def _above(path: str) -> str:
    return path.rpartition(".")[0]


def _last(path: str) -> str:
    return path.rpartition(".")[2]


@dataclass(frozen=True)
class _End:
    """A signal that is connected with a variable of a bus, and the path of that, both of one instance."""

    instance: Instance
    path: str
    variable: str
    source: Source

    @property
    def is_own(self) -> bool:
        """Whether it is a signal of the class itself."""
        return "." not in self.path

    @property
    def gives(self) -> bool:
        """Whether the bus has its value."""
        if is_inner(self.instance, self.path):
            member = self.instance.members[self.path.partition("[")[0]]
            basic = basic_type(self.instance, member)
            return basic is not None and "output" in basic.prefixes
        return drives(self.instance, self.path)


@dataclass
class _Buses:
    """All expandable connectors of a model, and the variables that are in them; paths are those from the model.

    Args:
        instances: the model and its parts, by their paths.
        buses: likewise.

    Attributes:
        joined: pairs of buses.
        equal: pairs of variables of buses.
        ends: signals, by the variable they are connected with.
    """

    instances: dict[str, Instance]
    buses: dict[str, Instance]
    joined: list[Pair] = field(default_factory=list[Pair])
    equal: list[Pair] = field(default_factory=list[Pair])
    ends: dict[str, list[_End]] = field(default_factory=dict[str, list[_End]])

    def run(self) -> None:
        """Give each bus its variables, and each variable its source."""
        for instance in self.instances.values():
            self._collect(instance)
        named = sorted({path for pair in self.equal for path in pair[:2]})
        same = self._same(_above(path) for path in named)
        self._add_buses(same)
        alike = [(path, f"{bus}.{_last(path)}", _NO_PLACE) for path in named for bus in same[_above(path)]]
        sets = [wire.ends for wire in groups([*self.equal, *alike])]
        members: dict[str, dict[str, Member]] = {bus: {} for bus in self.buses}
        for paths in sets:
            self._declare(paths, members)
        for path, bus in self.buses.items():
            kept = {
                name: member
                for name, member in bus.members.items()
                if {"parameter", "constant"} & member.declaration.prefixes or basic_type(bus, member) is None
            }
            bus.members = kept | members[path]
        for paths in sets:
            self._drive(paths)

    def _collect(self, instance: Instance) -> None:
        """Take the connections with buses out of those of an instance."""
        own = connections(instance)
        inside = {end for pair in own for end in pair[:2] if bus_of(instance, end)}
        whole = {end for end in inside if _is_bus(instance, end)}
        instance.pairs = []
        places = {end: source for *ends, source in own for end in ends}
        for wire in groups(own):
            if not inside & {*wire.ends}:
                instance.pairs += [pair for pair in own if pair[0] in wire.ends]
                continue
            variables = [end for end in wire.ends if end in inside]
            signals = [end for end in wire.ends if end not in inside]
            pairs = [(_within(instance, variables[0]), _within(instance, end), wire.source) for end in variables]
            if whole & {*wire.ends}:
                if signals:
                    what = f"{variables[0]} is a bus, and {signals[0]} is none."
                    raise ModelicaTextError(what, where=wire.source, advice="Connect a variable of the bus.")
                self.joined += pairs
                continue
            self.equal += pairs
            for end in signals:
                self.ends.setdefault(pairs[0][0], []).append(_End(instance, end, variables[0], places[end]))

    def _same(self, named: Iterable[str]) -> dict[str, list[str]]:
        """Return the buses that are joined with each; those in joined ones are joined, too."""
        buses = {*self.buses, *named, *(end for pair in self.joined for end in pair[:2])}
        pairs = list(self.joined)
        for _ in range(DEEPEST):
            wires = groups([*pairs, *((bus, bus, _NO_PLACE) for bus in sorted(buses))])
            pairs = list(self.joined)
            for wire in wires:
                inner = {_last(bus) for bus in buses if _above(bus) in wire.ends}
                below = [[f"{end}.{name}" for end in wire.ends] for name in sorted(inner)]
                pairs += [(first, other, wire.source) for first, *others in below for other in (first, *others)]
            more = {end for pair in pairs for end in pair[:2]}
            if more <= buses and len(groups([*pairs, *((bus, bus, _NO_PLACE) for bus in buses)])) == len(wires):
                return {bus: wire.ends for wire in wires for bus in wire.ends}
            buses |= more
        bus = next(iter(self.buses.values()))
        raise ModelicaTextError(
            "A bus is joined with one that is in it.", where=bus.text.place(bus.text.line),
            advice="Connect it with a bus that stands beside it.",
        )  # fmt: skip

    def _add_buses(self, same: dict[str, list[str]]) -> None:
        """Declare the buses within buses that only those have that they are joined with."""
        for path in sorted(same.keys() - self.buses.keys(), key=len):
            owner = self.buses.get(_above(path))
            model = next((self.buses[other] for other in same[path] if other in self.buses), None)
            if owner is None or model is None or model.owner is None:
                place = next(
                    (pair[2] for pair in (*self.joined, *self.equal) if path in map(_above, pair[:2])), _NO_PLACE
                )
                advice = "Declare it in the class of the bus, or join it with a connector."
                raise ModelicaTextError(f"There is no connector {path}.", where=place, advice=advice)
            name = _last(path).partition("[")[0]
            member = model.owner.members[model.name.partition("[")[0]]
            shape = tuple(map(fold.number, sizes(model.owner, member)))
            declared = replace(member.declaration, name=name, dimensions=shape, condition=None)
            owner.members.setdefault(name, Member(declared, member.text, member.given))
            part = part_at(owner, _last(path))
            assert isinstance(part, Instance)
            self.buses[path] = part

    def _declare(self, paths: list[str], members: dict[str, dict[str, Member]]) -> None:
        """Declare a variable in the buses that have it; its type is that of a declaration, or of its source."""
        basic, shape, member = self._declared(paths)
        for path in paths:
            name, _, index = _last(path).partition("[")
            before = members[_above(path)].get(name)
            known = shape or tuple(int(k) for k in index.rstrip("]").split(",") if k)
            if before is not None and not shape:
                sizes_before = (int(size.args[0]) for size in before.declaration.dimensions)
                known = tuple(map(max, sizes_before, known))
            kind = basic.kind if basic.kind != "enumeration" else member.declaration.type
            declared = Declaration(
                frozenset({"input"}), kind, name, tuple(map(fold.number, known)), Modification(), None,
                member.declaration.description, member.declaration.line,
            )  # fmt: skip
            attributes = {key: entry for key, entry in basic.given.inner.items() if key not in ("start", "fixed")}
            members[_above(path)][name] = Member(declared, member.text, Given(inner=attributes))

    def _declared(self, paths: list[str]) -> tuple[Basic, tuple[int, ...], Member]:
        """Return the type of a variable of buses, its sizes as far as they are declared, and a declaration."""
        ends = [end for path in paths for end in self.ends.get(path, ())]
        places = [(self.buses[_above(path)], _last(path), True) for path in paths]
        for end in sorted(ends, key=lambda end: not end.gives):
            part = part_at(end.instance, _above(end.path)) if _above(end.path) else end.instance
            if isinstance(part, Instance):
                places.append((part, _last(end.path), False))
        for instance, name, in_bus in places:
            member = instance.members.get(name.partition("[")[0])
            basic = basic_type(instance, member) if member is not None else None
            if member is not None and basic is not None and basic.kind in ("Real", "Integer", "Boolean", "enumeration"):
                return basic, sizes(instance, member) if in_bus else (), member
        bus = places[0][0]
        plain = Declaration(frozenset(), "Real", "", (), Modification(), None, "", bus.text.line)
        return Basic("Real", Given(), frozenset()), (), Member(plain, bus.text, Given())

    def _drive(self, paths: list[str]) -> None:
        """Connect a variable of buses with its source, and with what takes its value."""
        ends = [end for path in paths for end in self.ends.get(path, ())]
        givers = [end for end in ends if end.gives]
        if len(givers) != 1:
            names = " and ".join(_within(end.instance, end.path) for end in givers)
            what = f"{names} give {paths[0]} a value." if givers else f"Nothing gives {paths[0]} a value."
            text = self.buses[_above(paths[0])].text
            places = [end.source for end in givers or ends] or [text.place(text.line)]
            raise ModelicaTextError(what, where=places, advice="Connect exactly one output with a variable of a bus.")
        giver = givers[0]
        first = _within(giver.instance, giver.path)
        if giver.is_own:
            first = _within(giver.instance, giver.variable)
            bus, name = self.buses[_above(first)], _last(first).partition("[")[0]
            member = bus.members[name]
            bus.members[name] = replace(member, declaration=replace(member.declaration, prefixes=frozenset({"output"})))
            if member.declaration.type == "Boolean":
                bus.lent.add(f"{_last(first)}{MEMORY}")
            else:
                bus.balance += 1
                giver.instance.balance -= 1
            giver.instance.bus_equations.append((giver.variable, giver.path, giver.source))
        taking = [end for end in ends if end is not giver]
        for end in taking:
            if end.is_own:
                end.instance.bus_equations.append((end.path, end.variable, end.source))
        others = [_within(end.instance, end.path) for end in taking if not end.is_own]
        joined = [*dict.fromkeys((first, *paths, *others))]
        owner = self._common([*(self._holder(path) for path in paths), *(end.instance.path for end in ends)])
        inside = owner.path and f"{owner.path}."
        if len(joined) > 1:
            owner.bus_wires.append((tuple(path.removeprefix(inside) for path in joined), giver.source))

    def _holder(self, path: str) -> str:
        """Return the path of the instance that a bus is an end of."""
        while path not in self.instances:
            path = _above(path)
        return path

    def _common(self, paths: list[str]) -> Instance:
        """Return the lowest instance that has all of these in it."""
        ways = [path.split(".") if path else [] for path in paths]
        common = list(ways[0])
        while any(way[: len(common)] != common for way in ways):
            common.pop()
        return self.instances[".".join(common)]
