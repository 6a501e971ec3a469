"""What a declaration of a basic type says is checked: its attributes, its value, its limits."""

from __future__ import annotations

from contextlib import suppress

from modelica_like.errors import ModelicaTextError, UnknownName, ValueOutOfRange, did_you_mean
from modelica_like.netlist.modelica.fold import elements
from modelica_like.netlist.modelica.instance import Given, Instance, Member
from modelica_like.netlist.modelica.members import check_value
from modelica_like.netlist.modelica.resolve import Resolver
from modelica_like.netlist.modelica.tree import ClassText, Expr
from modelica_like.netlist.modelica.types import Basic, misfit, with_article

_TYPES = {
    **dict.fromkeys(("fixed", "unbounded"), "Boolean"),
    **dict.fromkeys(("unit", "displayUnit", "quantity"), "String"),
    "nominal": "Real",
    "stateSelect": "StateSelect",
}
"""Types of attributes; `start`, `min` and `max` have that of the variable."""
_COMMON = ("quantity", "start", "fixed")
_OF_REAL = ("unit", "displayUnit", "min", "max", "nominal", "unbounded", "stateSelect", *_COMMON)
_ATTRIBUTES = {"Real": _OF_REAL, "Boolean": _COMMON, "String": _COMMON, "": _OF_REAL}
_OF_ORDERED = ("min", "max", *_COMMON)


def check_declared(owner: Instance, member: Member, basic: Basic) -> None:
    """Refuse a declaration whose attributes, value or limits do not fit.

    Args:
        owner: instance that declares it.
        member: the declaration.
        basic: its type.

    Raises:
        UnknownName: it has no such attribute.
        ModelicaTextError, ValueOutOfRange: a value is of another type or size, or outside the limits.
    """
    declared = member.declaration
    check_attributes(declared.name, basic, member.text)
    value = _read(member.given)
    if value is None:
        return
    check_value(owner, member, value)
    # A component checks the limits of its parameters, all numbers.
    is_parameter = basic.kind == "Real" and not declared.dimensions and "constant" not in declared.prefixes
    if {"parameter", "constant"} & declared.prefixes and not is_parameter:
        _check_limits(member, basic, elements(value))


def check_attributes(name: str, basic: Basic, text: ClassText) -> None:
    """Refuse attributes that a variable does not have, and values of another type.

    Args:
        name: of the variable.
        basic: its type; one without a kind may be of any.
        text: class that declares it.

    Raises:
        UnknownName: it has no such attribute.
        ModelicaTextError: a value is of another type.
    """
    names = _ATTRIBUTES.get(basic.kind, _OF_ORDERED)
    for key, entry in basic.given.inner.items():
        place = (entry.text or text).place(entry.line)
        if key not in names:
            what = f"{name}, {with_article(basic)}," if basic.kind else name
            raise UnknownName(f"{what} has no '{key}'{did_you_mean(key, names) or '.'}", where=place)
        if entry.inner:
            raise UnknownName(f"{name}.{key} has no '{next(iter(entry.inner))}'.", where=place)
        if entry.value is not None and entry.scope is not None:
            kind = Basic(_TYPES[key], Given(), frozenset()) if key in _TYPES else basic
            wrong = misfit(Resolver(*entry.scope)(entry.value), kind)
            if wrong:
                raise ModelicaTextError(f"{name}.{key} {wrong}.", where=place)


def _read(given: Given | None) -> Expr | None:
    """Return a value; one that cannot be read is told where it is used."""
    if given is None or given.value is None or given.scope is None:
        return None
    with suppress(ModelicaTextError):
        return Resolver(*given.scope)(given.value)
    return None


def _check_limits(member: Member, basic: Basic, values: list[Expr]) -> None:
    """Refuse numbers outside `min` and `max`, those of arrays one by one."""
    for key, sign, words in (("min", 1, "at least"), ("max", -1, "at most")):
        limit = _read(basic.given.inner.get(key))
        limits = elements(limit) if limit is not None else []
        limits = len(values) * limits if len(limits) == 1 else limits
        for value, bound in zip(values, limits, strict=False):
            if value.kind == bound.kind == "number" and sign * value.args[0] < sign * bound.args[0]:
                what = f"{member.declaration.name} = {value.args[0]:g} is out of range: it must be {words}"
                place = (member.given.text or member.text).place(member.given.line or member.declaration.line)
                raise ValueOutOfRange(f"{what} {bound.args[0]:g}.", where=place)
