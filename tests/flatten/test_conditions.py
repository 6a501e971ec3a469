"""Guards of conditions: positive exactly where the condition holds."""

import operator
from collections.abc import Callable
from typing import Any

import casadi as ca
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from modelica_like.errors import LanguageError, Source
from modelica_like.flatten.conditions import guard_of
from modelica_like.language import Component, Mode, Parameter, Variable, param, var

NOWHERE = Source("")
RELATIONS: dict[str, Callable[[Any, Any], Any]] = {
    name: getattr(operator, name) for name in ("lt", "le", "gt", "ge", "eq", "ne")
}
NUMBERS = st.integers(-2, 2)


class Things(Component):
    x: Variable = var("1", "one")
    y: Variable = var("1", "another")
    p: Parameter = param("1", "number", default=1.0)
    m = Mode("a", "b", "c")


Condition = tuple[Any, Callable[[float, float, float], bool]]
"""An expression of x, y and p, and what it means."""


def relation(things: Any, name: str, number: int, sides: int) -> Condition:
    compare = RELATIONS[name]
    return [
        (compare(things.x, things.y + number), lambda x, y, p: compare(x, y + number)),
        (compare(things.y, number), lambda x, y, p: compare(y, number)),
        (compare(things.p, number), lambda x, y, p: compare(p, number)),
        (ca.SX(float(compare(number, 0))), lambda x, y, p: compare(number, 0)),
        (ca.SX(things.p), lambda x, y, p: p != 0),
    ][sides]


def joined(inner: st.SearchStrategy[Any]) -> st.SearchStrategy[Any]:
    return st.one_of(
        st.tuples(st.just("not"), inner),
        st.tuples(st.sampled_from(["and", "or"]), inner, inner),
    )


def written(tree: Any, things: Any) -> Condition:
    """Write a tree as an expression and as a function."""
    kind, *inner = tree
    if kind == "relation":
        return relation(things, *inner)
    if kind == "not":
        expression, holds = written(inner[0], things)
        return ca.logic_not(expression), lambda x, y, p: not holds(x, y, p)
    (one, first), (other, second) = (written(part, things) for part in inner)
    if kind == "and":
        return ca.logic_and(one, other), lambda x, y, p: first(x, y, p) and second(x, y, p)
    return ca.logic_or(one, other), lambda x, y, p: first(x, y, p) or second(x, y, p)


leaves = st.tuples(st.just("relation"), st.sampled_from([*RELATIONS]), NUMBERS, st.integers(0, 4))
trees = st.recursive(leaves, joined, max_leaves=6)


@given(trees, NUMBERS, NUMBERS, NUMBERS)
@settings(deadline=None, max_examples=150)
def test_a_guard_is_positive_where_its_condition_holds(tree, x, y, p):
    things: Any = Things()
    condition, holds = written(tree, things)
    value = ca.Function("guard", [things.x, things.y, things.p], [guard_of(condition, NOWHERE)])
    assert (float(value(x, y, p)) > 0) == holds(x, y, p)


@pytest.mark.parametrize("name", ["lt", "le", "gt", "ge"])
def test_a_guard_of_a_relation_is_its_distance(name):
    """So the instant at which it changes can be located: linear with slope 1, and 0 (but for the sign) where equal."""
    things: Any = Things()
    guard = guard_of(RELATIONS[name](things.x, things.y), NOWHERE)
    values = [float(ca.Function("guard", [things.x, things.y], [guard])(x, 1.0)) for x in (-2.0, 1.0, 4.5)]
    sign = 1 if name in ("gt", "ge") else -1
    assert [sign * one for one in values] == pytest.approx([-3.0, 0.0, 3.5], abs=1e-299)


def test_what_moves_is_no_condition_alone():
    things: Any = Things()
    for wrong in (things.x, things.x + things.p, 1.0):
        with pytest.raises(LanguageError, match="is not a relation"):
            guard_of(wrong, NOWHERE)
