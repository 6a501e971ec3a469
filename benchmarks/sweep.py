"""A sweep of document 000: runs per second and core, and what a second core brings.

Run with `python benchmarks/sweep.py [RUNS]`. Ratios are measured in the same run; the baseline are bare
calls of CasADi's IDAS on the hand-written equations, without events.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import casadi as ca
import numpy as np

from modelica_like import build
from modelica_like.analyse.sweeps.sweep import sweep

NETLIST = Path(__file__).parents[1] / "examples" / "machine_table_geared.toml"
OUTPUTS = ["table.s", "clutch.lock_time"]


def timed(model: object, runs: int, processes: int) -> float:
    """Seconds of a sweep."""
    side = round(runs**0.5)
    over = {"table_mass": np.linspace(300.0, 700.0, side), "load_torque": np.linspace(10.0, 20.0, side)}
    begin = time.perf_counter()
    found = sweep(model, over, OUTPUTS, processes=processes, chunk=100)  # type: ignore[arg-type]
    seconds = time.perf_counter() - begin
    assert not np.any(found["failure"].to_numpy() != "")
    return seconds / side**2


def bare(runs: int) -> float:
    """Seconds of one bare IDAS call: two inertias, one accelerated by a slipping clutch."""
    w, p = ca.SX.sym("w", 2), ca.SX.sym("p", 2)
    ode = ca.vertcat(0, (p[0] - p[1]) / 0.05)
    call = ca.integrator("bare", "idas", {"x": w, "p": p, "ode": ode}, 0, np.linspace(0.004, 0.2, 50).tolist())
    begin = time.perf_counter()
    for k in range(runs):
        call(x0=[150.0, 0.0], p=[20.0 + 1e-3 * k, 15.0])
    return (time.perf_counter() - begin) / runs


def main(runs: int) -> None:
    model = build(NETLIST)
    timed(model, 100, 1)
    one = timed(model, runs, 1)
    two = timed(model, runs, 2)
    base = bare(500)
    print(f"bare IDAS call {base * 1e3:.2f} ms")
    print(f"one process   {1 / one:6.0f} runs/s, {one / base:.1f} x the bare call")
    print(
        f"two processes {1 / two:6.0f} runs/s, {one / two:.2f} x one process ({runs} runs, start of processes included)"
    )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 10_000)
