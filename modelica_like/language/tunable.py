"""Tables whose numbers are parameters, which can change without a new compilation."""

from __future__ import annotations

import copy
from collections.abc import Generator, Iterable
from contextlib import contextmanager
from fnmatch import fnmatchcase
from typing import Any, TypeVar, cast

from modelica_like.errors import LanguageError, UnknownName, did_you_mean
from modelica_like.language.component import Component
from modelica_like.language.expr import symbol_of
from modelica_like.language.fields import Parameter, param
from modelica_like.language.inside import declarations, inside
from modelica_like.language.tables import Rows

_Root = TypeVar("_Root", bound=Component)


def with_tunable_tables(root: _Root, patterns: Iterable[str]) -> _Root:
    """Return a copy in which the numbers of tables are parameters `clutch.mu_pos[2,1]`, by row and column.

    Args:
        root: a component tree.
        patterns: paths of tables, such as `clutch.mu_pos` or `*.loss_table`. The number of rows is fixed. A pattern
            with `*` skips tables with texts and tables that are passed on to parts.

    Raises:
        UnknownName: no table has such a path.
        LanguageError: a named table has texts, or is passed on to parts.
    """
    root = copy.deepcopy(root)
    with_tables = [(part, name, rows) for part in root.walk() for name, rows in declarations(part).tables.items()]
    tables = {f"{table[0].path}.{table[1]}".lstrip("."): table for table in with_tables}
    for pattern in patterns:
        met = [path for path in tables if fnmatchcase(path, pattern.replace("[", "[[]"))]
        if not met:
            raise UnknownName(
                f"{root.label} has no table '{pattern}'{did_you_mean(pattern, tables) or '.'}",
                advice=f"Its tables are {', '.join(tables)}." if tables else "None of its parts has a table.",
            )
        for path in met:
            owner, name, rows = tables[path]
            kept = owner.parts or any(column.text for column in rows.columns)
            if kept and path == pattern:
                raise LanguageError(
                    f"The numbers of {path} cannot be parameters: "
                    + ("its parts are made from it." if owner.parts else "it has texts."),
                    advice="Name the table of the part." if owner.parts else "",
                )
            if not kept:
                inside(owner).own_fields = {**inside(owner).own_fields, **_cells(owner, name, rows)}
    return root


def _cells(owner: Component, table: str, rows: Rows) -> dict[str, Parameter]:
    """Return a parameter for every number of a table, row by row."""
    cells: dict[str, Parameter] = {}
    for i, row in enumerate(getattr(owner, table), 1):
        numbers: tuple[float, ...] = (row,) if rows.flat else row
        for j, number in enumerate(numbers, 1):
            column = rows.columns[min(j, len(rows.columns)) - 1]
            unit = "1" if column.scale else column.unit
            cell = cast("Parameter", param(unit, f"{column.what} in row {i} of {table}", default=number))
            cell.owner, cell.name = type(owner).__name__, f"{table}[{i}]" if rows.flat else f"{table}[{i},{j}]"
            cell.above = len(numbers) if column.rising and i > 1 else 0
            cells[cell.name] = cell
    return cells


@contextmanager
def symbols_in_tables(component: Any) -> Generator[None]:
    """Let the equations of a component see symbols in the tables whose numbers are parameters."""
    numbers: dict[str, Any] = {}
    for name, rows in declarations(component).tables.items():
        table = getattr(component, name)
        if f"{name}[1]" in component.fields or f"{name}[1,1]" in component.fields:
            numbers[name] = table
            symbols = tuple(
                symbol_of(component, f"{name}[{i}]")
                if rows.flat
                else tuple(symbol_of(component, f"{name}[{i},{j}]") for j in range(1, len(row) + 1))
                for i, row in enumerate(table, 1)
            )
            object.__setattr__(component, name, symbols)  # past the check of new rows
    try:
        yield
    finally:
        for name, table in numbers.items():
            object.__setattr__(component, name, table)
