"""Run any FMU safely, and read it like any other solution."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np

from modelica_like.arguments import checked
from modelica_like.errors import FmuFailed, ValueOutOfRange
from modelica_like.fmi.failures import tell_error
from modelica_like.fmi.process import run_child, workplace
from modelica_like.runs.collect import Number
from modelica_like.runs.recorded import RecordedModel, RecordedSolution, RecordedVariable
from modelica_like.runs.results import needed_outputs, settled
from modelica_like.solve.recorder import TERMINATED, Ended

Kind = Literal["me", "cs"]
Solver = Literal["CVode", "Euler"]
TIMEOUT = 60.0
_HEADER = 100_000_000
_CHILD = Path(__file__).with_name("child.py")


@checked
def run_fmu(
    path: str | Path, inputs: Mapping[str, Any] | None = None, parameters: Mapping[str, Any] | None = None, *,
    start: float = 0.0, stop: float | None = None, kind: Kind | None = None, tolerance: float | None = None,
    step: float | None = None, points: int | None = None, outputs: Sequence[str] | None = None,
    timeout: float = TIMEOUT, solver: Solver = "CVode", readings: Sequence[str] = (),
) -> RecordedSolution:  # fmt: skip
    """Run an FMU of FMI 1.0, 2.0 or 3.0 with FMPy, in a separate process.

    Mode changes of a Co-Simulation are located inside its communication steps, by event mode (FMI 3.0) or by repeating
    a step from a saved state, unless a mode comes and goes within one step; otherwise they are known to one step.

    Args:
        path: the FMU.
        inputs: a number, or pairs (time in s, value), by name; linear in between, with jumps where a time is repeated.
            A Co-Simulation gets their slopes if it supports them (FMI 2.0, `canInterpolateInputs`), otherwise their
            means over its own fixed steps, or over steps in which none changes by more than 1/500 of its range.
        parameters: start values by name, in the FMU's units; those of an array nested in its shape, or row by row.
        start: start time in s.
        stop: end time in s; by default that of the FMU.
        kind: `me` (Model Exchange) or `cs` (Co-Simulation); by default `cs` if the FMU has it.
        tolerance: relative tolerance.
        step: communication step, or interval of the results, in s; by default the FMU's, or 1/500 of the run.
        points: number of equal steps instead.
        outputs: variables to record; by default all that are not parameters.
        timeout: time limit in s.
        solver: of Model Exchange.
        readings: numbers to read off the run, `max(shaft.tau)`. An FMU tells nothing of the time between its results,
            so the run is repeated with twice as many, until a number changes by less than 1e-5 of the largest amount
            twice in a row; `change` of a number is what it was. What is shorter than all these steps can be missed.

    Raises:
        FmuRefused: the file is not an FMU, is unsafe to unpack, or lacks what was requested.
        FmuFailed: it reported an error, or a result is not finite.
        FmuCrashed, FmuTimeout: it crashed its process, or did not finish.
        UnknownName, MissingValue: it has no such variable; a reading still changes with 100,000 results.
        ValueOutOfRange: an array has another shape, or a time is wrong.
        OSError: the file cannot be read.
    """
    path = Path(path)
    job = {
        "start": start, "stop": stop, "kind": kind, "tolerance": tolerance, "step": step, "points": points,
        "solver": solver, "outputs": list(outputs) if outputs else None, "parameters": _plain(parameters or {}),
        "inputs": {name: _series(name, value) for name, value in (inputs or {}).items()},
    }  # fmt: skip
    _check_times(path.name, start, stop, step, timeout)
    run = _run(path, job, timeout)
    if readings:
        run.readings = _read(path, job, timeout, run, readings)
    return run


def _read(
    path: Path, job: dict[str, Any], timeout: float, run: RecordedSolution, readings: Sequence[str]
) -> dict[str, Number]:
    """Return readings of a run that is repeated with more results."""
    intervals, needed = int(np.count_nonzero(np.diff(run.time))), needed_outputs(run, readings)

    def again(times: int) -> RecordedSolution:
        return _run(path, job | {"points": times * intervals, "outputs": needed}, timeout)

    return settled(run, again, readings)


def _check_times(name: str, start: float, stop: float | None, step: float | None, timeout: float) -> None:
    if stop is not None and stop <= start:
        raise ValueOutOfRange(f"{name}: the end time {stop:g} s is not after the start time {start:g} s.")
    if step is not None and step <= 0:
        raise ValueOutOfRange(f"{name}: the step must be positive, not {step:g} s.")
    if timeout <= 0:
        raise ValueOutOfRange(f"{name}: the time limit must be positive, not {timeout:g} s.")


def _run(path: Path, job: dict[str, Any], timeout: float) -> RecordedSolution:
    begin = time.perf_counter()
    with workplace(job, [path]) as folder:
        death = run_child(path.name, _CHILD, folder, timeout)
        tell_error(folder, {"": path.name})
        table = np.load(folder / "result.npy", max_header_size=_HEADER)  # names of all columns
        meta = json.loads((folder / "meta.json").read_text())
    variables = (RecordedVariable(**{**variable, "names": dict(variable["names"])}) for variable in meta["variables"])
    names = set(table.dtype.names)
    columns = [variable for variable in variables if variable.path in names]
    parts = [tuple(column for column in columns if (column.kind == "discrete") is modes) for modes in (False, True)]
    constants = {name: float(job["parameters"].get(name, value)) for name, value in meta["constants"].items()}
    model = RecordedModel(meta["name"], parts[0], parts[1], constants)
    values, modes = (
        np.array([table[variable.path] for variable in part], float).reshape(-1, len(table)) for part in parts
    )
    run = RecordedSolution(model, table["time"].copy(), values, modes, time.perf_counter() - begin)
    if meta["ended"]:
        run._ended = Ended(float(run.time[-1]), run.model.name, TERMINATED)
    if death:
        run.notices = (f"{path.name} {death} while it was freed, after its results were complete.",)
    _check_finite(path.name, run)
    return run


def _check_finite(name: str, run: RecordedSolution) -> None:
    """Refuse results that are not finite; the run is on the error."""
    paths = [variable.path for variable in run.model.flat_variables]
    bad = [(int(np.argmin(finite)), path) for path in paths if not (finite := np.isfinite(run[path])).all()]
    if bad:
        first, path = min(bad)
        error = FmuFailed(
            f"{name}: {path} is not finite at t = {run.time[first]:.6g} s.",
            why=f"So are others: {', '.join(path for _, path in bad[1:6])}." if bad[1:] else "",
            advice="The run is on the error, as `run`. If this value does not matter, choose others by `outputs`.",
        )
        error.run = run
        raise error


def _plain(values: Mapping[str, Any]) -> dict[str, Any]:
    return {name: _numbers(name, value) for name, value in values.items()}


def _numbers(name: str, value: Any) -> Any:
    if isinstance(value, np.generic):
        return value.item()
    if not isinstance(value, Sequence | np.ndarray) or (isinstance(value, str) and value in ("true", "false")):
        return value
    try:
        return np.asarray(value, float).tolist()
    except (TypeError, ValueError) as error:
        raise ValueOutOfRange(
            f"The parameter '{name}' must be a number or an array of numbers.",
            advice="All rows of an array have the same length."
            if not isinstance(value, str)
            else f"Give '{value}' as a number in the unit of the FMU.",
        ) from error


def _series(name: str, value: Any) -> Any:
    if isinstance(value, int | float | np.number):
        return float(value)
    try:
        pairs: Any = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        pairs = np.empty(0)  # as what has another shape
    if pairs.ndim != 2 or pairs.shape[1] != 2 or not np.all(np.isfinite(pairs)) or np.any(np.diff(pairs[:, 0]) < 0):
        raise ValueOutOfRange(f"The input '{name}' must be a number, or pairs of rising time and value.")
    return pairs.tolist()
