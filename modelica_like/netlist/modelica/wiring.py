"""Connections of a text: pairs of ends, gathered to sets that are joined."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import casadi as ca

from modelica_like.errors import ModelicaTextError, Source
from modelica_like.netlist.modelica import fold
from modelica_like.netlist.modelica.elements import named_at, place_of
from modelica_like.netlist.modelica.instance import Instance, refused
from modelica_like.netlist.modelica.library import Known
from modelica_like.netlist.modelica.members import exists, part_of, sizes, unknown_name
from modelica_like.netlist.modelica.resolve import Resolver
from modelica_like.netlist.modelica.tree import Expr
from modelica_like.netlist.modelica.types import basic_type

INSIDE = "inside_"
"""Before the name of a connector within a connector: its side towards the inside of the component."""


@dataclass
class Wire:
    """Ends that are joined, by their paths here, and the place of the first connection."""

    ends: list[str]
    source: Source


def groups(pairs: list[tuple[str, str, Source]]) -> list[Wire]:
    """Gather pairs of ends that share some; a set stands where it has got its last end."""
    sets: dict[int, Wire] = {}
    number_of: dict[str, int] = {}
    last: dict[int, int] = {}
    for number, (*pair, source) in enumerate(pairs):
        touched = sorted({number_of[end] for end in pair if end in number_of}, key=last.__getitem__)
        place = touched[0] if touched else number  # its number stays, so that long sets are not gone through each time
        wire = sets.pop(place, None) or Wire([], source)
        added = [end for other in touched[1:] for end in sets.pop(other).ends]
        added += [end for end in dict.fromkeys(pair) if end not in number_of]
        wire.ends += added
        number_of |= dict.fromkeys(added, place)
        sets[place], last[place] = wire, number
    return [*sets.values()]


def end_of(end: Expr, resolver: Resolver) -> Expr:
    """Resolve the subscripts of an end of a connection, and keep its names."""
    if end.kind != "name":
        raise refused("this end of a connection", resolver.text, end.line)
    parts: list[tuple[str, tuple[Expr, ...]]] = []
    for k, (name, subs) in enumerate(end.args):
        inside = resolver.known()
        member = resolver.instance.members.get(name) if subs and not k and resolver.instance is not None else None
        if member is not None and resolver.instance is not None:
            inside.local |= {"end": fold.number(([*sizes(resolver.instance, member), 0])[0])}
        parts.append((name, tuple(inside(index) for index in subs)))
    return Expr("name", tuple(parts), end.line)


def pairs_of(left: Expr, right: Expr, instance: Instance, source: Source) -> list[tuple[str, str]]:
    """Return the paths of the ends of a connection, element by element of arrays; one that is absent is empty.

    Args:
        left: one end, its subscripts resolved.
        right: the other one.
        instance: whose members they name.
        source: of the connection.

    Raises:
        UnknownName: an end does not exist.
        ModelicaTextError: the ends are arrays of different sizes.
    """
    ends = [_ends(left, instance), _ends(right, instance)]
    count = max(map(len, ends))
    for k, end in enumerate((left, right)):
        if len(ends[k]) == 1 and count > 1:  # an array of signals that a component has as single ones
            (name, subscripts), other = end.args[-1], (right, left)[k]
            places = [place_of(path.rpartition(".")[2]) for path in ends[1 - k]]
            if other.args[-1][1] or not all(places):
                places = [(position,) for position in range(1, count + 1)]
            each = (
                Expr("name", (*end.args[:-1], (name, (*subscripts, *map(fold.number, place)))), end.line)
                for place in places
            )
            ends[k] = [path for e in each for path in _ends(e, instance)]
    if len(ends[0]) != len(ends[1]):
        raise ModelicaTextError("The sizes of both ends differ.", where=source)
    return list(zip(*ends, strict=True))


def _ends(end: Expr, instance: Instance) -> list[str]:
    """Return the paths of an end; several for an array."""
    (name, subscripts), rest = end.args[0], end.args[1:]
    if (inside := _of_bus(end, instance)) is not None:
        return inside
    if (bundle := _of_bundle(end, instance)) is not None:
        return bundle
    member = instance.members.get(name)
    if member is None:
        raise unknown_name(f"{instance.text.name} has no '{name}'.", instance.text, end.line)
    indices = _indices(subscripts, sizes(instance, member), instance, end.line)
    heads = [f"{name}{index}" for index in indices]
    if basic_type(instance, member) is not None or not rest:
        return heads
    if not exists(instance, member):
        return [""] * len(heads)
    part = part_of(instance, member, place_of(indices[0])) if indices else None
    if not isinstance(part, Instance):
        here = part.here if isinstance(part, Known) else str
        return [f"{head}.{here(path)}" for head in heads for path in _inside(rest, instance, end.line)]
    if len(rest) > 1:
        raise refused("a connection with the inside of a component", instance.text, end.line)
    last, subscripts = end.args[-1]
    outer = part.members.get(last)
    if outer is not None and not exists(part, outer):
        return [""] * len(heads)
    shape = sizes(part, outer) if outer is not None else ()
    return [f"{head}.{last}{index}" for head in heads for index in _indices(subscripts, shape, instance, end.line)]


def _of_bus(end: Expr, instance: Instance) -> list[str] | None:
    """Return the paths of what an end means in an expandable connector, declared or not; None if it is in none."""
    heads, owner = [""], instance
    for depth, (name, subscripts) in enumerate(end.args):
        member = owner.members.get(name)
        is_part = member is not None and basic_type(owner, member) is None and exists(owner, member)
        if owner.text.expandable and not (is_part and member is not None):
            shape, rest = sizes(owner, member) if member is not None else (), end.args[depth + 1 :]
            below = [f"{name}{index}" for index in _indices(subscripts, shape, instance, end.line)]
            last = [f".{path}" for path in _inside(rest, instance, end.line)] if rest else [""]
            return [f"{head}.{first}{path}" for head, first, path in product(heads, below, last)]
        if not is_part or member is None:
            return None
        shape = sizes(owner, member)
        indices = _indices(subscripts, shape, instance, end.line)
        heads = [f"{head}.{name}{index}".lstrip(".") for head in heads for index in indices]
        part = part_of(owner, member, place_of(indices[0])) if indices else None
        if not isinstance(part, Instance):
            return None
        owner = part
    return heads if owner.text.expandable else None


def _of_bundle(end: Expr, instance: Instance) -> list[str] | None:
    """Return the paths of the connectors within a connector that an end means, None if it means none."""
    owner, heads = instance, [""]
    for depth, (name, subscripts) in enumerate(end.args):
        member = owner.members.get(name)
        if member is None or depth > 1 or not exists(owner, member) or basic_type(owner, member) is not None:
            return None
        indices = _indices(subscripts, sizes(owner, member), instance, end.line)
        part = part_of(owner, member, place_of(indices[0])) if indices else None
        if not isinstance(part, Instance):
            return None
        heads = [f"{head}{name}{index}." for head in heads for index in indices]
        if part.text.kind == "connector":
            leaves = bundled(part)
            if len(end.args) > depth + 1:
                wanted = _inside(end.args[depth + 1 :], instance, end.line)
                leaves = [leaf for leaf in leaves if leaf in wanted or leaf.partition("[")[0] in wanted]
            side = INSIDE if depth == 0 else ""
            return [f"{head}{side}{leaf}" for head in heads for leaf in leaves] or None
        owner = part
    return None


def bundled(connector: Instance) -> list[str]:
    """Return the names of the connectors within a connector, none of those of an expandable one."""
    if connector.text.expandable:
        return []
    inner = {
        name: sizes(connector, member)
        for name, member in connector.members.items()
        if basic_type(connector, member) is None and exists(connector, member)
    }
    return [f"{name}{index}" for name, shape in inner.items() for index in _indices((), shape, connector, 0)]


def _inside(parts: tuple[tuple[str, tuple[Expr, ...]], ...], instance: Instance, line: int) -> list[str]:
    """Return the paths below a part, one for each of the elements that subscripts choose."""
    names = [[f"{name}{index}" for index in _indices(subs, (), instance, line)] for name, subs in parts]
    return [".".join(path) for path in product(*names)]


def _indices(subscripts: tuple[Expr, ...], shape: tuple[int, ...], instance: Instance, line: int) -> list[str]:
    """Return the elements that subscripts choose, such as `[2,1]`; those of further dimensions are all chosen.

    Args:
        subscripts: resolved.
        shape: sizes of the dimensions, as far as they are known.
        instance: for the place of an error.
        line: likewise.
    """
    subscripts = (*subscripts, *(Expr("all", (), line) for _ in shape[len(subscripts) :]))
    chosen: list[list[int]] = []
    for dimension, subscript in enumerate(subscripts):
        size = shape[dimension] if dimension < len(shape) else None
        if subscript.kind == "all" and size is not None:
            chosen.append(list(range(1, size + 1)))
            continue
        places = [item.args[0] if item.kind == "number" else 0.5 for item in fold.elements(subscript)]
        for place in places:
            if place != int(place) or place < 1 or (size is not None and place > size):
                allowed = f"1 to {size}" if size is not None else "the whole numbers from 1"
                what = f"A subscript of this end is not one of {allowed}."
                raise ModelicaTextError(what, where=instance.text.place(line))
        chosen.append([int(place) for place in places])
    return [named_at("", place) for place in product(*chosen)]


def paths(node: Expr) -> Iterator[str]:
    """Yield the paths of variables in a resolved expression."""
    if node.kind in ("name", "condition"):
        yield node.args[0][0]
        return
    inner = node.args[1] if node.kind == "call" else node.args
    for one in inner:
        if isinstance(one, Expr):
            yield from paths(one)


def rank(rows: list[tuple[list[str], Source]], columns: list[str]) -> int:
    """Return how many columns rows with these names can determine, one each."""
    place = {name: k for k, name in enumerate(columns)}
    entries = [(k, place[name]) for k, (names, _) in enumerate(rows) for name in names if name in place]
    lists = map(list, zip(*entries, strict=True)) if entries else ([], [])
    return ca.sprank(ca.DM(ca.Sparsity.triplet(len(rows), len(columns), *lists)))
