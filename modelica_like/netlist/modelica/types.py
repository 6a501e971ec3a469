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
        enumeration: name of its class.
    """

    kind: str
    given: Given
    prefixes: frozenset[str]
    enumeration: str = ""


def basic_type(instance: Instance, member: Member) -> Basic | None:
    """Return the basic type of a member, None if it is a part or a connector.

    Args:
        instance: it belongs to.
        member: the declaration.

    Raises:
        ModelicaTextError: its class does not exist.
    """
    declaration, attributes, prefixes = member.declaration, member.given, member.declaration.prefixes
    base = instance.find(declaration.type, member.text)
    if base is None:
        raise unknown_class(declaration.type, member.text, declaration.line)
    while isinstance(base, ClassText):
        if base.literals:
            return Basic("enumeration", attributes, prefixes, base.name)
        if base.short is None:
            return None
        scope = base.owner or base
        attributes = attributes.over(given(base.short.modification, (instance, scope), base.line), declaration.name)
        prefixes = prefixes | base.prefixes
        base = instance.classes.find(base.short.base, scope)
    plain = isinstance(base, str) and base in (*SCALARS, "StateSelect")
    return Basic(str(base), attributes, prefixes) if plain else None


def is_bound_outside(instance: Instance, member: Member, basic: Basic | None) -> bool:
    """Return whether a member is an input that the owner of a part gives an equation: `Own part(input = …)`."""
    scope = member.given.scope
    return (
        basic is not None
        and basic.kind == "Real"
        and "input" in basic.prefixes
        and not member.declaration.dimensions
        and member.given.value is not None
        and scope is not None
        and scope[0] is not instance
        and scope[0] is instance.owner
    )
