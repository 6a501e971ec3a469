"""Loads from simulations: what a run puts on a machine element."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from modelica_like.errors import UnknownName, did_you_mean

if TYPE_CHECKING:
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
"""What can be taken from a trajectory: `peak` is the largest absolute value."""


def load_of(run: Trajectories, key: Any, what: str = "peak") -> float:
    """Return one number of a trajectory, as the load of a design check.

    Args:
        run: the simulation.
        key: path of the variable, or `drive.clutch.tau`.
        what: `peak` (largest absolute value), `largest`, `smallest`, `final`, `mean`, `rms` or `integral` over time.

    Raises:
        UnknownName: there is no such variable, or it cannot be read in this way.
    """
    if what not in READERS:
        raise UnknownName(f"A load cannot be the '{what}' of a trajectory{did_you_mean(what, READERS) or '.'} "
                          f"It can be {', '.join(READERS)}.")  # fmt: skip
    return READERS[what](run.time, np.asarray(run[key], dtype=float))
