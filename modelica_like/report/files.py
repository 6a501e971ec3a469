"""Results as files."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from modelica_like.solve.plot import unit_of
from modelica_like.solve.solution import Solution


def write_csv(solution: Solution, path: Path, *, units: bool = False) -> None:
    """Write all trajectories: first column `time`, then one column per variable, modes as numbers.

    A repeated time is an event's left and right value. Numbers have as many digits as reading them back needs.

    Args:
        solution: the run.
        path: file to write.
        units: write a second header line with the units.

    Raises:
        OSError: the file cannot be written.
    """
    columns = [solution.time, *solution.together(*solution.names).values()]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["time", *solution.names])
        if units:
            writer.writerow(["s", *(unit_of(solution, name) for name in solution.names)])
        for row in np.column_stack(columns).tolist():
            writer.writerow(map(repr, row))
