"""Who does the runs of a sweep: this process, processes of this machine, or a Dask cluster."""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import threading
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

from modelica_like.analyse.sensitivity.outputs import read_output
from modelica_like.analyse.sweeps.readings import read_all
from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import ModelicaLikeError, WorkersLost, missing_extra
from modelica_like.simulation import simulate

_RESTARTS = 3
_DEAF = signal.SIGINT, signal.SIG_IGN
_PATIENCE = 10.0
"""Seconds to wait for a scheduler."""


@dataclass(frozen=True)
class Job:
    """What every run of a sweep has in common.

    Attributes:
        payload: the compiled model, pickled once.
        identity: tells models and their values apart.
        names: what is varied.
        outputs: what is read off.
        settings: arguments of `simulate`.
    """

    payload: bytes = field(repr=False)
    identity: str = field(repr=False)
    names: tuple[str, ...]
    outputs: tuple[str, ...]
    settings: dict[str, Any]

    @classmethod
    def of(cls, model: CompiledDae, names: Sequence[str], outputs: Sequence[str], settings: dict[str, Any]) -> Job:
        """Pack a model."""
        identity = repr([model.summary, [one.path for one in model.flat_variables], model.p.tolist(), model.u.tolist()])
        return cls(pickle.dumps(model), identity, tuple(names), tuple(outputs), settings)


Chunk = tuple[int, Any]
"""Number of the first run, and the points, shape (runs, names)."""

Done = tuple[int, list[list[float]], list[str]]
"""Number of the first run, the values of every run, and what went wrong (empty if nothing)."""


def run_chunk(job: Job, first: int, points: Any) -> Done:
    """Do some runs one after the other; one that fails is told, not fatal."""
    model = _model(job.payload)
    outputs = [read_output(model, name) for name in job.outputs]
    values: list[list[float]] = []
    failures: list[str] = []
    for point in points:
        try:
            given = dict(zip(job.names, map(float, point), strict=True))
            values.append(read_all(simulate(model, parameters=given, **job.settings), outputs))
            failures.append("")
        except ModelicaLikeError as error:
            values.append([float("nan")] * len(outputs))
            failures.append(str(error))
    return first, values, failures


@lru_cache(maxsize=1)
def _model(payload: bytes) -> CompiledDae:
    """Unpack the model once per process."""
    return pickle.loads(payload)


def in_this_process(job: Job, chunks: Sequence[Chunk]) -> Iterator[Done]:
    """Do the runs here."""
    for first, points in chunks:
        yield run_chunk(job, first, points)


def in_processes(job: Job, chunks: Sequence[Chunk], count: int) -> Iterator[Done]:
    """Do the runs in processes of this machine; what a process that dies was at is done again.

    Raises:
        WorkersLost: processes die again and again.
    """
    left = dict(chunks)
    others = set(multiprocessing.active_children())
    for _ in range(_RESTARTS):
        # Spawned, not forked: libraries of this process may have threads.
        with ProcessPoolExecutor(count, multiprocessing.get_context("spawn"), signal.signal, _DEAF) as pool:
            with _deaf():
                futures: list[Future[Done]] = [pool.submit(run_chunk, job, *chunk) for chunk in left.items()]
            try:
                for future in as_completed(futures):
                    done = future.result()
                    del left[done[0]]
                    yield done
            except BrokenProcessPool:
                continue
            except (KeyboardInterrupt, GeneratorExit):
                # Nobody waits for what they are at.
                for process in set(multiprocessing.active_children()) - others:
                    process.terminate()
                raise
            finally:
                for future in futures:
                    future.cancel()
        return
    raise _lost(
        left, f"worker processes of this machine died {_RESTARTS} times",
        'If they died at their start: a script that sweeps keeps its own work behind if __name__ == "__main__":, '
        "or says processes=1.",
    )  # fmt: skip


@contextmanager
def _deaf() -> Iterator[None]:
    """Ignore Ctrl-C for the moment in which processes are started: they inherit it, and are ended by this one."""
    here = threading.current_thread() is threading.main_thread()
    before = signal.signal(*_DEAF) if here else None
    try:
        yield
    finally:
        if here:
            signal.signal(signal.SIGINT, before)


def on_cluster(job: Job, chunks: Sequence[Chunk], scheduler: str) -> Iterator[Done]:
    """Do the runs on a Dask cluster; Dask itself does again what a lost worker was at.

    Raises:
        MissingExtra: Dask is not installed.
        WorkersLost: the scheduler is not there, or gave up a part of the runs.
    """
    try:
        from distributed import Client, as_completed
        from distributed.scheduler import KilledWorker
    except ImportError:
        raise missing_extra("Dask", "cluster") from None
    try:
        client = Client(scheduler, set_as_default=False, timeout=_PATIENCE)
    except (OSError, ValueError):
        raise WorkersLost(
            f"There is no Dask scheduler at {scheduler}.", advice="Its address looks like tcp://host:8786."
        ) from None
    with client:
        shared = client.scatter(job, broadcast=True, hash=False)
        futures = [client.submit(run_chunk, shared, first, points, pure=False) for first, points in chunks]
        left = dict(chunks)
        try:
            for future in as_completed(futures, loop=client.loop):
                done = future.result()
                del left[done[0]]
                yield done
        except KilledWorker as error:
            raise _lost(left, f"Dask gave up: {error}") from None
        finally:
            client.cancel(futures)


def _lost(left: dict[int, Any], why: str, hint: str = "") -> WorkersLost:
    count = sum(len(points) for points in left.values())
    return WorkersLost(
        f"{count} runs of the sweep were not done: {why}.",
        advice=f"What was done is in the checkpoint, if there is one: start the sweep again with it. {hint}".rstrip(),
    )


def cores() -> int:
    """Return the number of cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
