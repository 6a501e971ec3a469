"""Conditions in words."""

import functools
from collections.abc import Callable
from typing import Any

import pytest

from modelica_like.flatten.template import template_of
from modelica_like.language import (
    Component,
    Discrete,
    Events,
    Mode,
    Parameter,
    Variable,
    absolute,
    all_of,
    any_of,
    der,
    discrete,
    negate,
    param,
    sign,
    sin,
    var,
    where,
)


class Things(Component):
    units_checked = False
    x: Variable = var("m", "height")
    y: Variable = var("m", "width of one, in the middle (of all)")
    z: Variable = var("m", "a longer story about it")
    w: Variable = var("m")
    a: Parameter = param("m", "first", default=1.0)
    b: Parameter = param("m", "second", default=2.0)
    n: Discrete = discrete("1", "number", start=1.0)
    mode = Mode("low", "high")


def told(condition: Callable[[Any], Any], base: type[Component] = Things, **more: Any) -> str:
    def events(self: Any) -> Events:
        yield self.mode.go("low", "high", when=condition(self), **more)

    def equations(self: Any) -> Any:
        for name in "xyzw":
            yield der(getattr(self, name)) == 0

    return template_of(type("Odd", (base,), {"events": events, "equations": equations})()).transitions[0].because


@pytest.mark.parametrize(
    ("condition", "words"),
    [
        (lambda c: c.x > c.a, "height x rose above {a}"),
        (lambda c: c.x < c.a, "height x fell below {a}"),
        (lambda c: c.a <= c.x, "height x rose above {a}"),
        (lambda c: c.x > c.w, "w fell below height x"),
        (lambda c: c.x > c.a * c.w, "a*w fell below height x"),
        (lambda c: c.x > c.a + c.b, "height x rose above a+b"),
        (lambda c: c.x > 0, "height x rose above zero"),
        (lambda c: c.x < 0.1 + 0.2, "height x fell below 0.3"),
        (lambda c: -c.x < -3, "height x rose above 3"),
        (lambda c: -c.x < c.a, "-x fell below {a}"),
        (lambda c: negate(c.x > c.a), "height x fell below {a}"),
        (lambda c: negate(negate(c.x > c.a)), "height x rose above {a}"),
        (lambda c: c.y > c.a, "width of one y rose above {a}"),
        (lambda c: c.z > c.a, "z rose above {a}"),
        (lambda c: absolute(c.x) > c.a, "height |x| rose above {a}"),
        (lambda c: der(c.x) > c.a, "der(x) rose above {a}"),
        (lambda c: c.x + c.w > 2 * c.a, "x+w rose above 2*a"),
        (lambda c: (c.x + c.w) * c.a > 0, "(x+w)*a rose above zero"),
        (lambda c: -(c.x + c.w) < c.a, "-(x+w) fell below {a}"),
        (lambda c: sin(c.x) > c.a, "sin(x) rose above {a}"),
        (lambda c: c.x > c.a / c.b + c.b, "height x rose above a/b+b"),
        (lambda c: c.time > c.a, "time rose above {a}"),
        (lambda c: c.mode.is_("low"), "mode is low"),
        (lambda c: negate(c.mode.is_("high")), "mode is not high"),
        (lambda c: c.n == 2, "number n is 2"),
        (lambda c: negate(c.n == 2), "number n is not 2"),
        (lambda c: c.n != 0, "number n is not zero"),
        (lambda c: all_of(c.x > c.a, c.n == 1), "height x rose above {a} and number n is 1"),
        (lambda c: any_of(c.x > c.a, c.n == 1), "height x rose above {a} or number n is 1"),
        (lambda c: negate(any_of(c.x > c.a, c.n == 1)), "height x fell below {a} and number n is not 1"),
        (lambda c: any_of(c.x > c.a, c.a < c.x, c.w > 0), "height x rose above {a} or w rose above zero"),
        (lambda c: c.x + c.w > where(c.x > c.a, 1, 0), "its condition on x, w holds"),
        (lambda c: c.w > sin(c.x * c.w) * sin(c.a + c.b) + sin(c.x) * sin(c.w) * c.x, "its condition on x, w holds"),
        (lambda c: sign(c.x) > 0, "sign(x) rose above zero"),
    ],
)
def test_conditions_in_words(condition, words):
    assert told(condition) == words


def test_words_of_the_author_count():
    assert told(lambda c: c.x > 0, because="is up") == "is up"


def test_a_time_is_a_reason():
    class Timed(Things):
        def events(self) -> Events:
            yield self.mode.go("low", "high", at=self.a)

        def equations(self) -> Any:
            for name in "xyzw":
                yield der(getattr(self, name)) == 0

    assert template_of(Timed()).transitions[0].because == "its time is reached"


@pytest.mark.parametrize(("length", "fits"), [(40, True), (41, False)])
def test_sides_are_told_up_to_forty_characters(length, fits):
    """A variable has its name."""
    name = "v" * length
    long = type("Long", (Things,), {name: var("m"), "__annotations__": {name: "Variable"}, "equations": None})
    text = _named(long, [name])
    assert text == (f"{name} rose above zero" if fits else f"its condition on {name} holds")


@pytest.mark.parametrize(("last", "fits"), [(10, True), (11, False)])
def test_conditions_are_told_up_to_a_hundred_characters(last, fits):
    names = ["p" * 16, "q" * 16, "r" * last]
    long = type("Long", (Things,), {n: var("m") for n in names} | {"__annotations__": dict.fromkeys(names, "Variable")})
    text = _named(long, names)
    whole = " and ".join(f"{name} rose above zero" for name in names)
    assert (text == whole, len(whole) <= 100) == (fits, fits)


def _named(base: type[Component], names: list[str]) -> str:
    def equations(self: Any) -> Any:
        for name in ("x", "y", "z", "w", *names):
            yield der(getattr(self, name)) == 0

    def events(self: Any) -> Events:
        yield self.mode.go("low", "high", when=functools.reduce(all_of, [getattr(self, name) > 0 for name in names]))

    return template_of(type("Odd", (base,), {"events": events, "equations": equations})()).transitions[0].because
