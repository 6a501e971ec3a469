"""Patterns of quantities for JSON schemas: a text with a known unit of another dimension is refused.

Units that are not listed here, and formulas, pass: the pattern of a text decides only where it is sure.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import lru_cache
from typing import Any

from modelica_like.language.units import ANY, Unit, coherent, parse_unit, same_dimension
from modelica_like.language.units.atoms import ATOMS, Exponent
from modelica_like.language.units.quantity import counts_turns

_NUMBER = r"^\s*[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?\s*"
_UNKNOWN = "not_a_quantity_in_a_known_unit"
_WRONG = "Nm|Nms"
"""Units that are no units, but look like one."""
_USUAL = ("kg.m", "kg/m", "kg/m2", "kg/s", "N.m2", "N/m2", "N.s", "N.m/s", "W.s", "A.h", "rad/s2", "m/s2", "J/s", "V/s")
"""Units of no declaration that are met by mistake."""


class Quantities:
    """Schemas of texts by their unit.

    Args:
        units: texts of all units that are usual, from which those of each dimension are taken.
    """

    def __init__(self, units: Iterable[str]) -> None:
        named_units = {parse_unit(text) for text in (*units, *_USUAL)} | {parse_unit(name) for name in ATOMS}
        self._patterns = {unit: _pattern(unit) for unit in sorted(named_units, key=str) if unit.atoms and unit != ANY}
        self._used: dict[str, Unit] = {}

    def text(self, unit: Unit) -> dict[str, Any]:
        """Return the schema of a text that is a quantity in a unit, or a formula."""
        if unit == ANY:
            return {"type": "string"}
        name = re.sub(r"[^\w.]+", "_", f"quantity in {str(coherent(unit)).replace('/', ' per ')}")
        self._used[name] = coherent(unit)
        return {"$ref": f"#/definitions/{name}"}

    def definitions(self) -> dict[str, Any]:
        """Return the schemas to which those of `text` refer."""
        schemas = {
            name: {"type": "string", "anyOf": [{"pattern": self._of(unit)}, {"$ref": f"#/definitions/{_UNKNOWN}"}]}
            for name, unit in self._used.items()
        }
        return {_UNKNOWN: {"not": {"pattern": _whole([*self._patterns.values(), _WRONG])}}} | schemas

    def _of(self, unit: Unit) -> str:
        return _whole(
            pattern for u, pattern in self._patterns.items() if same_dimension(u, unit) and not counts_turns(u, unit)
        )


@lru_cache(maxsize=1)
def unnamed_quantities() -> Quantities:
    """Return the schemas of quantities for schemas that stand alone, such as those of one type."""
    return Quantities(())


def _whole(patterns: Iterable[str]) -> str:
    return f"{_NUMBER}({'|'.join(dict.fromkeys(patterns)) or '1'})$"


def _pattern(unit: Unit) -> str:
    """Return the pattern of a unit and of those with other prefixes."""
    above = "[.*]".join(_factor(name, power) for name, power in unit.atoms if power > 0)
    below = [_factor(name, -power) for name, power in unit.atoms if power < 0]
    if len(below) > 1:
        return rf"{above or '1'}/\({'[.*]'.join(below)}\)"
    return f"{above or '1'}/{below[0]}" if below else above


def _factor(name: str, power: Exponent) -> str:
    names = _alike(ATOMS[name].exponents) if name in ATOMS else (name,)
    alternatives = "|".join(re.escape(n) if n == "%" else n for n in names)
    spelled = "" if power == 1 else rf"\^?{power}" if isinstance(power, int) else re.escape(f"^({power})")
    return f"({alternatives}){spelled}"


@lru_cache(maxsize=256)
def _alike(exponents: tuple[Exponent, ...]) -> tuple[str, ...]:
    return tuple(name for name, atom in ATOMS.items() if atom.exponents == exponents)
