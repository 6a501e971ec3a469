"""Loads from simulations; a sizing file takes them by `{ from = "drive.toml", peak = "clutch.tau" }`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from modelica_like.errors import NetlistError, UnknownName, did_you_mean
from modelica_like.sizing.formulas import Value
from modelica_like.units import parse_unit

if TYPE_CHECKING:
    from modelica_like.solve.solution import Solution
    from modelica_like.solve.trajectories import Trajectories

Vector = NDArray[np.float64]
_Reader = Callable[[Vector, Vector], float]


def _integral(times: Vector, values: Vector) -> float:
    return float(np.sum(np.diff(times) * (values[1:] + values[:-1]) / 2))


def _mean(times: Vector, values: Vector) -> float:
    return _integral(times, values) / float(times[-1] - times[0])


READERS: dict[str, _Reader] = {
    "peak": lambda times, values: float(np.max(np.abs(values))),
    "largest": lambda times, values: float(np.max(values)),
    "smallest": lambda times, values: float(np.min(values)),
    "final": lambda times, values: float(values[-1]),
    "mean": _mean,
    "rms": lambda times, values: _mean(times, values**2) ** 0.5,
    "integral": _integral,
}
"""Readings of a trajectory: `peak` is the largest absolute value."""


_KEYS = ("from", "until", "set", *READERS)
_POWERS = {"stored_energy": "J", "loss_power": "W", "source_power": "W"}


def load_of(run: Trajectories, key: Any, what: str = "peak") -> float:
    """Return one number of a trajectory, as the load of a design check.

    Args:
        run: the simulation.
        key: path of the variable, or `drive.clutch.tau`.
        what: `peak` (largest absolute value), `largest`, `smallest`, `final`, `mean`, `rms` or `integral` over time.

    Raises:
        UnknownName: there is no such variable or reading.
    """
    if what not in READERS:
        raise UnknownName(f"A load cannot be the '{what}' of a trajectory{did_you_mean(what, READERS) or '.'} "
                          f"It can be {', '.join(READERS)}.")  # fmt: skip
    return READERS[what](run.time, np.asarray(run[key], dtype=float))


class Simulations:
    """Runs of netlists with paths relative to a folder; every run is made once, but for those that are known."""

    def __init__(self, folder: Path, known: Mapping[Path, Solution] | None = None) -> None:
        self.folder = folder
        self.known = known or {}
        self.runs: dict[str, Solution] = {}

    def load(self, table: Mapping[str, Any], where: str) -> Value:
        """Return the load of a table with `from`, a reading (`peak = "clutch.tau"`), `until` and `set`."""
        for key in table:
            if key not in _KEYS:
                hint = did_you_mean(key, _KEYS) or "."
                raise UnknownName(f"A load of a simulation has no '{key}'{hint} It has {', '.join(_KEYS)}.")
        wanted = [key for key in table if key in READERS]
        if len(wanted) != 1 or not isinstance(table.get("from"), str) or not isinstance(table[wanted[0]], str):
            raise NetlistError(
                f"{where} must be a value, or name a netlist and one variable of it.",
                advice='Write { from = "drive.toml", peak = "clutch.tau" }.',
            )
        run, path = self._run(table), table[wanted[0]]
        unit = parse_unit(_POWERS.get(path.rpartition(".")[2]) or self._unit(run, path))
        return Value(load_of(run, path, wanted[0]), unit * parse_unit("s") if wanted[0] == "integral" else unit)

    def _unit(self, run: Solution, path: str) -> str:
        if path not in run.names:
            raise UnknownName(f"{run.model.name} has no variable '{path}'{did_you_mean(path, run.names) or '.'}")
        return run.unit_of(path)

    def _run(self, table: Mapping[str, Any]) -> Solution:
        values = table.get("set", {})
        if not isinstance(values, dict):
            raise NetlistError('`set` of a load must be a table: { "clutch.mu" = 0.3 }.')
        known = self.known.get((self.folder / table["from"]).resolve())
        if known is not None and not values and "until" not in table:
            return known
        key = f"{table['from']} {table.get('until')} {sorted(values.items())}"
        if key not in self.runs:
            from modelica_like.netlist import load
            from modelica_like.simulation import simulate

            drive = load(self.folder / table["from"])
            for path, value in values.items():
                drive.set(path, value)
            self.runs[key] = simulate(drive, table.get("until"))
        return self.runs[key]
