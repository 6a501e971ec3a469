"""Trajectories from any source: simulate a netlist, run FMUs, read a table."""

from __future__ import annotations

from pathlib import Path

from modelica_like.cosimulation.files import describes_system
from modelica_like.cosimulation.run import cosim
from modelica_like.errors import NetlistError
from modelica_like.fmi.run import run_fmu
from modelica_like.simulation import build, simulate
from modelica_like.solve.measured import read_csv
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
