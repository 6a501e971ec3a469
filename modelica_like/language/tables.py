"""Structural fields that are tables: rows of numbers and texts."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, cast

from modelica_like.errors import LanguageError, ModelicaLikeError, NetlistError, ValueOutOfRange
from modelica_like.language.expr import Expr
from modelica_like.language.fields import Field, Value
from modelica_like.language.inside import inside
from modelica_like.language.places import caller
from modelica_like.language.units import ANY, Unit, parse_unit, to_si

REQUIRED = object()
"""Default of a required structural field."""
_SHOWN = 60


@dataclass(frozen=True)
class Column:
    """One column of a table; see `column`."""

    what: str
    unit: str
    scale: str
    rising: bool
    text: bool
    min: float
    max: float

    def unit_in(self, fields: Mapping[str, Field]) -> Unit:
        """Return the unit of the numbers: that of the scale parameter, or its own."""
        return fields[self.scale].unit if self.scale else parse_unit(self.unit)

    def described(self, fields: Mapping[str, Field]) -> str:
        """Return its description and unit: `slip speed in rad/s`."""
        unit = str(self.unit_in(fields))
        return f"{self.what} (a text)" if self.text else f"{self.what} in {unit}" if unit not in "1*" else self.what


@dataclass(frozen=True)
class Rows:
    """Declaration of a table; see `rows`."""

    columns: tuple[Column, ...]
    default: Any
    flat: bool
    more: bool

    @property
    def description(self) -> str:
        """Description of the rows: `Rows of slip speed in w_scale and friction coefficient.`."""
        parts = [f"{c.what} in {c.scale or c.unit}" if c.scale or c.unit != "1" else c.what
                 for c in self.columns]  # fmt: skip
        listed = ", ".join(parts[:-1]) + " and " + parts[-1] if len(parts) > 1 else parts[0]
        return f"{'List' if self.flat else 'Rows'} of {listed}{' and so on' if self.more else ''}."

    def read(self, label: str, fields: Mapping[str, Field], given: Any) -> tuple[tuple[Any, ...], frozenset[str]]:
        """Read a table.

        Args:
            label: name for messages, such as `Clutch.mu_pos`.
            fields: of the component.
            given: tuple of rows, tuples; cells are numbers in the column's unit, quantities, or texts.

        Returns:
            The table, in SI units, and the scale parameters of columns with quantities.

        Raises:
            NetlistError: it does not have the shape of the table, or a column does not rise.
            UnitError, ValueOutOfRange: a cell has another dimension or is not finite.
        """
        wanted = [c.described(fields) for c in self.columns]
        row = wanted[0] if self.flat else f"[{', '.join(wanted)}{', …' if self.more else ''}]"
        if not isinstance(given, tuple) or not given:
            shape = f"a list of {row}" if self.flat else f"a list of rows {row}"
            raise NetlistError(f"{label} = {_short(given)} must be {shape}.")
        width = len(self.columns)
        if self.more and isinstance(given[0], tuple):
            width = max(width, len(cast("tuple[Any, ...]", given[0])))
        columns = self.columns + (self.columns[-1],) * (width - len(self.columns))
        table: list[tuple[Any, ...]] = []
        measured: set[str] = set()
        for number, line in enumerate(cast("tuple[Any, ...]", given), 1):
            cells: Any = (line,) if self.flat else line
            if not isinstance(cells, tuple) or len(cast("tuple[Any, ...]", cells)) != width:
                raise NetlistError(f"{label}, row {number}: {_short(line)} must be {row}.")
            pairs = list(zip(columns, cast("tuple[Any, ...]", cells), strict=True))
            place = f"{label}, row {number}, "
            table.append(tuple(_cell(f"{place}{column.what}", column, fields, cell) for column, cell in pairs))
            measured |= {column.scale for column, cell in pairs if column.scale and isinstance(cell, str)}
        self._check_rising(label, table)
        return tuple(r[0] for r in table) if self.flat else tuple(table), frozenset(measured)

    def store(self, owner: Any, name: str, given: Any) -> tuple[Any, ...]:
        """Read a table for a component, which stores it as given, and the scales that must then have no value.

        Args:
            owner: the component.
            name: of the field.
            given: tuple of rows, tuples.

        Raises:
            ModelicaLikeError: see `read`, or a scale has a value.
        """
        label = f"{type(owner).__name__}.{name}"
        try:
            understood, measured = self.read(label, owner.fields, given)
            for scale in measured & inside(owner).values.keys():
                raise both_given(label, scale)
        except ModelicaLikeError as error:
            error.where = error.where or (caller(),)
            raise
        kept = inside(owner)
        kept.given_tables = {**kept.given_tables, name: given}
        kept.measured = {k: v for k, v in kept.measured.items() if v != label} | dict.fromkeys(measured, label)
        return understood

    def _check_rising(self, label: str, table: list[tuple[Any, ...]]) -> None:
        for k, column in enumerate(self.columns):
            for number, (before, after) in enumerate(pairwise(table), 2):
                if column.rising and not isinstance(after[k], Expr) and not before[k] < after[k]:
                    raise NetlistError(
                        f"{label}, row {number}: the {column.what} {after[k]:g} is not above {before[k]:g}, that of "
                        "the row before.", advice="Sort the rows and remove duplicates.",
                    )  # fmt: skip


def _cell(label: str, column: Column, fields: Mapping[str, Field], given: Any) -> Any:
    """Return a cell in SI units; symbols are not changed."""
    if isinstance(given, Expr) or (column.text and isinstance(given, str)):
        return given
    unit = column.unit_in(fields)
    if column.text or isinstance(given, bool) or not isinstance(given, int | float | str) or (
        unit == ANY and isinstance(given, str)
    ):  # fmt: skip
        plain = "a text" if column.text else "a number"
        kind = plain if column.text or str(unit) in "1*" else f"{plain} or a quantity in {unit}"
        raise NetlistError(f"{label}: {_short(given)} must be {kind}.")
    value = to_si(given, unit, label)
    if not column.min <= value <= column.max:
        limit = f"below {column.min:g}" if value < column.min else f"above {column.max:g}"
        raise ValueOutOfRange(f"{label}: {_short(given)} is {limit}.")
    return value


def _short(given: Any) -> str:
    text = repr(_as_written(given))
    return text if len(text) <= _SHOWN else f"{text[: _SHOWN - 1]}…"


def _as_written(given: Any) -> Any:
    return [_as_written(cell) for cell in cast("tuple[Any, ...]", given)] if isinstance(given, tuple) else given


def frozen_rows(value: Any) -> Any:
    """Make lists hashable, so that structural values can be compared."""
    if isinstance(value, list | tuple):
        return tuple(frozen_rows(item) for item in cast("list[Any]", value))
    return value


def keep_as_read(label: str, name: str, before: Value | None, new: Value) -> None:
    """Refuse another value for a parameter of whose value others were made when a text was read."""
    if before is not None and (before.number, before.formula) != (new.number, new.formula):
        raise LanguageError(
            f"{label}.{name} was read as a number, of which others were made, and cannot change afterwards.",
            where=caller(),
            advice="Change it in the text, or extend the class with this value under a name of its own.",
        )


def both_given(label: str, scale: str) -> ModelicaLikeError:
    """Return the error about a table with quantities and a scale."""
    return NetlistError(
        f"{label} has quantities, but {scale} scales plain numbers.",
        advice=f"Write numbers and {scale}, or quantities without {scale}.",
    )


def column(
    what: str, unit: str = "1", *, scale: str = "", rising: bool = False, text: bool = False,
    min: float = -math.inf, max: float = math.inf,
) -> Column:  # fmt: skip
    """Declare a column of a table.

    Args:
        what: one phrase.
        unit: in Modelica notation.
        scale: parameter with a unit that multiplies plain numbers; quantities need none.
        rising: whether every value must exceed the one before.
        text: whether it contains texts instead of numbers.
        min: smallest permitted value, in units of the scale or in SI units.
        max: largest permitted value.
    """
    return Column(what, unit, scale, rising, text, min, max)


def rows(*columns: Column, default: Any = REQUIRED, flat: bool = False, more: bool = False) -> Any:
    """Declare a structural field that is a table: in equations a tuple of rows, in SI units or in units of a scale.

    Args:
        columns: of the table.
        default: rows; without it they are required.
        flat: whether the rows are single values instead of lists.
        more: whether there may be more columns like the last.
    """
    return Rows(columns, default, flat, more)
