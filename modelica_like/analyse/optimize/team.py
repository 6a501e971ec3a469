"""Searches that do not wait for each other: one after the other, or in processes of this machine.

A process unpacks the problem once. It tells every design that it has tried, so that all of them count here, and an
interrupt knows the best one.
"""

from __future__ import annotations

import multiprocessing
import pickle
from collections.abc import Sequence
from concurrent.futures import Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, replace
from functools import cache
from types import TracebackType
from typing import Any

from modelica_like.analyse.optimize.designs import FEASIBLE, Design, Outcome
from modelica_like.analyse.optimize.runs import Runs
from modelica_like.analyse.optimize.solve import Search
from modelica_like.analyse.optimize.terms import Limit, Row
from modelica_like.analyse.sweeps.workers import begin_worker, deaf
from modelica_like.compile.buffers import Vector
from modelica_like.errors import ModelicaLikeError, WorkersLost

_LOOKS = 0.05
"""Seconds between two looks at what processes have told."""
_WORTH = 2.0
"""Seconds that searches must take for processes, which take about one to begin."""
_RUNS = 15
"""Of a search, about: for that estimate."""

_told: tuple[bytes, Any] = b"", None
"""In a process: the problem with the designs that are known, and where to tell of further ones."""


@dataclass(frozen=True, eq=False)
class Chain:
    """Searches of which each begins where the one before has ended, if that meets its limits.

    Attributes:
        begin: where the first one begins, in SI units; if that cannot be run, nothing is searched.
        limits: of the problem.
        aim: position of the objective.
        more: further limits of each search.
    """

    begin: Vector
    limits: tuple[Limit, ...]
    aim: int = 0
    more: tuple[tuple[Row, ...], ...] = ((),)

    def run(self, runs: Runs) -> list[Outcome]:
        """Return where the searches end."""
        problem, x, outcomes = replace(runs.problem, limits=self.limits), self.begin, list[Outcome]()
        for rows in self.more if runs.at(x) is not None else ():
            outcomes.append(Search(problem, runs, self.aim, rows).from_design(x))
            x = outcomes[-1].x if outcomes[-1].excess <= FEASIBLE else x
        return outcomes


class Team:
    """Does chains of searches, and ends its processes when it is left.

    Args:
        runs: of the problem; they have all designs in the end.
        processes: how many searches there may be at the same time.
    """

    def __init__(self, runs: Runs, processes: int) -> None:
        self._runs, self._processes = runs, processes
        self._context = multiprocessing.get_context("spawn")  # libraries of this process may have threads
        self._others = set(multiprocessing.active_children())
        self._queue: Any = None
        self._pool: ProcessPoolExecutor | None = None

    def __enter__(self) -> Team:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        if self._pool is None:
            return
        if error is not None:  # unfinished results are not needed
            for process in {*multiprocessing.active_children()} - self._others:
                process.terminate()
        self._pool.shutdown(cancel_futures=True)

    def run(self, chains: Sequence[Chain]) -> list[list[Outcome]]:
        """Return where the searches of each chain end.

        Raises:
            WorkersLost: a process died.
        """
        count = sum(len(chain.more) for chain in chains)
        short = self._runs.seconds * _RUNS * count < _WORTH
        if self._processes == 1 or len(chains) == 1 or (short and self._pool is None):
            return [chain.run(self._runs) for chain in chains]
        return self._apart(chains)

    def _apart(self, chains: Sequence[Chain]) -> list[list[Outcome]]:
        with deaf():
            pool = self._pool = self._pool or self._begun()
            futures: list[Future[_Ended]] = [
                pool.submit(_search, chain, self._runs.known(chain.begin)) for chain in chains
            ]
        try:
            while wait(futures, _LOOKS).not_done:
                self._listen()
            results = [future.result() for future in futures]
        except BrokenProcessPool:
            raise WorkersLost(
                "Searches were not done: a process of this machine died.",
                advice='If it died at startup: put the work of a script under if __name__ == "__main__":, '
                "or set processes=1.",
            ) from None
        self._listen()
        for result in results:
            self._runs.others += result.runs
            self._runs.refusals += result.refusals
        return [result.outcomes for result in results]

    def _begun(self) -> ProcessPoolExecutor:
        self._queue = self._context.SimpleQueue()
        payload = pickle.dumps((self._runs.problem, self._runs.designs))
        return ProcessPoolExecutor(self._processes, self._context, _begin, (payload, self._queue))

    def _listen(self) -> None:
        """Take the designs that processes have tried."""
        while not self._queue.empty():
            self._runs.know([self._queue.get()])
            self._runs.told()


@dataclass(frozen=True, eq=False)
class _Ended:
    """What a process tells of a chain: the ends of its searches, how many runs they took, and refused designs."""

    outcomes: list[Outcome]
    runs: int
    refusals: list[tuple[Vector, ModelicaLikeError]]


def _begin(payload: bytes, queue: Any) -> None:
    global _told
    begin_worker()
    _told = payload, queue


@cache
def _runs_here() -> Runs:
    problem, designs = pickle.loads(_told[0])
    runs = Runs(problem, lambda: _told[1].put(runs.designs[-1]))
    runs.know(designs)
    return runs


def _search(chain: Chain, known: list[Design]) -> _Ended:
    runs = _runs_here()
    runs.know(known)
    before, refused = runs.count, len(runs.refusals)
    outcomes = chain.run(runs)
    return _Ended(outcomes, runs.count - before, runs.refusals[refused:])
