"""Sweeps of documents 000 and 003: runs per second by the compiled run-time and by IDAS.

Run with `python benchmarks/sweep.py [RUNS]`. Comparisons with IDAS are included. Per second of CPU is per core; what a
second core brings is measured in the same round. `python benchmarks/sweep.py 1000000 FOLDER` does document 000 only,
with a checkpoint in that folder, and says what it took.
"""

from __future__ import annotations

import os
import resource
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from modelica_like import build
from modelica_like.analyse.sweeps.sweep import sweep

EXAMPLES = Path(__file__).parents[1] / "examples"
ROUNDS = 3
DRIVES: Mapping[str, tuple[Mapping[str, tuple[float, float]], Sequence[str], float]] = {
    "machine_table_geared": (
        {"table_mass": (300.0, 700.0), "load_torque": (10.0, 20.0)}, ["table.s", "clutch.lock_time"], 1.0,
    ),
    "machine_tool_startup": (
        {"h1": (1.0, 10.0), "k1": (5000.0, 7000.0)}, ["max(shaft1.tau)", "clutch.lock_time", "clutch.loss_energy"], 0.1,
    ),
}  # fmt: skip
"""What is varied, what is read, and how many runs for one of document 000."""


def timed(name: str, runs: float, solver: Any, processes: int, **how: Any) -> tuple[float, float]:
    """Runs per second of wall and per second of this process's CPU."""
    ranges, outputs, share = DRIVES[name]
    side = max(round((runs * share) ** 0.5), 2)
    over = {path: np.linspace(*bounds, side) for path, bounds in ranges.items()}
    model = build(EXAMPLES / f"{name}.toml", free=over)
    begin, cpu = time.perf_counter(), time.process_time()
    found = sweep(model, over, outputs, processes=processes, solver=solver, **how)
    wall, cpu = time.perf_counter() - begin, time.process_time() - cpu
    assert not np.any(found["failure"].to_numpy() != "")
    assert not found.attrs["notice"], found.attrs["notice"]
    return side**2 / wall, side**2 / cpu


def compare(name: str, runs: int) -> None:
    """Print what both solvers do."""
    # In turns, so that what else the machine does meets all.
    rounds = [
        (
            timed(name, runs, "native", 1), timed(name, runs, "native", 2),
            timed(name, runs, "native", 1, compiled=True), timed(name, runs / 25, "idas", 1),
        )
        for _ in range(ROUNDS)
    ]  # fmt: skip
    best = [tuple(max(one[k][n] for one in rounds) for n in (0, 1)) for k in range(4)]
    scaling = ", ".join(f"{two[0] / one[0]:.2f}" for one, two, *_ in rounds)
    kinds = "native, one thread", "native, two threads", "native, machine code", "IDAS, one process"
    print(f"{name}, best of {ROUNDS}; load of the machine {os.getloadavg()[0]:.1f}")
    for text, (wall, cpu) in zip(kinds, best, strict=True):
        print(f"  {text:20}{wall:9.0f} runs/s of wall {cpu:9.0f} runs/s of CPU")
    print(f"  two threads for one in each round: {scaling}")


def main(runs: int, folder: str = "") -> None:
    """Print tables, or what one large sweep took."""
    if folder:
        wall, cpu = timed("machine_table_geared", runs, "native", 2, checkpoint=folder)
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(f"{runs} runs in {runs / wall:.0f} s ({runs / cpu:.0f} s of CPU), at most {memory:.0f} MB")
        return
    for name in DRIVES:
        compare(name, runs)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 10_000, *sys.argv[2:3])
