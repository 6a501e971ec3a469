"""Discrete equations of a class: what a `when` may set, what determines a number, and what is shared."""

from typing import Any

import pytest

from modelica_like import build
from modelica_like.errors import LanguageError
from modelica_like.flatten import flatten
from modelica_like.flatten.template import template_of
from modelica_like.language import (
    Component,
    Discrete,
    Equations,
    Events,
    Input,
    Mode,
    Parameter,
    Variable,
    boolean,
    der,
    discrete,
    floor,
    if_,
    initial,
    integer,
    param,
    pre,
    signal_in,
    terminal,
    var,
    when,
)


class Things(Component, partial=True):
    x: Variable = var("1", "value")
    u: Input = signal_in("1", "input", default=1.0)
    T: Parameter = param("s", "time", default=1.0)
    n: Discrete = discrete("1", "number")
    mode = Mode("a", "b")

    def equations(self) -> Equations:
        yield self.T * der(self.x) == self.u


def made(base: type[Component] = Things, equations: Any = (), events: Any = (), **fields: Any) -> Component:
    """A component with more equations and events, as functions of it."""

    def all_equations(self: Any) -> Equations:
        yield from base.equations(self)
        for one in equations:
            yield one(self)

    def all_events(self: Any) -> Events:
        for one in events:
            yield one(self)

    hints = {"__annotations__": dict.fromkeys(fields, "Discrete")} if fields else {}
    return type("Made", (base,), {"equations": all_equations, "events": all_events, **fields, **hints})(x=0.0)


@pytest.mark.parametrize("target", [lambda c: c.x, lambda c: c.n])
def test_a_when_sets_variables_and_discrete_values(target):
    (form,) = template_of(made(events=[lambda c: when(c.x > 1, {target(c): 2})])).update_forms[:1]
    assert form.target in ("x", "n")


@pytest.mark.parametrize(
    "target",
    [
        lambda c: c.u, lambda c: c.T, lambda c: der(c.x), lambda c: c.time, lambda c: pre(c.n), lambda c: c.x + c.n,
        lambda c: c.mode.is_("a"), lambda c: initial(), lambda c: floor(c.x, events=True), lambda c: "n",
    ],
)  # fmt: skip
def test_a_when_sets_nothing_else(target):
    with pytest.raises(LanguageError, match="which is neither a variable nor discrete"):
        flatten(made(events=[lambda c: when(c.x > 1, {target(c): 2})]))


@pytest.mark.parametrize(
    ("equations", "events", "fields", "told"),
    [
        ((), (), {}, ""),
        ((lambda c: c.y == c.n,), (), {"y": var("1", "reader")}, "nothing determines the discrete variable n"),
        ((lambda c: c.y == c.n,), (), {"y": var("1", "reader"), "n": discrete("1", "number", start=1)}, ""),
        ((), (), {"n": boolean("flag")}, "nothing determines the discrete variable n"),
        ((), (), {"n": integer("count", start=1)}, "nothing determines the discrete variable n"),
        ((lambda c: c.n == 2 * c.mode.choose(a=1, b=2),), (), {}, ""),
        ((), (lambda c: when(c.x > 1, {c.n: 2}),), {}, ""),
        ((), (lambda c: c.mode.go("a", "b", when=c.x > 1, reset={c.n: 2}),), {}, ""),
        ((lambda c: c.n == c.mode.choose(a=1, b=2),), (lambda c: when(c.x > 1, {c.n: 2}),), {}, "determined twice"),
        ((), (lambda c: when(c.x > 1, {c.n: 2}), lambda c: when(c.x > 2, {c.n: 2})), {}, "n is determined twice"),
        (
            (), (lambda c: when(c.x > 1, {c.n: 2}), lambda c: c.mode.go("a", "b", when=c.x > 1, reset={c.n: 2})), {},
            "n is set by a transition and determined by an equation or a `when`",
        ),
        (
            (), (lambda c: when(c.x > 1, {c.x: 2}), lambda c: c.mode.go("a", "b", when=c.x > 1, reset={c.x: 2})), {},
            "",
        ),
        ((lambda c: c.n == 2 * c.x,), (), {}, "n changes at events only, but its equation follows x all the time"),
        ((lambda c: c.n == c.T / c.time,), (), {}, "its equation follows time all the time"),
        ((lambda c: c.n == if_(c.x > 1, 1, 0),), (), {}, ""),
        ((lambda c: c.n == 1 + floor(c.x, events=True),), (), {}, ""),
        ((), (lambda c: c.mode.go("a", "b", when=c.x > pre(c.n)),), {}, r"pre\(n\) is in a transition"),
        ((), (lambda c: c.mode.go("a", "b", when=c.x > 1, reset={c.x: pre(c.n)}),), {}, r"pre\(n\) is in a transition"),
    ],
)  # fmt: skip
def test_what_determines_a_discrete_value(equations, events, fields, told):
    component = made(equations=equations, events=events, **fields)
    if told:
        with pytest.raises(LanguageError, match=told):
            flatten(component)
    else:
        flatten(component)


def test_branches_of_a_when_count_in_their_order():
    """n is 10 or 20 by the first condition that becomes true; x is set by the second one only."""
    part = made(events=[lambda c: when(c.x > 1, {c.n: 10}).elsewhen(c.x > -1, {c.n: 20, c.x: 5})])
    model = build(part)
    at, rows = model.discrete_position, {row.reset.kind: k for k, row in enumerate(model.events.update_rows)}
    kinds = [("discrete", model.events.update_rows[k].reset.index) for k in range(len(model.events.update_rows))]
    for first in (0, 1):
        for second in (0, 1):
            d = [0.0] * model.discrete_size
            d[at["relation[1]"]], d[at["relation[2]"]], d[at["n"]] = first, second, 3.0
            found = model.events.updates(0.0, [0.0], [], model.p, [], d).full().ravel()
            n = found[kinds.index(("discrete", at["n"]))]
            assert n == (10 if first else 20 if second else 3)
            assert found[rows["state"]] == (5 if second and not first else float("inf"))


def test_start_and_end_are_shared_by_all_parts():
    class Part(Component):
        n: Discrete = discrete("1", "number")
        k: Discrete = discrete("1", "another")

        def events(self) -> Events:
            yield when(initial(), {self.n: pre(self.n) + 1})
            yield when(terminal(), {self.k: pre(self.k) + 2})

    class Two(Component):
        a, b = Part(), Part(n=4.0)

    flat = flatten(Two())
    paths = [one.path for one in flat.discretes]
    assert sorted(path for path in paths if path.endswith("()")) == ["initial()", "terminal()"]
    by_path = {one.path: one for one in flat.discretes}
    assert (by_path["initial()"].start, by_path["terminal()"].start) == (1.0, 0.0)
    assert (by_path["pre(a.n)"].start, by_path["pre(b.n)"].start) == (0.0, 4.0)
    assert by_path["initial()"].description == "whether a run begins"
    assert by_path["terminal()"].description == "whether a run ends"
    here = paths.index("initial()")
    pairs = {(paths[k], paths[of]) for k, of in flat.pres.items() if k != here}
    assert flat.pres[here] == here
    assert {("pre(a.n)", "a.n"), ("pre(b.n)", "b.n"), ("pre(a.k)", "a.k"), ("pre(b.k)", "b.k")} <= pairs
    assert all(one.hidden == ("(" in one.path or "[" in one.path) for one in flat.discretes)


def test_parts_of_one_class_share_its_template():
    class Part(Component):
        k: Parameter = param("1", "number")
        w: Parameter = param("*", "of any unit", default=1.0)
        extra: Parameter = param("1", "another", default=2.0)
        size: int = 1
        x: Variable = var("1", "value")

        def equations(self) -> Equations:
            yield self.x == (self.k if self.given("k") else 0) + self.size

    one = template_of(Part(k=1.0))
    assert template_of(Part(k=2.0, extra=5.0, x=1.0)) is one
    assert template_of(Part()) is not one
    assert template_of(Part(k=1.0, size=2)) is not one
    assert template_of(Part(k=1.0, w="1 m")) is not one
    assert template_of(Part(k=1.0, w="2 m")) is template_of(Part(k=1.0, w="1 m"))
