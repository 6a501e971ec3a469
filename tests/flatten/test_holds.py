"""Motions that modes hold, and ideal elements: which equation it is, and what it says."""

from typing import Any

import casadi as ca
import pytest

from modelica_like.errors import LanguageError
from modelica_like.flatten.holds import UNLIMITED, HoldForm, IdealForm
from modelica_like.flatten.template import Template, template_of
from modelica_like.language import (
    Component,
    Equations,
    Expr,
    Hold,
    Mode,
    Parameter,
    Variable,
    der,
    if_,
    param,
    sin,
    var,
)


class Stop(Component, partial=True):
    units_checked = False
    s: Variable = var("m", "place")
    v: Variable = var("m/s", "speed")
    f: Variable = var("N", "force")
    m: Parameter = param("kg", "mass", default=2.0)
    k: Parameter = param("1", "share", default=0.25)
    stop = Mode("free", "held", "loose", holds={"held": Hold("v", reaction="f", capacity="limits", restitution="k")})

    def limits(self) -> tuple[Expr, None]:
        return 3 * self.m, None

    def held(self) -> Any:
        return self.m * der(self.v)

    def equations(self) -> Equations:
        yield self.m * der(self.v) == self.f - sin(self.time)
        yield self.stop.choose(free=self.f, held=self.held(), loose=der(self.v) + self.f) == 0
        yield der(self.s) == self.v


def terms(template: Template, **values: float) -> list[float]:
    """Rows of the hold terms with named slots, parameters and modes, all others zero."""
    names = [[slot.path for slot in template.slots], template.parameters, template.discretes]
    columns = [[values.get(name, 0.0) for name in group] for group in names]
    return template.hold_terms(*columns, 0.0).full().ravel().tolist()


def test_the_equation_of_a_mode_is_found():
    class Plain(Stop):
        pass

    template = template_of(Plain())
    assert template.holds == (HoldForm("stop", 1, 0, "v", "f", 1, True),)
    assert terms(template, m=5.0, k=0.5, stop=1.0) == [5.0, 15.0, UNLIMITED, 0.5]
    assert terms(template, m=5.0, k=0.5, stop=2.0) == [0.0, 15.0, UNLIMITED, 0.5]
    assert terms(template, m=5.0, k=0.5, stop=0.0) == [0.0, 15.0, UNLIMITED, 0.5]


@pytest.mark.parametrize(
    ("held", "rigid"),
    [
        (lambda c: c.m * der(c.v) * c.k, True),
        (lambda c: der(c.v) + c.f, False),
        (lambda c: der(c.v) + 0.1 * c.v, False),
        (lambda c: der(c.v) - if_(c.v > 0, c.k, -c.k), True),  # no other variable: a number that events change
        (lambda c: der(c.v) + 0 * c.f + (c.f - c.f), True),
    ],
)
def test_a_hold_is_rigid_without_other_variables(held, rigid):
    class Odd(Stop):
        def held(self) -> Any:
            return held(self)

    assert template_of(Odd()).holds[0].rigid == rigid


def test_what_holds_in_every_mode_and_without_more():
    class Always(Stop):
        stop = Mode("one", "two", holds={"one": "v", "two": "v"})

        def equations(self) -> Equations:
            yield self.s == self.v * self.m
            yield self.stop.choose(one=der(self.v), two=3 * der(self.v)) == 0
            yield self.f == 0

    template = template_of(Always())
    assert template.holds == (HoldForm("stop", 0, -1, "v", "", 1, True), HoldForm("stop", 1, -1, "v", "", 1, True))
    assert terms(template, stop=1.0) == [0.0, UNLIMITED, UNLIMITED, 0.0, 3.0, UNLIMITED, UNLIMITED, 0.0]
    assert terms(template, stop=0.0) == [1.0, UNLIMITED, UNLIMITED, 0.0, 0.0, UNLIMITED, UNLIMITED, 0.0]


@pytest.mark.parametrize("name", ["m", "acceleration", "other", "limits", "stop"])
def test_what_is_held_is_a_variable_of_its_own(name):
    class Odd(Stop):
        stop = Mode("free", "held", "loose", holds={"held": name})

        @property
        def acceleration(self) -> Expr:
            return der(self.v)

    with pytest.raises(LanguageError, match=f"holds the motion '{name}', which is not a variable of Odd"):
        template_of(Odd())


def test_an_equation_must_hold_it_in_that_mode():
    class Odd(Stop):
        stop = Mode("free", "held", "loose", holds={"free": "v"})

    with pytest.raises(LanguageError, match=r"holds v in 'free', but no equation sets der\(v\) is zero"):
        template_of(Odd())


class Switch(Component, partial=True):
    units_checked = False
    u: Variable = var("V", "voltage")
    i: Variable = var("A", "current")
    R: Parameter = param("Ohm", "resistance", default=1.0)
    state = Mode("blocks", "conducts", ideal={"blocks": "i", "conducts": "u"})


def switch(first: Any, second: Any) -> Component:
    def equations(self: Any) -> Equations:
        yield first(self) == 0
        yield second(self) == 0

    return type("Made", (Switch,), {"equations": equations})()


@pytest.mark.parametrize(
    ("first", "second", "row"),
    [
        (lambda c: c.u + c.i, lambda c: c.state.choose(blocks=c.i, conducts=c.u), 1),
        (lambda c: c.state.choose(blocks=c.R * c.i, conducts=3 * c.u), lambda c: c.u + c.i, 0),
        (lambda c: c.state.choose(blocks=c.u, conducts=c.i), lambda c: c.state.choose(blocks=c.i, conducts=c.u), 1),
    ],
)
def test_the_equation_of_an_ideal_element_is_found(first, second, row):
    assert template_of(switch(first, second)).ideals == (IdealForm("state", ("i", "u"), row),)


@pytest.mark.parametrize(
    "second",
    [
        lambda c: c.state.choose(blocks=c.u, conducts=c.i),
        lambda c: c.state.choose(blocks=c.i, conducts=c.u - c.R * c.i),
        lambda c: c.state.choose(blocks=c.i + c.u, conducts=c.u),
        lambda c: c.state.choose(blocks=c.i, conducts=c.i),
        lambda c: c.state.choose(blocks=c.i, conducts=0),
    ],
)
def test_an_ideal_element_without_its_equation_is_told(second):
    with pytest.raises(LanguageError, match="is ideal, but no equation sets i and u to zero"):
        template_of(switch(lambda c: c.u + c.i, second))


def test_other_modes_are_no_ideal_elements():
    assert template_of(type("Bare", (Switch,), {"state": Mode("a", "b"), "equations": _both})()).ideals == ()


def _both(self: Any) -> Equations:
    yield self.u == ca.SX(1)
    yield self.i == self.u
