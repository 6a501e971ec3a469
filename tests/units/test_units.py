"""Units: reading, printing, algebra, and agreement with pint."""

import math
import pickle
import subprocess
import sys
from fractions import Fraction

import numpy as np
import pint
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from modelica_like.errors import UnitError, ValueOutOfRange
from modelica_like.language.formula import parse_formula
from modelica_like.language.units import (
    ANY,
    ONE,
    Unit,
    coherent,
    in_unit,
    parse_unit,
    read_quantity,
    same_dimension,
    to_si,
)
from modelica_like.language.units.atoms import ATOMS, BASE, PINT_NAMES, find_atom, pint_registry

NAMES = st.sampled_from(["kg", "m", "s", "A", "K", "rad", "N", "J", "W", "V", "Ohm", "mm", "min", "rpm", "deg", "%"])
EXPONENTS = st.one_of(
    st.integers(-9, 9).filter(bool), st.fractions(-3, 3, max_denominator=6).filter(lambda value: value.denominator > 1)
)
UNITS = st.dictionaries(NAMES, EXPONENTS, max_size=5).map(lambda powers: Unit(tuple(powers.items())))


@settings(max_examples=30)
@given(UNITS)
def test_what_is_printed_reads_back(unit: Unit) -> None:
    assert parse_unit(str(unit)).exponents == unit.exponents
    assert dict(parse_unit(str(unit)).atoms) == dict(unit.atoms)


@settings(max_examples=30)
@given(UNITS, UNITS)
def test_exponents_add_in_products_and_subtract_in_quotients(first: Unit, second: Unit) -> None:
    pairs = list(zip(first.dimension, second.dimension, strict=True))
    assert (first * second).dimension == tuple(a + b for a, b in pairs)
    assert (first / second).dimension == tuple(a - b for a, b in pairs)
    assert math.isclose((first * second).factor, first.factor * second.factor, rel_tol=1e-12)


@settings(max_examples=30)
@given(UNITS, st.integers(-4, 4))
def test_powers_multiply_exponents(unit: Unit, power: int) -> None:
    assert (unit**power).dimension == tuple(power * exponent for exponent in unit.dimension)


@settings(max_examples=30)
@given(UNITS)
def test_a_unit_divided_by_itself_is_one(unit: Unit) -> None:
    assert unit / unit == ONE


@pytest.mark.parametrize(("name", "atom"), ATOMS.items())
def test_the_table_agrees_with_pint(name: str, atom: object) -> None:
    registry = pint_registry()
    zero, one = (registry.Quantity(v, PINT_NAMES.get(name, name)).to_base_units() for v in (0.0, 1.0))
    spelled = {"kilogram": "kg", "meter": "m", "second": "s", "ampere": "A", "kelvin": "K", "mole": "mol",
               "candela": "cd", "radian": "rad"}  # fmt: skip
    assert find_atom(name) is atom
    assert math.isclose(one.magnitude - zero.magnitude, ATOMS[name].factor, rel_tol=1e-12)
    assert zero.magnitude == ATOMS[name].offset
    powers = {spelled[unit]: power for unit, power in one.unit_items()}
    assert powers == {unit: power for unit, power in zip(BASE, ATOMS[name].exponents, strict=True) if power}


def test_reading_units_of_the_table_does_not_start_pint() -> None:
    code = "import sys; from modelica_like.language.units import parse_unit as p; p('kN.mm/rad'); p('rpm')\n"
    code += "assert 'pint' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize(
    ("text", "printed"),
    [
        ("kg.m2", "kg.m2"),
        ("N.m.s/rad", "N.m.s/rad"),
        ("J/(kg.K)", "J/(kg.K)"),
        ("m/s/s", "m/s2"),
        ("s-1", "1/s"),
        ("1/min", "1/min"),
        ("N*m", "N.m"),
        ("kg*m^2", "kg.m2"),
        ("kg*m**2", "kg.m2"),
        ("kg\u00b7m\u00b2", "kg.m2"),
        ("N m", "N.m"),
        ("s\u207b\u00b9", "1/s"),
        ("\u00b0C", "degC"),
        ("\u03a9", "Ohm"),
        ("\u00b5m", "um"),
        ("1", "1"),
        ("", "1"),
        ("*", "*"),
        ("m^(1/2)", "m^(1/2)"),
        (" rad / s ", "rad/s"),
        ("(N.m)/(rad/s)", "N.m.s/rad"),
    ],
)
def test_notations(text: str, printed: str) -> None:
    assert str(parse_unit(text)) == printed


def test_products_keep_the_declared_names() -> None:
    assert str(parse_unit("kg.m2") * parse_unit("rad/s2")) == "kg.m2.rad/s2"
    assert str(parse_unit("N.m/s") * parse_unit("s")) == "N.m"
    assert str(parse_unit("N.m") ** 0.5) == "N^(1/2).m^(1/2)"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("Nm", "Unknown unit 'Nm'; did you mean 'N.m'?"),
        ("U/min", "Unknown unit 'U' in 'U/min'; did you mean 'rpm'?"),
        ("tr/min", "Unknown unit 'tr' in 'tr/min'; did you mean 'rpm'?"),
        ("U/s", "Unknown unit 'U' in 'U/s'; did you mean 'rev/s'?"),
        ("Upm", "Unknown unit 'Upm'; did you mean 'rpm'?"),
        ("kgm2", "Unknown unit 'kgm' in 'kgm2'; did you mean 'kg.m2'?"),
        ("N.radn", "Unknown unit 'radn' in 'N.radn'; did you mean 'N.rad'?"),
        ("J/kg.K", "'J/kg.K' is ambiguous: put everything after the '/' in parentheses, as in J/(kg.K)."),
        ("dB", "Unit 'dB' is logarithmic; give a plain number."),
        ("m+s", "'m+s' is not a unit."),
        ("(m", "'(m' is not a unit."),
        ("m)", "'m)' is not a unit."),
        ("m21", "'m21' is not a unit."),
        ("2", "'2' is not a unit."),
        ("m" * 500, "'" + "m" * 30 + "...' is too long for a unit."),
    ],
)
def test_what_is_no_unit_is_told(text: str, message: str) -> None:
    with pytest.raises(UnitError) as caught:
        parse_unit(text)
    assert caught.value.what == message


def test_other_names_come_from_pint() -> None:
    assert math.isclose(parse_unit("inch").factor, 0.0254)
    assert math.isclose(parse_unit("kWh").factor, 3.6e6)
    assert same_dimension(parse_unit("lbf.ft"), parse_unit("N.m"))


def test_the_radian_is_dimensionless_but_an_exponent() -> None:
    assert same_dimension(parse_unit("N.m.rad"), parse_unit("J"))
    assert parse_unit("rad/s").exponents == {"kg": 0, "m": 0, "s": -1, "A": 0, "K": 0, "mol": 0, "cd": 0, "rad": 1}


def test_the_wildcard_fits_everything_and_swallows_products() -> None:
    metre = parse_unit("m")
    assert same_dimension(ANY, metre)
    assert same_dimension(metre, ANY)
    assert metre * ANY == ANY / metre == ANY**2 == ANY
    assert not same_dimension(metre, ONE)


def test_an_irrational_exponent_is_refused() -> None:
    with pytest.raises(UnitError, match=r"cannot have the exponent 0\.1234567"):
        parse_unit("m") ** 0.1234567
    assert parse_unit("m") ** Fraction(2, 3) == Unit((("m", Fraction(2, 3)),))


@pytest.mark.parametrize(
    ("text", "number", "unit"),
    [
        ("8.5 kg.cm2", 8.5, "kg.cm2"),
        ("6000 rpm", 6000, "rpm"),
        ("1e-3", 1e-3, "1"),
        ("20 degC", 20, "degC"),
        ("-3 N.m", -3, "N.m"),
        ("+.5e2mm", 50, "mm"),
        (" 5 % ", 5, "%"),
        ("100 1/min", 100, "1/min"),
        ("inf m", math.inf, "m"),
    ],
)
def test_quantities(text: str, number: float, unit: str) -> None:
    assert read_quantity(text) == (number, parse_unit(unit))


@pytest.mark.parametrize(
    "text", ["2*J", "2 * J", "J", "", "2 - 1", "2/3", "-J", "infinite", "speed", "6000/min", "2^2"]
)
def test_expressions_are_no_quantities(text: str) -> None:
    assert read_quantity(text) is None


@given(st.floats(allow_nan=False, allow_infinity=False), UNITS)
def test_quantities_read_back(number: float, unit: Unit) -> None:
    read = read_quantity(f"{number!r} {unit}")
    assert read is not None
    assert read[0] == number
    assert read[1].exponents == unit.exponents


@pytest.mark.parametrize(
    ("value", "unit", "si"),
    [
        (0.3, "kg.m2", 0.3),
        ("8.5 kg.cm2", "kg.m2", 8.5e-4),
        ("6000 rpm", "rad/s", 200 * math.pi),
        (90, "deg", math.pi / 2),
        ("90", "deg", math.pi / 2),
        ("1e-3", "N.m", 1e-3),
        ("20 degC", "K", 293.15),
        ("5 %", "1", 0.05),
        ("300 1/min", "Hz", 5.0),
        ("10 N.m/rad", "N.m", 10.0),
        (np.float32(3), "m", 3.0),
        (np.int64(3), "m", 3.0),
        (np.array(3), "m", 3.0),
        (Fraction(1, 2), "m", 0.5),
        (pint.Quantity(3, "kg*cm**2"), "kg.m2", 3e-4),
        (pint.Quantity(3, "degC"), "K", 276.15),
        ("7 m", "*", 7.0),
        ("3 rad/s", "1/s", 3.0),
    ],
)
def test_values_in_si(value: object, unit: str, si: float) -> None:
    assert math.isclose(to_si(value, parse_unit(unit), "Part.value"), si, rel_tol=1e-12)


@pytest.mark.parametrize(
    ("value", "unit", "message"),
    [
        ("8.5 kg.cm", "kg.m2", "Inertia.J expects kg.m2; '8.5 kg.cm' is kg.m."),
        ("3 min", "m", "Inertia.J expects m; '3 min' is s."),
        ("100 U/min", "rad/s", "Inertia.J = '100 U/min': Unknown unit 'U' in 'U/min'; did you mean 'rpm'?"),
        ("\uff11\uff12 kg", "rad/s", "Inertia.J expects rad/s; '\uff11\uff12 kg' is kg."),
        ("3 Nm", "N.m", "Inertia.J = '3 Nm': Unknown unit 'Nm'; did you mean 'N.m'?"),
        (
            "6000 1/min",
            "rad/s",
            "Inertia.J expects rad/s; '6000 1/min' does not say whether it counts turns or radians.",
        ),
        ("50 Hz", "rad/s", "Inertia.J expects rad/s; '50 Hz' does not say whether it counts turns or radians."),
        ("600 rpm", "Hz", "Inertia.J expects Hz; '600 rpm' does not say whether it counts turns or radians."),
        ("a + b", "m", "Inertia.J expects m; 'a + b' is not a quantity."),
        (True, "1", "Inertia.J expects 1; True is not a number."),
        (None, "m", "Inertia.J expects m; None is not a number."),
        ([1], "m", "Inertia.J expects m; [1] is not a number."),
        (pint.Quantity(1, "s"), "m", "Inertia.J expects m; '1 second' is s."),
    ],
)
def test_wrong_values_are_told(value: object, unit: str, message: str) -> None:
    with pytest.raises(UnitError) as caught:
        to_si(value, parse_unit(unit), "Inertia.J")
    assert caught.value.what == message


@pytest.mark.parametrize("value", [math.nan, math.inf, "nan", "-inf m", "1e999 m", np.float64("nan")])
def test_values_must_be_finite(value: object) -> None:
    with pytest.raises(ValueOutOfRange, match=r"^Mass\.m must be a finite number, not"):
        to_si(value, parse_unit("m"), "Mass.m")


def test_a_conversion_that_overflows_is_refused() -> None:
    with pytest.raises(ValueOutOfRange, match="must be a finite number"):
        to_si("1e300 Gm2", parse_unit("m2"), "Mass.m")


def test_coherent_names() -> None:
    assert str(coherent(parse_unit("kg.cm"))) == "kg.m"
    assert str(coherent(parse_unit("kN.mm"))) == "N.m"
    assert str(coherent(parse_unit("kN.m/deg"))) == "N.m/rad"
    assert [str(coherent(parse_unit(name))) for name in ("rpm", "bar", "degC", "kJ")] == ["rad/s", "Pa", "K", "J"]
    assert str(coherent(parse_unit("N.m"))) == "N.m"


@given(st.floats(1e-3, 1e6), UNITS)
def test_display_conversion_undoes_the_reading(value: float, unit: Unit) -> None:
    assert math.isclose(in_unit(value * unit.factor, str(unit)), value, rel_tol=1e-12)
    assert math.isclose(in_unit(293.15, "degC"), 20.0, rel_tol=1e-12)


def test_units_pickle_and_hash() -> None:
    unit = parse_unit("N.m/s")
    assert pickle.loads(pickle.dumps(unit)) == unit
    assert len({unit, parse_unit("N.m/s")}) == 1


@pytest.mark.parametrize("text", ["\uff11\uff12 rad/s", "1\uff12 rad/s", "\u0661\u0662 rad/s"])
def test_digits_of_other_scripts_are_digits(text: str) -> None:
    """Full-width ones, as Japanese keyboards write them; they ended in a TypeError."""
    assert to_si(text, parse_unit("rad/s"), "x") == 12.0
    assert str(parse_formula(f"{text} + 1 rad/s")) == "12 rad/s + 1 rad/s"


TOGETHER = """
import threading
from concurrent.futures import ThreadPoolExecutor
from modelica_like.language.units.atoms import find_atom
begin = threading.Barrier(6)
def ask(name):
    begin.wait()
    return find_atom(name).factor
with ThreadPoolExecutor(6) as pool:
    print(*pool.map(ask, ["S", "hp", "inch", "bar", "ft", "gallon"]))
"""


def test_threads_ask_for_the_first_unit_together() -> None:
    """pint creates its registry at the first unit; a page asks in several threads."""
    done = subprocess.run([sys.executable, "-c", TOGETHER], capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0, done.stderr
    assert len(done.stdout.split()) == 6
