"""Measure document 003 cut into two FMUs against the whole, and draw it: python docs/cosimulation.py FOLDER."""

import sys
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from modelica_like import Solution, cosim, simulate, split
from modelica_like.show.plot import save_plot
from modelica_like.style import COLOURS, STYLE

HERE = Path(__file__).parent
NETLIST = HERE.parent / "examples" / "machine_tool_startup.toml"
STEPS = (2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 5e-5)
SIGNALS = {"J4.w": "speed of the load", "shaft2.tau": "torque of the shaft"}
MASTERS = ("jacobi", "gauss-seidel")
WANTED = 1e-3

Errors = Mapping[str, tuple[float, ...]]


def error(run: Solution, whole: Solution, signal: str) -> float:
    """Return the largest deviation of a signal, in parts of its range."""
    expected = np.interp(run.time, whole.time, whole[signal])
    return float(np.abs(run[signal] - expected).max() / np.ptp(whole[signal]))


def measure(system: Path, whole: Solution, master: str, inputs: str = "linear") -> Errors:
    """Return the errors of both signals for all steps."""
    runs = [cosim(system, step=step, master=master, inputs=inputs, outputs=tuple(SIGNALS)) for step in STEPS]
    return {signal: tuple(error(run, whole, signal) for run in runs) for signal in SIGNALS}


def step_that_keeps(errors: Errors, wanted: float = WANTED) -> float:
    """Return the longest step that keeps an error in both signals, between those measured, in s."""
    worst = [max(values) for values in zip(*errors.values(), strict=True)]
    for (above, below), (long, short) in zip(pairwise(worst), pairwise(STEPS), strict=True):
        if below <= wanted < above:
            share = np.log(wanted / below) / np.log(above / below)
            return float(short * (long / short) ** share)
    raise ValueError("no step keeps it")


def draw(results: Mapping[str, Errors]) -> Figure:
    """Draw the errors over the step."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(8.0, 3.6), layout="constrained")
        panels = figure.subplots(1, 2, sharey=True)
        for axes, (signal, title) in zip(panels, SIGNALS.items(), strict=True):
            for (name, errors), colour in zip(results.items(), COLOURS, strict=False):
                axes.loglog(STEPS, errors[signal], "o-", color=colour, markersize=4, label=name)
            axes.axhline(WANTED, color="black", linewidth=0.8, linestyle=(0, (4, 4)))
            axes.set_title(f"{title}, {signal}")
            axes.set_xlabel("communication step in s")
        panels[0].set_ylabel("largest error, in parts of the range")
        panels[0].set_ylim(top=2.0)
        panels[0].legend()
    return figure


def table(results: Mapping[str, Errors]) -> str:
    """Return the errors as a table in Markdown."""
    names = [f"{name}, {signal}" for name in results for signal in SIGNALS]
    lines = ["| step | " + " | ".join(names) + " |", "|---" * (len(names) + 1) + "|"]
    for k, step in enumerate(STEPS):
        values = [errors[signal][k] for errors in results.values() for signal in SIGNALS]
        lines.append(f"| {1e3 * step:g} ms | " + " | ".join(f"{value:.1e}" for value in values) + " |")
    return "\n".join(lines)


def main(folder: Path) -> None:
    """Measure, draw, and write the tables."""
    system = split(NETLIST, "shaft2", folder, names=("drive", "load")).path
    whole = simulate(NETLIST, rtol=1e-10, points=20_000)
    results = {master: measure(system, whole, master) for master in MASTERS}
    lines = [table(results)]
    lines += [f"{name}: {1e3 * step_that_keeps(errors):.2g} ms keep {WANTED:g}" for name, errors in results.items()]
    held = {f"{master}, inputs held": measure(system, whole, master, "hold") for master in MASTERS}
    save_plot(draw({**results, **held}), HERE / "pictures" / "cosimulation.png", dpi=150)
    for tolerance in (1e-3, 1e-4, 1e-5):
        run = cosim(system, tolerance=tolerance, master="gauss-seidel", outputs=tuple(SIGNALS))
        worst = max(error(run, whole, signal) for signal in SIGNALS)
        lines.append(f"| {tolerance:g} | {run.steps} | {run.rejected} | {worst:.1e} |")
    sys.stdout.write("\n".join(lines) + "\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
