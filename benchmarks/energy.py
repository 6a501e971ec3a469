"""Energy balance of drives and the judgement of their energies, as ratios to their simulation without it.

Run with `python benchmarks/energy.py [NETLIST ...]`.
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

from modelica_like import build, load, simulate
from modelica_like.runs.conserve import find_astray

EXAMPLES = Path(__file__).parents[1] / "examples"
DRIVES = [
    "machine_tool_startup", "msl/rotational/CoupledClutches", "lepelletier_gears", "msl/rotational/Backlash",
    "machine_table_direct", "msl/translational/PreLoad", "winch",
]  # fmt: skip
ROUNDS = 5


def measure(netlist: Path) -> str:
    """Time all in turns, in CPU time, and take the best of each; `simulate` judges every run."""
    model, told = build(load(netlist)), list[str]()
    for solver in ("idas", "native"):
        runs, judgements, balances, drift = list[float](), list[float](), list[float](), 0.0
        for _ in range(ROUNDS):
            times = [time.process_time()]
            run = simulate(model, solver=solver)
            times.append(time.process_time())
            find_astray(replace(run))  # a copy, in which nothing is kept yet
            times.append(time.process_time())
            balance = run.energy()
            times.append(time.process_time())
            whole, judged, balanced = (end - begin for begin, end in pairwise(times))
            runs.append(whole)
            judgements.append(judged)
            balances.append(balanced)
            drift = balance.drift / run.options.rtol
        judged = min(judgements)
        plain = max(min(runs) - judged, 1e-9)
        told.append(
            f"{netlist.stem:22} {solver:6} run {plain * 1e3:6.1f} ms, judged {judged * 1e3:6.1f} ms = "
            f"{judged / plain:5.2f} of it, balance {min(balances) * 1e3:6.1f} ms; drift {drift:.2g} x rtol"
        )
    return "\n".join(told)


if __name__ == "__main__":
    for path in map(Path, sys.argv[1:] or [EXAMPLES / f"{name}.toml" for name in DRIVES]):
        print(measure(path))
