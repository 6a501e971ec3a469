"""Energy balance of drives, as a ratio to their simulation, and how far energies drift in tolerances of the run.

Run with `python benchmarks/energy.py [NETLIST ...]`.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

from modelica_like import build, load, simulate

EXAMPLES = Path(__file__).parents[1] / "examples"
DRIVES = [
    "machine_tool_startup", "msl/rotational/CoupledClutches", "lepelletier_gears", "msl/rotational/Backlash",
    "machine_table_direct",
]  # fmt: skip
ROUNDS = 7


def measure(netlist: Path) -> str:
    """Time both in turns, in CPU time, and take the best of each."""
    model = build(load(netlist))
    runs: list[float] = []
    balances: list[float] = []
    drift = 0.0
    for _ in range(ROUNDS):
        begin = time.process_time()
        run = simulate(model)
        ran = time.process_time()
        balance = run.energy()
        runs.append(ran - begin)
        balances.append(time.process_time() - ran)
        drift = balance.drift / run.options.rtol
    share = min(balances) / min(runs)
    return (
        f"{netlist.stem:22} simulation {min(runs) * 1e3:6.1f} ms, energies {min(balances) * 1e3:6.1f} ms = {share:.2f} "
        f"of it, first {balances[0] * 1e3:6.1f} ms; drift {drift:.2g} x rtol"
    )


if __name__ == "__main__":
    for path in map(Path, sys.argv[1:] or [EXAMPLES / f"{name}.toml" for name in DRIVES]):
        print(measure(path))
