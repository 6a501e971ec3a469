"""Formulas of sizing files: values and units."""

import math

import numpy as np
import pytest

from modelica_like.analyse.sizing.formulas import Value, read_value
from modelica_like.errors import ModelicaLikeError
from modelica_like.language.units import ONE, parse_unit, same_dimension

VALUES = {
    "force": Value(100.0, parse_unit("N")),
    "arm": Value(0.05, parse_unit("mm")),
    "speed": Value(10.0, parse_unit("rpm")),
    "times": Value(np.array([1.0, 2.0]), parse_unit("s")),
}


@pytest.mark.parametrize(
    ("text", "number", "unit"),
    [
        ("6000 rpm", 200 * math.pi, "rad/s"),
        ("20 degC", 293.15, "K"),
        ("force", 100.0, "N"),
        ("2*force*arm", 10.0, "N.m"),
        ("force/arm**2", 40000.0, "Pa"),
        ("force*speed*arm", 50.0, "W"),
        ("sqrt(force*force)", 100.0, "N"),
        ("arm**-1", 20.0, "1/m"),
        ("abs(-force) + max(force, force)", 200.0, "N"),
        ("sin(pi/2)", 1.0, "1"),
        ("-71/37", -71 / 37, "1"),
        ("2**0.5", math.sqrt(2), "1"),
    ],
)
def test_value(text: str, number: float, unit: str) -> None:
    value = read_value(text, VALUES.__getitem__)
    assert value.number == pytest.approx(number)
    assert same_dimension(value.unit, parse_unit(unit))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("force + arm", "'force + arm' mixes N and m."),
        ("force - 1", "'force - 1.0' mixes N and 1."),
        ("force**arm", "the exponent of something with a unit must be a number"),
        ("sin(force)", "'sin(force)' takes a number; 'force' is in N."),
        ("2*times", "'times' has 2 values; a formula takes single numbers."),
        ("force/0", "'force/0' is not a finite number."),
        ("force force", "neither a quantity nor a formula"),
        ("import os", "neither a quantity nor a formula"),
    ],
)
def test_wrong(text: str, message: str) -> None:
    with pytest.raises(ModelicaLikeError) as caught:
        read_value(text, VALUES.__getitem__)
    assert message in str(caught.value)


def test_a_name_alone_may_be_a_series() -> None:
    assert read_value("times", VALUES.__getitem__) == VALUES["times"]
    assert read_value("3", VALUES.__getitem__) == Value(3.0, ONE)
