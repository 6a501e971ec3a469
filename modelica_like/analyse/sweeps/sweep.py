"""Many runs of one model over values of its parameters."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from modelica_like.analyse.sweeps.checkpoint import Checkpoint
from modelica_like.analyse.sweeps.native_runs import NativeRuns
from modelica_like.analyse.sweeps.plan import Plan, Sampling, make_plan
from modelica_like.analyse.sweeps.workers import (
    ONE_IN,
    Chunk,
    Done,
    Job,
    Reference,
    cores,
    in_processes,
    in_this_process,
    in_threads,
    is_compared,
    on_cluster,
)
from modelica_like.arguments import checked
from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import ExportError, ModelicaLikeError, ValueOutOfRange, extra_module
from modelica_like.simulation import Model, Solver, build

if TYPE_CHECKING:
    import xarray

_CHUNK = 25, 1000
"""Smallest and largest number of runs in a chunk."""
_PARTS = 200
"""Number of chunks of a sweep, within the limits of the chunk size."""
_TOLD = 3
_WORTH_PROCESSES = 100
"""Fewer runs finish before processes have started."""
_POINTS = 50
_WORTH_CODE = 20.0
"""CPU time of all runs in s from which on machine code is made: it saves a fifth, and takes a compiler 1 to 5 s."""

Told = Callable[[int, int], None]
"""Called with the number of finished runs and of all runs."""


@checked
def sweep(
    drive: Model, over: Mapping[str, Iterable[Any]], outputs: Sequence[str], *,
    sampling: Sampling | None = None, until: float | str | None = None,
    parameters: Mapping[str, Any] | None = None, processes: int | None = None, scheduler: str | None = None,
    checkpoint: str | Path | None = None, progress: Told | None = None, chunk: int | None = None,
    solver: Solver = "native", **settings: Any,
) -> xarray.Dataset:  # fmt: skip
    """Simulate a drive over values of its parameters, compiled once.

    Args:
        drive: a component, a netlist file or a compiled model.
        over: path of every parameter or input with its values, numbers in SI units or quantities: the full grid of
            them. With a `sampling`, the lower and the upper bound of each.
        outputs: numbers to read off each run, named as for `sensitivities`: `table.s`, `max(shaft.tau)`,
            `clutch.lock_time`, `clutch.loss_energy`, `at(motor.w, 0.1 s)`.
        sampling: `LatinHypercube(count, seed)` or `Sobol(count, seed)` instead of the grid.
        until: end time.
        parameters: other values, the same for all runs.
        processes: parallel runs on this machine, native ones in threads; by default one per core (IDAS: if worth it).
        scheduler: address of a Dask scheduler (`tcp://…`), instead of this machine.
        checkpoint: a folder (Zarr) for finished runs: the same sweep resumes where it stopped.
        progress: called after each chunk of runs.
        chunk: runs that a worker does at a time; by default a 200th of all, from 25 to 1000.
        solver: `native`, the compiled run-time, or `idas`. IDAS does the runs that fail in the run-time. For
            comparison it repeats one run in a hundred of the first 2,000, one in a thousand of the others, and those
            with the smallest and largest outputs.
        settings: further arguments of `simulate`, such as rtol, points or start. Without `compiled`, long sweeps have
            machine code where there is a compiler; results are the same.

    Returns:
        A dataset over the parameters (a grid) or over `sample`: the outputs with their units, and `failure`, the
        message of each failed run (empty for the others). `solver` names the solver, `checked` is the number of runs
        repeated by IDAS, `notice` lists differences and runs left to IDAS.

    Raises:
        UnknownName: a name is not known.
        ValueOutOfRange: values, outputs or processes are missing, or what is varied is an output or has one value.
        CheckpointMismatch: the checkpoint belongs to another sweep.
        KeyboardInterrupt: the sweep was interrupted; the note says how much is in the checkpoint.
        WorkersLost: workers died repeatedly.
    """
    model = build(drive, free=over).with_parameters(dict(parameters or {}))
    plan = make_plan(model, over, sampling)
    _check_names(plan, outputs, parameters or {})
    chunks = _chunks(plan, outputs, processes, chunk)
    job = Job.of(model, plan.names, outputs, {"until": until, "points": _POINTS, **settings, "solver": solver})
    job, why = _solvable(job, plan.points) if scheduler is None else (job, "")
    done = _collect(job, plan, chunks, checkpoint, progress, _workers(job, processes, scheduler, len(plan)))
    _check_extremes(job, plan, done)
    return _dataset(model, plan, job, done, why)


def _check_names(plan: Plan, outputs: Sequence[str], parameters: Mapping[str, Any]) -> None:
    """Refuse what is varied as an output, which has a column of its own, and as one of the other parameters."""
    for name in plan.names:
        if name in parameters:
            raise ValueOutOfRange(
                f"{name} is varied, and has a value for all runs.", advice="Leave out one of the two."
            )
        if name in outputs:
            raise ValueOutOfRange(
                f"{name} is varied, and cannot be an output, too.", advice="Its values stand beside every output."
            )


def _chunks(plan: Plan, outputs: Sequence[str], processes: int | None, chunk: int | None) -> list[Chunk]:
    """Divide the runs among workers."""
    if not outputs or any(number is not None and number < 1 for number in (processes, chunk)):
        raise ValueOutOfRange(
            "A sweep needs at least one output, and positive numbers of processes and runs in a chunk."
        )
    count = chunk or min(max(len(plan) // _PARTS, _CHUNK[0]), _CHUNK[1])
    return [(first, plan.points[first : first + count]) for first in range(0, len(plan), count)]


def _solvable(job: Job, points: Any) -> tuple[Job, str]:
    """Return the job, for IDAS if the run-time cannot do it, and what to tell about that."""
    try:
        if job.settings["solver"] == "native":
            runs = Reference(job).native()
            return (job, runs.notice) if job.settings.get("compiled") is not None else (_coded(job, runs, points), "")
    except ExportError:
        raise  # there is no run-time: IDAS has its events, too
    except ModelicaLikeError as error:
        return replace(job, settings={**job.settings, "solver": "idas"}), f"IDAS did all runs: {error.what}"
    return job, ""


def _coded(job: Job, runs: NativeRuns, points: Any) -> Job:
    """Return the job with machine code, which is made here for all workers, if a run tells that this pays."""
    if len(points) >= ONE_IN:  # or the run would be a large part of all
        begin = time.thread_time()
        runs.run(points[:1])
        coded = replace(job, settings={**job.settings, "compiled": True})
        pays = (time.thread_time() - begin) * len(points) >= _WORTH_CODE
        if pays and not Reference(coded).native().notice:
            return coded
    return job


def _check_extremes(job: Job, plan: Plan, done: Done) -> None:
    """Compare the native runs with the smallest and the largest outputs."""
    if job.settings["solver"] != "native":
        return
    wanted: set[int] = set()
    for column in done.values.T:
        finite = np.flatnonzero(np.isfinite(column))
        if len(finite):
            wanted |= {int(finite[np.argmin(column[finite])]), int(finite[np.argmax(column[finite])])}
    Reference(job).compare(done, plan.points, sorted(k for k in wanted if not is_compared(k)))


def _workers(job: Job, processes: int | None, scheduler: str | None, runs: int) -> Callable[..., Generator[Done]]:
    if scheduler is not None:
        return lambda chunks: on_cluster(job, chunks, scheduler)
    if job.settings["solver"] == "native":
        return lambda chunks: in_threads(job, chunks, processes or cores())
    count = processes if processes is not None else cores() if runs >= _WORTH_PROCESSES else 1
    return lambda chunks: in_processes(job, chunks, count) if count > 1 else in_this_process(job, chunks)


def _collect(
    job: Job, plan: Plan, chunks: list[Chunk], checkpoint: str | Path | None, progress: Told | None,
    workers: Callable[..., Generator[Done]],
) -> Done:  # fmt: skip
    """Do all chunks and store their results."""
    total = len(plan)
    kept = Checkpoint(checkpoint, job, plan, len(chunks[0][1])) if checkpoint is not None else None
    left = kept.left(chunks) if kept is not None else chunks
    count = total - sum(len(points) for _, points in left)
    results = Done(0, np.full((total, len(job.outputs)), np.nan))
    try:
        with closing(workers(left)) as working:
            for done in working:
                if kept is not None:
                    kept.keep(done)
                results.values[done.first : done.first + len(done.values)] = done.values
                results.add(done)
                count += len(done.values)
                if progress is not None:
                    progress(count, total)
    except KeyboardInterrupt as error:
        where = f"in {kept.path}: the same sweep resumes there" if kept is not None else "lost without a checkpoint"
        error.add_note(f"{count} of {total} runs are {where}.")
        raise
    return kept.results() if kept is not None else results


def _dataset(model: CompiledDae, plan: Plan, job: Job, done: Done, why: str) -> xarray.Dataset:
    failures, units = done.failures, dict(zip(job.outputs, job.units, strict=True))
    # A fixed-width array would be as wide as the longest message.
    reasons = np.full(len(plan), "", object)
    reasons[list(failures)] = list(failures.values())
    data: dict[str, Any] = {
        name: (plan.dims, done.values[:, k].reshape(plan.shape), {"units": unit})
        for k, (name, unit) in enumerate(units.items())
    }
    data["failure"] = (plan.dims, reasons.reshape(plan.shape), {"long_name": "why a run failed"})
    columns = plan.axes if plan.axes is not None else plan.points.T
    coords = {
        name: (name if plan.axes is not None else "sample", column, {"units": unit})
        for name, unit, column in zip(plan.names, plan.units, columns, strict=True)
    }
    notes: list[str] = []
    if done.by_idas:
        notes.append(f"IDAS did {done.by_idas} of {len(done.values)} runs, where the native run-time failed.")
    if done.differences:
        listed = [f"  run {k}: {done.differences[k]}" for k in sorted(done.differences)[:_TOLD]]
        notes.append(
            f"In {len(done.differences)} of {done.checked} repeated runs IDAS has other results:\n" + "\n".join(listed)
        )
    notice = "\n".join(filter(None, [why, *notes]))
    attrs = {"model": model.name, "solver": job.settings["solver"], "checked": done.checked, "notice": notice}
    return extra_module("xarray", "data").Dataset(data, coords=coords, attrs=attrs)
