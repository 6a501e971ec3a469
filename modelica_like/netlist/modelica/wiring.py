"""Connections of a text: pairs of ends, gathered to sets that are joined."""

from __future__ import annotations

from dataclasses import dataclass

from modelica_like.errors import ModelicaTextError, Source
from modelica_like.netlist.modelica.instance import Instance, refused
from modelica_like.netlist.modelica.library import Known
from modelica_like.netlist.modelica.members import part_of, sizes, unknown_name
from modelica_like.netlist.modelica.tree import Expr
from modelica_like.netlist.modelica.types import basic_type


@dataclass
class Wire:
    """Ends that are joined, by their paths here, and the place of the first connection."""

    ends: list[str]
    source: Source


def groups(connections: list[tuple[Expr, Expr, Source]], instance: Instance) -> list[Wire]:
    """Gather connections that share ends.

    Args:
        connections: pairs of ends.
        instance: whose members they name.

    Raises:
        UnknownName: an end does not exist.
    """
    wires: list[Wire] = []
    for left, right, source in connections:
        for pair in _pairs(left, right, instance, source):
            touched = [w for w in wires if set(pair) & set(w.ends)]
            wire = Wire([], touched[0].source if touched else source)
            for end in (*(end for t in touched for end in t.ends), *pair):
                if end not in wire.ends:
                    wire.ends.append(end)
            wires = [w for w in wires if w not in touched]
            wires.append(wire)
    return wires


def _pairs(left: Expr, right: Expr, instance: Instance, source: Source) -> list[tuple[str, str]]:
    """Return the paths of the ends of a connection, element by element of arrays."""
    ends = [_ends(left, instance), _ends(right, instance)]
    count = max(map(len, ends))
    for k, end in enumerate((left, right)):
        if len(ends[k]) == 1 and count > 1:  # an array of signals that a component has as single ones
            name, subscripts = end.args[-1]
            elements = (Expr("number", (float(position),)) for position in range(1, count + 1))
            each = (Expr("name", (*end.args[:-1], (name, (*subscripts, element))), end.line) for element in elements)
            ends[k] = [path for e in each for path in _ends(e, instance)]
    if len(ends[0]) != len(ends[1]):
        raise ModelicaTextError("The sizes of both ends differ.", where=source)
    return list(zip(*ends, strict=True))


def _ends(end: Expr, instance: Instance) -> list[str]:
    """Return the paths of an end; several for an array."""
    (name, subscripts), rest = end.args[0], end.args[1:]
    member = instance.members.get(name)
    if member is None:
        raise unknown_name(f"{instance.text.name} has no '{name}'.", instance.text, end.line)
    shape = sizes(instance, member)
    indices = [f"[{int(subscript.args[0])}]" for subscript in subscripts if subscript.kind == "number"]
    if shape and not indices:
        indices = [f"[{k}]" for k in range(1, shape[0] + 1)]
    heads = [f"{name}{index}" for index in indices or [""]]
    if basic_type(instance, member) is not None or not rest:
        return heads
    inner = ".".join(n + "".join(f"[{int(k.args[0])}]" for k in subs) for n, subs in rest)
    part = part_of(instance, member, int(indices[0][1:-1]) if indices else 0)
    if isinstance(part, Known):
        return [f"{head}.{part.here(inner)}" for head in heads]
    if not isinstance(part, Instance):
        return [f"{head}.{inner}" for head in heads]
    if len(rest) > 1:
        raise refused("a connection with the inside of a component", instance.text, end.line)
    last, index = end.args[-1]
    outer = part.members.get(last)
    shape = sizes(part, outer) if outer is not None and not index else ()
    if len(heads) == 1 and shape:
        return [f"{heads[0]}.{inner}[{k}]" for k in range(1, shape[0] + 1)]
    return [f"{head}.{inner}" for head in heads]
