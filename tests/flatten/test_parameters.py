"""Parameters of a flat model: what is independent, what follows, and from which names."""

import casadi as ca
import pytest

from modelica_like import build
from modelica_like.errors import CyclicAssembly, UnitMismatch, UnknownName, ValueOutOfRange
from modelica_like.flatten import FlatModel, flatten
from modelica_like.language import (
    Assembly,
    Component,
    Equations,
    Input,
    Output,
    Parameter,
    Variable,
    der,
    param,
    signal_in,
    signal_out,
    var,
)


class Part(Component):
    a: Parameter = param("N", "independent", default=2e3, min=0.0, max=9e3)
    b: Parameter = param("N", "follows from its own", default="a + 500 N")
    T: Parameter = param("K", "temperature", default="20 degC + 5 K", tunable=False)
    k: Parameter = param("*", "of any unit", default=1.0)
    u: Input = signal_in("1", "input", default=3.0)
    y: Output = signal_out("1", "output")

    def equations(self) -> Equations:
        yield self.y == self.u * self.a / self.b


def numbers(flat: FlatModel) -> dict[str, float]:
    return {one.path: one.value for one in (*flat.parameters, *flat.derived)}


def drive(a: object = "1 kN", **values: object) -> Assembly:
    """A part in a drive that has names of its own."""
    return Assembly("drive", parts={"part": Part(**values)}, parameters={"a": a, "other": "4 kN"})


def test_values_are_in_si_units():
    flat = flatten(Part())
    assert numbers(flat) == {"a": 2000.0, "b": 2500.0, "T": 298.15, "k": 1.0}
    assert [(one.path, str(one.unit)) for one in flat.parameters] == [("a", "N"), ("k", "*")]
    derived = [(one.path, str(one.unit), one.tunable, one.above) for one in flat.derived]
    assert derived == [("b", "N", False, 0), ("T", "K", False, 0)]


def test_a_given_formula_means_names_of_the_drive_and_a_default_those_of_the_part():
    assert numbers(flatten(drive()))["part.b"] == 2500.0
    assert numbers(flatten(drive(b="a + 500 N")))["part.b"] == 1500.0
    assert numbers(flatten(drive(b="part.a + other")))["part.b"] == 6000.0
    with pytest.raises(UnknownName, match="other"):
        flatten(Part(b="other"))


def test_inputs_with_values_are_parameters():
    flat = flatten(drive(u=5.0))
    one = next(one for one in flat.parameters if one.path == "part.u")
    assert (one.value, one.tunable, one.above) == (5.0, True, 0)
    model = build(drive(u=5.0))
    assert (
        model.equations.variables(0, [], [], model.p, [], []).full().ravel()[model.position["part.y"]]
        == 5.0 * 2.0 / 2.5
    )


def test_units_that_were_written_are_kept_where_none_is_declared():
    written = {one.path: one.written for one in flatten(Part(a="3 N", k="3 kN")).parameters}
    assert written["a"] is None
    assert str(written["k"]) == "kN"
    assert {one.path: one.written for one in flatten(Part(k=3.0)).parameters}["k"] is None


def test_a_circle_is_told_without_the_way_to_it():
    class Circle(Component):
        a: Parameter = param("1", "one", default="b")
        b: Parameter = param("1", "two", default="2 * c")
        c: Parameter = param("1", "three", default="b + 1")

    with pytest.raises(CyclicAssembly, match=r"circle: b → c → b\."):
        flatten(Circle())


def test_what_follows_twice_is_no_circle():
    class Twice(Component):
        a: Parameter = param("1", "one", default="c + b")
        b: Parameter = param("1", "two", default="2 * c")
        c: Parameter = param("1", "three", default="d + 1")
        d: Parameter = param("1", "four", default=1.0)
        x: Variable = var("1", "value", default="a * b")

        def equations(self) -> Equations:
            yield der(self.x) == self.c / self.time

    flat = flatten(Twice())
    assert numbers(flat) == {"a": 6.0, "b": 4.0, "c": 2.0, "d": 1.0}
    (start,) = flat.starts
    assert float(ca.Function("start", [flat.p], [start.value])([1.0])) == 24.0
    again = ca.Function("formulas", [flat.p], [flat.formulas])([2.0]).full().ravel()
    assert dict(zip([one.path for one in flat.derived], again, strict=True)) == {"a": 9.0, "b": 6.0, "c": 3.0}


@pytest.mark.parametrize(
    ("values", "error", "told"),
    [
        ({"b": "1 / 0 * a"}, ValueOutOfRange, "finite"),
        ({"b": "1 kN * (2 - 2) / 0"}, ValueOutOfRange, "finite"),
        ({"b": "2 * T"}, UnitMismatch, "expects N; the expression is K"),
        ({"b": "a + 5 K"}, UnitMismatch, "differ"),
        ({"b": "a / 5"}, None, ""),
    ],
)
def test_formulas_are_checked(values, error, told):
    if error is None:
        assert numbers(flatten(Part(**values)))["b"] == 400.0
        return
    with pytest.raises(error, match=told):
        flatten(Part(**values))


def test_units_of_formulas_count_only_where_they_are_checked():
    class Loose(Part):
        units_checked = False

    assert numbers(flatten(Loose(b="2 * T")))["b"] == pytest.approx(2 * 298.15)


def test_constants_that_formulas_follow_from_have_a_unit():
    """T is 298.15 K by numbers alone."""

    class Twice(Part):
        hot: Parameter = param("K", "twice as hot", default="2 * T")

    assert numbers(flatten(Twice()))["hot"] == pytest.approx(2 * 298.15)
    with pytest.raises(UnitMismatch, match="expects K; the expression is"):
        flatten(Twice(hot="T * T"))
