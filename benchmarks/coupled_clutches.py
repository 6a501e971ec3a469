"""MSL CoupledClutches in one warm run, against a plain CasADi IDAS integrator over the same time without any event.

Run with `python benchmarks/coupled_clutches.py`. The baseline integrates the model's own equations with the modes
frozen at their start: what the events and their location cost on top is the ratio.
"""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from modelica_like import Options, build, simulate
from modelica_like.initialize import initialize
from modelica_like.solve.idas import Integrator

NETLIST = Path(__file__).parent.parent / "examples" / "msl" / "rotational" / "CoupledClutches.toml"
RUNS = 15


def median(action: Callable[[], Any]) -> float:
    """Median wall time of several runs."""
    times: list[float] = []
    for _ in range(RUNS):
        begin = time.perf_counter()
        action()
        times.append(time.perf_counter() - begin)
    return statistics.median(times)


def main() -> None:
    model = build(NETLIST)
    run = simulate(model)
    start = initialize(model)
    integrator = Integrator(model, Options())
    integrator.run(start, 0.4, 128)
    with_events = median(lambda: simulate(model))
    smooth = median(lambda: integrator.run(start, 0.4, 128))
    sys.stdout.write(
        f"CoupledClutches: {with_events * 1e3:.1f} ms for 1.5 s with {len(run.events)} mode changes; "
        f"its first smooth 0.4 s alone {smooth * 1e3:.2f} ms; ratio {with_events / smooth:.1f}\n"
    )


if __name__ == "__main__":
    main()
