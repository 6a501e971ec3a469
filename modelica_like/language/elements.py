"""Elements of long lists of numbers: one operation of a graph, however long the list is."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from typing import Any, cast

import casadi as ca
import numpy as np

from modelica_like.errors import LanguageError
from modelica_like.language.expr import Expr, Scalar

_NAME = "element_of_{}"
_BITS = 52
"""Of a list's number, which is a constant of the graph and so a double."""
_LISTS: dict[int, Any] = {}
"""Function of the index and of the list's number, by that."""


def element(values: Sequence[float], index: Scalar) -> Expr:
    """Return an element of a list of numbers.

    Args:
        values: the numbers, at least one; they are data, no parameters.
        index: from 0; below and beyond, the first and last element count. Between whole numbers that below counts: if
            it moves, they are events.

    Raises:
        LanguageError: there are no values, or they are no numbers.
    """
    # Whoever does not check types may hand in anything.
    given = list[object](values)
    if len(given) == 0 or not all(isinstance(value, int | float | np.number) for value in given):
        raise LanguageError(
            "element takes a list of numbers, at least one.",
            advice="Of expressions, `where` chooses one; of a table over a variable, `interpolate` is the value.",
        )
    data = np.asarray(values, float)
    number = int.from_bytes(hashlib.sha256(data.tobytes()).digest()[:8], "big") >> (64 - _BITS)
    if number not in _LISTS:
        place, of = ca.MX.sym("index"), [ca.MX.sym("number"), ca.MX.sym("count")]
        nodes, numbers = (np.arange(float(len(data))), data) if len(data) > 1 else (np.arange(2.0), data[[0, 0]])
        table = ca.interpolant("table", "linear", [nodes], numbers, {"lookup_mode": ["exact"]})
        # No slope, though it depends on the index, whole number as it is.
        within = ca.fmin(ca.fmax(ca.floor(place), 0), len(data) - 1)
        name = _NAME.format(number)
        _LISTS[number] = ca.Function(name, [place, *of], [table(within)], {"never_inline": True})
    return cast(Expr, _LISTS[number](ca.floor(ca.SX(cast(Any, index))), number, len(data)))


def applied(code: int, operands: list[Any], function: Any = None) -> Any:
    """Apply an operation of an expression graph to other operands.

    Args:
        code: number of the operation in CasADi.
        operands: expressions.
        function: that which the operation is read from; with it come the lists of a model that was stored.
    """
    if code == ca.OP_CALL:
        return _list_of(float(operands[1]), function)(*operands)
    return ca.SX.unary(code, *operands) if len(operands) == 1 else ca.SX.binary(code, *operands)


def rebuilt(node: Any, operands: list[Any]) -> Any:
    """Return a node of an expression graph with other operands."""
    if node.is_output():  # the value of a call, its only operand
        return operands[0]
    return applied(ca.OP_CALL if node.is_call() else node.op(), operands)


def inserted(symbols: list[Any], values: list[Any], expressions: list[Any]) -> list[Any]:
    """Replace symbols by expressions that may contain those before them.

    Args:
        symbols: scalar symbols.
        values: their expressions, in an order in which they can be computed.
        expressions: what they are replaced in.
    """
    if not ca.Function("calls", [], [*values, *expressions], {"allow_free": True}).find_functions():
        return list(ca.substitute_inplace(symbols, values, expressions, False)[1])
    # CasADi puts the last operand in the place of a call there.
    known: dict[int, Any] = {}

    def written(expression: Any) -> Any:
        those = [leaf for leaf in ca.symvar(expression) if leaf.element_hash() in known]
        return ca.substitute(
            expression, ca.vertcat(*those), ca.vertcat(*(known[leaf.element_hash()] for leaf in those))
        )

    for symbol, value in zip(symbols, values, strict=True):
        known[symbol.element_hash()] = written(value)
    return [written(expression) for expression in expressions]


def numbers_of(number: float, count: float, function: Any) -> tuple[float, ...]:
    """Return the list of numbers that a function reads an element of.

    Args:
        number: of the list, the second operand of the element.
        count: of its numbers, the third operand.
        function: that which has the operation.
    """
    numbers = _list_of(number, function).map(int(count))(np.arange(count), number, count)
    return tuple(numbers.full().ravel().tolist())


def _list_of(number: float, function: Any) -> Any:
    number = int(number)
    if number not in _LISTS:
        _LISTS[number] = function.find_function(_NAME.format(number))
    return _LISTS[number]
