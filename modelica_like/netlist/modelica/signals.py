"""Signals of an instance: which of its own ends drive others, and which need a value before events."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from modelica_like.errors import Source
from modelica_like.language.fields import Output
from modelica_like.language.inside import declarations
from modelica_like.netlist.modelica import fold
from modelica_like.netlist.modelica.calls import OF_BEFORE
from modelica_like.netlist.modelica.causal import declared_in
from modelica_like.netlist.modelica.instance import Instance, Member
from modelica_like.netlist.modelica.library import Known
from modelica_like.netlist.modelica.lifting import UP, height, owner_above
from modelica_like.netlist.modelica.members import exists, part_at
from modelica_like.netlist.modelica.parse import parse_expression
from modelica_like.netlist.modelica.tree import Expr, calls_in, with_operands
from modelica_like.netlist.modelica.types import Basic, basic_type, is_signal
from modelica_like.netlist.modelica.wiring import Wire
from modelica_like.netlist.modelica.written import MEMORY

INSTANTS = ("sample", "edge", "change", "initial", "terminal")
Equation = tuple[Expr, Expr, Source]


@dataclass
class Inner:
    """What becomes of connections with protected signals of a class, which are no ends for others.

    Attributes:
        wires: connections that are left.
        equal: pairs of names that are equations now, with their places.
    """

    wires: list[Wire] = field(default_factory=list)
    equal: list[tuple[Expr, Expr, Source]] = field(default_factory=list)


def inner_signals(instance: Instance, wires: list[Wire]) -> Inner:
    """Write connections with protected signals as equations; those that drive parts are noted in the instance."""
    result = Inner()
    for wire in wires:
        ends = [end for end in wire.ends if _is_there(instance, end)]
        inner = [end for end in ends if is_inner(instance, end)]
        if not inner:
            result.wires.append(wire)
            continue
        others = [end for end in ends if end not in inner]
        source = next((end for end in others if drives(instance, end)), "")
        if source:
            result.equal += [(_named(end), _named(source), wire.source) for end in inner]
        else:
            source, *rest = inner
            outputs = [end for end in others if "." not in end]
            result.equal += [(_named(end), _named(source), wire.source) for end in (*rest, *outputs)]
            others = [source, *(end for end in others if end not in outputs)]
            if len(others) > 1:
                instance.driving.add(source.partition("[")[0])
        if len(others) > 1:
            result.wires.append(Wire(others, wire.source))
    return result


def _named(path: str) -> Expr:
    return parse_expression(path)


def own_signal(instance: Instance, path: str) -> tuple[Member, Basic] | None:
    """Return the declaration of an own signal, None if a path means something else."""
    member = instance.members.get(path.partition("[")[0]) if "." not in path else None
    basic = basic_type(instance, member) if member is not None else None
    is_one = member is not None and basic is not None and bool(basic.prefixes & {"input", "output"})
    return (member, basic) if member is not None and basic is not None and is_one else None


def is_inner(instance: Instance, end: str) -> bool:
    """Tell whether an end is a protected signal of the class itself."""
    own = own_signal(instance, end)
    return own is not None and "protected" in own[0].declaration.prefixes


def _is_there(instance: Instance, end: str) -> bool:
    member = instance.members.get(end.partition(".")[0].partition("[")[0])
    return member is None or exists(instance, member)


def drives(instance: Instance, end: str) -> bool:
    """Tell whether an end gives a value: an input of the class, or an output of a part."""
    path, dot, last = end.rpartition(".")
    if not dot:
        own = own_signal(instance, end)
        return own is not None and "input" in own[1].prefixes
    part = part_at(instance, path)
    if isinstance(part, Known):
        return isinstance(declarations(part.type).fields.get(last), Output)
    below = own_signal(part, last) if isinstance(part, Instance) else None
    return below is not None and "output" in below[1].prefixes


@dataclass
class Memories:
    """Signals of an instance that change at events, and the equations they need.

    Attributes:
        of: types of these signals by path, and whether they are true for instants only.
        equations: all, with those of the values that are kept.
    """

    instance: Instance
    assigned: set[str]
    of: dict[str, tuple[Basic, bool]] = field(default_factory=dict[str, tuple[Basic, bool]])
    equations: list[Equation] = field(default_factory=list)

    def read(self, equations: list[Equation], values: list[Expr], place: Source) -> None:
        """Find them.

        Args:
            equations: of the instance.
            values: further expressions.
            place: of the class.
        """
        sides = [side for left, right, _ in equations for side in (left, right)]
        asked = {path for value in (*sides, *values) for path in _asked(value)}
        for left, right, source in equations:
            path = left.args[0][0] if left.kind in ("name", "condition") else ""
            basic = self._signal(path)
            if basic is None or not (left.kind == "condition" or (basic.kind != "Real" and path in asked)):
                self.equations.append((left, right, source))
                continue
            self.of[path] = basic, any(call.args[0] in INSTANTS for call in calls_in(right))
            self.equations += [self._out(path, basic, source), (kept(path), right, source)]
        lent = {name.removesuffix(MEMORY) for name in self.instance.lent if name.endswith(MEMORY)}
        for path in sorted(self.assigned | lent):
            basic = self._signal(path)
            if basic is not None and path not in self.of:
                self.of[path] = basic, False
                self.equations.append(self._out(path, basic, place))
        for path in sorted(asked - self.of.keys()):
            basic = self._signal(path)
            if basic is not None and basic.kind != "Real" and "input" in basic.prefixes:
                self.of[path] = basic, False
                self.equations.append((kept(path), taken(path, basic), place))

    def _signal(self, path: str) -> Basic | None:
        own = own_signal(self.instance, path) if path else None
        return own[1] if own is not None and is_signal(self.instance, *own) else None

    def _out(self, path: str, basic: Basic, source: Source) -> Equation:
        value: Expr = kept(path)
        if basic.kind == "Boolean":
            value = Expr("if", (Expr("condition", value.args), fold.number(1), fold.number(0)))
        return Expr("name", ((path, ()),)), value, source


def kept(path: str) -> Expr:
    """Return the name of the value itself of a signal that changes at events."""
    return Expr("name", ((f"{path}{MEMORY}", ()),))


def taken(path: str, basic: Basic) -> Expr:
    """Return what an input says: a truth value above one half, or the nearest whole number."""
    name, half = Expr("name", ((path, ()),)), fold.number(0.5)
    if basic.kind == "Boolean":
        return Expr(">", (name, half))
    return fold.call("floor", (Expr("+", (name, half)),), 0)


def whole_numbers(instance: Instance, value: Expr) -> Expr:
    """Return the value of a discrete variable with whole numbers of signals, which change at events, too."""

    def taking(node: Expr) -> Expr:
        if node.kind == "call" and node.args[0] in OF_BEFORE:
            return node
        if node.kind != "name":
            return with_operands(node, taking)
        path = node.args[0][0]
        place = declared_in(owner_above(instance, height(node)), path.lstrip(UP))
        basic = basic_type(*place) if place is not None else None
        if place is None or basic is None or basic.kind not in ("Integer", "enumeration"):
            return node
        return taken(path, basic) if is_signal(*place, basic) else node

    return taking(value)


def _asked(value: Expr) -> Iterator[str]:
    """Yield the names whose values before events an expression needs."""
    for call in calls_in(value):
        argument = call.args[1][0] if call.args[0] in OF_BEFORE and call.args[1] else None
        if argument is not None and argument.kind in ("name", "condition"):
            yield argument.args[0][0]
