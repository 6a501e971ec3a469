"""Tables of numbers in CSV files: measured or computed curves, with units."""

from __future__ import annotations

import codecs
import csv
import io
import re
from collections import Counter
from pathlib import Path

import numpy as np

from modelica_like.compile.compiled import Vector
from modelica_like.errors import NetlistError, UnitError
from modelica_like.language.units import coherent, parse_unit
from modelica_like.runs.recorded import RecordedModel, RecordedSolution, RecordedVariable

_WITH_UNIT = re.compile(r"(.+?)\s*\[(?!\d+\])([^\]]*)\]")
"""A name with its unit in brackets; `belt[2]` is a name."""
_SEPARATOR = re.compile(r"\Asep=(.)\r?\n")
"""The line by which Excel names the separator."""


def title_and_unit(title: str) -> tuple[str, str]:
    """Return name and unit of a column: `motor.w [rpm]`; without a unit that is empty."""
    match = _WITH_UNIT.fullmatch(title.strip().strip('"'))
    return (match[1], match[2].strip()) if match else (title.strip().strip('"'), "")


def read_columns(path: Path) -> dict[str, tuple[Vector, str]]:
    """Read columns by name, with their units (empty: not said): in brackets, or in a second line.

    Cells are separated by commas, or by semicolons or tabs, between which numbers may have decimal commas, as Excel
    writes them. The text is UTF-8, UTF-16 or Windows-1252. Lines that begin with `#` are comments.

    Raises:
        NetlistError: the file cannot be read, or is not a table of numbers.
    """
    text = _text(path)
    said = _SEPARATOR.match(text)
    head = next((line for line in text.splitlines() if line.strip() and not line.startswith("#")), "")
    separator = said[1] if said else next((mark for mark in ";\t" if mark in head), ",")
    before = 1 if said else 0
    reader = csv.reader(io.StringIO(text[said.end() if said else 0 :], newline=""), delimiter=separator)
    try:
        rows = [(reader.line_num + before, row) for row in reader if any(map(str.strip, row))]
    except csv.Error as error:
        raise NetlistError(f"{path.name}:{reader.line_num + before}: this is no line of a table: {error}.") from None
    rows = [(line, row) for line, row in rows if not row[0].startswith("#")]
    titles = [title_and_unit(title) for title in _trimmed(rows[0][1], 0)] if rows else []
    rows = [(line, _trimmed(row, len(titles))) for line, row in rows]
    if len(rows) > 1 and len(rows[1][1]) == len(titles) and _number(rows[1][1][0]) is None:
        units = [unit.strip().removeprefix("[").removesuffix("]").strip() for unit in rows.pop(1)[1]]
        titles = [(name, unit or unit_text) for (name, unit), unit_text in zip(titles, units, strict=True)]
    if len(rows) < 2 or _number(titles[0][0]) is not None:
        raise NetlistError(f"{path.name} is not a table: it needs a line of names, and lines of numbers.")
    names = [name for name, _ in titles]
    twice = [name for name, count in Counter(names).items() if count > 1]
    if twice:
        raise NetlistError(f"{path.name}: two columns are called '{twice[0]}'.", advice="Rename one of them.")
    comma = separator != "," and any("," in cell for _, row in rows[1:] for cell in row)
    values = np.array([_numbers(f"{path.name}:{line}", row, len(titles), comma) for line, row in rows[1:]])
    return {name: (column, unit) for (name, unit), column in zip(titles, values.T, strict=True)}


def read_csv(path: Path) -> RecordedSolution:
    """Read trajectories from a table with a column `time`; values with a unit become SI values.

    A repeated time gives the values before and after an event.

    Raises:
        NetlistError: the file cannot be read, or is not such a table.
    """
    columns = read_columns(path)
    if next(iter(columns)) != "time":
        raise NetlistError(f"{path.name}: the first column of a table of trajectories is `time`.")
    values = {name: _in_si(numbers, unit) for name, (numbers, unit) in columns.items()}
    time, unit = values.pop("time")
    if unit not in ("", "s"):
        raise NetlistError(f"{path.name}: '{columns['time'][1]}' is no unit of time.", advice="Write s, ms, min or h.")
    if not np.all(np.isfinite(time)) or np.any(np.diff(time) < 0):
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


def _text(path: Path) -> str:
    """Return the text of a table in the encodings that Excel writes."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise NetlistError(f"{path}: {error.strerror or error}.") from None
    wide = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    for encoding in ("utf-16",) if wide else ("utf-8-sig", "cp1252"):
        try:
            text = data.decode(encoding)
        except UnicodeDecodeError:
            continue
        if "\0" not in text:
            return text
    raise NetlistError(f"{path.name} is not a text: a table is UTF-8, UTF-16 or Windows-1252.")


def _trimmed(row: list[str], least: int) -> list[str]:
    """Return a row without empty cells at its end, which spreadsheets add, behind a number of others."""
    while len(row) > least and not row[-1].strip():
        row = row[:-1]
    return row


def _number(text: str) -> float | None:
    try:
        return float(text.replace(",", "."))
    except ValueError:
        return None


def _numbers(place: str, row: list[str], count: int, comma: bool) -> list[float]:
    """Read a line of numbers; `comma` is whether decimals of this file stand behind commas."""
    if len(row) != count:
        raise NetlistError(f"{place}: {len(row)} values under {count} names.")
    numbers: list[float] = []
    for text in row:
        number = None if ("." if comma else ",") in text else _number(text)
        if number is None:
            advice = "Write numbers without separators of thousands, all with the same decimal mark."
            raise NetlistError(f"{place}: '{text}' is not a number.", advice=advice if {*text} & {*",."} else "")
        numbers.append(number)
    return numbers
