"""Checks of a class: what is told, and which units outputs with `*` take."""

from typing import Any

import pytest

from modelica_like.errors import ComponentUnbalanced, LanguageError, ModelicaLikeError, UnitMismatch
from modelica_like.flatten import flatten
from modelica_like.language import (
    Component,
    Connector,
    Equations,
    Events,
    Input,
    Mode,
    Output,
    Parameter,
    Variable,
    connect,
    der,
    flow,
    if_,
    param,
    signal_in,
    signal_out,
    sin,
    var,
)


class Gain(Component):
    u: Input = signal_in("1", "input", default=1.0)
    y: Output = signal_out("1", "output")

    def equations(self) -> Equations:
        yield self.y == 2 * self.u


class Setting(Component):
    """It sets the input of its part by an equation."""

    own: Input = signal_in("1", "input", default=1.0)
    T: Parameter = param("s", "time", default=1.0)
    gain = Gain()

    def equations(self) -> Equations:
        yield self.gain.u == self.own + self.time / self.T + if_(self.own > 2, self.gain.y, 0)


def test_an_input_of_a_part_that_an_equation_sets_is_told():
    with pytest.raises(ComponentUnbalanced) as caught:
        flatten(Setting())
    assert caught.value.what == "Setting declares 1 equation for no unknowns of its own."
    assert "gain.u is an input of a part: inputs are connected" in caught.value.advice
    assert (
        caught.value.where[0].text
        == "yield self.gain.u == self.own + self.time / self.T + if_(self.own > 2, self.gain.y, 0)"
    )

    class Outer(Component):
        inner = Setting()

    with pytest.raises(ComponentUnbalanced) as caught:
        flatten(Outer())
    assert "yield connect(self.…, self.gain.u)" in caught.value.advice


class Flange(Connector):
    phi: Variable = var("rad", "angle")
    tau: Variable = flow("N.m", "torque")


class Plain:
    """No component."""


class Base(Component):
    a = Flange("end", free=True)
    b = Flange("another end", optional=True)
    w: Variable = var("1", "one")

    def equations(self) -> Equations:
        yield self.a.tau == 0
        yield self.w == 1


def unbalanced(bases: tuple[type, ...], *texts: str) -> tuple[str, str]:
    """What is told about a class with the equations `text == 1`."""

    def equations(self: Any) -> Equations:
        for text in texts:
            yield eval(text, {"self": self}) == 1

    kind = type("Odd", bases, {"equations": equations, "x": var("1", "another"), "__annotations__": {"x": "Variable"}})
    with pytest.raises(ComponentUnbalanced) as caught:
        flatten(kind())
    return caught.value.what, caught.value.advice.split(":")[0]


def test_the_number_of_equations_is_told_with_the_unknowns():
    own = "Each own variable, output and flow"
    base = "Its base Base has equations of its own"
    three = "3 unknowns (w, x, a.tau)"
    assert unbalanced((Component,)) == ("Odd declares 0 equations for 1 unknowns (x).", f"{own} needs one")
    assert unbalanced((Plain, Component)) == ("Odd declares 0 equations for 1 unknowns (x).", f"{own} needs one")
    assert unbalanced((Component,), "self.x", "2 * self.x") == (
        "Odd declares 2 equations for 1 unknowns (x).", f"{own} takes one",
    )  # fmt: skip
    assert unbalanced((Base,), "self.x") == (f"Odd declares 1 equation for {three}.", base)
    assert unbalanced((Base,), "self.x", "self.w") == (f"Odd declares 2 equations for {three}.", base)
    four = ("self.x", "self.w", "2 * self.w", "3 * self.w")
    assert unbalanced((Base,), *four) == (f"Odd declares 4 equations for {three}.", f"{own} takes one")


def test_flows_of_optional_ends_count_if_these_are_used():
    class Pair(Component):
        one, other = Base(), Base()

        def equations(self) -> Equations:
            yield connect(self.one.b, self.other.b)

    flatten(Base())
    with pytest.raises(ComponentUnbalanced, match=r"Base declares 2 equations for 3 unknowns \(w, a.tau, b.tau\)"):
        flatten(Pair())


class Wild(Component):
    """Its outputs have the units of their equations."""

    a: Parameter = param("*", "one", default=1.0)
    b: Parameter = param("*", "another", default=1.0)
    rate: Parameter = param("1/s", "rate", default=1.0)
    y: Output = signal_out("*", "output")
    z: Output = signal_out("*", "what follows from the output")

    def equations(self) -> Equations:
        yield self.a + self.b == self.y
        yield der(self.z) == self.rate * self.y


def test_units_are_taken_from_either_side():
    flat = flatten(Wild(a="1 m", b="2 m", z=0.0))
    assert {one.path: str(one.unit) for one in flat.variables}["y"] == "m"


@pytest.mark.parametrize(("given", "told"), [
    ({"a": "1 m", "b": "2 s"}, "its units do not fit together: a in m, b in s."),
    ({"a": "1 m", "rate": "1 Hz", "b": 1}, "its units do not fit together: a in m, b in *."),
])  # fmt: skip
def test_units_of_values_that_do_not_fit_together_are_told(given, told):
    class Narrow(Wild):
        def equations(self) -> Equations:
            yield self.y == self.a + self.b + self.rate / self.rate * sin(self.a / self.b)
            yield self.z == self.y

    with pytest.raises(UnitMismatch, match="Narrow") as caught:
        flatten(Narrow(**given))
    assert caught.value.what.endswith(told)


def test_one_value_alone_or_another_error_is_told_by_its_equation():
    class Narrow(Wild):
        def equations(self) -> Equations:
            yield self.y == sin(self.a)
            yield self.z == self.y

    with pytest.raises(UnitMismatch, match="the argument of a function and a number differ"):
        flatten(Narrow(a="1 m"))

    class Odd(Wild):
        def equations(self) -> Equations:
            yield self.y == sin(self.a) + float("nan")
            yield self.z == sin(self.a)

    with pytest.raises(ModelicaLikeError) as caught:
        flatten(Odd(a="1 m", b="1 m"))
    assert "do not fit together" not in str(caught.value)
    with pytest.raises(LanguageError, match="nan"):
        flatten(Odd(a=1, b=1))


def test_a_declared_unit_stays_as_it_is_written():
    class Power(Component):
        k: Parameter = param("N.m.rad/s", "power", default=1.0)
        P: Variable = var("W", "power")

        def equations(self) -> Equations:
            yield self.k == self.P

    assert str(flatten(Power()).variables[0].unit) == "W"


def test_the_first_equation_of_an_output_decides():
    class Twice(Component):
        a: Parameter = param("m", "length", default=1.0)
        x: Variable = var("s", "time")
        y: Output = signal_out("*", "output")

        def equations(self) -> Equations:
            yield self.y == self.a
            yield self.y == self.x

    with pytest.raises(UnitMismatch, match="left m, right s"):
        flatten(Twice())


def test_rates_have_the_unit_by_time():
    class Fast(Component):
        x: Variable = var("m", "length")
        y: Output = signal_out("*", "rate of the rate")
        z: Output = signal_out("*", "rate")
        mode = Mode("a", "b")

        def equations(self) -> Equations:
            yield self.y == der(der(self.x))
            yield self.z == der(self.x)
            yield der(self.y) + der(self.z) / self.time == 0

        def events(self) -> Events:
            yield self.mode.go("a", "b", when=der(self.z) * self.time > self.z)

    units = {one.path: str(one.unit) for one in flatten(Fast(x=1.0)).variables}
    assert (units["y"], units["z"]) == ("m/s2", "m/s")
