"""Basic types: what a declaration of a number, a condition or a choice says."""

from __future__ import annotations

from dataclasses import dataclass

from modelica_like.netlist.modelica.instance import Given, Instance, Member, given, unknown_class
from modelica_like.netlist.modelica.tree import ClassText

SCALARS = ("Real", "Integer", "Boolean", "String")


@dataclass(slots=True)
class Basic:
    """The basic type of a declaration.

    Attributes:
        kind: `Real`, `Integer`, `Boolean`, `String`, `StateSelect` or `enumeration`.
        given: attributes such as `unit` and `start`.
        prefixes: of the declaration and its types.
    """

    kind: str
    given: Given
    prefixes: frozenset[str]


def basic_type(instance: Instance, member: Member) -> Basic | None:
    """Return the basic type of a member, None if it is a part or a connector.

    Args:
        instance: it belongs to.
        member: the declaration.

    Raises:
        ModelicaTextError: its class does not exist.
    """
    declaration, attributes, prefixes = member.declaration, member.given, member.declaration.prefixes
    found = instance.find(declaration.type, member.text)
    if found is None:
        raise unknown_class(declaration.type, member.text, declaration.line)
    while isinstance(found, ClassText):
        if found.literals:
            return Basic("enumeration", attributes, prefixes)
        if found.short is None:
            return None
        scope = found.owner or found
        attributes = attributes.over(given(found.short.modification, (instance, scope), found.line))
        prefixes = prefixes | found.prefixes
        found = instance.classes.find(found.short.base, scope)
    plain = isinstance(found, str) and found in (*SCALARS, "StateSelect")
    return Basic(str(found), attributes, prefixes) if plain else None
