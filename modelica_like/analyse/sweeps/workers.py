"""Workers of a sweep: threads of this process, processes of this machine, or a Dask cluster."""

from __future__ import annotations

import ctypes
import multiprocessing
import os
import pickle
import signal
import threading
from collections.abc import Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, ThreadPoolExecutor, as_completed, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import islice
from typing import Any

import numpy as np

from modelica_like.analyse.sweeps.native_runs import NativeRuns
from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import ModelicaLikeError, WorkersLost, extra_module
from modelica_like.runs.readings import read_number, read_output
from modelica_like.simulation import plan, simulate

_RESTARTS = 3
_DEAF = signal.SIGINT, signal.SIG_IGN
_PATIENCE = 10.0
"""Seconds to wait for a scheduler."""
_PLANNED = ("until", "t0", "rtol", "atol", "points", "options", "on_chattering", "compiled")
_AGREE = 1e3
"""Difference between solvers that is reported, in tolerances of their steps."""
ONE_IN, _LATER, _MANY = 100, 1000, 2000
"""One in so many native runs is compared with IDAS, and one in so many of those after the first `_MANY`."""


@dataclass(frozen=True)
class Job:
    """The common part of all runs of a sweep.

    Attributes:
        payload: the compiled model, pickled once.
        identity: hash of the model and its values.
        names: paths of the varied parameters.
        outputs: names of the outputs.
        units: their coherent SI units.
        settings: arguments of `simulate`.
    """

    payload: bytes = field(repr=False)
    identity: str = field(repr=False)
    names: tuple[str, ...]
    outputs: tuple[str, ...]
    units: tuple[str, ...]
    settings: dict[str, Any]

    @classmethod
    def of(cls, model: CompiledDae, names: Sequence[str], outputs: Sequence[str], settings: dict[str, Any]) -> Job:
        """Pack a model.

        Raises:
            UnknownName: an output is not known.
        """
        identity = repr(
            [model.summary, [variable.path for variable in model.flat_variables], model.p.tolist(), model.u.tolist()]
        )
        units = tuple(str(read_number(model, name).unit) for name in outputs)
        return cls(pickle.dumps(model), identity, tuple(names), tuple(outputs), units, settings)


Chunk = tuple[int, Any]
"""Number of the first run, and the points, shape (runs, names)."""


@dataclass
class Done:
    """Results of some runs.

    Attributes:
        first: number of the first run.
        values: shape (runs, outputs).
        failures: messages by run.
        by_idas: number of native runs that failed and were repeated by IDAS.
        checked: number of native runs repeated by IDAS for comparison.
        differences: between the solvers, by run.
    """

    first: int
    values: Any
    failures: dict[int, str] = field(default_factory=dict)
    by_idas: int = 0
    checked: int = 0
    differences: dict[int, str] = field(default_factory=dict)

    def add(self, other: Done) -> None:
        """Add records of others; run numbers may be texts, as in JSON."""
        self.failures.update({int(k): text for k, text in other.failures.items()})
        self.differences.update({int(k): text for k, text in other.differences.items()})
        self.by_idas += other.by_idas
        self.checked += other.checked


def run_chunk(job: Job, first: int, points: Any) -> Done:
    """Do some runs one after the other; a failed run is recorded, not raised."""
    reference, left = Reference(job), 0
    if job.settings["solver"] == "native":
        try:
            return reference.review(points, first, *reference.native().run(points))
        except ModelicaLikeError:
            # This machine has no library.
            left = len(points)
    done = Done(first, np.full((len(points), len(job.outputs)), np.nan), by_idas=left)
    for k, point in enumerate(points):
        reference.run(done, k, point)
    return done


def is_compared(number: int) -> bool:
    """Return whether a native run is one of those that IDAS repeats."""
    return number % (ONE_IN if number < _MANY else _LATER) == 0


class Reference:
    """Runs by IDAS: those of a sweep with this solver, and checks of native runs.

    Args:
        job: the common part of all runs.
    """

    def __init__(self, job: Job) -> None:
        self._job, self._model = job, _model(job.payload)
        self._outputs = [read_output(self._model, name) for name in job.outputs]
        _, options = plan(self._model, **{k: v for k, v in job.settings.items() if k in _PLANNED})
        # Relative to the largest value, and absolute.
        self._relative = _AGREE * options.rtol
        nominal = {variable.path: abs(variable.nominal) for variable in self._model.flat_variables}
        self._absolute = np.array([_AGREE * options.atol * nominal.get(output.path, 1.0) for output in self._outputs])

    def native(self) -> NativeRuns:
        """Return the same runs by the compiled run-time."""
        job = self._job
        return NativeRuns(self._model, job.names, self._outputs, job.settings)

    def run(self, done: Done, k: int, point: Any) -> None:
        """Do one run, and record its results."""
        given = dict(zip(self._job.names, map(float, point), strict=True))
        try:
            settings = {**self._job.settings, "solver": "idas", "readings": self._job.outputs}
            done.values[k] = simulate(self._model, parameters=given, **settings).read(*self._job.outputs)
        except ModelicaLikeError as error:
            done.failures[done.first + k] = str(error)

    def review(self, points: Any, first: int, values: Any, refused: dict[int, str], failed: list[int]) -> Done:
        """Repeat failed runs, and compare some of the others."""
        done = Done(first, values, {first + k: text for k, text in refused.items()}, len(failed))
        for k in failed:
            self.run(done, k, points[k])
        left_out = {*refused, *failed}
        sample = [k for k in range(len(points)) if is_compared(first + k) and k not in left_out]
        self.compare(done, points, sample)
        return done

    def compare(self, done: Done, points: Any, sample: Sequence[int]) -> None:
        """Repeat runs with IDAS, and record differences."""
        largest = np.max(np.abs(done.values), axis=0, where=np.isfinite(done.values), initial=0.0)
        for k in sample:
            other = Done(0, np.full_like(done.values, np.nan))
            self.run(other, k, points[k])
            done.checked += 1
            text = other.failures.get(k, "").partition("\n")[0] or self._difference(
                done.values[k], other.values[k], largest
            )
            if text:
                done.differences[done.first + k] = text

    def _difference(self, native: Any, idas: Any, largest: Any) -> str:
        allowed = self._relative * np.maximum(largest, np.nan_to_num(np.abs(idas))) + self._absolute
        # Two events that do not happen are equal.
        same = (np.abs(native - idas) <= allowed) | (np.isnan(native) & np.isnan(idas))
        return ", ".join(
            f"{name} = {a:.9g} instead of {b:.9g}"
            for name, a, b, equal in zip(self._job.outputs, native, idas, same, strict=True)
            if not equal
        )


@lru_cache(maxsize=1)
def _model(payload: bytes) -> CompiledDae:
    """Unpack the model once per process."""
    return pickle.loads(payload)


def in_this_process(job: Job, chunks: Sequence[Chunk]) -> Generator[Done]:
    """Do the runs here."""
    for first, points in chunks:
        yield run_chunk(job, first, points)


def in_threads(job: Job, chunks: Sequence[Chunk], count: int) -> Generator[Done]:
    """Do native runs in threads of this process, and the runs for IDAS in this one meanwhile."""
    reference, stop = Reference(job), ctypes.c_int(0)
    runs, left, waiting = reference.native(), iter(chunks), dict[Future[Any], Chunk]()
    with ThreadPoolExecutor(count) as pool:
        try:
            while True:
                for first, points in islice(left, 2 * count - len(waiting)):
                    waiting[pool.submit(runs.run, points, stop)] = first, points
                if not waiting:
                    return
                done = wait(waiting, return_when=FIRST_COMPLETED).done
                for future in [f for f in waiting if f in done]:
                    first, points = waiting.pop(future)
                    yield reference.review(points, first, *future.result())
        finally:
            # Their unfinished results are not needed.
            stop.value = 1


def in_processes(job: Job, chunks: Sequence[Chunk], count: int) -> Generator[Done]:
    """Do the runs in processes of this machine; the runs of a process that dies are repeated.

    Raises:
        WorkersLost: processes died repeatedly.
    """
    left = dict(chunks)
    others = set(multiprocessing.active_children())
    for _ in range(_RESTARTS):
        # Spawned, not forked: libraries of this process may have threads.
        with ProcessPoolExecutor(count, multiprocessing.get_context("spawn"), begin_worker) as pool:
            with deaf():
                futures: list[Future[Done]] = [pool.submit(run_chunk, job, *chunk) for chunk in left.items()]
            try:
                for future in as_completed(futures):
                    done = future.result()
                    del left[done.first]
                    yield done
            except BrokenProcessPool:
                continue
            except (KeyboardInterrupt, GeneratorExit):
                # Their unfinished results are not needed.
                for process in set(multiprocessing.active_children()) - others:
                    process.terminate()
                raise
            finally:
                for future in futures:
                    future.cancel()
        return
    raise _lost(
        left, f"worker processes of this machine died {_RESTARTS} times",
        'If they died at startup: put the work of a script under if __name__ == "__main__":, '
        "or set processes=1.",
    )  # fmt: skip


def begin_worker() -> None:
    """Prepare a process: Ctrl-C is for its parent, and it ends with that, killed perhaps."""
    signal.signal(*_DEAF)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)


@contextmanager
def deaf() -> Iterator[None]:
    """Ignore Ctrl-C while processes are started: they inherit this, and this process ends them."""
    here = threading.current_thread() is threading.main_thread()
    before = signal.signal(*_DEAF) if here else None
    try:
        yield
    finally:
        if here:
            signal.signal(signal.SIGINT, before)


def on_cluster(job: Job, chunks: Sequence[Chunk], scheduler: str) -> Generator[Done]:
    """Do the runs on a Dask cluster; Dask repeats the runs of a lost worker.

    Raises:
        MissingExtra: Dask is not installed.
        WorkersLost: there is no scheduler, or it gave up some of the runs.
    """
    dask = extra_module("distributed", "cluster", "Dask")
    try:
        client = dask.Client(scheduler, set_as_default=False, timeout=_PATIENCE)
    except (OSError, ValueError):
        raise WorkersLost(
            f"There is no Dask scheduler at {scheduler}.", advice="An address looks like tcp://host:8786."
        ) from None
    with client:
        shared = client.scatter(job, broadcast=True, hash=False)
        futures = [client.submit(run_chunk, shared, first, points, pure=False) for first, points in chunks]
        left = dict(chunks)
        try:
            for future in dask.as_completed(futures, loop=client.loop):
                done = future.result()
                del left[done.first]
                yield done
        except dask.scheduler.KilledWorker as error:
            raise _lost(left, f"Dask gave up: {error}") from None
        finally:
            client.cancel(futures)


def _lost(left: dict[int, Any], why: str, hint: str = "") -> WorkersLost:
    count = sum(len(points) for points in left.values())
    return WorkersLost(
        f"{count} runs of the sweep were not done: {why}.",
        advice=f"Finished runs are in the checkpoint, if there is one: start the sweep again with it. {hint}".rstrip(),
    )


def cores() -> int:
    """Return the number of cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
