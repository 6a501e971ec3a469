"""Trajectories from any source: simulate a netlist, run FMUs, read a table."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from modelica_like.cosimulation.files import describes_system
from modelica_like.cosimulation.run import cosim
from modelica_like.errors import NetlistError
from modelica_like.fmi.run import run_fmu
from modelica_like.simulation import build, simulate
from modelica_like.solve.recorded import RecordedModel, RecordedSolution, RecordedVariable
from modelica_like.solve.trajectories import Trajectories

_POINTS = 500


def trajectories(
    source: str | Path | Trajectories, until: float | None = None, points: int = _POINTS, tolerance: float | None = None
) -> Trajectories:
    """Return the trajectories of a netlist, an FMU, a system of FMUs or a CSV file; a solution is returned unchanged.

    Args:
        source: a file that ends in `.toml`, `.fmu`, `.ssp` or `.csv`.
        until: end time of the run in s; by default that of the source.
        points: number of equal intervals of its results; a system has results at its communication points.
        tolerance: relative tolerance of its run; for a system, of its FMUs.

    Raises:
        NetlistError: the file is none of these, or the table is not one.
        ModelicaLikeError: the run fails.
        OSError: the file cannot be read.
    """
    if isinstance(source, Trajectories):
        return source
    path = Path(source)
    kind = path.suffix.lower()
    if kind == ".fmu":
        return run_fmu(path, stop=until, points=points, tolerance=tolerance)
    if kind == ".csv":
        return read_csv(path)
    if kind not in (".toml", ".ssp"):
        raise NetlistError(
            f"'{path.name}' has no trajectories.",
            advice="Netlists and systems of FMUs (.toml), FMUs (.fmu), SSPs (.ssp) and tables (.csv) have.",
        )
    if describes_system(path):
        return cosim(path, until, fmu_tolerance=tolerance)
    return simulate(build(path), until, points=points, rtol=tolerance)


def read_csv(path: Path) -> RecordedSolution:
    """Read a table with the first column `time` in s; a second header line with units may follow the names.

    A repeated time gives the values before and after an event.

    Raises:
        NetlistError: the file is not such a table.
        OSError: the file cannot be read.
    """
    with path.open(newline="", encoding="utf-8-sig") as file:
        rows = [row for row in csv.reader(file) if row]
    if len(rows) < 2 or rows[0][0].strip().strip('"') != "time":
        raise NetlistError(f"{path.name}: a table must begin with a line of names; the first one is `time`.")
    names = [name.strip() for name in rows[0]]
    units = None if _is_number(rows[1][0]) else rows[1]
    first = 1 if units is None else 2
    values = np.array([_numbers(path.name, k, row, len(names)) for k, row in enumerate(rows[first:], first + 1)])
    if not len(values) or np.any(np.diff(values[:, 0]) < 0):
        raise NetlistError(f"{path.name}: the times must increase.")
    columns = [RecordedVariable(name, unit) for name, unit in zip(names, units or ["1"] * len(names), strict=True)]
    model = RecordedModel(path.stem, tuple(columns[1:]), (), {})
    return RecordedSolution(model, values[:, 0], values[:, 1:].T, np.empty((0, len(values))), 0.0)


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
