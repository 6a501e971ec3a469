"""Limits that must hold with a probability: by moments, then by sampling.

The output of a design without scatter must keep a distance from such a limit. At first that is as many standard
deviations as a normal distribution needs, to first order; then the distance of the output's own quantile, by sampling.
Both depend on the design, so the search is repeated until they stay.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from modelica_like.analyse.optimize.designs import Outcome
from modelica_like.analyse.optimize.problem import Problem
from modelica_like.analyse.optimize.sized import Outputs
from modelica_like.analyse.optimize.terms import Limit
from modelica_like.analyse.sensitivity.derivatives import sensitivities
from modelica_like.analyse.tolerance.result import Probability
from modelica_like.analyse.tolerance.scatter import read_population
from modelica_like.analyse.tolerance.tolerance import spread
from modelica_like.compile.buffers import Vector
from modelica_like.errors import extra_module
from modelica_like.simulation import quick_run

_REPEATS = 6
_STAYS, _SAMPLES_STAY = 1e-3, 1e-2
"""Change of a distance, relative to itself, that is none; a quantile by sampling is not known better."""
_PRECISION = 0.2
"""Half width of the 95 % interval of the probability of breaking a limit, relative to it: 0.06 standard deviations at
99.9 %."""


class Chances:
    """The distances of limits that must hold with a probability.

    Args:
        problem: the problem, with its tolerances.
    """

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.places = [k for k, limit in enumerate(problem.limits) if limit.probability < 1.0]
        self.outputs = Outputs([problem.limits[k].name for k in self.places], problem.sized)
        normal = extra_module("scipy.stats", "analyse").norm
        self.factors = np.array([float(normal.ppf(problem.limits[k].probability)) for k in self.places])
        self.results: tuple[Probability, ...] = ()

    def search(self, find: Callable[[Problem], Outcome]) -> tuple[Problem, Outcome]:
        """Return the problem with its distances, and where the search for it ends."""
        margins = self._margins(self.problem.begin)
        problem = self._moved(margins)
        outcome = find(problem)
        for distances, stay in ((self._margins, _STAYS), (self._sampled, _SAMPLES_STAY)):
            for _ in range(_REPEATS):
                new = distances(outcome.x)
                if np.all(np.abs(new - margins) <= stay * np.abs(new)):
                    break
                margins = new
                problem = self._moved(margins)
                outcome = find(problem)
        return problem, outcome

    def _moved(self, margins: Vector) -> Problem:
        limits = list(self.problem.limits)
        for k, margin in zip(self.places, margins, strict=True):
            sign = 1.0 if limits[k].sense == "<=" else -1.0
            limits[k] = replace(limits[k], value=limits[k].value - sign * float(margin))
        return replace(self.problem, limits=tuple(limits))

    def _margins(self, x: Vector) -> Vector:
        """Return the distances at a design, the largest of all load cases."""
        problem, question = self.problem, self.problem.question
        rows: list[Vector] = []
        for case in problem.cases:
            model = problem.model.with_parameters({**case.values, **problem.named(x)})
            # What is free can scatter, too: about the value of the design.
            population = read_population(model, question.tolerances or {}, question.correlated, question.folder)
            to = [scatter.name for scatter in population.scatters]
            of_runs = sensitivities(model, self.outputs.read, to, until=question.until, start=question.start)
            values = np.array([output.value for output in of_runs.outputs])
            slopes = self.outputs.slopes(values, of_runs.derivatives)
            rows.append(np.sqrt(np.einsum("ki,ij,kj->k", slopes, population.covariance, slopes)))
        return self.factors * np.max(rows, axis=0)

    def _sampled(self, x: Vector) -> Vector:
        """Return the distances of the outputs' quantiles at a design, the largest of all load cases."""
        problem, question = self.problem, self.problem.question
        limits = [problem.limits[k] for k in self.places]
        least = min(1.0 - limit.probability for limit in limits)
        distances: list[Vector] = []
        results: list[Probability] = []
        for case in problem.cases:
            model = problem.model.with_parameters({**case.values, **problem.named(x)})
            population = read_population(model, question.tolerances or {}, question.correlated, question.folder)
            plain = [replace(limit, text=limit.inner, probability=1.0) for limit in limits]
            run = {"until": question.until, "start": question.start}
            found = spread(model, population, (), plain, run, problem.sized, _PRECISION * least)
            names = [spread.name for spread in found.outputs]
            of_run = np.array(quick_run(model, **run).read(*self.outputs.read), float)
            nominal = self.outputs.values(of_run[None, :])[0]
            results += [replace(limit, within=case.suffix) for limit in found.limits]
            distances.append(np.array([
                _distance(limit, found.samples[:, names.index(limit.name)], float(value))
                for limit, value in zip(limits, nominal, strict=True)
            ]))  # fmt: skip
        self.results = tuple(results)
        return np.max(distances, axis=0)


def _distance(limit: Limit, samples: Vector, nominal: float) -> float:
    """Return how far an output without scatter must stay from a limit; what has no value breaks it."""
    sign = 1.0 if limit.sense == "<=" else -1.0
    outputs = np.where(np.isfinite(samples), sign * samples, np.inf)
    quantile = float(np.quantile(outputs, limit.probability, method="higher"))
    return max(quantile - sign * nominal, 0.0)
