"""Values of attributes such as `nominal` and `unit`, and what a reader of a text should know."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from modelica_like.errors import UnitError
from modelica_like.language.units import parse_unit, same_dimension
from modelica_like.netlist.modelica.instance import Given
from modelica_like.netlist.modelica.resolve import Resolver
from modelica_like.netlist.modelica.tree import Expr
from modelica_like.netlist.modelica.types import Basic


@dataclass
class Notes:
    """What a reader should know: values that were taken, units that were left out."""

    told: list[str] = field(default_factory=list)
    display: dict[str, str] = field(default_factory=dict)

    def tell(self, sentence: str) -> None:
        """Keep a sentence, once."""
        if sentence not in self.told:
            self.told.append(sentence)


def value_of(given: Given | None) -> Expr | None:
    """Return the value of an attribute as an expression, None if it has none."""
    if given is None or given.value is None or given.scope is None:
        return None
    return Resolver(*given.scope, numeric=True)(given.value)


def known(given: Given | None) -> Any:
    """Return the value of an attribute, None if it has none."""
    if given is None or given.scope is None:
        return None
    with given.scope[0].classes.saying():
        value = value_of(given)
    return value.args[0] if value is not None and value.args else None


def number_of(given: Given | None) -> float | None:
    """Return the value of a limit, None if it has none, or one that is none."""
    value = known(given)
    return value if isinstance(value, float) and abs(value) < 1e50 else None


def nominal_of(basic: Basic) -> float:
    """Return the nominal value, or 1."""
    value = known(basic.given.inner.get("nominal"))
    return value if isinstance(value, float) else 1.0


def unit_of(basic: Basic, notes: Notes) -> str:
    """Return the unit; one that is not coherent is left out, because Modelica converts nothing."""
    unit = known(basic.given.inner.get("unit"))
    try:
        read = parse_unit(str(unit or "1"))
    except UnitError:
        notes.tell(f"The unit '{unit}' is not known here and is left out.")
        return "1"
    if (read.factor, read.offset) == (1.0, 0.0):
        return str(read)
    notes.tell(f"The unit '{unit}' is left out: numbers of the text stay as they are.")
    return "1"


def shown_unit(basic: Basic, notes: Notes) -> str:
    """Return the unit in which a variable is shown, empty if it is its own."""
    unit = str(known(basic.given.inner.get("displayUnit")) or "")
    with suppress(UnitError):  # it is only shown
        if unit and same_dimension(parse_unit(unit), parse_unit(unit_of(basic, notes))):
            return unit
    return ""
