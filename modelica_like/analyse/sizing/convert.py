"""From the values of a sizing file to the arguments of a design check."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import Any, get_args, get_origin

import numpy as np

from modelica_like.analyse.sizing.checks import arguments_of, is_result, unit_of_kind, without_none
from modelica_like.analyse.sizing.document import placed
from modelica_like.analyse.sizing.formulas import Lookup, Value, read_value
from modelica_like.errors import (
    MissingValue,
    ModelicaLikeError,
    NetlistError,
    Source,
    UnitError,
    unknown_name,
)
from modelica_like.language.units import Unit, coherent, read_quantity, same_dimension, to_si

SimulatedLoad = Callable[[Mapping[str, Any], str], Value]
_TEXTS: dict[Any, type] = {str: str, bool: bool, int: int}


@dataclasses.dataclass(frozen=True)
class Converter:
    """Turns values into arguments, with names in formulas, loads from simulations, and results of other checks."""

    lookup: Lookup
    simulated: SimulatedLoad
    result: Callable[[str], Any]

    def arguments(
        self, target: Any, table: Mapping[str, Any], where: str, place: Callable[[str], Source] | None = None
    ) -> dict[str, Any]:
        """Return the arguments of a check, or of a dataclass, from a table.

        Args:
            target: the check or dataclass.
            table: values by name.
            where: path of the table, for messages.
            place: returns the place of an argument in the file.
        """
        expected = arguments_of(target)
        for name in table:
            if name not in expected:
                raise unknown_name(
                    f"{where} has no argument '{name}'", name, expected, f" It has {', '.join(expected)}."
                )
        missing = [argument.name for argument in expected.values() if argument.required and argument.name not in table]
        if missing:
            raise MissingValue(f"{where} needs {' and '.join(missing)}.")
        values: dict[str, Any] = {}
        for name, value in table.items():
            try:
                values[name] = self._value(without_none(expected[name].kind), value, f"{where}.{name}")
            except ModelicaLikeError as error:
                raise placed(error, place(name)) if place else error from None
        return values

    def _value(self, kind: Any, value: Any, where: str) -> Any:
        unit = unit_of_kind(kind)
        if unit is not None:
            return self.quantity(unit, value, where)
        if get_origin(kind) in (Sequence, tuple, list):
            if not isinstance(value, list):
                raise NetlistError(f"{where} must be a list.")
            inner = get_args(kind)[0]
            return tuple(self._value(inner, item, f"{where}[{k}]") for k, item in enumerate(value))
        if dataclasses.is_dataclass(kind) and isinstance(kind, type):
            if isinstance(value, dict):
                return kind(**self.arguments(kind, value, where))
            result = self.result(value) if isinstance(value, str) else None
            if not isinstance(result, kind):
                raise NetlistError(
                    f"{where} must be a table: {{ {_example(kind)} }}.",
                    advice=f"Or name a check whose result is a {kind.__name__}." if is_result(kind) else "",
                )
            return result
        if kind in _TEXTS and type(value) is not _TEXTS[kind]:
            raise NetlistError(f"{where} must be {_article(kind)}, not {value!r}.")
        return value

    def quantity(self, unit: Unit, value: Any, where: str) -> Any:
        """Return a number, or an array from a list, in SI units."""
        if isinstance(value, list):
            if not value or any(isinstance(item, list) for item in value):
                raise NetlistError(f"{where} must be a list of numbers, neither empty nor of lists.")
            return np.array([self.quantity(unit, item, f"{where}[{k}]") for k, item in enumerate(value)], dtype=float)
        if isinstance(value, dict):
            return _fitting(self.simulated(value, where), unit, where)
        if isinstance(value, str) and read_quantity(value) is None:
            return _fitting(read_value(value, self.lookup), unit, f"{where} = '{value}'")
        return to_si(value, unit, where)


def _fitting(value: Value, unit: Unit, where: str) -> Any:
    """Return a number that is already in SI units, after checking its unit."""
    if not same_dimension(value.unit, unit):
        raise UnitError(f"{where} is {coherent(value.unit)}; {unit} is expected.")
    return value.number


def _example(kind: Any) -> str:
    return ", ".join(f"{name} = …" for name, argument in arguments_of(kind).items() if argument.required)


def _article(kind: Any) -> str:
    return {str: "a text", bool: "true or false", int: "a whole number"}[kind]
