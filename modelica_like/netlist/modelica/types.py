"""Basic types: what a declaration of a number, a condition or a choice says."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from modelica_like.netlist.modelica import fold
from modelica_like.netlist.modelica.instance import Given, Instance, Member, given, unknown_class
from modelica_like.netlist.modelica.tree import ClassText, Expr, Extends

SCALARS = ("Real", "Integer", "Boolean", "String")
_FIT = {
    "Real": ("number", "+", "-", "*", "/", "^", "neg", "native"),
    "Integer": ("number", "+", "-", "*", "/", "^", "neg", "native"),
    "Boolean": (),
    "String": ("string",),
    "enumeration": ("literal",),
    "StateSelect": ("literal",),
}
"""Kinds of expressions that fit a type, beside names and calls of numbers, and conditions for a Boolean."""


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
        if is_external_object(base):
            return Basic("object", attributes, prefixes)
        if base.short is None:
            return None
        scope = base.owner or base
        attributes = attributes.over(given(base.short.modification, (instance, scope), base.line), declaration.name)
        prefixes = prefixes | base.prefixes
        base = instance.classes.find(base.short.base, scope)
    plain = isinstance(base, str) and base in (*SCALARS, "StateSelect")
    return Basic(str(base), attributes, prefixes) if plain else None


def is_external_object(text: ClassText) -> bool:
    """Tell whether a class is what functions of another language keep."""
    return any(isinstance(base, Extends) and base.base == "ExternalObject" for base in text.elements)


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


def is_signal(instance: Instance, member: Member, basic: Basic) -> bool:
    """Return whether a member is an input or output to connect: an input with an equation of its own class is none."""
    if instance.text.kind == "connector":  # a part of variables, see causal.py; a bus has signals only
        return instance.text.expandable
    connector = not {"input", "output"} & member.declaration.prefixes
    if connector and "protected" in member.declaration.prefixes:
        return member.declaration.name in instance.driving
    if "input" in basic.prefixes:
        optional = member.declaration.condition is not None and connector and instance.owner is not None
        return member.given.value is None or is_bound_outside(instance, member, basic) or optional
    return "output" in basic.prefixes and (connector or member.text.kind == "block")


def with_article(basic: Basic) -> str:
    """Return the type in words."""
    if basic.kind == "enumeration":
        return f"a value of {basic.enumeration}"
    return f"an {basic.kind}" if basic.kind == "Integer" else f"a {basic.kind}"


def misfit(value: Expr, basic: Basic) -> str:
    """Return what is wrong with the type of a value, in words; empty if it fits, or is not known before the run."""
    for leaf in _leaves(value):
        if basic.kind not in _FIT:
            continue
        condition = fold.is_condition(leaf)
        if leaf.kind in ("name", "call"):
            other = condition is not (basic.kind == "Boolean")
        else:
            other = not condition if basic.kind == "Boolean" else leaf.kind not in _FIT[basic.kind]
        if basic.kind == "Integer" and leaf.kind == "number":
            other = leaf.args[0] != math.floor(leaf.args[0])
        if basic.kind == "Integer" and leaf.kind == "native":
            other = not leaf.args[0].whole
        if leaf.kind == "literal" and not other:
            kind = str(leaf.args[0]).rpartition(".")[0]
            other = kind != basic.enumeration
        if other:
            return f"is {with_article(basic)}, and {_words(leaf)} is none"
    return ""


def _leaves(value: Expr) -> Iterator[Expr]:
    """Yield the elements of arrays, and the values of the branches of an `if`."""
    inner = {"array": value.args, "if": (*value.args[1::2], value.args[-1])} if value.args else {}
    if value.kind == "shared":
        yield from _leaves(value.args[0].result)
    elif value.kind == fold.OUTSIDE:
        yield from _leaves(value.args[0])
    elif value.kind not in ("array", "if"):
        yield value
    for item in inner.get(value.kind, ()):
        yield from _leaves(item)


def _words(leaf: Expr) -> str:
    if leaf.kind == "number":
        return f"{leaf.args[0]:g}"
    if leaf.kind == "boolean":
        return str(leaf.args[0]).lower()
    if leaf.kind in ("string", "literal"):
        return f'"{leaf.args[0]}"' if leaf.kind == "string" else str(leaf.args[0])
    return "a truth value" if fold.is_condition(leaf) else "a formula of numbers"
