"""The units in which results are shown."""

from __future__ import annotations

from collections.abc import Mapping
from fnmatch import fnmatchcase
from typing import Any

from modelica_like.compile.compiled import Vector
from modelica_like.errors import UnitError, unknown_name
from modelica_like.language.units import Unit, parse_unit, same_dimension

QUANTITIES = {
    "rad/s": "speed", "N.m": "torque", "m/s": "velocity", "N": "force", "rad": "angle", "m": "position", "W": "power",
    "J": "energy", "rad/s2": "acceleration", "A": "current", "V": "voltage", "K": "temperature", "Pa": "pressure",
}  # fmt: skip
"""Quantities by coherent unit."""


class Display:
    """Units in which the values of a model are shown: SI, unless the netlist or the user chooses others.

    A path overrides a pattern, a pattern overrides a quantity.

    Args:
        model: names, units and settings.
        chosen: units by path, pattern (`*.w`), quantity (`speed`) or SI unit (`rad/s`), in addition to [display].

    Raises:
        UnknownName: a key is none of these.
        UnitError: a text is not a unit, or has another dimension.
    """

    def __init__(self, model: Any, chosen: Mapping[str, str] | None = None) -> None:
        self._own = {variable.path: str(variable.unit) for variable in (*model.flat_variables, *model.flat_discretes)}
        self._differences = {v.path for v in model.flat_variables if getattr(v, "difference", False)}
        wanted = {**getattr(model, "settings", {}).get("display", {}), **(chosen or {})}
        self._quantities: dict[str, str] = {}
        self._paths: dict[str, str] = {}
        named = {name: unit for unit, name in QUANTITIES.items()}
        named |= {unit: unit for unit in (*self._own.values(), *QUANTITIES)}
        for key, text in wanted.items():
            unit = parse_unit(text)
            if key in named:
                _check(key, named[key], unit)
                self._quantities[named[key]] = text
                continue
            fitting = [path for path in self._own if path == key or fnmatchcase(path, key)]
            if not fitting:
                quantities = [*self._own, *QUANTITIES.values()]
                what = f"{model.name} has no variable or quantity '{key}' to show in {text}"
                raise unknown_name(what, key, quantities)
            if key in self._own:
                _check(key, self._own[key], unit)
            same = {path: text for path in fitting if _fits(self._own[path], unit)}
            self._paths |= same if key in self._own else {path: t for path, t in same.items() if path not in wanted}

    def __contains__(self, path: object) -> bool:
        return path in self._own

    def of(self, path: str) -> str:
        """Return the unit in which a variable is shown; a difference of temperatures has no zero of a scale."""
        shown = self._paths.get(path) or self.of_quantity(self._own[path])
        return self._own[path] if path in self._differences and parse_unit(shown).offset else shown

    def of_quantity(self, unit: str) -> str:
        """Return the unit in which a coherent unit is shown."""
        return self._quantities.get(unit, unit)

    def values(self, path: str, values: Vector) -> Vector:
        """Convert values of a variable from SI units to its shown unit."""
        return self.converted(values, self._own[path], self.of(path))

    def converted(self, values: Any, unit: str, shown: str) -> Any:
        """Return values in another unit."""
        if unit == shown:
            return values
        here, there = parse_unit(unit), parse_unit(shown)
        return (values * here.factor + here.offset - there.offset) / there.factor

    def quantity(self, path: str) -> str:
        """Return the quantity of a variable: `speed`, or `value` if it has no name."""
        return QUANTITIES.get(self._own[path], "value")


def _fits(si_unit: str, unit: Unit) -> bool:
    try:
        return same_dimension(parse_unit(si_unit), unit) and si_unit not in ("1", "*")
    except UnitError:  # unit names of other FMUs
        return False


def _check(key: str, si_unit: str, unit: Unit) -> None:
    if not _fits(si_unit, unit):
        raise UnitError(f"{key} is in {si_unit}: it cannot be shown in {unit}.")
