"""The machine tool of document 003 in two FMUs, against the whole drive: python examples/cosim/machine_tool.py."""

import tempfile
from pathlib import Path

import numpy as np

from modelica_like import cosim, simulate, split

NETLIST = Path(__file__).parents[1] / "machine_tool_startup.toml"


def main() -> tuple[float, float]:
    """Return the largest deviation of the load's speed from the whole drive, and the coupling's energy, in parts."""
    whole = simulate(NETLIST, rtol=1e-8, points=5000)
    with tempfile.TemporaryDirectory() as folder:
        parts = split(NETLIST, "shaft2", folder, names=("drive", "load"))
        run = cosim(parts.path, step="0.2 ms", master="gauss-seidel")
    (shaft,) = run.couplings
    print(run)
    print(shaft)
    deviation = np.abs(run["J4.w"] - np.interp(run.time, whole.time, whole["J4.w"])).max() / np.ptp(whole["J4.w"])
    print(f"The load's speed deviates by {deviation:.1e} of its range from that of the whole drive.")
    return float(deviation), shaft.residual / shaft.throughput


if __name__ == "__main__":
    main()
