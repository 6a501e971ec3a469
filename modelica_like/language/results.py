"""Results of design checks: frozen dataclasses that print as tables, with a verdict for lines with a limit."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, cast, dataclass_transform, get_type_hints

import numpy as np

from modelica_like.language.quantities import Number, Quantity, is_symbolic

_ROUNDING = 1e-9
_WIDE = 9
Limits = Mapping[str, tuple[Number | None, Number | None]]
"""Smallest and largest value by name of the line, or None."""


def line(
    description: str, *, at_most: str = "", at_least: str = "", required: bool = False, either_way: bool = False
) -> Any:
    """Declare a line of a result; its unit is that of the annotation.

    Args:
        description: one phrase.
        at_most: name of another line that this one must not exceed.
        at_least: name of another line that this one must reach.
        required: whether this line, a truth value, must be true.
        either_way: whether limits are those of its amount, as of a speed in either direction.
    """
    limits = {"at_most": at_most, "at_least": at_least, "required": required, "either_way": either_way}
    return dataclasses.field(metadata={"description": description, **limits})


@dataclass(frozen=True, slots=True)
class Line:
    """One line of a printed result.

    Attributes:
        name: name of the field.
        value: the value as text, in the unit.
        unit: its unit.
        description: one phrase.
        verdict: `ok`, the distance from a violated limit, or empty without a limit.
        exceeded: whether a limit is violated.
    """

    name: str
    value: str
    unit: str
    description: str
    verdict: str
    exceeded: bool


@dataclass_transform(frozen_default=True, field_specifiers=(line,))
class Result:
    """Base of all results of design checks; every subclass is a frozen dataclass."""

    def __init_subclass__(cls) -> None:
        dataclass(frozen=True)(cls)

    def __post_init__(self) -> None:
        for field in _fields(type(self)):
            value: Any = getattr(self, field.name)
            # Python's roots of negative numbers are complex.
            if isinstance(value, complex) or getattr(getattr(value, "dtype", None), "kind", "") == "c":
                raise ValueError(f"There is no {field.metadata['description']}: it is the root of a negative number.")

    def lines(self, limits: Limits | None = None) -> tuple[Line, ...]:
        """Return the lines of the table.

        Args:
            limits: smallest and largest values in SI units by name of the line, in addition to those of the check.
        """
        chosen = (field for field in _fields(type(self)) if not is_rows(getattr(self, field.name)))
        return tuple(self._line(field, (limits or {}).get(field.name, (None, None))) for field in chosen)

    def tables(self) -> dict[str, tuple[Result, ...]]:
        """Return the parts of the result that are rows of a table, by description."""
        values = {field.metadata["description"]: getattr(self, field.name) for field in _fields(type(self))}
        return {description: value for description, value in values.items() if is_rows(value)}

    def _line(self, field: dataclasses.Field[Any], limit: tuple[Number | None, Number | None]) -> Line:
        value, quantity, about = getattr(self, field.name), quantity_of(type(self), field.name), field.metadata
        verdicts = [_required(value)] if about["required"] else []
        judged = abs(value) if about["either_way"] else value
        for sort, other in zip(("at_least", "at_most"), limit, strict=True):
            bounds = [getattr(self, about[sort])] if about[sort] else []
            for bound in [*bounds, *([] if other is None else [other])]:
                verdicts.append(_verdict(judged, bound, quantity, above=sort == "at_most"))
        missed = [text for text in verdicts if text not in ("", "ok")]
        verdict = "; ".join(missed) or next(filter(None, verdicts), "")
        return Line(field.name, shown(value, quantity), quantity.shown, about["description"], verdict, bool(missed))

    def __str__(self) -> str:
        text = _aligned([(line.name, line.value, line.unit, line.description, line.verdict) for line in self.lines()])
        parts = [type(self).__name__, text]
        for title, rows in self.tables().items():
            parts += ["", title, _grid(rows)]
        return "\n".join(parts)


def is_rows(value: object) -> bool:
    """Return whether a value is a tuple of results."""
    return isinstance(value, tuple) and isinstance(next(iter(cast("tuple[Any, ...]", value)), None), Result)


def _fields(kind: Any) -> tuple[dataclasses.Field[Any], ...]:
    return dataclasses.fields(kind)


@lru_cache(maxsize=512)
def hints(kind: Any) -> dict[str, Any]:
    """Return the annotations of a function or a dataclass, with their metadata."""
    return get_type_hints(kind, include_extras=True)


def quantity(hint: Any) -> Quantity | None:
    """Return the quantity of an annotation, or None."""
    return next((extra for extra in getattr(hint, "__metadata__", ()) if isinstance(extra, Quantity)), None)


def quantity_of(kind: type, name: str) -> Quantity:
    """Return the quantity of a field of a dataclass; texts and truth values are plain numbers here."""
    return quantity(hints(kind).get(name)) or Quantity("1", "")


def shown(value: Any, quantity: Quantity) -> str:
    """Return a value as text in its unit of display, six digits."""
    if isinstance(value, bool | np.bool_):
        return "yes" if value else "no"
    if isinstance(value, str) or is_symbolic(value):
        return str(value)
    if isinstance(value, tuple):
        return ", ".join(shown(item, quantity) for item in cast("tuple[Any, ...]", value))
    with np.errstate(over="ignore"):  # 1e308 m is inf in mm
        numbers = np.ravel(np.asarray(value, dtype=float)) / quantity.factor + 0.0
    return ", ".join(f"{number:.6g}" for number in numbers)


def titled(line: Line) -> str:
    """Return the heading of a line that is a column: its name with the unit."""
    return f"{line.name} [{line.unit}]" if line.unit else line.name


def _grid(rows: tuple[Result, ...]) -> str:
    """Return results of one kind as rows, or transposed if they have many lines."""
    lines = [row.lines() for row in rows]
    heading = tuple(map(titled, lines[0]))
    table = [heading, *(tuple(line.value for line in each) for each in lines)]
    return _aligned(table if len(heading) <= _WIDE else list(zip(*table, strict=True)))


def _required(value: Any) -> str:
    if is_symbolic(value):
        return ""
    return "ok" if np.all(value) else "not fulfilled"


def _verdict(value: Number, bound: Number, quantity: Quantity, *, above: bool) -> str:
    if is_symbolic(value, bound):
        return ""
    values, bounds = np.broadcast_arrays(np.ravel(np.asarray(value, float)), np.ravel(np.asarray(bound, float)))
    excess = values - bounds if above else bounds - values
    worst = int(np.argmax(np.where(np.isnan(excess), np.inf, excess)))
    if excess[worst] <= _ROUNDING * abs(bounds[worst]):
        return "ok"
    more, limit = float(excess[worst]), float(bounds[worst])
    share = f" ({100 * (more / abs(limit)):.3g} %)" if limit else ""
    unit = f" {quantity.shown}".rstrip()
    difference = f"{more / quantity.factor:.4g}{unit}{share}"
    return f"{'above' if above else 'below'} the limit {shown(limit, quantity)}{unit} by {difference}"


def _aligned(rows: list[tuple[str, ...]]) -> str:
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    padded = (
        "  ".join(text.rjust(width) if _is_number(text) else text.ljust(width)
                  for text, width in zip(row, widths, strict=True))
        for row in rows
    )  # fmt: skip
    return "\n".join(f"  {text}".rstrip() for text in padded)


def _is_number(text: str) -> bool:
    return text[:1].isdigit() or (text[:1] == "-" and text[1:2].isdigit())


def comparison(**results: Result) -> str:
    """Return results of one kind as columns of a table.

    Args:
        results: results of the same check, by heading.
    """
    return _aligned([("", *results, "", ""), *beside(result.lines() for result in results.values())])


def beside(columns: Iterable[Sequence[Line]]) -> list[tuple[str, ...]]:
    """Return lines of results of one kind: name, values, unit and description."""
    rows = zip(*columns, strict=True)
    return [(row[0].name, *(line.value for line in row), row[0].unit, row[0].description) for row in rows]
