"""What runs and steps by the compiled run-time take: python benchmarks/native.py.

CPU time of one warm run with 500 results and 10 outputs, the best of several, by `build(drive).native()` and by
`simulate(…, solver="native")`; and steps per second of machine_tool_startup under a controller in Python.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from modelica_like import build, simulate
from modelica_like.compile.compiled import CompiledDae

ROOT = Path(__file__).parents[1]
DRIVES = {
    "machine_table_direct": (ROOT / "examples/machine_table_direct.toml", 0.3),
    "CoupledClutches": (ROOT / "examples/msl/rotational/CoupledClutches.toml", 4.0),
    "machine_tool_startup": (ROOT / "examples/machine_tool_startup.toml", 8.0),
    "winch": (ROOT / "tests/system/new_drives/winch.toml", 20.0),
}
"""Netlists, and goals in ms."""


def best(run: Callable[[], object], seconds: float = 2.0) -> float:
    """Return the least CPU time in s of several calls."""
    run()
    found, until = float("inf"), time.process_time() + seconds
    while time.process_time() < until:
        begin = time.process_time()
        run()
        found = min(found, time.process_time() - begin)
    return found


def whole_run(model: CompiledDae) -> float:
    """CPU time in s of a run by the handle."""
    end = float(model.settings["until"]) if not isinstance(model.settings["until"], str) else None
    if end is None:
        from modelica_like.simulation import seconds

        end = seconds(model.settings["until"])
    handle = model.native(outputs=[one.path for one in model.flat_variables[:: len(model.flat_variables) // 10]][:10])

    def run() -> None:
        handle.reset(until=end)
        handle.run(end, 500)

    return best(run)


def main() -> None:
    """Print a table."""
    print(f"{'':24}{'handle':>10}{'goal':>8}{'simulate':>10}{'IDAS':>10}   ms")
    for name, (path, goal) in DRIVES.items():
        model = build(path)
        times = whole_run(model), best(lambda m=model: simulate(m, solver="native")), best(lambda m=model: simulate(m))
        first, second, third = (1e3 * one for one in times)
        print(f"{name:24}{first:10.2f}{goal:8.1f}{second:10.2f}{third:10.1f}")


if __name__ == "__main__":
    main()
