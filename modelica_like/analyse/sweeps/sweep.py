"""Many runs of one model over values of its parameters."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from modelica_like.analyse.sensitivity.outputs import read_output
from modelica_like.analyse.sweeps.checkpoint import Checkpoint
from modelica_like.analyse.sweeps.plan import Plan, Sampling, make_plan
from modelica_like.analyse.sweeps.workers import Chunk, Done, Job, cores, in_processes, in_this_process, on_cluster
from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import ValueOutOfRange, missing_extra
from modelica_like.simulation import Model, build

if TYPE_CHECKING:
    import xarray

_CHUNK = 25
_WORTH_PROCESSES = 100
"""Fewer runs are done before processes have started."""
_POINTS = 50

Told = Callable[[int, int], None]
"""Called with the number of runs that are done and that of all."""


def sweep(
    drive: Model, over: Mapping[str, Iterable[Any]], outputs: Sequence[str], *,
    sampling: Sampling | None = None, until: float | str | None = None,
    parameters: Mapping[str, Any] | None = None, processes: int | None = None, scheduler: str | None = None,
    checkpoint: str | Path | None = None, progress: Told | None = None, chunk: int = _CHUNK, **settings: Any,
) -> xarray.Dataset:  # fmt: skip
    """Simulate a drive over values of its parameters; it is compiled once.

    Args:
        drive: a component, a netlist file or a compiled model.
        over: path of every parameter or input with its values, numbers in SI units or quantities: the full grid of
            them. With a `sampling`, the lower and the upper bound of each.
        outputs: what to read off each run, as `sensitivities` names it: `table.s`, `max(shaft.tau)`,
            `clutch.lock_time`, `clutch.loss_energy`, `at(motor.w, 0.1 s)`.
        sampling: `LatinHypercube(count, seed)` or `Sobol(count, seed)` instead of the grid.
        until: end time.
        parameters: other values, the same for all runs.
        processes: how many of this machine; by default one per core, or none beside this one for few runs.
        scheduler: address of a Dask scheduler (`tcp://…`), instead of processes of this machine.
        checkpoint: a folder (Zarr) that keeps what is done: the same sweep goes on where it was stopped.
        progress: called after each chunk of runs.
        chunk: runs that a worker does at a time.
        settings: further arguments of `simulate`, such as rtol, points or start.

    Returns:
        A dataset over the parameters (a grid) or over `sample`: the outputs with their units, and `failure`, the
        sentence of each run that failed (empty for the others).

    Raises:
        UnknownName: a name is not known.
        ValueOutOfRange: there is nothing to vary, nothing to read, or no positive number of processes.
        CheckpointMismatch: the checkpoint belongs to another sweep.
        KeyboardInterrupt: it was interrupted; its note says how much is in the checkpoint.
        WorkersLost: workers died again and again.
    """
    model = build(drive, free=over)
    if parameters:
        model = model.with_parameters(dict(parameters))
    plan = make_plan(model, over, sampling)
    if not outputs or (processes is not None and processes < 1) or chunk < 1:
        raise ValueOutOfRange(
            "A sweep needs at least one output, and positive numbers of processes and runs in a chunk."
        )
    read = [read_output(model, name) for name in outputs]
    job = Job.of(model, plan.names, outputs, {"until": until, "points": _POINTS, **settings})
    chunks: list[Chunk] = [(first, plan.points[first : first + chunk]) for first in range(0, len(plan), chunk)]
    values, failures = _collect(job, plan, chunks, checkpoint, progress, _workers(job, processes, scheduler, len(plan)))
    return _dataset(model, plan, {one.name: str(one.unit) for one in read}, values, failures)


def _workers(job: Job, processes: int | None, scheduler: str | None, runs: int) -> Callable[..., Iterator[Done]]:
    if scheduler is not None:
        return lambda chunks: on_cluster(job, chunks, scheduler)
    count = processes if processes is not None else cores() if runs >= _WORTH_PROCESSES else 1
    return (
        (lambda chunks: in_processes(job, chunks, count))
        if count > 1
        else (lambda chunks: in_this_process(job, chunks))
    )


def _collect(
    job: Job, plan: Plan, chunks: list[Chunk], checkpoint: str | Path | None, progress: Told | None,
    workers: Callable[..., Iterator[Done]],
) -> tuple[Any, dict[int, str]]:  # fmt: skip
    """Have all chunks done, and keep what they give."""
    total = len(plan)
    kept = Checkpoint(checkpoint, job, plan, len(chunks[0][1])) if checkpoint is not None else None
    left = kept.left(chunks) if kept is not None else chunks
    count = total - sum(len(points) for _, points in left)
    values, failures = np.full((total, len(job.outputs)), np.nan), {}
    try:
        for done in workers(left):
            first, numbers, told = done
            if kept is not None:
                kept.keep(done)
            values[first : first + len(numbers)] = numbers
            failures.update({first + k: text for k, text in enumerate(told) if text})
            count += len(numbers)
            if progress is not None:
                progress(count, total)
    except KeyboardInterrupt as error:
        where = f"in {kept.path}: the same sweep goes on there" if kept is not None else "lost without a checkpoint"
        error.add_note(f"{count} of {total} runs are {where}.")
        raise
    return kept.results() if kept is not None else (values, failures)


def _dataset(
    model: CompiledDae, plan: Plan, units: Mapping[str, str], values: Any, failures: Mapping[int, str]
) -> xarray.Dataset:
    try:
        import xarray
    except ImportError:
        raise missing_extra("xarray", "data") from None
    told = np.array([failures.get(k, "") for k in range(len(plan))], dtype=str)
    data: dict[str, Any] = {
        name: (plan.dims, values[:, k].reshape(plan.shape), {"units": unit})
        for k, (name, unit) in enumerate(units.items())
    }
    data["failure"] = (plan.dims, told.reshape(plan.shape), {"long_name": "why a run failed"})
    columns = plan.axes if plan.axes is not None else plan.points.T
    coords = {
        name: (name if plan.axes is not None else "sample", column, {"units": unit})
        for name, unit, column in zip(plan.names, plan.units, columns, strict=True)
    }
    return xarray.Dataset(data, coords=coords, attrs={"model": model.name})
