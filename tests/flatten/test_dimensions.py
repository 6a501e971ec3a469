"""Units of expressions against a calculation with exponents of m, kg and s, over random expressions."""

from collections.abc import Callable
from fractions import Fraction
from typing import Any

import casadi as ca
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from modelica_like.errors import LanguageError, Source, UnitMismatch
from modelica_like.flatten.dimensions import Dimensions, check_equation, check_expression
from modelica_like.language.units import ANY, ONE, Unit, parse_unit

Exponents = tuple[Fraction, ...]
UNITS = {"1": (0, 0, 0), "m": (1, 0, 0), "s": (0, 0, 1), "m/s": (1, 0, -1), "kg.m2": (2, 1, 0), "rad": (0, 0, 0)}
NUMBER: Exponents = (Fraction(0),) * 3
MIXED, DIFFER = "mixed", "differ"
"""Branches of different units, and units that must be the same and are not; what fits everything is None."""
NOWHERE = Source("")

SUMS: dict[str, Callable[[Any, Any], Any]] = {
    "-": lambda a, b: a - b, "min": ca.fmin, "max": ca.fmax, "mod": ca.fmod, "hypot": ca.hypot, "sign": ca.copysign,
    "remainder": ca.remainder, "+": lambda a, b: a + b,
}  # fmt: skip
PLAIN: dict[str, Callable[[Any], Any]] = {"sin": ca.sin, "exp": ca.exp, "tanh": ca.tanh, "log": ca.log}
KEPT: dict[str, Callable[[Any], Any]] = {"neg": lambda a: -a, "abs": ca.fabs, "twice": lambda a: 2 * a}
POWERS: dict[str, tuple[Callable[[Any], Any], Fraction]] = {
    "square": (lambda a: a**2, Fraction(2)), "root": (ca.sqrt, Fraction(1, 2)), "cube": (lambda a: a**3, Fraction(3)),
    "inverse": (lambda a: 1 / a, Fraction(-1)), "third": (lambda a: a ** (1 / 3), Fraction(1, 3)),
}  # fmt: skip


def same(one: Any, other: Any) -> Any:
    if DIFFER in (one, other):
        return DIFFER
    if one is None or other is None:
        return one or other
    return one if one == other != MIXED else DIFFER


def times(one: Any, other: Any, power: float | Fraction = 1) -> Any:
    if {MIXED, DIFFER} & {one, other}:
        return DIFFER
    return None if None in (one, other) else tuple(a + power * b for a, b in zip(one, other, strict=True))


def fits(checked: Any, then: Any) -> Any:
    return DIFFER if checked == DIFFER else then


class Written:
    """Writes trees as expressions of fresh symbols, and calculates their exponents."""

    def __init__(self) -> None:
        self.units: dict[int, Unit] = {}
        self.kept: list[Any] = []
        self.dimensions = Dimensions(lambda leaf: self.units[leaf.element_hash()])

    def leaf(self, name: str) -> tuple[Any, Any]:
        self.kept.append(symbol := ca.SX.sym(name))
        self.units[symbol.element_hash()] = ANY if name == "*" else parse_unit(name)
        return symbol, None if name == "*" else tuple(map(Fraction, UNITS[name]))

    def write(self, tree: Any) -> tuple[Any, Any]:
        kind, *inner = tree
        if kind == "leaf":
            return self.leaf(*inner)
        (one, unit), *others = (self.write(part) for part in inner)
        if kind in PLAIN:
            return PLAIN[kind](one), same(unit, NUMBER)
        if kind in KEPT:
            return KEPT[kind](one), unit
        if kind in POWERS:
            function, exponent = POWERS[kind]
            return function(one), times(NUMBER, unit, exponent)
        if kind == "signum":
            return ca.sign(one), fits(unit, NUMBER)
        if kind == "more":
            return one + 2.5, same(unit, NUMBER)
        (other, another), *rest = others
        if kind in SUMS:
            return SUMS[kind](one, other), same(unit, another)
        if kind == "atan2":
            return ca.atan2(one, other), fits(same(unit, another), NUMBER)
        if kind == "power":
            return one**other, fits(same(another, NUMBER), same(unit, NUMBER))
        if kind in ("*", "/"):
            factor, exponent = (one * other, 1) if kind == "*" else (one / other, -1)
            return factor, times(unit, another, exponent)
        (then, first), (otherwise, second) = rest
        condition = {"<": one < other, "!=": one != other, "not": ca.logic_not(one <= other)}[kind]
        chosen = MIXED if MIXED in (first, second) else same(first, second)
        if chosen == DIFFER and DIFFER not in (first, second):
            chosen = MIXED
        return ca.if_else(condition, then, otherwise), fits(same(unit, another), fits(first, fits(second, chosen)))


def branches(inner: st.SearchStrategy[Any]) -> st.SearchStrategy[Any]:
    one = st.sampled_from([*PLAIN, *KEPT, *POWERS, "signum", "more"])
    # Sums of choices are choices of three; they are tried below.
    plain = inner.map(lambda tree: ("twice", tree) if tree[0] in ("<", "!=", "not") else tree)
    return st.one_of(
        st.tuples(one, inner),
        st.tuples(st.sampled_from([*SUMS]), plain, plain),
        st.tuples(st.sampled_from(["*", "/", "atan2", "power"]), inner, inner),
        st.tuples(st.sampled_from(["<", "!=", "not"]), inner, inner, inner, inner),
    )


leaves = st.tuples(st.just("leaf"), st.sampled_from([*UNITS, "*", "1", "1"]))
trees = st.recursive(leaves, branches, max_leaves=5)


@given(trees)
@settings(deadline=None, max_examples=200)
def test_units_are_those_of_exponents(tree):
    written = Written()
    expression, unit = written.write(tree)
    dimensions = written.dimensions
    if unit == DIFFER:
        with pytest.raises(UnitMismatch, match="differ"):
            check_expression(expression, ONE, dimensions, "it")
        with pytest.raises(UnitMismatch, match="differ"):
            check_equation(ca.SX(0), expression, dimensions, "It", NOWHERE)
        assert dimensions.unit_or_any(expression) == ANY
        return
    check_equation(expression, ca.SX(0), dimensions, "It", NOWHERE)
    if unit == MIXED:
        with pytest.raises(UnitMismatch, match="allowed only in"):
            check_equation(expression, written.leaf("m")[0], dimensions, "It", NOWHERE)
    elif unit is None:
        assert dimensions.unit(expression) == ANY
    else:
        m, kg, s = unit
        assert dimensions.unit(expression).dimension == (kg, m, s, 0, 0, 0, 0)


def test_a_choice_of_three_is_one_choice():
    """It is a sum of three terms; another term beside a choice is not a branch."""
    written = Written()
    (a, _), (b, _), (c, _), (k, _) = (written.leaf(name) for name in ("m", "m", "m", "1"))
    three = ca.if_else(k == 0, a, 0) + ca.if_else(k == 1, b, 0) + ca.if_else(k == 2, c, 0)
    assert str(written.dimensions.unit(three)) == "m"
    mixed = ca.if_else(k == 0, a, 0) + ca.if_else(k == 1, k, 0) + ca.if_else(k == 2, c, 0)
    check_equation(mixed, ca.SX(0), written.dimensions, "It", NOWHERE)
    check_equation(written.leaf("*")[0] - mixed, ca.SX(0), written.dimensions, "It", NOWHERE)
    for wrong in (ca.if_else(k == 0, a, 0) + k, k + ca.if_else(k == 0, a, 0), mixed - mixed * k):
        with pytest.raises(UnitMismatch, match="differ"):
            check_expression(wrong, ONE, written.dimensions, "it")


def test_a_number_that_is_none_is_told():
    written = Written()
    wrong = written.leaf("1")[0] + float("nan")
    assert written.dimensions.unit_or_any(wrong) == ANY
    with pytest.raises(LanguageError, match="it: an expression contains nan"):
        check_expression(wrong, ONE, written.dimensions, "it")


def test_deep_expressions_need_no_deep_stack():
    written = Written()
    deep = leaf = written.leaf("m")[0]
    for _ in range(1500):
        deep = ca.sqrt(deep * leaf) + leaf
    assert str(written.dimensions.unit(deep)) == "m"
