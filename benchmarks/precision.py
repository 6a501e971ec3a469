"""What precision costs: errors of readings and CPU times of both solvers at three tolerances.

Run with `python benchmarks/precision.py`; it prints the table of docs/native.md. Errors are the largest relative ones
of peaks, root mean squares and works, against the compiled run-time at 1e-12; how far IDAS at 1e-11 is from that is
told first, as two methods that share nothing. Times are medians of the CPU time of runs with 500 results.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np

from modelica_like import build, simulate
from modelica_like.compile.compiled import CompiledDae

EXAMPLES = Path(__file__).parent.parent / "examples"
SYSTEMS = {
    "document 003": "machine_tool_startup",
    "with backlash": "machine_tool_backlash",
    "with magnets": "machine_tool_magnet",
    "Lepelletier": "lepelletier",
    "`two_mass`": "two_mass",
}
TOLERANCES = (1e-6, 1e-7, 1e-8)
SPREAD, VARIANTS = 0.3, 14
RUNS = 5
SMALL = 1e-6
"""Of the largest reading of a system: smaller ones are compared with this."""


def readings(model: CompiledDae) -> list[str]:
    """Peaks and root mean squares of six loads, and works."""
    loads = [one.path for one in model.flat_variables if str(one.unit) in ("N.m", "N") and not one.hidden][:6]
    return [f"{kind}({load})" for load in loads for kind in ("peak", "rms")] + ["loss_energy", "source_energy"]


def values(model: CompiledDae, solver: Any, rtol: float) -> tuple[np.ndarray, float]:
    """Readings of a run, and its CPU time in s."""
    names = readings(model)
    begin = time.process_time()
    run = simulate(model, solver=solver, rtol=rtol, points=500, readings=names)
    return np.array(run.read(*names), float), time.process_time() - begin


def error(found: np.ndarray, exact: np.ndarray) -> float:
    """Largest relative error."""
    return float(np.max(np.abs(found - exact) / np.maximum(np.abs(exact), SMALL * np.abs(exact).max())))


def cells(models: list[CompiledDae]) -> str:
    """Errors of the solvers at the tolerances, the worst of all models, and the time of the first one."""
    exact = [values(model, "native", 1e-12)[0] for model in models]
    row = [f"{max(error(values(m, 'idas', 1e-11)[0], e) for m, e in zip(models, exact, strict=True)):.0e}"]
    for solver in ("idas", "native"):
        for rtol in TOLERANCES:
            worst = max(error(values(m, solver, rtol)[0], e) for m, e in zip(models, exact, strict=True))
            spent = np.median([values(models[0], solver, rtol)[1] for _ in range(RUNS)])
            row.append(f"{worst:.0e}, {1e3 * spent:.0f} ms")
    return " | ".join(row)


def variants(model: CompiledDae) -> list[CompiledDae]:
    """The model with its parameters changed at random; zeros, times and plain numbers stay."""
    source, steady = np.random.default_rng(3), ("s", "1")
    numbers = {one.path: value for one, value in zip(model.flat_parameters, model.p, strict=True)
               if value and str(one.unit) not in steady}  # fmt: skip
    return [
        model.with_parameters({name: x * source.uniform(1 - SPREAD, 1 + SPREAD) for name, x in numbers.items()})
        for _ in range(VARIANTS)
    ]


if __name__ == "__main__":
    print("system | IDAS at 1e-11 | IDAS 1e-6 | 1e-7 | 1e-8 | native 1e-6 | 1e-7 | 1e-8")
    for title, netlist in SYSTEMS.items():
        model = build(EXAMPLES / f"{netlist}.toml")
        print(title, cells([model]), sep=" | ", flush=True)
        if netlist == "machine_tool_startup":
            print(f"{VARIANTS} variants of it", cells(variants(model)), sep=" | ", flush=True)
