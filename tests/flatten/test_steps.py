"""What jumps becomes an event; what meets, or is asked to make none, does not; nothing that depends looks constant."""

from collections.abc import Callable
from typing import Any

import casadi as ca
import pytest

from modelica_like.flatten.steps import honest, with_events
from modelica_like.language import (
    Component,
    Expr,
    Parameter,
    Variable,
    absolute,
    all_of,
    any_of,
    floor,
    interpolate,
    maximum,
    minimum,
    mod,
    param,
    sign,
    sin,
    sqrt,
    var,
    where,
)
from modelica_like.language.discrete import Marker
from modelica_like.language.expr import symbols_in


class Law(Component):
    x: Variable = var("1", "a variable")
    y: Variable = var("1", "another one")
    a: Parameter = param("1", "a parameter", default=1.0)


Equation = Callable[[Law], Any]


def events(expression: Any) -> int:
    return sum(isinstance(one, Marker) for one in symbols_in(with_events(expression)))


@pytest.mark.parametrize(
    ("law", "count"),
    [
        (lambda c: c.y - c.a * sign(c.x), 2),
        (lambda c: c.y - floor(c.x), 1),
        (lambda c: c.y - mod(c.x, c.a), 1),
        (lambda c: c.y - where(c.x < 6, 2, 1), 1),
        (lambda c: c.y - where(all_of(c.x < 6, c.y < c.a), 2, 1), 2),
        (lambda c: c.y - where(any_of(c.x < 6, c.time < 2), c.x, c.y), 2),
        (lambda c: c.y - (c.x > c.a) * 3.0, 1),
        (lambda c: c.y - where(c.x < 0, c.x, 2 * c.x + 1e-9), 1),
        (lambda c: c.y - where(c.x < c.a, c.x**2, c.x), 1),
        (lambda c: c.y - where(floor(c.x) < 3, 1, 0), 1),
        (lambda c: c.y - where(absolute(c.x) < 1e-3, 1, 0), 1),
        (lambda c: c.y - maximum(0, sign(c.x)), 2),
        (lambda c: c.y - minimum(sign(c.x - c.a), 0), 2),
        (lambda c: c.y - maximum(absolute(c.x), sign(sin(c.y) - 0.3)), 2),
    ],
)
def test_jumps_become_events(law: Equation, count: int) -> None:
    assert events(law(Law())) == count


@pytest.mark.parametrize(
    "law",
    [
        lambda c: c.y - c.x * sign(c.x),
        lambda c: c.y - where(c.x < 0, -c.x, c.x),
        lambda c: c.y - where(c.x < c.a, c.x / c.a, 2 - c.a / c.x),
        lambda c: c.y - where(c.x > 0, sqrt(c.x), 0),
        lambda c: c.y - where(c.x * c.y > 0, 3, 0.5) * absolute(c.x) * c.y,
        lambda c: c.y - (floor(c.x) + mod(c.x, 1) ** 3),
        lambda c: c.y - mod(c.x, 1) * (1 - mod(c.x, 1)),
        lambda c: c.y - interpolate(c.x, [0, 1, 3], [0, 2, 1], smooth=True),
        lambda c: c.y - maximum(c.x, 3),
        lambda c: c.y - where(c.a < 6, 2, 1),
    ],
)
def test_branches_that_meet_make_none(law: Equation) -> None:
    assert events(law(Law())) == 0


SILENT: list[Callable[[Expr], Expr]] = [
    lambda x: sign(x, events=False),
    lambda x: floor(x, events=False),
    lambda x: mod(x, 2, events=False) - x,
    lambda x: where(all_of(x < 6, sin(x) > 0), 2, 1, events=False),
    lambda x: ca.if_else(x == 3, 2, 1),
    lambda x: ca.fmod(x, 2) - x,
]


@pytest.mark.parametrize("law", SILENT)
def test_what_is_asked_to_make_no_event_keeps_its_values_and_a_slope_in_the_graph(law: Callable[[Expr], Expr]) -> None:
    c = Law()
    before, after = law(c.x), honest(law(c.x))
    assert events(c.y - before) == 0
    assert any(ca.which_depends(after, c.x, 2, True))
    both = ca.Function("both", [c.x], [before, after, ca.jacobian(after, c.x)])
    for x in (-7.5, -1.0, 0.0, 0.25, 3.0, 1e30, -1e30):
        old, new, slope = (float(one) for one in both(x))
        assert old == new
        assert slope in (0.0, -1.0)  # the second one of `- x`


def test_a_step_of_a_step_follows_it() -> None:
    """A relation of a floor changes with the floor only."""
    c = Law()
    (only,) = (one for one in symbols_in(with_events(c.y - where(floor(c.x) < 3, 1, 0))) if isinstance(one, Marker))
    assert only.kind == "floor"
