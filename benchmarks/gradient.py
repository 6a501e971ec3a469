"""Gradients against simulations of the same run: `python benchmarks/gradient.py`.

Ratios of CPU times of the same run, best of several; times are for orientation only. The gradient includes everything
from the finished simulation on: the replay, and the sweep along it. That of a handle is run and gradient together, as a
ratio to the run of a handle without.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from chain import Chain

from modelica_like import CompiledDae, build, sensitivities, simulate
from modelica_like.native.model import NativeModel

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


def measure_handle(name: str, model: CompiledDae, output: str, until: float) -> None:
    """Run and gradient by one parameter and by all."""

    def run(by: list[str]) -> float:
        handle = model.native(outputs=[output], by=by)

        def action() -> None:
            handle.reset(until=until)
            handle.step(until)
            if by:
                handle.gradient()

        return best(action)

    known = NativeModel.of(model).variables
    names = [parameter.path for parameter in model.flat_parameters if parameter.path in known]
    one = run([])
    ratios = "   ".join(f"by {len(by)}: {run(by) / one:.1f}" for by in (names[:1], names))
    sys.stdout.write(f"{name:32} handle     {one * 1e3:8.2f} ms   {ratios}\n")
    sys.stdout.flush()


HANDLES = {
    "machine_tool_startup": ("load.w", 1.0),
    "msl/rotational/CoupledClutches": ("J1.w", 1.5),
    "lepelletier": ("car.w", 35.0),
    "dc_bench": ("clutch.phi_rel", 1.0),
}


def main() -> None:
    for name, (output, until) in HANDLES.items():
        measure_handle(name, build(EXAMPLES / f"{name}.toml"), output, until)
    for n in (100, 200):
        measure_handle(f"chain {n}", build(Chain(n=n)), "masses[2].w", 1.0)
    for name, output in CASES.items():
        measure(name, build(EXAMPLES / f"{name}.toml"), output, (1, 10, 100))
    for n, repeats in ((10, 5), (100, 3)):
        measure(f"chain {n}", build(Chain(n=n)), "masses[2].w", (1, 10, 100), repeats, until=1.0, precision=1e-6)
    large = {"until": 1.0, "rtol": 1e-6, "points": 100, "precision": 1e-6}
    measure("chain 1000", build(Chain(n=1000)), "masses[2].w", (4,), 1, **large)


if __name__ == "__main__":
    main()
