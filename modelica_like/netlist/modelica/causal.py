"""Connectors with inputs and outputs in them: parts of variables, whose connections are equations."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from modelica_like.errors import ModelicaTextError, Source
from modelica_like.netlist.modelica import fold
from modelica_like.netlist.modelica.elements import elements_of, named_array
from modelica_like.netlist.modelica.instance import Instance, Member, refused
from modelica_like.netlist.modelica.lifting import above
from modelica_like.netlist.modelica.members import part_at, parts_in, sizes
from modelica_like.netlist.modelica.resolve import Resolver
from modelica_like.netlist.modelica.tree import ClassText, Expr, Statement
from modelica_like.netlist.modelica.types import Basic, basic_type
from modelica_like.netlist.modelica.wiring import end_of, groups, pairs_of

Pair = tuple[str, str, Source]


@dataclass(frozen=True)
class Variable:
    """A variable of a connector: its role is `input`, `output`, `flow` or `potential`."""

    name: str
    role: str
    basic: Basic

    @property
    def continuous(self) -> bool:
        """Whether it may change all the time."""
        return self.basic.kind == "Real" and "discrete" not in self.basic.prefixes


def is_causal(part: object) -> bool:
    """Tell whether a part is a connector with inputs and outputs among its variables."""
    if not isinstance(part, Instance) or part.text.kind != "connector" or part.text.expandable:
        return False
    return any({"input", "output"} & member.declaration.prefixes for member in part.members.values())


def variables(connector: Instance) -> list[Variable]:
    """Return the variables of a connector.

    Raises:
        ModelicaTextError: another connector is in it.
    """
    result: list[Variable] = []
    for name, member in connector.members.items():
        basic = basic_type(connector, member)
        if basic is None:
            raise refused(f"{name} beside inputs and outputs in a connector", member.text, member.declaration.line)
        if {"parameter", "constant"} & basic.prefixes:
            continue
        role = next((role for role in ("input", "output", "flow") if role in basic.prefixes), "potential")
        if role == "potential" and basic.kind != "Real":
            raise refused(f"{name} in a connector, neither input nor output", member.text, member.declaration.line)
        result += [Variable(path, role, basic) for path, _ in elements_of(name, sizes(connector, member))]
    return result


def declared_at(instance: Instance, path: str) -> tuple[Instance, Member] | None:
    """Return the declaration of a variable of an instance, or of a causal connector in it; None if it is neither."""
    place = declared_in(instance, path)
    return place if place is not None and (place[0] is instance or is_causal(place[0])) else None


def declared_in(instance: Instance, path: str) -> tuple[Instance, Member] | None:
    """Return the declaration of a variable of an instance or of a part in it; None if it is neither."""
    heads, _, last = path.rpartition(".")
    part = part_at(instance, heads) if heads else instance
    member = part.members.get(last.partition("[")[0]) if isinstance(part, Instance) else None
    return (part, member) if member is not None and isinstance(part, Instance) else None


def variable_at(instance: Instance, path: str) -> Expr:
    """Return a variable of an instance, or of a connector in it."""
    place = declared_at(instance, path)
    basic = basic_type(*place) if place is not None else None
    return named_array(path, (), basic.kind if basic is not None else "Real")


def connector_at(instance: Instance, path: str) -> Instance | None:
    """Return the causal connector at a path, None if something else is there."""
    part = part_at(instance, path)
    return part if isinstance(part, Instance) and is_causal(part) else None


def connections(instance: Instance) -> list[Pair]:
    """Return the pairs of ends that the equations of an instance connect, also those of parts with its `inner` ones."""
    if instance.pairs is None:
        instance.pairs = [pair for pair in _own(instance) if _outer(instance, pair) is None]
        if any("inner" in member.declaration.prefixes for member in instance.members.values()):
            instance.pairs += [pair for part, way in parts_below(instance) for pair in _adopted(part, instance, way)]
    return instance.pairs


def _adopted(part: Instance, above_it: Instance, levels: int) -> Iterator[Pair]:
    """Yield the connections of a part with what is `inner` in an instance above it."""
    for pair in _own(part):
        if _outer(part, pair) is above_it:
            seen = above(part, levels)
            left, right = (end if _is_outer(part, end) else seen(end) for end in pair[:2])
            if not _bus_in(above_it, left, right) and None in (connector_at(above_it, end) for end in (left, right)):
                what = f"A connection with {left if _is_outer(part, pair[0]) else right}, which is outer"
                advice = "Connect it where the inner part is; equations may use its variables."
                raise ModelicaTextError(f"{what}: that is not supported here.", where=pair[2], advice=advice)
            yield left, right, pair[2]


def _bus_in(instance: Instance, *ends: str) -> bool:
    return any(bus_of(instance, end) for end in ends)


def bus_of(instance: Instance, end: str) -> str:
    """Return the path of the expandable connector that an end is, or that it is in; empty if it is in none."""
    names = end.split(".")
    for depth in range(1, len(names) + 1):
        part = part_at(instance, ".".join(names[:depth]))
        if not isinstance(part, Instance):
            return ""
        if part.text.expandable:
            return ".".join(names[:depth])
    return ""


def _is_outer(instance: Instance, end: str) -> bool:
    member = instance.members.get(end.partition(".")[0].partition("[")[0])
    return member is not None and "outer" in member.declaration.prefixes


def _outer(instance: Instance, pair: Pair) -> Instance | None:
    """Return the instance above whose part a connection names, None if it is one of own parts."""
    names = [end.partition(".")[0].partition("[")[0] for end in pair[:2] if _is_outer(instance, end)]
    found = instance.inner(names[0]) if names else None
    if names and found is None:
        what = f"outer {names[0]} has no inner {names[0]} above it."
        raise ModelicaTextError(what, where=pair[2])
    return found


def _own(instance: Instance) -> list[Pair]:
    """Return the pairs of all `connect` of an instance."""
    if instance.own_pairs is None:
        instance.own_pairs = []
        for statement, text in instance.equations:
            instance.own_pairs += _pairs(instance, statement, text, {})
    return instance.own_pairs


def _pairs(instance: Instance, statement: Statement, text: ClassText, local: dict[str, Expr]) -> Iterator[Pair]:
    resolver = Resolver(instance, text, local)
    if statement.kind == "connect":
        source = text.place(statement.line)
        left, right = (end_of(side, resolver) for side in statement.parts)
        yield from ((*pair, source) for pair in pairs_of(left, right, instance, source) if "" not in pair)
    elif statement.kind == "for" and _connects(statement.parts[1]):
        for known in rounds(resolver, statement.parts[0], statement.line):
            for inner in statement.parts[1]:
                yield from _pairs(instance, inner, text, known)
    elif statement.kind == "if" and any(_connects(body) for _, body in statement.parts):
        for condition, body in statement.parts:
            holds = (
                Expr("boolean", (True,)) if condition is None else resolver.condition(condition, "if", statement.line)
            )
            if holds.kind != "boolean":
                raise refused("a connection in a branch that changes during a run", text, statement.line)
            if holds.args[0]:
                for inner in body:
                    yield from _pairs(instance, inner, text, local)
                return


def rounds(resolver: Resolver, iterators: Sequence[tuple[str, Expr | None]], line: int) -> Iterator[dict[str, Expr]]:
    """Yield what is known in each round of a loop of equations, the last of its iterators innermost."""
    (name, over), rest = iterators[0], iterators[1:]
    if over is None:
        raise refused("an iterator without a range", resolver.text, line)
    for value in resolver.known().array(over):
        inner = Resolver(resolver.instance, resolver.text, {**resolver.local, name: value})
        yield from rounds(inner, rest, line) if rest else (inner.local,)


def _connects(body: Iterable[Statement]) -> bool:
    return any(
        statement.kind == "connect"
        or (statement.kind == "for" and _connects(statement.parts[1]))
        or (statement.kind == "if" and any(_connects(inner) for _, inner in statement.parts))
        for statement in body
    )


def parts_below(instance: Instance, levels: int = 1) -> Iterator[tuple[Instance, int]]:
    """Yield the parts in an instance, with the levels from them up to it."""
    for _, part in parts_in(instance):
        if isinstance(part, Instance) and part.text.kind != "connector":
            yield part, levels
            yield from parts_below(part, levels + 1)


def cardinality(resolver: Resolver, argument: Expr) -> Expr:
    """Return how many connections a connector has.

    Raises:
        ModelicaTextError: the argument is no connector of the instance or of a part.
    """
    instance = resolver.instance
    ends = end_of(argument, resolver) if instance is not None and argument.kind == "name" else None
    paths = [] if ends is None or instance is None else pairs_of(ends, ends, instance, resolver.text.place(0))
    if instance is None or len(paths) != 1:
        raise refused("cardinality(…) of what is no single connector", resolver.text, argument.line)
    path = paths[0][0]
    variable = declared_in(instance, path)
    basic = basic_type(*variable) if variable is not None else None
    if basic is not None and not basic.prefixes & {"input", "output"}:
        raise refused("cardinality(…) of what is no single connector", resolver.text, argument.line)
    head, _, last = path.rpartition(".")
    places = [(instance, path)]
    if head:
        part = part_at(instance, head)
        places += [(part, last)] if isinstance(part, Instance) else []
    elif instance.owner is not None:
        places.append((instance.owner, f"{instance.name}.{path}"))
    count = sum(pair[:2].count(end) for place, end in places for pair in connections(place))
    return fold.number(count, argument.line)


class Joints:
    """The sets of causal connectors that are joined in an instance.

    Args:
        instance: whose connections they are.

    Attributes:
        sets: ends by their paths, with the place of a connection.
        others: pairs of other ends.
        above: own parts' connectors that are joined with something further out.
    """

    def __init__(self, instance: Instance) -> None:
        self.instance = instance
        causal: list[Pair] = []
        self.others: list[Pair] = []
        for left, right, source in connections(instance):
            kinds = [connector_at(instance, end) for end in (left, right)]
            if kinds == [None, None]:
                self.others.append((left, right, source))
                continue
            if None in kinds or len({tuple(sorted(v.name for v in variables(kind))) for kind in kinds if kind}) > 1:
                raise ModelicaTextError(f"The connectors {left}, {right} differ.", where=source)
            causal.append((left, right, source))
        self.sets = groups(causal)
        self.above = {end for pair in _own(instance) if _outer(instance, pair) is not None for end in pair[:2]}

    def equations(self) -> Iterator[tuple[str, list[tuple[int, str]], Source]]:
        """Yield equations, as a variable and the signed ones whose sum it is, and count those of other variables.

        Raises:
            ModelicaTextError: a variable has no end that gives it a value, or several.
        """
        joined: set[str] = set(self.above)
        for wire in self.sets:
            joined.update(wire.ends)
            connector = connector_at(self.instance, wire.ends[0])
            assert connector is not None
            for variable in variables(connector):
                yield from self._equations(variable, wire.ends, wire.source)
        parts = (
            (head, p) for head, p in parts_in(self.instance) if isinstance(p, Instance) and p.text.kind != "connector"
        )
        for end, connector in ((f"{head}.{end}", below) for head, part in parts for end, below in connectors(part)):
            place = connector.text.place(connector.text.line)
            if end not in joined:
                yield from ((f"{end}.{v.name}", [], place) for v in variables(connector) if v.role == "flow")

    def _equations(
        self, variable: Variable, ends: list[str], source: Source
    ) -> Iterator[tuple[str, list[tuple[int, str]], Source]]:
        paths = [f"{end}.{variable.name}" for end in ends]
        if variable.role == "flow":
            signs = [1 if "." in end else -1 for end in ends]
            yield paths[0], [(-sign * signs[0], path) for sign, path in zip(signs[1:], paths[1:], strict=True)], source
            return
        first = paths[0]
        if variable.role != "potential":
            giving = [end for end in ends if self._gives(end, variable.name)]
            if len(giving) != 1:
                what = f"{len(giving) or 'None'} of {', '.join(ends)} give{'s' * (not giving)} {variable.name} a value."
                raise ModelicaTextError(what, where=source, advice="Exactly one end of a connection does.")
            first = f"{giving[0]}.{variable.name}"
        yield from ((path, [(1, first)], source) for path in paths if path != first)

    def _gives(self, end: str, name: str) -> bool:
        """Tell whether a connector gives the others of its set a value: an output of a part, or an own input."""
        connector = connector_at(self.instance, end)
        assert connector is not None
        role = next(variable.role for variable in variables(connector) if variable.name == name)
        return role == ("output" if "." in end else "input")

    def taken(self) -> int:
        """Return how many equations of continuous variables of connectors stand in the instance, and not in them."""
        owner = self.instance.owner
        outside = {end for pair in connections(owner) for end in pair[:2]} if owner is not None else set[str]()
        own = 0
        for name, connector in connectors(self.instance):
            free = f"{self.instance.name}.{name}" not in outside  # the class itself has to give its inputs, too
            roles = ("output", "flow", *(["input"] * free))
            own += sum(variable.continuous and variable.role in roles for variable in variables(connector))
        inside = (connector_at(self.instance, end) for wire in self.sets for end in wire.ends if "." in end)
        return own + sum(
            variable.continuous and variable.role in ("input", "potential")
            for connector in inside if connector is not None for variable in variables(connector)
        )  # fmt: skip


def connectors(instance: Instance) -> Iterator[tuple[str, Instance]]:
    """Yield the own causal connectors of an instance by their names."""
    yield from ((path, part) for path, part in parts_in(instance) if isinstance(part, Instance) and is_causal(part))
