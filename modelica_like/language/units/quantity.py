"""Quantities: a number with a unit, `"8.5 kg.cm2"`, to SI and back."""

from __future__ import annotations

import math
import re
import unicodedata
from fractions import Fraction
from numbers import Real
from typing import Any

from modelica_like.errors import UnitError, ValueOutOfRange
from modelica_like.language.units.atoms import BASE
from modelica_like.language.units.unit import ANY, Unit, coherent, parse_unit, same_dimension

_NUMBER = re.compile(
    r"([+-]?(?:(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?|(?:nan|inf)(?![A-Za-z0-9_.])))\s*(.*)", re.DOTALL
)


def plain_digits(text: str) -> str:
    """Return a text with the digits of other scripts, such as full-width ones, as 0 to 9."""
    if text.isascii():
        return text
    return "".join(char if (digit := unicodedata.decimal(char, -1)) < 0 else str(digit) for char in text)


def read_quantity(text: str) -> tuple[float, Unit] | None:
    """Read `8.5 kg.cm2`, `6000 rpm`, `20 degC` or `1e-3`.

    Returns:
        The number and its unit (`ONE` if there is none), or None if the text is not a number with at most a unit
        behind it: then it is an expression such as `2*J`.

    Raises:
        UnitError: the text after a number is not a unit.
    """
    match = _NUMBER.fullmatch(plain_digits(text.strip()))
    if match is None:
        return None
    number, unit = match.groups()
    if unit and not (unit[0].isalpha() or unit[0] in "%\u00b0(1"):
        return None
    return float(number), parse_unit(unit)


def to_si(value: object, unit: Unit, name: str, *, difference: bool = False) -> float:
    """Return the value of a parameter or variable in coherent SI units.

    Args:
        value: a number in `unit`, a text such as `"8.5 kg.cm2"`, or a `pint.Quantity`.
        unit: the declared unit.
        name: the declared name, such as `Inertia.J`, for messages.
        difference: whether it is one of two values, as an uncertainty: 1 degC is 1 K then.

    Raises:
        UnitError: the value has another dimension, or is not a quantity.
        ValueOutOfRange: the value is not finite.
    """
    number, given = _quantity(value, unit, name)
    if not same_dimension(given, unit):
        raise UnitError(f"{name} expects {unit}; '{value}' is {coherent(given)}.")
    if counts_turns(given, unit):
        raise UnitError(f"{name} expects {unit}; '{value}' does not say whether it counts turns or radians.",
                        advice="Write rpm or rad/s for a speed, Hz for a frequency.")  # fmt: skip
    result = number * given.factor + (0.0 if difference else given.offset)
    if not math.isfinite(result):
        raise ValueOutOfRange(f"{name} must be a finite number, not {value}.")
    return result


def counts_turns(given: Unit, unit: Unit) -> bool:
    """Return whether one counts turns: 50 Hz and 314 rad/s have the same dimension, but a turn is 2 pi radians."""
    rate = tuple(-1 if name == "s" else 0 for name in BASE[:-1])
    if ANY in (given, unit) or given == unit or unit.dimension != rate:
        return False
    turning, expected = given.exponents["rad"] != 0, unit.exponents["rad"] != 0
    return turning != expected and not (turning and str(unit) == "1/s")


def _quantity(value: object, unit: Unit, name: str) -> tuple[float, Unit]:
    if isinstance(value, str):
        try:
            read = read_quantity(value)
        except UnitError as error:
            what = f"{name} = '{value}': {error.what}"
            raise UnitError(what, advice=error.advice, word=error.word, instead=error.instead) from None
        if read is None:
            raise UnitError(f"{name} expects {unit}; '{value}' is not a quantity.")
        match = _NUMBER.fullmatch(plain_digits(value.strip()))
        return read if match is not None and match.group(2) else (read[0], unit)
    if isinstance(value, bool) or value is None:
        raise UnitError(f"{name} expects {unit}; {value} is not a number.")
    if isinstance(value, Real):
        try:
            return float(value), unit
        except OverflowError:
            raise ValueOutOfRange(f"{name} is too large for a number.") from None
    return _foreign(value, unit, name)


def _foreign(value: Any, unit: Unit, name: str) -> tuple[float, Unit]:
    """Read a pint.Quantity or a zero-dimensional array, without importing either package."""
    try:
        if hasattr(value, "magnitude") and hasattr(value, "units"):
            return float(value.magnitude), parse_unit(
                ".".join(f"{name}^({Fraction(power).limit_denominator(100)})" for name, power in value.unit_items())
            )
        return float(value.item()), unit
    except (AttributeError, TypeError, ValueError):
        raise UnitError(f"{name} expects {unit}; {value!r} is not a number.") from None


def in_unit(value_si: float, unit_text: str) -> float:
    """Return an SI value in another unit for display: `in_unit(628.3, "rpm")` is about 6000.

    Raises:
        UnitError: the text is not a unit.
    """
    unit = parse_unit(unit_text)
    return (value_si - unit.offset) / unit.factor
