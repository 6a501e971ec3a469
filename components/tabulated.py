"""Laws given as measured tables, and their extrapolation."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import Literal

from modelica_like.language import BoundMode, Component, Events, Expr, LanguageError, Mode, all_of, any_of, interpolate
from modelica_like.language.inside import declarations

Flat = tuple[float, ...]
ROUNDING = 1e-10
GUESSED = {"hold": ": its last value holds", "linear": ": its last slope goes on", "error": ""}


class Tabulated(Component, partial=True):
    """Element with measured tables.

    Beyond the measured range the last value is a guess, and the report of a run says so; the last slope is used only if
    requested.
    """

    smooth: bool = False
    """Interpolate in tables with a continuous slope."""
    extrapolate: Literal["hold", "linear", "error"] = "hold"
    """Beyond a table: `hold` its last value, continue its last slope within the limits of its cells (`linear`), or end
    the run (`error`)."""
    range = Mode("kept", "left", description="whether it was always within the rows of its tables")

    def look_up(self, x: Expr | float, table: Sequence[Sequence[float]], column: int = 1) -> Expr:
        """Return a value of a table at x, in the scale of its first column."""
        return interpolate(
            x, [r[0] for r in table], [r[column] for r in table], self.smooth, self.extrapolate,
            _limits(self, table, column),
        )  # fmt: skip

    def look_up_map(self, x: Expr | float, first: Flat, y: Expr | float, second: Flat, table: Sequence[Flat]) -> Expr:
        """Return a value of a map: along its rows over `second` at y, and then across them over `first` at x.

        Raises:
            LanguageError: the table has another size than `first` and `second`.
        """
        sizes = len(table), len(table[0])
        if sizes != (len(first), len(second)):
            raise LanguageError(
                f"{self.label}: the table has {sizes[0]} rows and {sizes[1]} columns, but there are "
                f"{len(first)} values for rows and {len(second)} for columns.",
                advice="Give one value for each row, and one for each column.",
            )
        along = [self.look_up(y, list(zip(second, values, strict=True))) for values in table]
        return interpolate(
            x, first, along, self.smooth, self.extrapolate, _limits(self, table, 0),  # type: ignore[arg-type]
        )  # fmt: skip

    def leaving(
        self, name: str, x: Expr, table: Sequence[Sequence[float]], *conditions: Expr, least: float = 0.0,
        watch: BoundMode | None = None,
    ) -> Events:  # fmt: skip
        """Yield the event at which x leaves a table.

        Args:
            name: of the table.
            x: in the scale of its first column.
            table: rows.
            conditions: under which it matters.
            least: smallest possible x.
            watch: mode that tells it, by default `range`.
        """
        if len(table) > 1 and self.extrapolate != "linear":
            first, last = table[0][0], table[-1][0]
            above = isinstance(first, float | int) and first <= least
            # Reaching the end of a table does not leave it.
            slack = ROUNDING * (last - first)
            outside = x > last + slack if above else any_of(x > last + slack, x < first - slack)
            yield (watch or self.range).go(
                "kept", "left", when=all_of(outside, *conditions), fails=self.extrapolate == "error",
                notice=f"leaves the rows of {name}{GUESSED[self.extrapolate]}",
            )  # fmt: skip


def _limits(component: Component, table: object, column: int) -> tuple[float, float]:
    """Return what a cell may be: beyond it no slope goes on, so that no efficiency exceeds 1, and no friction drives.

    Args:
        component: to which the table belongs.
        table: as it stands there.
        column: of the cell.
    """
    tables = declarations(component).tables
    name = next((name for name in tables if getattr(component, name) is table), None)
    return (tables[name].columns[column].min, tables[name].columns[column].max) if name else (-inf, inf)
