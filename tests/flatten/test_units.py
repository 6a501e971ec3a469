"""Dimensions along every equation."""

import pytest

from modelica_like.errors import ModelicaLikeError, UnitMismatch, WiringErrors
from modelica_like.flatten import flatten
from modelica_like.language import (
    Component,
    Equations,
    Events,
    Expr,
    Mode,
    Output,
    Parameter,
    Variable,
    absolute,
    atan2,
    cos,
    der,
    exp,
    interpolate,
    maximum,
    minimum,
    param,
    sign,
    signal_out,
    sin,
    sqrt,
    tanh,
    var,
    where,
)


class Things(Component):
    J: Parameter = param("kg.m2", "inertia", default=1.0)
    k: Parameter = param("1", "number", default=2.0)
    eps: Parameter = param("rad", "small angle", default=1e-9)
    phi: Variable = var("rad", "angle")
    w: Variable = var("rad/s", "speed")
    tau: Variable = var("N.m", "torque")
    P: Variable = var("W", "power")
    x: Variable = var("m", "length")
    f: Variable = var("N", "force")
    mode = Mode("a", "b")


def check(equation: object) -> None:
    """Flatten a component with one equation in question and the rest trivial."""

    class Questioned(Things):
        def equations(self) -> Equations:
            yield equation(self)  # type: ignore[operator]
            for name in ("phi", "w", "tau", "P", "x"):
                yield getattr(self, name) == 0

    flatten(Questioned())


@pytest.mark.parametrize(
    "equation",
    [
        lambda c: c.J * der(c.w) == c.tau,
        lambda c: der(c.phi) == c.w,
        lambda c: c.tau * c.w == c.P,
        lambda c: c.f == c.tau / c.x,
        lambda c: c.f * c.x == c.tau,
        lambda c: c.tau == 0,
        lambda c: c.tau == c.tau * sin(c.phi),
        lambda c: c.phi == 1.0,  # the radian is a number
        lambda c: c.tau == c.J * c.w**2,
        lambda c: c.x == sqrt(c.x**2 + c.x * c.x),
        lambda c: c.x == (c.x**3) ** (1 / 3),
        lambda c: c.tau == maximum(c.tau, 0) + minimum(0, c.tau) + absolute(c.tau) - c.tau / c.k,
        lambda c: c.f == where(c.x > 0, c.tau / c.x, 0),
        lambda c: c.f == c.mode.choose(a=0, b=c.tau / c.x),
        lambda c: c.mode.choose(a=c.x, b=c.tau) == 0,  # only one branch at a time, and zero fits all
        lambda c: c.k == exp(c.phi / c.eps) * tanh(c.k) * sign(c.tau),
        lambda c: c.phi == atan2(c.x, c.x),
        lambda c: c.tau == interpolate(c.phi / c.eps, [0, 1], [2, 3]) * c.P / c.w,
        lambda c: c.w == der(c.phi**2) / c.phi,
        lambda c: der(0.5 * c.J * c.w**2) == c.P,
        lambda c: c.k**c.k == c.k,
        lambda c: c.x == 2 * c.x - c.x / 2,
        lambda c: 0.5 * c.tau == -c.tau,
        lambda c: c.tau / c.time == c.P,
    ],
)
def test_right_equations(equation):
    check(equation)


@pytest.mark.parametrize(
    ("equation", "message"),
    [
        (lambda c: c.tau == c.x, "left N.m, right m."),
        (lambda c: c.tau == 1, "left N.m, right 1."),
        (lambda c: c.J * der(c.w) == 2 * c.P, "left kg.m2.rad/s2, right W."),
        (lambda c: c.tau == c.tau + c.x, "the terms of a sum differ: N.m and m."),
        (lambda c: c.tau == maximum(c.tau, c.x), "the terms of a sum differ: N.m and m."),
        (lambda c: c.tau == c.tau * sin(c.x), "the argument of a function and a number differ: m and 1."),
        (lambda c: c.k == exp(c.tau), "the argument of a function and a number differ: N.m and 1."),
        (lambda c: c.f == where(c.x > c.phi, c.f, 0), "the sides of a comparison differ: rad and m."),
        (lambda c: c.f == where(c.x > 0, c.f, c.x), "the branches of choose(…) or where(…) differ in unit"),
        (lambda c: c.k == c.k**c.x, "an exponent and a number differ: m and 1."),
        (lambda c: c.x == c.x**c.k, "the base of a variable power and a number differ: m and 1."),
        (
            lambda c: c.f == c.mode.choose(a=c.x, b=c.tau),
            "the branches of choose(…) or where(…) differ in unit; this is allowed only in `… == 0`.",
        ),
        (lambda c: c.w == der(c.x), "left rad/s, right m/s."),
        (lambda c: c.phi == cos(c.phi) * c.time, "left rad, right s."),
        (lambda c: c.k == c.x / where(c.x > 0, c.x, c.f), "the factors of a product differ: m and different units"),
        (lambda c: c.k == sqrt(where(c.x > 0, c.x, c.f)), "the factors of a product differ: 1 and different units"),
    ],
)
def test_wrong_equations(equation, message):
    with pytest.raises(UnitMismatch) as caught:
        check(equation)
    assert message in caught.value.what
    assert caught.value.what.startswith("Questioned, test_units.py:")


def test_the_sides_are_told_as_they_are_written():
    """Python asks the symbol on the right first, and would exchange the sides."""

    class Written(Things):
        def equations(self) -> Equations:
            yield self.J * der(self.w) == self.P
            for name in ("phi", "w", "tau", "x", "f"):
                yield getattr(self, name) == 0

    with pytest.raises(UnitMismatch, match=r"`yield self.J \* der\(self.w\) == self.P`: left kg.m2.rad/s2, right W\."):
        flatten(Written())


def test_all_wrong_equations_of_a_class_are_told_together():
    class Twice(Things):
        def equations(self) -> Equations:
            yield self.tau == self.x
            yield self.x == self.P
            for name in ("phi", "w", "x", "f"):
                yield getattr(self, name) == 0

    with pytest.raises(WiringErrors) as caught:
        flatten(Twice())
    assert len(caught.value.errors) == 2


@pytest.mark.parametrize(
    ("law", "message"),
    [
        ("stored_energy", "Energetic.stored_energy expects J; the expression is W."),
        ("loss_power", "Energetic.loss_power expects W; the expression is N."),
        ("source_power", "Energetic.source_power expects W; the expression is m."),
    ],
)
def test_energies_and_powers_are_checked(law, message):
    class Energetic(Things):
        def equations(self) -> Equations:
            for name in ("phi", "w", "tau", "P", "x", "f"):
                yield getattr(self, name) == 0

        def stored_energy(self) -> Expr | float:
            return self.P if law == "stored_energy" else 0.5 * self.J * self.w**2

        def loss_power(self) -> Expr | float:
            return self.f if law == "loss_power" else 0.0

        def source_power(self) -> Expr | float:
            return self.x if law == "source_power" else self.tau * self.w

    with pytest.raises(UnitMismatch, match=message):
        flatten(Energetic())


@pytest.mark.parametrize(
    ("event", "message"),
    [
        (lambda c: c.mode.go("a", "b", when=c.x > c.tau), "condition: the sides of a comparison differ"),
        (lambda c: c.mode.go("a", "b", when=c.x > 1), "condition: the sides of a comparison differ"),
        (lambda c: c.mode.go("a", "b", when=c.x > 0, reset={c.x: c.tau}), "left m, right N.m."),
        (lambda c: c.mode.go("a", "b", at=c.x_at), r"Eventful, time of an event expects s; the expression is m\."),
        (lambda c: c.mode.initially("b", when=c.x > c.tau), "condition: the sides of a comparison differ"),
    ],
)
def test_events_are_checked(event, message):
    class Eventful(Things):
        x_at: Parameter = param("m", "wrong", default=1.0)

        def equations(self) -> Equations:
            for name in ("phi", "w", "tau", "P", "x", "f"):
                yield getattr(self, name) == 0

        def events(self) -> Events:
            yield event(self)

    with pytest.raises(ModelicaLikeError, match=message):
        flatten(Eventful())


class Wild(Component):
    k: Parameter = param("*", "value", default=1.0)
    rate: Parameter = param("1/s", "rate", default=1.0)
    y: Output = signal_out("*", "k")
    z: Output = signal_out("*", "integral of k")

    def equations(self) -> Equations:
        yield self.y == 2 * self.k
        yield der(self.z) == self.rate * self.k


@pytest.mark.parametrize("unit", ["N.m", "rad/s", "m", "1"])
def test_wildcards_take_the_unit_of_their_value(unit):
    units = {v.path: str(v.unit) for v in flatten(Wild(k=f"3 {unit}")).variables}
    assert units["y"] == unit


def test_instances_of_one_class_may_have_different_units():
    class Two(Component):
        a, b = Wild(k="1 N.m"), Wild(k="2 rad/s")

    units = {v.path: str(v.unit) for v in flatten(Two()).variables}
    assert (units["a.y"], units["b.y"]) == ("N.m", "rad/s")
