"""Trajectories from any source: simulate a netlist, run FMUs, read a table."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from modelica_like.errors import NetlistError, UnitError
from modelica_like.fmi.cosimulation.files import describes_system
from modelica_like.fmi.cosimulation.run import cosim
from modelica_like.fmi.run import run_fmu
from modelica_like.netlist import load
from modelica_like.netlist.read import assign, is_modelica
from modelica_like.runs.measured import read_csv
from modelica_like.runs.trajectories import Trajectories
from modelica_like.simulation import simulate

_POINTS = 500


def trajectories(
    source: str | Path | Trajectories, until: float | None = None, points: int = _POINTS,
    tolerance: float | None = None, values: Mapping[str, Any] | None = None, option: str = "",
) -> Trajectories:  # fmt: skip
    """Return the trajectories of a netlist, an FMU, a system of FMUs or a CSV file; a solution is returned unchanged.

    Args:
        source: a file that ends in `.toml`, `.mo`, `.fmu`, `.ssp` or `.csv`; of a text also `drives.mo:Package.Class`.
        until: end time of the run in s; by default that of the source.
        points: number of equal intervals of its results; a system has results at its communication points.
        tolerance: relative tolerance of its run; for a system, of its FMUs.
        values: to set in a netlist by path, or parameters of an FMU: numbers in its units. Tables and solutions stay.
        option: of the command line that gave the values, which messages name as their place.

    Raises:
        NetlistError: the file is none of these, or the table is not one.
        ModelicaLikeError: the run fails.
        OSError: the FMU or system cannot be read.
    """
    if isinstance(source, Trajectories):
        return source
    path = Path(source)
    kind = path.suffix.lower()
    if kind == ".fmu":
        texts = [f"{name} = {value!r}" for name, value in (values or {}).items() if isinstance(value, str)]
        if texts:
            raise UnitError(f"The FMU '{path.name}' cannot be given {texts[0]}.", advice="Give a number in its unit.")
        return run_fmu(path, parameters=values, stop=until, points=points, tolerance=tolerance)
    if kind == ".csv":
        return read_csv(path)
    text = is_modelica(path)
    if not text and kind not in (".toml", ".ssp"):
        raise NetlistError(
            f"'{path.name}' has no trajectories.",
            advice="Netlists and systems of FMUs (.toml), Modelica texts (.mo), FMUs (.fmu), SSPs (.ssp) and "
            "tables (.csv) have.",
        )
    if not text and describes_system(path):
        if values:
            raise NetlistError(f"No values can be set in the system '{path.name}'.", advice="Change the file.")
        return cosim(path, until, fmu_tolerance=tolerance)
    drive = load(path)
    assign(drive, values or {}, option)
    return simulate(drive, until, points=points, rtol=tolerance)
