"""Reference trajectories of the standard library, and how far a run is from them."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).parent
SHARED = next((up / "shared" for up in HERE.parents if (up / "shared").is_dir()), HERE.parents[2] / "shared")
LIBRARY = SHARED / "modelica_text"
WIDTH = 2e-3
"""Of the tube: a part of a column's range in a window that is as large a part of the run, as the library's own test
has it. The tube is laid around our run, which is dense: references are thinned, and lack values beside jumps."""
SETTLED = {
    ("Modelica.Mechanics.Rotational.Examples.LossyGearDemo1", "gear.mode"): 1e-10,
    ("Modelica.Mechanics.Translational.Examples.PreLoad", "outerContactA.v_rel"): 1e-6,
}
"""Times in s before which a reference is still at its start: a gear that is stuck until 50 ps, a contact that moves at
1 mm/s for 0.2 µs and is then reset."""

STANDING = {
    ("Modelica.Mechanics.Rotational.Examples.LossyGearDemo2", "gear.mode"): "Inertia2.w",
    ("Modelica.Mechanics.Rotational.Examples.LossyGearDemo2", "bearingFriction.mode"): "Inertia2.w",
}
"""Speeds, where modes count only while it is more than `CREEPS`: of two frictions that stick on one shaft, equations
leave open which one slides at ±5e-11 rad/s, as the reference has it, and at less here."""
CREEPS = 1e-9


def references() -> dict[str, Path]:
    """Return the files of trajectories by the name of the class."""
    return {path.stem: path for folder in ("msl", "msl_more") for path in (SHARED / "reference" / folder).glob("*.csv")}


def read_reference(path: Path) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return times and columns."""
    with path.open(encoding="utf-8") as file:
        names = [name.strip().strip('"') for name in _split(file.readline().strip())]
    data = np.loadtxt(path, delimiter=",", skiprows=1, ndmin=2)
    return data[:, 0], {name: data[:, k] for k, name in enumerate(names) if k}


def _split(line: str) -> list[str]:
    """Return the names of a line; a name such as `x[1,2]` has a comma of its own."""
    names, depth = [""], 0
    for letter in line:
        depth += (letter == "[") - (letter == "]")
        if letter == "," and not depth:
            names.append("")
        else:
            names[-1] += letter
    return names


@dataclass
class Comparison:
    """How far a run is from its reference.

    Attributes:
        worst: distance from the tube, in parts of a column's range, by column; 0 inside.
        missing: columns that the run does not have.
    """

    worst: dict[str, float] = field(default_factory=dict)
    missing: list[str] = field(default_factory=list)

    @property
    def right(self) -> bool:
        """Whether all columns are there, and in the tube."""
        return bool(self.worst) and not self.missing and max(self.worst.values()) == 0.0


def compare(name: str, run: Any, times: np.ndarray, columns: dict[str, np.ndarray]) -> Comparison:
    """Compare a run of an example with the columns of its reference: each value of that must be in our tube.

    What the reference has before the events of its first instant, and behind those of its last one, does not count: a
    run has the values behind the first and before the last ones.
    """
    result = Comparison()
    window = WIDTH * (times[-1] - times[0])
    first, last = np.searchsorted(times, times[0], "right") - 1, np.searchsorted(times, times[-1], "left")
    for column, values in columns.items():
        ours = values_of(run, column)
        if ours is None:
            result.missing.append(column)
            continue
        begin = max(first, int(np.searchsorted(times, SETTLED.get((name, column), times[0]))))
        at, wanted = times[begin : last + 1], values[begin : last + 1]
        if (name, column) in STANDING:
            moves = np.abs(columns[STANDING[name, column]][begin : last + 1]) > CREEPS
            at, wanted = at[moves], wanted[moves]
        span = max(float(np.ptp(values)), 1e-6 * float(np.abs(values).max()), 1e-9)
        low, high = _envelope(run.time, ours, at, window)
        distance = float(np.max(np.maximum(low - wanted, wanted - high), initial=0.0)) / span
        result.worst[column] = 0.0 if distance <= WIDTH else distance
    return result


def values_of(run: Any, name: str) -> np.ndarray | None:
    """Return a column of a run by the library's name of it, None if there is none."""
    for path in (name, name.replace(", ", ","), f"{name}_condition"):
        try:
            return np.asarray(run[path], float)
        except KeyError:
            continue
    return None


def _envelope(times: np.ndarray, values: np.ndarray, at: np.ndarray, window: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the least and the largest value of a run in a window around each time."""
    first, last = np.searchsorted(times, at - window, "left"), np.searchsorted(times, at + window, "right")
    edges = np.stack([np.interp(at + shift, times, values) for shift in (-window, 0.0, window)])
    low, high = edges.min(axis=0), edges.max(axis=0)
    for k, (a, b) in enumerate(zip(first, last, strict=True)):
        if b > a:
            low[k], high[k] = min(low[k], values[a:b].min()), max(high[k], values[a:b].max())
    return low, high
