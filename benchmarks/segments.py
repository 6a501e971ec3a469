"""What events cost: runs against the same smooth segments integrated by one IDAS call each, event times known.

Run with `python benchmarks/segments.py [name …]`. The floor restarts IDAS at every event, too, with as many results as
the run has there, but looks at no guard and searches for nothing. Both in one process, CPU time, best of several.
All calls of compiled functions in a run are then repeated with the same arguments and nothing between: what is left
of the run is Python. The compiled run-time (`solver="native"`) has the same floor: it searches, too.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from modelica_like import Solution, build, simulate
from modelica_like.compile.buffers import BufferedFunction
from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.solve.idas import Grid, Integrator

EXAMPLES = Path(__file__).parent.parent / "examples"
NETLISTS = {
    "CoupledClutches": "msl/rotational/CoupledClutches",
    "direct": "machine_table_direct",
    "003": "machine_tool_startup",
    "Backlash": "msl/rotational/Backlash",
    "LossyGearDemo1": "msl/rotational/LossyGearDemo1",
    "Lepelletier": "lepelletier",
}
RUNS = 9


def best(action: Callable[[], Any]) -> float:
    """Shortest CPU time of several runs in s."""
    times: list[float] = []
    for _ in range(RUNS):
        begin = time.process_time()
        action()
        times.append(time.process_time() - begin)
    return min(times)


def segment_calls(run: Solution) -> Callable[[], None]:
    """Return the floor: one IDAS call for each segment of a run."""
    integrator = Integrator(run.model, run.options)
    pieces = [
        (segment.start, float(segment.times[-1] - segment.times[0]), len(segment.times) - 1)
        for segment in run.segments
        if segment.times[-1] > segment.times[0]
    ]

    def integrate() -> None:
        for start, span, results in pieces:
            integrator.run(start, span, Grid(looks=results))

    return integrate


def compiled_calls(model: CompiledDae) -> tuple[Callable[[], None], int]:
    """Return the calls of compiled functions in a run as an action, and their number."""
    calls: list[tuple[BufferedFunction, list[Any]]] = []
    ordinary = BufferedFunction.__call__

    def recorded(self: BufferedFunction, *arguments: Any) -> list[Vector]:
        calls.append((self, [np.array(one) for one in arguments]))
        return ordinary(self, *arguments)

    BufferedFunction.__call__ = recorded
    try:
        simulate(model)
    finally:
        BufferedFunction.__call__ = ordinary

    def repeat() -> None:
        for function, arguments in calls:
            function(*arguments)

    return repeat, len(calls)


def measure(name: str) -> str:
    model = build(EXAMPLES / f"{NETLISTS[name]}.toml")
    run = simulate(model)
    floor = segment_calls(run)
    floor()
    repeat, count = compiled_calls(model)
    with_events, alone, compiled = best(lambda: simulate(model)), best(floor), best(repeat)
    native = best(lambda: simulate(model, solver="native"))
    return (
        f"{name:16s} {with_events * 1e3:8.2f} ms with {len(run.events):4d} mode changes, "
        f"{run.statistics.integrations:4d} IDAS calls, {run.statistics.steps:6d} steps; "
        f"{len(run.segments):4d} segments alone {alone * 1e3:8.2f} ms; ratio {with_events / alone:5.2f}; "
        f"{count:4d} compiled calls {compiled * 1e3:8.2f} ms; native {native * 1e3:8.2f} ms, "
        f"ratio {native / alone:5.2f}"
    )


def main(names: list[str]) -> None:
    for name in names:
        sys.stdout.write(measure(name) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main(sys.argv[1:] or list(NETLISTS))
