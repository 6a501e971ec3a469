"""A sweep of document 000: runs per second and core, and what a second core brings.

Run with `python benchmarks/sweep.py [RUNS]`. Ratios are measured in the same run; the baseline are bare
calls of CasADi's IDAS on the hand-written equations, without events.
"""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

import casadi as ca
import numpy as np

from modelica_like import CompiledDae, build
from modelica_like.analyse.sweeps.sweep import sweep

NETLIST = Path(__file__).parents[1] / "examples" / "machine_table_geared.toml"
ROUNDS = 3
OUTPUTS = ["table.s", "clutch.lock_time"]


def timed(model: CompiledDae, runs: int, processes: int) -> tuple[float, float]:
    """Seconds of wall and of this process's CPU per run of a sweep."""
    side = round(runs**0.5)
    over = {"table_mass": np.linspace(300.0, 700.0, side), "load_torque": np.linspace(10.0, 20.0, side)}
    begin, cpu = time.perf_counter(), time.process_time()
    found = sweep(model, over, OUTPUTS, processes=processes, chunk=100)
    wall, cpu = time.perf_counter() - begin, time.process_time() - cpu
    assert not np.any(found["failure"].to_numpy() != "")
    return wall / side**2, cpu / side**2


def bare(runs: int) -> float:
    """Seconds of CPU of one bare IDAS call: two inertias, one accelerated by a slipping clutch."""
    w, p = ca.SX.sym("w", 2), ca.SX.sym("p", 2)
    ode = ca.vertcat(0, (p[0] - p[1]) / 0.05)
    call = ca.integrator("bare", "idas", {"x": w, "p": p, "ode": ode}, 0, np.linspace(0.004, 0.2, 50).tolist())
    begin = time.process_time()
    for k in range(runs):
        call(x0=[150.0, 0.0], p=[20.0 + 1e-3 * k, 15.0])
    return (time.process_time() - begin) / runs


def main(runs: int) -> None:
    model = build(NETLIST)
    timed(model, 100, 1)
    base = bare(500)
    # In turns, so that what else the machine does meets both.
    rounds = [(timed(model, runs, 1), timed(model, runs, 2)) for _ in range(ROUNDS)]
    cpu = min(one[1] for one, _ in rounds)
    walls = [min(each[k][0] for each in rounds) for k in (0, 1)]
    ratios = ", ".join(f"{one[0] / two[0]:.2f}" for one, two in rounds)
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")
    print(f"{ROUNDS} x {runs} runs, load of the machine {load:.1f}; bare IDAS call {base * 1e3:.2f} ms of CPU")
    print(f"one core      {1 / cpu:6.0f} runs/s of CPU, {1 / walls[0]:.0f} of wall; {cpu / base:.1f} x the bare call")
    print(
        f"two processes {1 / walls[1]:6.0f} runs/s of wall, {walls[0] / walls[1]:.2f} x one process "
        f"(each round: {ratios}; start of processes included)"
    )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 10_000)
