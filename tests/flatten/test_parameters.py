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
from modelica_like.netlist import loads


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
        ({"b": "a + 5 K"}, UnitMismatch, "mixes N and K"),
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


def torque(unit_of_place: str, **parameters: object) -> dict[str, float]:
    """The numbers of a drive in which one part takes the parameter M of the drive."""

    class Takes(Component):
        size: Parameter = param(unit_of_place, "of the part")
        w: Variable = var(unit_of_place, "with a start value")

        def equations(self) -> Equations:
            yield der(self.w) == self.size / self.time

    flat = flatten(Assembly("drive", parts={"part": Takes(size="M", w="M")}, parameters=parameters))
    (start,) = flat.starts
    value = ca.Function("start", [flat.p], [start.value])([one.value for one in flat.parameters])
    return {**numbers(flat), "start": float(value)}


FORMULAS = [
    ("N.m", 4.0, {"F": "4 N", "M": "F*1 m"}),
    ("N.m", 8.0, {"F": "4 N", "M": "F*2 m"}),
    ("1", 3.0, {"n": "3 rad/s", "M": "n/(1 rad/s)"}),
    ("1", 3.0, {"n": "3 rad/s", "M": "2*n/(2 rad/s)"}),
    ("1", 1.0, {"n": "3 rad/s", "M": "n/n"}),
    ("kg", 200.0, {"n": 100, "M": "n*2 kg"}),
    ("kg", 101.0, {"n": 100, "M": "(n + 1)*1 kg"}),
    ("kg", 200.0, {"n": 100, "m": "2*n", "M": "m*1 kg"}),
    ("kg", 200.0, {"n": 100, "M": "2*n"}),  # a plain number takes the unit of its place
    ("N", 30.0, {"mass": 3, "g": "10 m/s2", "M": "mass*g"}),  # in products, too
    ("N", 16.0, {"E": "4 N", "M": "E*E/(1 N)"}),
    ("kg2", 9.0, {"m": "3 kg", "M": "m**(4/2)"}),
    ("N", 2.0, {"F": "2 N", "M": "max(F, 0)"}),
]


@pytest.mark.parametrize(("unit", "value", "parameters"), FORMULAS)
def test_the_unit_of_a_formula_is_that_of_what_is_written(unit, value, parameters):
    """A formula may come down to one of its parameters, which has another unit."""
    found = torque(unit, **parameters)
    assert (found["part.size"], found["start"]) == (value, value)


@pytest.mark.parametrize(
    ("place", "unit", "parameters"),
    [
        ("N.m", "N.m.s", {"E": "4 N.m", "M": "E*1 s"}),
        ("N.m", "m", {"E": "4 N.m", "M": "E/(1 N)"}),
        ("rad/s", "rad", {"E": "4 rad/s", "M": "E*1 s"}),
        ("rad/s", "rad", {"E": "4 rad/s", "F": "E*1 s", "M": "F"}),
        ("rad/s", "kg", {"n": 100, "M": "(n + 1)*1 kg"}),
        ("kg", "no unit", {"n": 100, "M": "n + 1"}),
    ],
)
def test_numbers_that_cancel_take_no_unit_away(place, unit, parameters):
    told = "has no unit" if unit == "no unit" else f"is {unit}"
    with pytest.raises(UnitMismatch) as caught:
        torque(place, **parameters)
    assert caught.value.what.startswith(f"part.size = M expects {place}; the expression {told}.")


def test_a_netlist_in_a_netlist_takes_no_unit_away(tmp_path):
    (tmp_path / "box.toml").write_text(
        '[parameters]\nJ = "1 kg.m2"\nE = "J*1 s"\n[parts]\na = { is = "Inertia", J = "J" }\n'
        '[expose]\nflange_a = "a.flange_a"\n'
    )
    text = (
        'free = ["b.flange_b"]\n[parameters]\nK = "3 kg.m2"\n[parts]\nbox = {{ is = "./box.toml", J = "{}" }}\n'
        'b = {{ is = "Inertia", J = "{}" }}\n[connect]\nx = ["box.flange_a", "b.flange_a"]\n'
    )
    drive = loads(text.format("K*1", "box.J"), file=str(tmp_path / "drive.toml"))
    assert numbers(flatten(drive))["b.J"] == 3.0
    for inner, outer in (("K*1 s", "K"), ("K", "box.E"), ("K", "box.J*1 s")):
        with pytest.raises(UnitMismatch, match=r"expects kg.m2; the expression is kg.m2.s"):
            flatten(loads(text.format(inner, outer), file=str(tmp_path / "drive.toml")))


def test_what_a_parameter_follows_from_gives_it_its_unit():
    """Also for readings, FMUs and tables."""
    drive = Assembly("drive", parts={"part": Part()}, parameters={"m": "4 kg", "F": "m*1 m/s2", "n": "2*m/(1 kg)"})
    assert {one.path: str(one.unit) for one in flatten(drive).derived if "." not in one.path} == {
        "F": "kg.m/s2",
        "n": "1",
    }
