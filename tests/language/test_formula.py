"""Formulas of parameters: what they mean, how they print, and that they never run anything."""

import math
import string

import casadi as ca
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from modelica_like.errors import NetlistError, UnitError, UnitMismatch, ValueOutOfRange
from modelica_like.flatten import flatten
from modelica_like.language import Component, Equations, Parameter, Variable, param, var
from modelica_like.language.formula import Formula, as_formula, parse_formula

VALUES = {"a": 1.75, "b": -0.5, "c_2": 3.0, "part.J": 0.25, "masses[1].m": 2.0, "x.y[3].z": 0.125}


def evaluate(formula: Formula) -> float:
    return float(ca.DM(ca.evalf(ca.SX(formula.evaluate(lambda name: ca.SX(VALUES[name]))))))


numbers = st.floats(min_value=0, max_value=1e6, allow_nan=False).map(lambda x: Formula("number", (x,)))
names = st.sampled_from(sorted(VALUES)).map(lambda name: Formula("name", (name,)))
formulas = st.recursive(
    numbers | names,
    lambda inner: st.one_of(
        st.builds(Formula, st.sampled_from(["+", "-", "*", "/", "**", "min", "max"]), st.tuples(inner, inner)),
        st.builds(
            Formula, st.sampled_from(["neg", "sqrt", "abs", "sin", "cos", "exp", "log", "tanh"]), st.tuples(inner)
        ),
    ),
    max_leaves=20,
)


@given(formulas)
@settings(deadline=None, max_examples=200)
def test_what_is_printed_is_read_as_the_same_formula(formula):
    assert parse_formula(str(formula)) == formula


@given(formulas)
@settings(deadline=None, max_examples=100)
def test_the_value_is_that_of_python(formula):
    """An independent reading: Python's own arithmetic on the printed text."""
    scope = {
        "__builtins__": {},
        "min": min,
        "max": max,
        "abs": math.fabs,
        **{n: getattr(math, n) for n in ("sqrt", "sin", "cos", "exp", "log", "tanh")},
    }
    text = str(formula)
    for name in sorted(VALUES, key=len, reverse=True):
        text = text.replace(name, f"({VALUES[name]!r})") if "." in name else text
    scope.update({n: v for n, v in VALUES.items() if "." not in n})
    try:
        expected = eval(text, scope)
    except (ArithmeticError, ValueError, TypeError):  # also where roots of negative numbers became complex
        return
    if isinstance(expected, complex) or not math.isfinite(expected):
        return
    assert evaluate(formula) == pytest.approx(expected, rel=1e-9, abs=1e-300)


@given(st.text(max_size=60) | st.text(alphabet="ab1.*+-/()[]_ ,'\"=:\\{}lambda", max_size=60))
@example("__import__('os').system('true')")
@example("().__class__.__bases__[0].__subclasses__()")
@example("[x for x in (1).__class__.__mro__]")
@example("'\\d'")
@example("1if a else b")
@example("f'{a}'")
@example("-" * 1999 + "a")
@example("(" * 1000 + "a" + ")" * 999)
@example("a" + "+a" * 999)
@example("a" + ".a" * 999)
@example("sin(" * 300 + "a" + ")" * 300)
@example("9" * 1999)
@example("9**9**9**9**9")
@example("1e400")
@example("\x00")
@example("\ud800")
@settings(deadline=None, max_examples=300)
def test_any_text_is_a_formula_or_a_sentence(text):
    try:
        formula = parse_formula(text)
    except NetlistError as error:
        message = error.what
    else:
        message = ""
        assert parse_formula(str(formula)) == formula
        for name in formula.names():
            assert not set(name) - set(string.ascii_letters + string.digits + "_.[]") or not name.isascii()
    assert not message or "is neither a quantity nor a formula" in message or "too long" in message
    assert len(message) < 300


@pytest.mark.parametrize(
    "text",
    [
      "open('x')", "a()", "a.b()", "a[b]", "a[-1]", "a['b']", "[1]", "(1, 2)", "{1: 2}", "lambda: 1",
      "a if b else c", "a < b", "not a", "True", "None", "'text'", "1j", "a := 2", "a; b", "a = b", "*a",
      "yield a", "a % b", "a // b", "a @ b", "a ^ b", "~a", "import os", "", "sqrt(x=1)", "sqrt()", "min(1, 2, 3)",
      "1e999",
    ],
)  # fmt: skip
def test_what_is_no_arithmetic_is_refused(text):
    with pytest.raises(NetlistError):
        parse_formula(text)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("squrt(2)", "there is no function 'squrt'; did you mean 'sqrt'"),
        ("min(1)", "min takes 2 arguments"),
        ("sin(1, 2)", "sin takes 1 argument"),
        ("1e999", "a number in it is too large"),
        ("-" * 500 + "a", "it is nested too deeply"),
    ],
)
def test_the_reason_is_told(text, why):
    with pytest.raises(NetlistError) as caught:
        parse_formula(text)
    assert why in caught.value.what


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("2*a", 3.5),
        ("-a**2", -3.0625),
        ("2**-1", 0.5),
        ("2**3**2", 512.0),
        ("a - (b - c_2)", 5.25),
        ("a/b/c_2", 1.75 / -0.5 / 3.0),
        ("pi", math.pi),
        ("sqrt(4) + abs(-2) + min(1, 2) + max(1, 2)", 7.0),
        ("exp(0) + log(1) + sin(0) + cos(0) + tan(0) + tanh(0)", 2.0),
        ("part.J*masses[1].m", 0.5),
        ("+a", 1.75),
        ("1_000", 1000.0),
    ],
)
def test_values(text, value):
    assert evaluate(parse_formula(text)) == pytest.approx(value, rel=1e-15)


class Gearbox(Component):
    z_sun: Parameter = param("1", "teeth of the sun", default=20)
    z_ring: Parameter = param(
        "1", "teeth of the ring", default=z_sun * 3
    )  # the declaration itself, before it has a name
    ratio: Parameter = param("1", "ratio", default="z_ring / z_sun")
    sum: Parameter = param("1", "all", default=1 + (2 - z_sun) / (-z_sun * 2) - 3 * z_sun)
    y: Variable = var("1", "the ratio")

    def equations(self) -> Equations:
        yield self.y == self.ratio + self.sum


def test_formulas_in_a_class_body_and_as_text():
    flat = flatten(Gearbox(z_sun=10))
    derived = {one.path: one.value for one in flat.derived}
    assert derived == {"z_ring": 30.0, "ratio": 3.0, "sum": 1 + (2 - 10) / (-10 * 2) - 30}


def test_a_value_given_by_the_owner_speaks_the_names_of_the_owner():
    class Train(Component):
        teeth: Parameter = param("1", "teeth", default=12)
        box = Gearbox(z_sun=teeth, z_ring="4*teeth")
        second = Gearbox(z_sun="box.z_sun + teeth")

    derived = {one.path: one.value for one in flatten(Train()).derived}
    assert (derived["box.z_sun"], derived["box.z_ring"], derived["box.ratio"]) == (12.0, 48.0, 4.0)
    assert (derived["second.z_sun"], derived["second.z_ring"]) == (24.0, 72.0)


@pytest.mark.parametrize("text", ["1/0", "log(0)", "sqrt(-1)", "(-1)**0.5", "2**9999", "1e308*10"])
def test_a_formula_without_a_finite_value_is_refused(text):
    with pytest.raises(ValueOutOfRange, match=r"^z_sun must be a finite number, not"):
        flatten(Gearbox(z_sun=text))


def test_a_formula_outside_the_range_is_refused():
    class Rotor(Component):
        J0: Parameter = param("kg.m2", "base", default=1.0)
        J: Parameter = param("kg.m2", "moment of inertia", default="-J0", min=0)

    with pytest.raises(ValueOutOfRange, match=r"^J = -1 is out of range: it must be at least 0 kg\.m2\.$"):
        flatten(Rotor())


@pytest.mark.parametrize(("text", "unit"), [("J0", "kg.m2"), ("2*J0/length**2", "kg"), ("sqrt(J0/mass)", "m")])
def test_formulas_are_checked_for_their_dimension(text, unit):
    def rotor(unit: str) -> Component:
        class Rotor(Component):
            J0: Parameter = param("kg.m2", "base", default=1.0)
            length: Parameter = param("m", "length", default=1.0)
            mass: Parameter = param("kg", "mass", default=1.0)
            result: Parameter = param(unit, "result", default=text)

        return Rotor()

    flatten(rotor(unit))
    with pytest.raises(UnitError, match=r"^result = .* expects N\.m; the expression is"):
        flatten(rotor("N.m"))


def test_only_numbers_formulas_and_declarations_stand_in_formulas():
    assert as_formula(2) == Formula("number", (2.0,))
    for value in (True, "J", None, [1]):
        with pytest.raises(NetlistError, match="cannot be used in a formula"):
            as_formula(value)


class Pulley(Component):
    """Two moments of inertia, one from the other."""

    own: Parameter = param("kg.m2", "of the pulley", default=0.5)
    total: Parameter = param("kg.m2", "of all", default=1.0)
    turns: Variable = var("1", "turns")

    def equations(self) -> Equations:
        yield self.turns * self.total == self.own


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("own + 1182.6 kg.mm2", 0.5 + 1182.6e-6), ("1182.6 kg.mm2 + own", 0.5 + 1182.6e-6),
        ("2*(own - 3e-1 kg.cm2)", 2 * (0.5 - 0.3e-4)), ("-5 kg.cm2 + own", 0.5 - 5e-4), ("3 kg.m2 / 2", 1.5),
        ("max(own, 2 g.m2)", 0.5), ("20 % * own", 0.1), ("(4 g.m)**2 / 2 kg", 8e-6), ("own", 0.5), ("7 kg.cm2", 7e-4),
    ],
)  # fmt: skip
def test_quantities_in_formulas(text, value):
    model = flatten(Pulley(total=text))
    found = {one.path: one.value for one in (*model.parameters, *model.derived)}
    assert found["total"] == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize("text", ["own + 2 N.m", "2 N.m + own", "2 N.m * own", "own + 2"])
def test_quantities_in_formulas_have_dimensions(text):
    with pytest.raises(UnitMismatch):
        flatten(Pulley(total=text))


@pytest.mark.parametrize("text", ["a + 2 kg.m2", "2 kg.m2 + a", "a**(3 rpm)", "-(1e-3 kg/m3)*a", "min(2 N, 3.5 kN)"])
def test_a_formula_with_quantities_prints_as_itself(text):
    assert parse_formula(str(parse_formula(text))) == parse_formula(text)


@pytest.mark.parametrize("text", ["a + 2 kgm2", "2 pi", "2 kg.m2 a"])
def test_what_only_looks_like_a_quantity_is_refused(text):
    with pytest.raises(NetlistError, match="neither a quantity nor a formula"):
        parse_formula(text)
