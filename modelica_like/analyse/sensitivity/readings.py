"""Numbers read off runs: final values, peaks, energies, times of mode changes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from modelica_like.analyse.sensitivity.outputs import Output
from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import ExportError, InitializationError, LanguageError, MissingExtra, SolveError, UnknownName
from modelica_like.simulation import simulate
from modelica_like.solve.solution import Solution
from modelica_like.solve.trajectories import ENERGY_TERMS


def read(solution: Solution, output: Output) -> float:
    """Read one number off a run; peaks and integrals come from its results.

    Raises:
        UnknownName: a mode change does not happen.
    """
    owner, _, last = output.path.rpartition(".")
    match output.kind:
        case "end":
            return _value(solution.model, solution.final, output.path)
        case "at":
            return _value(solution.model, solution.at(output.moment), output.path)
        case "max":
            return float(np.max(_value(solution.model, solution, output.path)))
        case "min":
            return float(np.min(_value(solution.model, solution, output.path)))
        case "time":
            return _time(solution, output)
        case _ if last in ("loss_energy", "source_energy"):
            rows = [row for row in solution.energy() if owner in ("", row.component)]
            return sum(row.lost if last == "loss_energy" else row.source for row in rows)
        case _:
            return float(np.trapezoid(_value(solution.model, solution, output.path), solution.time))


def _value(model: CompiledDae, values: Any, path: str) -> Any:
    """Return a value or a trajectory; the model's energies and powers are those of all its components."""
    if path not in ENERGY_TERMS:
        return values[path]
    return sum(values[f"{one}.{path}" if one else path] for one in model.components)


def _time(solution: Solution, output: Output) -> float:
    found, number = [event.time for event in solution.events if output.is_change(event)], output.change[2]
    if len(found) < number:
        raise UnknownName(f"'{output.name}' does not happen in this run.")
    return found[number - 1]


def read_all(solution: Solution, outputs: Sequence[Output]) -> list[float]:
    """Read several numbers; nan for mode changes that do not happen."""
    values: list[float] = []
    for output in outputs:
        try:
            values.append(read(solution, output))
        except UnknownName:
            values.append(float("nan"))
    return values


def quick_run(model: CompiledDae, **run: Any) -> Solution:
    """Simulate with the compiled run-time, or with IDAS if there is none or it fails.

    Args:
        model: the compiled model.
        run: further arguments of `simulate`.

    Raises:
        ModelicaLikeError: IDAS also fails; this is its error.
    """
    try:
        return simulate(model, **run, solver="native")
    except (ExportError, InitializationError, LanguageError, MissingExtra, SolveError):
        return simulate(model, **run, solver="idas")
