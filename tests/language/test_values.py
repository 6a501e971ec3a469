"""Values of parameters, inputs and start values: numbers, quantities with units, guesses."""

import math

import numpy as np
import pint
import pytest

from modelica_like import build
from modelica_like.errors import LanguageError, UnitError, UnknownName, ValueOutOfRange
from modelica_like.language import (
    Component,
    Equations,
    Input,
    Mode,
    Parameter,
    Variable,
    guess,
    param,
    signal_in,
    var,
)


class Rotor(Component):
    J: Parameter = param("kg.m2", "moment of inertia", min=0)
    T: Parameter = param("K", "temperature", default="20 degC")
    efficiency: Parameter = param("1", "efficiency", default=0.5, min=0, max=1)
    anything: Parameter = param("*", "takes the unit of its value", default=1.0)
    w: Variable = var("rad/s", "speed")
    load: Input = signal_in("N.m", "load", default="1 kN.m")
    mode = Mode("slow", "fast")

    def equations(self) -> Equations:
        yield self.w == 0


@pytest.mark.parametrize(
    ("given", "number"),
    [
        (2, 2.0),
        (2.5, 2.5),
        (np.float64(2.5), 2.5),
        (np.array(3.0), 3.0),
        ("8.5 kg.cm2", 8.5e-4),
        ("8.5e-4", 8.5e-4),
        ("1 t.mm2", 1e-3),
        (pint.Quantity(8.5, "kg*cm**2"), 8.5e-4),
    ],
)
def test_quantities_become_si(given, number):
    value = Rotor(J=given).value("J")
    assert value is not None
    assert value.number == pytest.approx(number, rel=1e-15)
    assert value.given is given


def test_speeds_and_temperatures():
    rotor = Rotor(J=1, w="6000 rpm")
    start, temperature = rotor.start("w"), rotor.value("T")
    assert start is not None
    assert temperature is not None
    assert start.number == pytest.approx(200 * math.pi, rel=1e-15)
    assert temperature.number == pytest.approx(293.15, rel=1e-15)


def test_a_wildcard_takes_the_unit_of_its_value():
    value = Rotor(J=1, anything="3 mm").value("anything")
    assert value is not None
    assert value.number == pytest.approx(3e-3)
    assert str(value.unit) == "mm"


@pytest.mark.parametrize(
    ("name", "given", "message"),
    [
        ("J", "8.5 kg.cm", "Rotor.J expects kg.m2; '8.5 kg.cm' is kg.m."),
        ("J", True, "Rotor.J expects kg.m2; True is not a number."),
        ("J", None, "Rotor.J expects kg.m2; None is not a number."),
        ("J", [1.0], "Rotor.J expects kg.m2; [1.0] is not a number."),
        ("J", np.zeros(2), "Rotor.J expects kg.m2; array([0., 0.]) is not a number."),
        ("w", "50 Hz", "Rotor.w expects rad/s; '50 Hz' does not say whether it counts turns or radians."),
        ("w", "3 flurb", "Rotor.w = '3 flurb'"),
    ],
)
def test_wrong_units_are_refused(name, given, message):
    with pytest.raises(UnitError) as caught:
        Rotor(**{name: given})
    assert caught.value.what.startswith(message)
    assert caught.value.where[0].file == __file__


@pytest.mark.parametrize(
    ("name", "given", "message"),
    [
        ("J", -1, "Rotor.J = -1 is out of range: it must be at least 0 kg.m2."),
        ("J", "-1 kg.cm2", "Rotor.J = -1 kg.cm2 is out of range: it must be at least 0 kg.m2."),
        ("efficiency", 1.1, "Rotor.efficiency = 1.1 is out of range: it must be at most 1."),
        ("J", math.nan, "Rotor.J must be a finite number, not nan."),
        ("J", math.inf, "Rotor.J must be a finite number, not inf."),
        ("w", "nan", "Rotor.w must be a finite number, not nan."),
    ],
)
def test_values_outside_their_range_are_refused(name, given, message):
    with pytest.raises(ValueOutOfRange) as caught:
        Rotor(**{name: given})
    assert caught.value.what == message


class Press(Component):
    force: Parameter = param("kN", "force", min=1, max=5)

    def equations(self) -> Equations:
        yield from ()


@pytest.mark.parametrize(("given", "number"), [(1, 1000.0), ("1 kN", 1000.0), (5.0, 5000.0), ("1000 N", 1000.0)])
def test_limits_are_in_the_declared_unit(given, number):
    assert build(Press(force=given)).p == [number]
    assert build(Press(force=2)).flat_parameters[0].checked(number, given) == number


@pytest.mark.parametrize(
    ("given", "bound"), [(0.9, "least 1000 N"), ("999 N", "least 1000 N"), ("5.1 kN", "most 5000 N")]
)
def test_values_outside_limits_in_the_declared_unit_are_refused(given, bound):
    with pytest.raises(ValueOutOfRange) as caught:
        Press(force=given)
    assert caught.value.what == f"Press.force = {given} is out of range: it must be at {bound}."
    with pytest.raises(ValueOutOfRange, match=f"it must be at {bound}"):
        build(Press(force=2)).flat_parameters[0].checked({0.9: 900.0, "999 N": 999.0, "5.1 kN": 5100.0}[given], given)


def test_start_values_are_fixed_or_guessed():
    fixed, guessed = Rotor(J=1, w=3.0).start("w"), Rotor(J=1, w=guess("30 rpm")).start("w")
    assert fixed is not None
    assert guessed is not None
    assert (fixed.number, fixed.fixed) == (3.0, True)
    assert guessed.fixed is False
    assert guessed.number == pytest.approx(math.pi)
    assert Rotor(J=1).start("w") is None


def test_defaults_of_parameters_and_inputs():
    rotor = Rotor(J=1)
    load, efficiency = rotor.value("load"), rotor.value("efficiency")
    assert load is not None
    assert efficiency is not None
    assert (load.number, efficiency.number) == (1000.0, 0.5)
    assert Rotor().value("J") is None


def test_attributes_and_paths_set_the_same_value():
    class Drive(Component):
        rotor = Rotor(J=1)

    by_attribute, by_path = Drive(), Drive()
    by_attribute.rotor.J = "2 kg.m2"
    by_path.set("rotor.J", "2 kg.m2")
    values = [drive.rotor.value("J") for drive in (by_attribute, by_path)]
    assert [value.number for value in values if value] == [2.0, 2.0]
    by_path.set("rotor.mode", "fast")
    by_attribute.rotor.mode = "fast"
    assert by_path.rotor.start_mode("mode") == by_attribute.rotor.start_mode("mode") == "fast"


def test_an_unknown_mode_is_refused():
    with pytest.raises(UnknownName, match=r"Rotor.mode has no mode 'fats'; did you mean 'fast'\?"):
        Rotor(J=1, mode="fats")


def test_a_part_that_is_not_replaceable_is_not_replaced():
    class Drive(Component):
        rotor = Rotor(J=1)

    with pytest.raises(LanguageError, match=r"Drive.rotor cannot be replaced\."):
        Drive(rotor=Rotor(J=2))


def test_the_representation_shows_what_was_given():
    assert repr(Rotor(J="8.5 kg.cm2", w=0.0)) == "Rotor(J='8.5 kg.cm2', w=0.0)"
