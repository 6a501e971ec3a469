"""Dimensions along every equation."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from contextlib import contextmanager
from fractions import Fraction
from typing import Any, cast

import casadi as ca

from modelica_like.errors import LanguageError, Source, UnitMismatch
from modelica_like.language.expr import Expr, operands
from modelica_like.language.units import ANY, ONE, Unit, same_dimension

UnitOf = Callable[[Any], Unit]
"""Gives the unit of a leaf (a symbolic `casadi.SX`)."""

_SUMS = {ca.OP_ADD, ca.OP_SUB, ca.OP_FMIN, ca.OP_FMAX, ca.OP_FMOD, ca.OP_HYPOT, ca.OP_COPYSIGN, ca.OP_REMAINDER}
_SAME = {ca.OP_NEG, ca.OP_FABS, ca.OP_TWICE, ca.OP_ASSIGN}
_COMPARED = dict.fromkeys((ca.OP_LT, ca.OP_LE, ca.OP_EQ, ca.OP_NE), "the sides of a comparison")
_COMPARED[ca.OP_ATAN2] = "the coordinates of an angle"
_PLAIN = {ca.OP_NOT, ca.OP_AND, ca.OP_OR, ca.OP_SIGN}
_POWERS = {ca.OP_SQ: Fraction(2), ca.OP_SQRT: Fraction(1, 2), ca.OP_INV: Fraction(-1)}


_FINEST = 60
"""Largest denominator of an exponent; a power of a number can have any."""
_MIXED = Unit((("different units in different modes", 1),))
"""Sum of a mode's branches with different units: valid only in an equation with zero."""


class _Clash(Exception):
    """Two terms of a sum or a relation differ."""

    def __init__(self, left: Unit, right: Unit, what: str) -> None:
        self.left, self.right, self.what = left, right, what


class _NotANumber(Exception):
    """A number in an expression is nan."""


class Dimensions:
    """Units of expressions, with a cache.

    Args:
        unit_of: gives the unit of a leaf.
    """

    def __init__(self, unit_of: UnitOf) -> None:
        self._unit_of = unit_of
        self._known: dict[int, tuple[Any, Unit]] = {}

    def unit(self, expression: Expr | float) -> Unit:
        """Return the unit of an expression; zero and unknown units fit everything."""
        root: Any = ca.SX(cast(Any, expression))
        pending = [root]
        while pending:
            node = pending.pop()
            parts = operands(node)
            unknown = [part for part in parts if part.element_hash() not in self._known]
            if unknown:
                pending += [node, *unknown]
            elif node.element_hash() not in self._known:
                units = [self._known[part.element_hash()][1] for part in parts]
                # The node itself is kept too, so that no other node can get its identity.
                self._known[node.element_hash()] = (node, self._of_node(node, parts, units))
        return self._known[root.element_hash()][1]

    def unit_or_any(self, expression: Expr | float) -> Unit:
        """Return the unit of an expression, or `ANY` if its terms clash (the check of the equation reports that)."""
        try:
            return self.unit(expression)
        except (_Clash, _NotANumber):
            return ANY

    def _of_node(self, node: Any, parts: list[Any], units: list[Unit]) -> Unit:
        if node.is_symbolic():
            return self._unit_of(node)
        if not parts:
            if math.isnan(float(node)):
                raise _NotANumber
            return ANY if float(node) == 0.0 else ONE
        operation = node.op()
        if operation == ca.OP_ADD and all(map(_is_choice, parts)):
            return _MIXED if _MIXED in units or not same_dimension(*units) else _common(*units, what="")
        if operation in _SUMS:
            return _common(*units, what="the terms of a sum")
        if operation in _COMPARED:
            _common(*units, what=_COMPARED[operation])
            return ONE
        if operation in _PLAIN:
            return ONE
        if operation in _SAME:
            return units[0]
        if operation == ca.OP_MUL:
            return _times(*units)
        if operation == ca.OP_DIV:
            return _times(*units, power=-1)
        if operation in _POWERS:
            return _times(ONE, *units, power=_POWERS[operation])
        if operation == ca.OP_IF_ELSE_ZERO:
            return units[1]
        if operation in (ca.OP_POW, ca.OP_CONSTPOW):
            return _power(*units, exponent=parts[1])
        for unit in units:
            _common(unit, ONE, what="the argument of a function and a number")
        return ONE


def _is_choice(node: Any) -> bool:
    """Tell whether a term comes from `Mode.choose`."""
    while node.op() == ca.OP_ADD:
        *_, node = operands(node)
    return node.op() == ca.OP_IF_ELSE_ZERO


def _common(left: Unit, right: Unit, *, what: str) -> Unit:
    if (_MIXED in (left, right) and ANY not in (left, right)) or not same_dimension(left, right):
        raise _Clash(left, right, what)
    return right if left == ANY else left


def _times(left: Unit, right: Unit, *, power: float | Fraction = 1) -> Unit:
    if _MIXED in (left, right):
        raise _Clash(left, right, "the factors of a product")
    return left * right**power


def _power(base: Unit, exponent_unit: Unit, *, exponent: Any) -> Unit:
    _common(exponent_unit, ONE, what="an exponent and a number")
    if exponent.is_constant():
        return _times(ONE, base, power=Fraction(float(exponent)).limit_denominator(_FINEST))
    return _common(base, ONE, what="the base of a variable power and a number")


def check_equation(left: Expr, right: Expr, dimensions: Dimensions, component: str, source: Source) -> None:
    """Check that both sides of an equation have the same dimension.

    Args:
        left: one side.
        right: the other.
        dimensions: knows the units of the leaves.
        component: name of the class, for messages.
        source: place of the equation.

    Raises:
        UnitMismatch: they differ, or a side is a sum of different dimensions.
        LanguageError: a number is nan.
    """
    place = f"{component}, {source}" if source.file else component
    with _told(place, (), component, source):
        units = dimensions.unit(left), dimensions.unit(right)
    if _MIXED in units and ANY not in units:
        raise UnitMismatch(
            f"{place}: the branches of choose(…) or where(…) differ in unit; this is allowed only in `… == 0`."
        )
    if not same_dimension(*units):
        raise UnitMismatch(f"{place}: left {units[0]}, right {units[1]}.")


def check_expression(
    expression: Expr | float, expected: Unit, dimensions: Dimensions, label: str, source: Source | None = None
) -> None:
    """Check that an expression has the expected dimension.

    Args:
        expression: the expression.
        expected: its unit, or one of the same dimension.
        dimensions: knows the units of the leaves.
        label: name for messages.
        source: its place.

    Raises:
        UnitMismatch: it has another one.
        LanguageError: a number is nan.
    """
    where = (source,) if source else ()
    with _told(label, where, label, source):
        unit = dimensions.unit(expression)
    if unit == _MIXED:
        raise UnitMismatch(
            f"{label} expects {expected}; the branches of choose(…) or where(…) differ in unit.", where=where
        )
    expect_unit(unit, expected, label, where)


def expect_unit(unit: Unit, expected: Unit, label: str, where: tuple[Source, ...] = ()) -> None:
    """Check that a unit has the dimension of the expected one; the other arguments are those of `check_expression`.

    Raises:
        UnitMismatch: it has another one.
    """
    if not same_dimension(unit, expected):
        actual = "has no unit" if unit == ONE else f"is {unit}"
        raise UnitMismatch(f"{label} expects {expected}; the expression {actual}.", where=where)


@contextmanager
def _told(label: str, where: tuple[Source, ...], owner: str, source: Source | None) -> Generator[None]:
    """Return the error of an expression without a unit: terms clash, or a number of the owner is nan."""
    try:
        yield
    except _Clash as clash:
        raise UnitMismatch(f"{label}: {clash.what} differ: {clash.left} and {clash.right}.", where=where) from None
    except _NotANumber:
        raise LanguageError(
            f"{owner}: an expression contains nan.",
            where=source or (),
            advice="Functions of `math` do not work on symbols: import sqrt, sin and so on from the language.",
        ) from None
