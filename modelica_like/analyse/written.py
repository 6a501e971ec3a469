"""What a netlist says about its own analysis, and where."""

from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import ModelicaLikeError
from modelica_like.language import Assembly, Component


@contextmanager
def placed(drive: Component | CompiledDae, key: str) -> Iterator[None]:
    """Add the line of a section's entry, such as `optimize.free`, to an error without a place."""
    try:
        yield
    except ModelicaLikeError as error:
        source = drive.source_of(key) if isinstance(drive, Assembly) else None
        error.where = error.where or ((source,) if source is not None and source.file else ())
        raise


def with_values(drive: Assembly, values: Mapping[str, float | str]) -> Assembly:
    """Return a copy of a drive with other values of parameters, and numbers in cells of tables, `coil.table[3,2]`."""
    drive = copy.deepcopy(drive)
    parts = {part.path: part for part in drive.walk()}
    tables: dict[str, Any] = {}
    for name, value in values.items():
        table, bracket, place = name.rpartition("[")
        if bracket and "," in place:
            owner, _, last = table.rpartition(".")
            rows = tables.setdefault(table, [list(row) for row in getattr(parts[owner], last)])
            row, column = map(int, place.rstrip("]").split(","))
            rows[row - 1][column - 1] = value
        else:
            drive.set(name, value)
    for table, rows in tables.items():
        drive.set(table, rows)
    return drive
