"""Connections of a text: pairs of ends, gathered to sets that are joined."""

from __future__ import annotations

from dataclasses import dataclass

from modelica_like.errors import Source
from modelica_like.modelica_text.instance import Instance, refused
from modelica_like.modelica_text.library import Known
from modelica_like.modelica_text.members import part_of, unknown_name
from modelica_like.modelica_text.tree import Expr
from modelica_like.modelica_text.types import basic_type


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
        for pair in zip(_ends(left, instance, source), _ends(right, instance, source), strict=True):
            touched = [one for one in wires if set(pair) & set(one.ends)]
            made = Wire([], touched[0].source if touched else source)
            for end in (*(end for one in touched for end in one.ends), *pair):
                if end not in made.ends:
                    made.ends.append(end)
            wires = [one for one in wires if one not in touched]
            wires.append(made)
    return wires


def _ends(end: Expr, instance: Instance, source: Source) -> list[str]:
    """Return the paths of an end; several for an array of signals."""
    (name, subscripts), rest = end.args[0], end.args[1:]
    member = instance.members.get(name)
    if member is None:
        raise unknown_name(f"{instance.text.name} has no '{name}'.", instance.text, end.line)
    index = "".join(f"[{int(one.args[0])}]" for one in subscripts)
    if basic_type(instance, member) is not None or not rest:
        return [f"{name}{index}"]
    inner = ".".join(one + "".join(f"[{int(k.args[0])}]" for k in subs) for one, subs in rest)
    part = part_of(instance, member, int(index[1:-1]) if index else 0)
    if isinstance(part, Known):
        inner = part.here(inner)
    elif isinstance(part, Instance) and len(rest) > 1:
        raise refused("a connection with the inside of a component", instance.text, end.line)
    return [f"{name}{index}.{inner}"]
