"""Elements of arrays: at subscripts that only a run knows a choice over all."""

from __future__ import annotations

from typing import TYPE_CHECKING

from modelica_like.errors import ModelicaTextError
from modelica_like.netlist.modelica import fold
from modelica_like.netlist.modelica.fold import OUTSIDE
from modelica_like.netlist.modelica.instance import refused
from modelica_like.netlist.modelica.laws import closed, opened
from modelica_like.netlist.modelica.lifting import UP, height, owner_above
from modelica_like.netlist.modelica.tree import Expr
from modelica_like.netlist.modelica.types import basic_type

if TYPE_CHECKING:
    from modelica_like.netlist.modelica.resolve import Resolver

_LONG = 10
"""Numbers, names and operations of a subscript; a longer one is written once, and not for each element."""
_WHOLE = ("floor", "integer", "ceil", "sign", "div")
_AS_WHOLE = ("+", "-", "*", "neg")
_CALLS_AS_WHOLE = ("pre", "noEvent", "previous", "hold", "mod", "rem", "min", "max", "abs", fold.ARGUMENT, fold.SILENT)
"""Operations and calls whose results are whole numbers if those of their operands are."""


def elements_at(resolver: Resolver, value: Expr, subscripts: tuple[Expr, ...], line: int) -> Expr:
    """Return an element of an array, or those of a slice.

    Raises:
        ModelicaTextError, Unfit: there is none.
    """
    for k, subscript in enumerate(subscripts):
        if value.kind != "array":
            raise refused("a subscript of something that is not an array", resolver.text, line)
        rest = subscripts[k + 1 :]
        if subscript.kind == "all":
            return Expr("array", tuple(elements_at(resolver, item, rest, line) for item in value.args), line)
        chosen = subscript_of(resolver, subscript, len(value.args))
        if isinstance(chosen, Expr) and chosen.kind != "array":
            return picked(chosen, tuple(elements_at(resolver, item, rest, line) for item in value.args), line)
        if isinstance(chosen, Expr):
            rows = (elements_at(resolver, value, (index, *rest), line) for index in chosen.args)
            return Expr("array", tuple(rows), line)
        value = value.args[chosen - 1]
    return value


def subscript_of(resolver: Resolver, expression: Expr, size: int, *, known: bool = False) -> int | Expr:
    """Return a subscript: a position, an array of them, or what only a run knows; `end` is the size of the array.

    Args:
        resolver: of its place.
        expression: the subscript.
        size: of the array.
        known: whether the subscript must be known when the text is read.

    Raises:
        ModelicaTextError: it is no whole number from 1 to the size.
    """
    inside = resolver.known()
    inside.local["end"] = fold.number(size)
    chosen, place = inside(expression), resolver.text.place(expression.line)
    if chosen.kind == "array":
        return chosen
    chosen = fold.numbered(chosen)
    if chosen.kind != "number":
        if known or fold.is_condition(chosen) or not is_whole(resolver, chosen):
            raise ModelicaTextError(
                "A subscript must be a number that constants and parameters determine.", where=place
            )
        return chosen
    position = chosen.args[0]
    if position != int(position) or not 1 <= position <= size:
        what = f"The index {position:g} is {'outside' if position == int(position) else 'no whole number from'}"
        raise ModelicaTextError(f"{what} 1 to {size}.", where=place)
    return int(position)


def is_whole(resolver: Resolver, node: Expr) -> bool:
    """Tell whether an expression is of whole numbers; what a function has from outside is as it is declared there."""
    from modelica_like.netlist.modelica.causal import declared_in

    def all_whole(operands: tuple[Expr, ...]) -> bool:
        return all(is_whole(resolver, operand) for operand in operands)

    if node.kind == "number":
        return node.args[0] == int(node.args[0])
    if node.kind == "native":
        return node.args[0].whole
    if node.kind == OUTSIDE:
        return all_whole(node.args[:1])
    if node.kind == "literal":
        return True
    if node.kind == "if":
        return all_whole((*node.args[1::2], node.args[-1]))
    if node.kind == "call":
        return node.args[0] in _WHOLE or (node.args[0] in _CALLS_AS_WHOLE and all_whole(node.args[1]))
    if node.kind != "name":
        return node.kind == "shared" or (node.kind in _AS_WHOLE and all_whole(node.args))
    if resolver.instance is None:
        return True
    path = node.args[0][0]
    place = declared_in(owner_above(resolver.instance, height(node)), path.lstrip(UP)) if path != "time" else None
    basic = basic_type(*place) if place is not None else None
    return basic is not None and basic.kind in ("Integer", "enumeration")


def picked(index: Expr, items: tuple[Expr, ...], line: int) -> Expr:
    """Return the element of an array at a subscript.

    Raises:
        Unfit: the array has no elements, or those of different sizes.
    """
    if not items:
        raise fold.Unfit("An array without elements has none at a subscript")
    if index.size > _LONG:
        arguments: list[Expr] = []
        slot, *slots = (opened(value, arguments) for value in (index, *items))
        return closed(fold.quiet(picked(slot, tuple(slots), line)), arguments, line)
    kept = [part for k, item in enumerate(items, 1) for part in (_is(index, k, line), item)]
    return fold.choice(kept, _outside(items[-1], index, len(items), line), line)


def placed(index: Expr, items: tuple[Expr, ...], new: tuple[Expr, ...], line: int) -> Expr:
    """Return an array that has a new element at a subscript.

    Args:
        index: the subscript.
        items: the elements so far.
        new: what each of them becomes if it is the one.
        line: of the assignment.

    Raises:
        Unfit: an element gets one of another size.
    """
    changed = [
        fold.choice([_is(index, k, line), other], item, line)
        for k, (item, other) in enumerate(zip(items, new, strict=True), 1)
    ]
    if not items:
        raise fold.Unfit("An array without elements has none at a subscript")
    everywhere = [part for k in range(2, len(items) + 1) for part in (_is(index, k, line), items[0])]
    first = fold.choice([_is(index, 1, line), new[0], *everywhere], _outside(items[0], index, len(items), line), line)
    return Expr("array", (first, *changed[1:]), line)


def _is(index: Expr, place: int, line: int) -> Expr:
    return fold.operation("==", (index, fold.number(place, line)), line)


def _outside(value: Expr, index: Expr, size: int, line: int) -> Expr:
    whole = fold.operation("==", (fold.function("floor", (index,), line), index), line)
    ends = zip((">=", "<="), (1, size), strict=True)
    low, high = (fold.operation(kind, (index, fold.number(end)), line) for kind, end in ends)
    holds = fold.operation("and", (fold.operation("and", (low, high), line), whole), line)
    return demanding(value, holds, f"has a subscript that is none of 1 to {size}", line)


def demanding(value: Expr, holds: Expr, words: str, line: int) -> Expr:
    """Return a value, of an array each element, that demands a condition where it is taken."""
    if value.kind == "array":
        return Expr("array", tuple(demanding(item, holds, words, line) for item in value.args), line)
    return Expr(OUTSIDE, (value, holds, words), line)
