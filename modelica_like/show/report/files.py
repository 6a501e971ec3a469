"""Results as files; the ending of the name chooses the format."""

from __future__ import annotations

import csv
import sys
from collections.abc import Callable, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

import numpy as np

from modelica_like.errors import NetlistError, missing_extra
from modelica_like.runs.display import Display
from modelica_like.runs.signals import Signal, evaluated, named, read_signals
from modelica_like.runs.trajectories import Trajectories
from modelica_like.writing import check_writable, replacing

if TYPE_CHECKING:
    import pandas
    import xarray

STDOUT = Path("-")
"""The name of standard output."""
_NEEDED = {".csv": (), ".parquet": (("pyarrow", "parquet"),), ".nc": (("scipy", "analyse"), ("xarray", "data"))}
"""Endings of tables, with the packages that write them and their extras."""


def check_table(path: Path) -> None:
    """Raise an error before a run if a table cannot be written.

    Raises:
        NetlistError: no table has this ending.
        MissingExtra: a package that writes it is not installed.
        OSError: it cannot be written there.
    """
    if path == STDOUT:
        return
    if path.suffix.lower() not in _NEEDED:
        raise NetlistError(
            f"'{path.name}': a table can be {', '.join(_NEEDED)}.", advice="`-` is standard output, as .csv."
        )
    for package, extra in _NEEDED[path.suffix.lower()]:
        if find_spec(package) is None:
            raise missing_extra(package, extra)
    check_writable(path)


def write_solution(
    solution: Trajectories, path: Path, *, units: bool = False, display: Mapping[str, str] | None = None,
    show: Sequence[str] = (),
) -> None:  # fmt: skip
    """Write all trajectories as a table; the ending chooses the format.

    A repeated time gives the values before and after an event.

    Args:
        solution: the run.
        path: `.csv` (first column `time`, then one column per variable, modes as numbers, with enough digits to
            read back the same numbers), `.parquet` or `.nc` (netCDF); `-` is standard output.
        units: write a second header line with the units into a .csv; its values are then in the units of the
            netlist's [display]. A netCDF file always has units, and is always in SI units.
        display: units by path, pattern or quantity, in addition to those of the netlist, such as {"speed": "rpm"}.
        show: formulas in it (`2*pi*motor.w`) become further columns; all variables are columns anyway.

    Raises:
        NetlistError: no table has this ending.
        UnknownName, UnitError: a variable cannot be shown in a unit.
        OSError: the file cannot be written.
    """
    more = [signal for signal in read_signals(solution.model, show) if not signal.plain]
    columns = {column.name: column.values(solution) for column in more}

    def dataset() -> xarray.Dataset:
        named = {column.name: ("time", columns[column.name], {"units": column.unit}) for column in more}
        return solution.to_xarray().assign(named)

    _write(
        path, lambda file: _rows(solution, file, display or {}, more, units=units),
        lambda: solution.to_pandas().assign(**columns), dataset,
    )  # fmt: skip


def write_dataset(dataset: xarray.Dataset, path: Path) -> None:
    """Write a sweep as a table, one row per run, or as netCDF; see `write_solution`.

    Raises:
        NetlistError: no table has this ending.
        OSError: the file cannot be written.
    """
    _write(path, lambda file: dataset.to_dataframe().to_csv(file), dataset.to_dataframe, lambda: dataset)


def _write(
    path: Path, rows: Callable[[TextIO], None], frame: Callable[[], pandas.DataFrame],
    dataset: Callable[[], xarray.Dataset],
) -> None:  # fmt: skip
    check_table(path)
    if path == STDOUT:
        rows(sys.stdout)
        return
    with replacing(path) as draft:
        match path.suffix.lower():
            case ".parquet":
                frame().to_parquet(draft)
            case ".nc":
                dataset().to_netcdf(draft, engine="scipy")
            case _:
                with draft.open("w", newline="", encoding="utf-8") as file:
                    rows(file)


def _rows(
    solution: Trajectories, file: TextIO, display: Mapping[str, str], more: Sequence[Signal], *, units: bool
) -> None:
    signals = [*named(solution.model, solution.names), *more]
    values, shown = evaluated(solution, signals), Display(solution.model, display)
    spelled = [signal.shown_in(shown) if units else signal.unit for signal in signals]
    columns = [shown.converted(values[s.name], s.unit, unit) for s, unit in zip(signals, spelled, strict=True)]
    columns.insert(0, solution.time)
    writer = csv.writer(file)
    writer.writerow(["time", *(signal.name for signal in signals)])
    if units:
        writer.writerow(["s", *spelled])
    for row in np.column_stack(columns).tolist():
        writer.writerow(map(repr, row))
