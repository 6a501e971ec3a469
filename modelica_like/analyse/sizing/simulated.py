"""Loads from simulations; a sizing file takes them by `{ from = "drive.toml", peak = "clutch.tau" }`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from modelica_like.analyse.sizing.formulas import Value
from modelica_like.errors import NetlistError, unknown_name
from modelica_like.language.units import parse_unit
from modelica_like.runs.readings import read_output

if TYPE_CHECKING:
    from modelica_like.runs.solution import Solution

READERS = {
    "peak": "peak({})", "largest": "max({})", "smallest": "min({})", "final": "{}", "mean": "mean({})",
    "rms": "rms({})", "integral": "integral({})", "reading": "{}",
}  # fmt: skip
"""Readings of a variable: `peak` is the largest absolute value; `reading` is the name of any other one."""
_KEYS = ("from", "until", "set", *READERS)


def load_of(run: Solution, key: Any, what: str = "peak") -> float:
    """Return one number of a run, as the load of a design check.

    Args:
        run: the simulation.
        key: path of the variable, a formula, or `drive.clutch.tau`.
        what: `peak` (largest absolute value), `largest`, `smallest`, `final`, `mean`, `rms` or `integral` over time,
            or `reading`: the key is one.

    Raises:
        UnknownName: there is no such variable or reading.
        MissingValue: the run has not kept what happens between its results.
    """
    return float(run.read(_name(key if isinstance(key, str) else run.path(key), what))[0])


def name_of_load(table: Mapping[str, Any]) -> str:
    """Return the reading that a table with one of `READERS` takes."""
    what = next(key for key in table if key in READERS)
    return _name(table[what], what)


def _name(path: str, what: str) -> str:
    if what not in READERS:
        raise unknown_name(
            f"A load cannot be the '{what}' of a trajectory", what, READERS, f" It can be {', '.join(READERS)}."
        )
    return READERS[what].format(path)


class Simulations:
    """Runs of netlists with paths relative to a folder; every run is made once, but for those that are known."""

    def __init__(self, folder: Path, solutions: Mapping[Path, Solution] | None = None) -> None:
        self.folder = folder
        self.known = solutions or {}
        self.runs: dict[str, Solution] = {}

    def load(self, table: Mapping[str, Any], where: str) -> Value:
        """Return the load of a table with `from`, a reading (`peak = "clutch.tau"`), `until` and `set`."""
        for key in table:
            if key not in _KEYS:
                raise unknown_name(f"A load of a simulation has no '{key}'", key, _KEYS, f" It has {', '.join(_KEYS)}.")
        wanted = [key for key in table if key in READERS]
        if len(wanted) != 1 or not isinstance(table.get("from"), str) or not isinstance(table[wanted[0]], str):
            raise NetlistError(
                f"{where} must be a value, or name a netlist and one variable of it.",
                advice='Write { from = "drive.toml", peak = "clutch.tau" }.',
            )
        name = name_of_load(table)
        run = self._run(table, name)
        unit = parse_unit(str(read_output(run.model, name).unit))
        return Value(float(run.read(name)[0]), unit)

    def _run(self, table: Mapping[str, Any], name: str) -> Solution:
        values = table.get("set", {})
        if not isinstance(values, dict):
            raise NetlistError('`set` of a load must be a table: { "clutch.mu" = 0.3 }.')
        solution = self.known.get((self.folder / table["from"]).resolve())
        if solution is not None and not values and "until" not in table:
            return solution
        key = f"{table['from']} {table.get('until')} {sorted(values.items())}"
        if key not in self.runs:
            from modelica_like.netlist import load
            from modelica_like.simulation import quick_run

            drive = load(self.folder / table["from"])
            for path, value in values.items():
                drive.set(path, value)
            self.runs[key] = quick_run(drive, table.get("until"), readings=[name])
        return self.runs[key]
