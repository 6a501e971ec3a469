"""Discrete equations in the right order, and guards a moment later."""

import functools
from typing import Any

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from modelica_like import build
from modelica_like.compile.soon import ahead, guards_soon, time_resolution
from modelica_like.errors import StructureError
from modelica_like.language import (
    Component,
    Discrete,
    Equations,
    Events,
    Parameter,
    Variable,
    der,
    discrete,
    param,
    pre,
    var,
    when,
)

SIZE = 5


class Net(Component, partial=True):
    """Numbers that follow from each other's new and old values."""

    a: Discrete = discrete("1", "first")
    b: Discrete = discrete("1", "second")
    c: Discrete = discrete("1", "third")
    d: Discrete = discrete("1", "fourth")
    e: Discrete = discrete("1", "fifth")
    x: Variable = var("1", "value")
    T: Parameter = param("s", "time", default=1.0)

    def equations(self) -> Equations:
        yield self.T * der(self.x) == 1


def net(new: list[list[int]], old: list[list[int]], whens: list[bool]) -> Component:
    """Number k is k + 1, plus new and old values with weights; by an equation, or by a `when` where x passes k."""

    def value(self: Any, k: int) -> Any:
        mine = [getattr(self, name) for name in "abcde"]
        one = sum(weight * number for weight, number in zip(new[k], mine, strict=True))
        other = sum(weight * pre(number) for weight, number in zip(old[k], mine, strict=True) if weight)
        return k + 1 + one + other

    def equations(self: Any) -> Equations:
        yield from Net.equations(self)
        for k, name in enumerate("abcde"):
            if not whens[k]:
                yield getattr(self, name) == value(self, k)

    def events(self: Any) -> Events:
        for k, name in enumerate("abcde"):
            if whens[k]:
                yield when(self.x > k, {getattr(self, name): value(self, k)})

    return type("Made", (Net,), {"equations": equations, "events": events})(x=-1.0)


WEIGHTS = st.lists(st.lists(st.integers(-2, 2), min_size=SIZE, max_size=SIZE), min_size=SIZE, max_size=SIZE)


@given(WEIGHTS, WEIGHTS, st.permutations(range(SIZE)), st.lists(st.booleans(), min_size=SIZE, max_size=SIZE))
@settings(deadline=None, max_examples=8)
def test_new_values_follow_from_new_ones_and_old_ones(new, old, order, whens):
    """In an order that is not that of the lines: number k uses new values of those before it only."""
    place = {k: n for n, k in enumerate(order)}
    new = [[w if place[j] < place[k] else 0 for j, w in enumerate(row)] for k, row in enumerate(new)]
    model = build(net(new, old, whens))
    d = np.random.default_rng(1).integers(-9, 9, model.discrete_size).astype(float)
    at = model.discrete_position
    # Whether the condition of a `when` is true, and whether it was, is random.
    for number in range(1, 1 + sum(whens)):
        for kind in ("relation", "was"):
            d[at[f"{kind}[{number}]"]] %= 2
    results = model.events.updates(0.0, [0.0], [], model.p, model.u, d).full().ravel()
    found = {row.reset.index: value for row, value in zip(model.events.update_rows, results, strict=True)}
    before, expected = [d[at[name]] for name in "abcde"], dict[int, float]()
    for k in order:
        own = k + 1 + sum(w * expected[j] for j, w in enumerate(new[k]) if w)
        own += sum(w * one for w, one in zip(old[k], before, strict=True))
        number = 1 + sum(whens[:k])
        active = not whens[k] or (d[at[f"relation[{number}]"]] and not d[at[f"was[{number}]"]])
        expected[k] = own if active else before[k]
    assert [found[at[name]] for name in "abcde"] == [expected[k] for k in range(SIZE)]


def test_numbers_that_need_each_other_are_told_in_a_circle():
    ring = [[int(j == (k + 1) % 3 and k < 3) for j in range(SIZE)] for k in range(SIZE)]
    none = [[0] * SIZE] * SIZE
    with pytest.raises(
        StructureError, match=r"in a loop: (a → b → c → a|b → c → a → b|c → a → b → c)\.|loop: a → c → b → a"
    ):
        build(net(ring, none, [False] * SIZE))
    alone = [[int(j == k == 1) for j in range(SIZE)] for k in range(SIZE)]
    with pytest.raises(StructureError, match="b determines itself at an event"):
        build(net(alone, none, [False] * SIZE))
    build(net(none, ring, [False] * SIZE))


@pytest.mark.parametrize("t", [-7.0, -0.5, 0.0, 0.3, 1.0, 12.5])
def test_a_moment_is_a_share_of_time_or_of_a_second(t):
    moment = 1e-10 * max(1.0, abs(t))
    assert time_resolution(t) == pytest.approx(moment, rel=1e-15)
    assert float(ca.evalf(ahead(ca.SX(t)))) == pytest.approx(moment, rel=1e-15)


def test_joined_relations_go_on_one_by_one():
    """A relation at zero that falls is no longer true, whatever the other one of the pair does."""
    t, x = ca.SX.sym("t"), ca.SX.sym("x", 3)
    guards = ca.vertcat(ca.fmin(x[0], x[1]), ca.fmax(x[1], ca.fmin(x[2], x[0])), x[2])
    rates = ca.DM([1.0, -2.0, 3.0])
    soon = guards_soon(t, lambda one: ca.jtimes(one, x, ca.SX(rates)), guards)
    values = ca.Function("soon", [t, x], [soon])(20.0, [0.0, 0.0, 5.0]).full().ravel()
    moved = np.array([0.0, 0.0, 5.0]) + 20e-10 * np.array([1.0, -2.0, 3.0])
    expected = [min(moved[0], moved[1]), max(moved[1], min(moved[2], moved[0])), moved[2]]
    np.testing.assert_allclose(values, expected, rtol=1e-12)
    assert guards_soon(t, functools.partial(ca.jtimes), ca.SX(0, 1)).numel() == 0
