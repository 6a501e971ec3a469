"""What runs and steps by the compiled run-time take: python benchmarks/native.py.

CPU time of one warm run with 500 results and 10 outputs, the best of several, by `build(drive).native()`, with its
equations compiled and without, and by `simulate(…, solver="native")`; and steps per second of machine_tool_startup
under a controller in Python.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from modelica_like import build, simulate
from modelica_like.compile.compiled import CompiledDae
from modelica_like.simulation import seconds

ROOT = Path(__file__).parents[1]
DRIVES = {
    "machine_table_direct": (ROOT / "examples/machine_table_direct.toml", 0.3),
    "CoupledClutches": (ROOT / "examples/msl/rotational/CoupledClutches.toml", 4.0),
    "machine_tool_startup": (ROOT / "examples/machine_tool_startup.toml", 8.0),
    "lepelletier": (ROOT / "examples/lepelletier.toml", 2.5),
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


def whole_run(model: CompiledDae, *, compiled: bool = False) -> Callable[[], object]:
    """Return a run by the handle with 500 results and 10 outputs."""
    end, paths = seconds(model.settings["until"]), [one.path for one in model.flat_variables]
    handle = model.native(outputs=paths[:: len(paths) // 10][:10], compiled=compiled)

    def run() -> None:
        handle.reset(until=end)
        handle.run(end, 500)

    return run


def control_loop(model: CompiledDae) -> Callable[[], object]:
    """Return a thousand steps of 1 ms in which a controller in Python moves the force on the clutch."""
    handle = model.native(inputs=["force"], outputs=["J3.w"])
    force = model.p[model.parameter_position["force"]]

    def run() -> None:
        handle.reset(until=1.0)
        for k in range(1, 1001):
            handle.inputs[0] = force * (1.0 + 0.01 * (20.0 - handle.outputs[0]))
            handle.step(1e-3 * k)

    return run


def main() -> None:
    """Print a table."""
    print(f"{'':24}{'handle':>10}{'goal':>8}{'compiled':>10}{'ratio':>8}{'simulate':>10}{'IDAS':>10}   ms")
    for name, (path, goal) in DRIVES.items():
        model = build(path)
        handles = whole_run(model), whole_run(model, compiled=True)
        runs = *handles, lambda m=model: simulate(m, solver="native"), lambda m=model: simulate(m)
        tapes, code, second, third = (1e3 * best(run) for run in runs)
        print(f"{name:24}{tapes:10.3f}{goal:8.1f}{code:10.3f}{tapes / code:8.1f}{second:10.2f}{third:10.1f}")
    steps = 1000 / best(control_loop(build(DRIVES["machine_tool_startup"][0])))
    print(f"machine_tool_startup in steps of 1 ms, controller in Python: {steps:.0f} steps/s (goal 20000)")


if __name__ == "__main__":
    main()
