"""Tables of numbers in CSV files: measured or computed curves, with units."""

from __future__ import annotations

import csv
import re
from pathlib import Path

import numpy as np

from modelica_like.compile.compiled import Vector
from modelica_like.errors import NetlistError, UnitError
from modelica_like.solve.recorded import RecordedModel, RecordedSolution, RecordedVariable
from modelica_like.units import coherent, parse_unit

_WITH_UNIT = re.compile(r"(.+?)\s*\[(?!\d+\])([^\]]*)\]")
"""A name with its unit in brackets; `belt[2]` is a name."""


def title_and_unit(title: str) -> tuple[str, str]:
    """Return name and unit of a column: `motor.w [rpm]`; without a unit that is empty."""
    found = _WITH_UNIT.fullmatch(title.strip().strip('"'))
    return (found[1], found[2].strip()) if found else (title.strip().strip('"'), "")


def read_columns(path: Path) -> dict[str, tuple[Vector, str]]:
    """Read columns by name, with their units (empty: not said): in brackets, or in a second line.

    Lines that begin with `#` are comments.

    Raises:
        NetlistError: the file is not a table of numbers.
        OSError: the file cannot be read.
    """
    with path.open(newline="", encoding="utf-8-sig") as file:
        reader = csv.reader(file)
        rows = [(reader.line_num, row) for row in reader if any(map(str.strip, row)) and not row[0].startswith("#")]
    titles = [title_and_unit(title) for title in rows[0][1]] if rows else []
    if len(rows) > 1 and len(rows[1][1]) == len(titles) and not _is_number(rows[1][1][0]):
        units = [unit.strip() for unit in rows.pop(1)[1]]
        titles = [(name, unit or own) for (name, unit), own in zip(titles, units, strict=True)]
    if len(rows) < 2:
        raise NetlistError(f"{path.name} is not a table: it needs a line of names, and lines of numbers.")
    values = np.array([_numbers(path.name, line, row, len(titles)) for line, row in rows[1:]])
    return {name: (column, unit) for (name, unit), column in zip(titles, values.T, strict=True)}


def read_csv(path: Path) -> RecordedSolution:
    """Read trajectories from a table with a column `time`; values with a unit become SI values.

    A repeated time gives the values before and after an event.

    Raises:
        NetlistError: the file is not such a table.
        OSError: the file cannot be read.
    """
    columns = read_columns(path)
    if next(iter(columns)) != "time":
        raise NetlistError(f"{path.name}: the first column of a table of trajectories is `time`.")
    values = {name: _in_si(numbers, unit) for name, (numbers, unit) in columns.items()}
    time, _ = values.pop("time")
    if np.any(np.diff(time) < 0):
        raise NetlistError(f"{path.name}: the times must increase.")
    variables = tuple(RecordedVariable(name, unit or "1") for name, (_, unit) in values.items())
    table = np.array([numbers for numbers, _ in values.values()]).reshape(len(values), len(time))
    run = RecordedSolution(RecordedModel(path.stem, variables, (), {}), time, table, np.empty((0, len(time))), 0.0)
    run.measured = True
    return run


def _in_si(numbers: Vector, text: str) -> tuple[Vector, str]:
    try:
        unit = parse_unit(text)
    except UnitError:  # a unit of another tool
        return numbers, text
    return (numbers * unit.factor + unit.offset, str(coherent(unit))) if text else (numbers, "")


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _numbers(name: str, line: int, row: list[str], count: int) -> list[float]:
    if len(row) != count:
        raise NetlistError(f"{name}:{line}: {len(row)} values under {count} names.")
    for text in row:
        if not _is_number(text):
            raise NetlistError(f"{name}:{line}: '{text}' is not a number.")
    return [float(text) for text in row]
