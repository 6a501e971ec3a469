"""Formulas of sizing files, with units."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from modelica_like.errors import UnitError, ValueOutOfRange
from modelica_like.language.formula import parse_formula
from modelica_like.language.units import ONE, Unit, coherent, read_quantity


class Value(NamedTuple):
    """A number, or an array of numbers, in coherent SI with its unit."""

    number: Any
    unit: Unit


Lookup = Callable[[str], Value]


def read_value(text: str, lookup: Lookup) -> Value:
    """Read a quantity or a formula: `8.5 kg.cm2`, `2*torque`, `belt.shaft_load`; `lookup` returns values of names."""
    quantity = read_quantity(text)
    if quantity is not None:
        number, unit = quantity
        return _finite(Value(number * unit.factor + unit.offset, unit), text)
    formula = parse_formula(text)
    if formula.operation == "name":
        return lookup(text.strip())
    unit = formula.unit(lambda name: coherent(lookup(name).unit))
    number = float(
        formula.evaluate(lambda name: _scalar(lookup(name), name), lambda part: ca.SX(_quantity(part).number))
    )
    return _finite(Value(number, unit), text)


def _quantity(text: str) -> Value:
    number, unit = read_quantity(text) or (math.nan, ONE)
    return Value(number * unit.factor + unit.offset, unit)


def _scalar(value: Value, name: str) -> ca.SX:
    if np.ndim(value.number):
        raise UnitError(f"'{name}' has {np.size(value.number)} values; a formula takes single numbers.")
    return ca.SX(float(value.number))


def _finite(value: Value, text: str) -> Value:
    if not math.isfinite(value.number):
        raise ValueOutOfRange(f"'{text}' is not a finite number.")
    return value
