"""Gradients against simulations of the same run: `python benchmarks/gradient.py`.

Ratios of CPU times of the same run, best of several; times are for orientation only. The gradient includes everything
from the finished simulation on: the replay, and the sweep along it.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from chain import Chain

from modelica_like import CompiledDae, build, sensitivities, simulate

EXAMPLES = Path(__file__).parents[1] / "examples"
CASES = {
    "machine_table_geared": "clutch.loss_energy",
    "msl/rotational/CoupledClutches": "clutch1.loss_energy",
    "machine_tool_startup": "clutch.lock_time",
    "dc_bench": "battery.source_energy",
    "lepelletier": "car.w",
}


def best(action: Callable[[], Any], repeats: int = 5) -> float:
    """Shortest CPU time of several runs, after one to warm up."""
    action()
    times: list[float] = []
    for _ in range(repeats):
        begin = time.process_time()
        action()
        times.append(time.process_time() - begin)
    return min(times)


def measure(
    name: str, model: CompiledDae, output: str, numbers: tuple[int, ...], repeats: int = 5, **options: Any
) -> None:
    precision = options.pop("precision", 1e-8)
    run = simulate(model, **options)
    one = best(lambda: simulate(model, **options), repeats)
    names = [parameter.name for parameter in sensitivities(run, [output], precision=precision).parameters]
    parts = [f"{name:32} simulation {one * 1e3:8.1f} ms"]
    for method in ("adjoint", "forward"):
        for number in sorted({min(number, len(names)) for number in numbers}):
            chosen = names[:number]
            ratio = best(
                lambda m=method, c=chosen: sensitivities(run, [output], c, method=m, precision=precision), repeats
            ) / one  # fmt: skip
            parts.append(f"{method} {number}: {ratio:.1f}")
    sys.stdout.write("   ".join(parts) + "\n")
    sys.stdout.flush()


def main() -> None:
    for name, output in CASES.items():
        measure(name, build(EXAMPLES / f"{name}.toml"), output, (1, 10, 100))
    for n, repeats in ((10, 5), (100, 3)):
        measure(f"chain {n}", build(Chain(n=n)), "masses[2].w", (1, 10, 100), repeats, until=1.0, precision=1e-6)
    large = {"until": 1.0, "rtol": 1e-6, "points": 100, "precision": 1e-6}
    measure("chain 1000", build(Chain(n=1000)), "masses[2].w", (4,), 1, **large)


if __name__ == "__main__":
    main()
