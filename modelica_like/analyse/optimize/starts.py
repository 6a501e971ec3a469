"""Where searches begin that look for the best of several optima: at the most promising of many points.

Their values take one native run each, in threads, which is far less than a search from there.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np

from modelica_like.analyse.optimize.designs import FEASIBLE
from modelica_like.analyse.optimize.problem import Problem
from modelica_like.analyse.optimize.runs import Runs
from modelica_like.analyse.optimize.solve import Scale
from modelica_like.analyse.optimize.terms import starts_of
from modelica_like.analyse.sweeps.native_runs import NativeRuns
from modelica_like.analyse.sweeps.workers import cores
from modelica_like.compile.buffers import Vector
from modelica_like.errors import ModelicaLikeError
from modelica_like.runs.readings import read_output

_EACH = 16
"""Points for each start at most: a search takes about as many runs with derivatives."""
_CHUNK = 32
"""Points that are run before they are counted, so that an interrupt does not wait."""
_APART = 0.5
"""Distance of two starts, relative to that of as many points spread evenly between the bounds."""


def promising_starts(runs: Runs, scale: Scale, number: int, seed: int) -> list[Vector]:
    """Return starts in SI units: the drive as it is, and the best of many points that are apart.

    Args:
        runs: of the problem; they are counted there.
        scale: what is to be small, and what is limited.
        number: of starts.
        seed: of the Latin hypercube between the bounds.
    """
    problem = runs.problem
    count = number * min(number, _EACH)
    points = np.array([_in_order(problem, x) for x in starts_of(problem.free, count, seed)])
    values = _outputs(runs, points[1:]) if number > 1 else None
    if values is None:  # there is no run-time for it
        return [*points[:number]]
    measured = [scale.measures(some) for some in values]
    merits = [(max(excess, FEASIBLE), objective) for objective, excess in measured]
    usable = [k for k in range(len(merits)) if np.all(np.isfinite(values[k]))]
    apart = _APART * number ** (-1.0 / len(problem.free))
    chosen = [points[0]]
    for k in sorted(usable, key=lambda k: merits[k]):
        x = points[1 + k]
        if len(chosen) < number and all(np.linalg.norm((x - y) / problem.span) > apart for y in chosen[1:]):
            chosen.append(x)
    return chosen


def _in_order(problem: Problem, x: Vector) -> Vector:
    """Return values of which none is above the one that it must not exceed."""
    x = x.copy()
    for _ in problem.ordered:
        for low, high in problem.ordered:
            x[[low, high]] = min(x[low], x[high]), max(x[low], x[high])
    return x


def _outputs(runs: Runs, points: Vector) -> Vector | None:
    """Return the outputs of native runs, shape (points, cases, outputs), nan where one has none."""
    problem, question, alone = runs.problem, runs.problem.question, runs.alone
    if alone.modal or not alone.read:
        return None
    names, settings = [parameter.name for parameter in problem.free], {"until": question.until, "start": question.start}
    given = {key: value for key, value in settings.items() if value is not None}
    values = np.empty((len(points), len(problem.cases), len(problem.outputs)))
    try:
        for c, case in enumerate(problem.cases):
            model = problem.model.with_parameters(dict(case.values))
            native = NativeRuns(model, names, [read_output(model, name) for name in alone.read], given)
            values[:, c] = alone.of_runs.values(_in_threads(runs, native, points))[:, alone.places]
    except ModelicaLikeError:
        return None
    runs.others += len(points) * len(problem.cases)
    return values


def _in_threads(runs: Runs, native: NativeRuns, points: Vector) -> Vector:
    """Return what native runs at points read, and count them."""
    chunks = np.array_split(points, -(-len(points) // _CHUNK))
    numbers: list[Vector] = []
    pool = ThreadPoolExecutor(cores())
    try:
        for done in pool.map(native.run, chunks):
            numbers.append(done[0])
            for _ in done[0]:
                runs.told()
    finally:
        pool.shutdown(cancel_futures=True)
    return np.vstack(numbers)
