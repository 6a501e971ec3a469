"""Assertions of subscripts that only a run knows: that the array has such an element."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from modelica_like.errors import ModelicaTextError, Source
from modelica_like.netlist.modelica import fold
from modelica_like.netlist.modelica.fold import OUTSIDE
from modelica_like.netlist.modelica.laws import Law
from modelica_like.netlist.modelica.lifting import height
from modelica_like.netlist.modelica.tree import Expr, with_operands
from modelica_like.netlist.modelica.whens import is_ending
from modelica_like.netlist.modelica.written import ASSERT, Happening

Demand = tuple[Expr, Expr]
Equations = list[tuple[Expr, Expr, Source]]


def demanded_elements(equations: Equations, initial: Equations, happenings: list[Happening]) -> list[Happening]:
    """Return whens and assertions with those of subscripts; in a `when` they are demanded when it happens.

    Args:
        equations: of an instance.
        initial: those of the start.
        happenings: whens and assertions so far.

    Raises:
        ModelicaTextError: nothing can demand one, in an initial equation or of what is outside.
    """
    every = [(demand, source) for *sides, source in equations for side in sides for demand in demands(side)]
    result: list[Happening] = []
    for happening in happenings:
        branches = list(happening.branches)
        for m, (conditions, new) in enumerate(branches):
            every += [(demand, happening.source) for each in conditions for demand in demands(each)]
            values = (value for name, value in new.items() if not is_ending(name))
            inner = dict.fromkeys(demand for value in values for demand in demands(value))
            placed = [(holds, _at(words, happening.source)) for holds, words in inner]
            more = {f"{ASSERT}{len(new) + n}": Expr("demand", demand) for n, demand in enumerate(placed)}
            branches[m] = (conditions, {**new, **more})
        result.append(replace(happening, branches=tuple(branches)))
    for *sides, source in initial:
        if any(map(demands, sides)):
            raise ModelicaTextError("A subscript of an initial equation must be known.", where=source)
    for (holds, words), source in dict.fromkeys(every):
        if height(holds):
            raise ModelicaTextError("A subscript of what is outside of a class must be known.", where=source)
        result.append(Happening((((_settled(holds),), {}),), source, _at(words, source).args[0]))
    return result


def _settled(holds: Expr) -> Expr:
    """Return a condition as it is when an event is over: the values before are the values."""
    if holds.kind == "call" and holds.args[0] == "pre":
        return holds.args[1][0]
    return with_operands(holds, _settled)


def _at(words: Expr, source: Source) -> Expr:
    """Return the words of a demand with its place: the end of a run does not tell it."""
    return Expr("string", (f"{words.args[0]}, in {source}".partition(" `")[0],), words.line)


def demands(node: Expr) -> list[Demand]:
    """Return what subscripts in an expression demand, once each: a condition, and the words of its assertion."""
    return list(dict.fromkeys(_demands(node, ())))


def _demands(node: Expr, guards: tuple[Expr, ...]) -> Iterator[Demand]:
    """Yield the demands where all guards hold: conditions of what is around the expression."""
    args = node.args[1] if node.kind == "call" else node.args
    if node.kind == "shared" and node.args[0].demanding:
        law, *arguments = node.args
        for holds, words in demands(law.result):
            yield guarded(Expr("shared", (Law(holds), *arguments), node.line), guards), words
        for argument in arguments:
            yield from _demands(argument, guards)
    elif node.kind == "if":
        before = guards
        for condition, value in zip(args[:-1:2], args[1::2], strict=True):
            yield from _demands(condition, before)
            yield from _demands(value, (*before, condition))
            before = (*before, fold.operation("not", (condition,), node.line))
        # Where a subscript is none of its array is not where the conditions of that choice say so.
        yield from _demands(args[-1], guards if args[-1].kind == OUTSIDE else before)
    elif node.kind in ("and", "or"):
        yield from _demands(args[0], guards)
        first = args[0] if node.kind == "and" else fold.operation("not", (args[0],), node.line)
        yield from _demands(args[1], (*guards, first))
    elif node.kind == OUTSIDE:
        yield guarded(node.args[1], guards), Expr("string", node.args[2:], node.line)
    else:
        for operand in args:
            if isinstance(operand, Expr):
                yield from _demands(operand, guards)


def guarded(holds: Expr, guards: tuple[Expr, ...]) -> Expr:
    """Return what must hold where all guards do."""
    for guard in reversed(guards):
        holds = fold.operation("or", (fold.operation("not", (guard,), holds.line), holds), holds.line)
    return holds
