"""What is chosen from few: whole numbers, words, rows of a table."""

from __future__ import annotations

import copy
import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from modelica_like.errors import ModelicaLikeError, NetlistError, Source, ValueOutOfRange
from modelica_like.language import Assembly, Component
from modelica_like.language.inside import inside

ENUMERATED = 200
"""Combinations: each is an optimisation of its own."""


@dataclass(frozen=True)
class Choice:
    """One combination.

    Attributes:
        labels: what was chosen by path, as shown.
        values: what that means for the drive, by path.
        places: where values come from a table, by path.
    """

    labels: Mapping[str, Any]
    values: Mapping[str, Any]
    places: Mapping[str, Source] = field(default_factory=dict[str, Source])


def options_of(drive: Component, choose: Mapping[str, Any]) -> list[list[Choice]]:
    """Return what there is to choose from, by path.

    Args:
        drive: a component; tables are looked for beside its netlist.
        choose: values by path of a parameter, or by name of a part the file of a table: a row for each kind, a column
            for each parameter of the part, and `name`.

    Raises:
        NetlistError: a table cannot be read.
        ValueOutOfRange: there is nothing to choose from.
    """
    for path, given in choose.items():
        if not isinstance(given, str | list | tuple) or not given:
            raise ValueOutOfRange(
                f"choose: {path} needs a list of values or the name of a table, not {given!r}.",
                advice='Write {"clutch.plates": [2, 4, 6]}, or {"motor": "motors.csv"}.',
            )
    folder = Path(inside(drive).origin).parent if isinstance(drive, Assembly) else Path()
    return [
        _rows(path, folder / given) if isinstance(given, str) else [Choice({path: v}, {path: v}) for v in given]
        for path, given in choose.items()
    ]


def together(several: Sequence[Choice]) -> Choice:
    """Return what is chosen from each list as one choice."""
    return Choice(
        {path: label for choice in several for path, label in choice.labels.items()},
        {path: value for choice in several for path, value in choice.values.items()},
        {path: place for choice in several for path, place in choice.places.items()},
    )


def with_choice(drive: Component, choice: Choice) -> Component:
    """Return a copy of a drive with what is chosen.

    Raises:
        ModelicaLikeError: the drive has no such parameter, or it cannot have such a value.
    """
    drive = copy.deepcopy(drive)
    for path, value in choice.values.items():
        try:
            drive.set(path, value)
        except ModelicaLikeError as error:
            error.where = (choice.places[path],) if path in choice.places else ()
            raise
    return drive


def _rows(path: str, file: Path) -> list[Choice]:
    if not file.is_file():
        raise NetlistError(
            f"choose: the table '{file.name}' for {path} does not exist.",
            advice="Its place is beside the netlist; write a list for values of one parameter.",
        )
    try:
        with file.open(newline="", encoding="utf-8-sig") as stream:
            head, *rows = [row for row in csv.reader(stream) if any(cell.strip() for cell in row)] or [[]]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        why = error.strerror if isinstance(error, OSError) else error
        raise NetlistError(f"choose: '{file.name}' cannot be read: {why}.", where=Source(str(file))) from None
    head = [name.strip() for name in head]
    columns = [k for k, name in enumerate(head) if name != "name"]
    if not rows or not columns:
        raise NetlistError(
            f"choose: '{file.name}' has no {'row' if columns else 'column of a parameter'}.", where=Source(str(file)),
            advice=f"Its first line names parameters of {path}, and each further line is a kind of it.",
        )  # fmt: skip
    return [_row(path, file, head, columns, number, row) for number, row in enumerate(rows, 2)]


def _row(path: str, file: Path, head: Sequence[str], columns: Sequence[int], number: int, row: Sequence[str]) -> Choice:
    if len(row) != len(head):
        raise NetlistError(
            f"choose: a line of '{file.name}' has {len(row)} cells, its first line {len(head)}.",
            where=Source(str(file), number, ",".join(row)),
        )
    label = row[head.index("name")].strip() if "name" in head else f"row {number - 1}"
    place = Source(str(file), number, ",".join(row))
    values = {f"{path}.{head[k]}": _cell(row[k].strip()) for k in columns}
    return Choice({path: label}, values, dict.fromkeys(values, place))


def _cell(text: str) -> Any:
    try:
        return float(text)
    except ValueError:
        return text
