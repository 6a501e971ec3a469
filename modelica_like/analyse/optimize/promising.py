"""Which of very many combinations of choices are worth a search: Optuna tries some of them by single native runs.

Optuna is by T. Akiba, S. Sano, T. Yanase, T. Ohta and M. Koyama (2019), its sampler, the tree-structured Parzen
estimator, by J. Bergstra (2011). What is free is moved together with what is chosen.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from modelica_like.analyse.optimize.choices import Choice, together, with_choice
from modelica_like.analyse.optimize.designs import FEASIBLE
from modelica_like.analyse.optimize.problem import Problem, Question, make_problem
from modelica_like.analyse.optimize.runs import Values
from modelica_like.analyse.optimize.solve import Scale
from modelica_like.compile.buffers import Vector
from modelica_like.errors import ModelicaLikeError, extra_module
from modelica_like.language import Component
from modelica_like.runs.readings import does_not_happen

TRIALS = 400
"""Combinations with values of what is free: twice as many as are enumerated, as most cost one run and no gradient."""
FINISHED = 10
"""Combinations that are optimised then."""


@dataclass(frozen=True)
class Promise:
    """How the combinations were found.

    Attributes:
        all: number of combinations.
        tried: number of those that were run.
        runs: number of simulations.
    """

    all: int
    tried: int
    runs: int

    def __str__(self) -> str:
        return (
            f"Of {self.all} combinations Optuna tried {self.tried} by single runs, and the best {FINISHED} of these "
            "were optimised: another one may be better."
        )


def promising(
    drive: Component, question: Question, options: Sequence[Sequence[Choice]], seed: int, told: Callable[[], None]
) -> tuple[list[Choice], Promise]:
    """Return the most promising combinations.

    Args:
        drive: the drive.
        question: what is asked.
        options: what there is to choose from, by path.
        seed: of the sampler.
        told: called after each trial.

    Raises:
        MissingExtra: Optuna is not installed.
        ModelicaLikeError: the drive has an error, or no combination can be run.
    """
    optuna = extra_module("optuna", "choose")
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    study = optuna.create_study(sampler=optuna.samplers.TPESampler(seed=seed, multivariate=True))
    trials = _Trials(drive, question, options)
    names = [f"choice {k}" for k in range(len(options))]
    best: dict[tuple[int, ...], tuple[float, float]] = {}
    failure: ModelicaLikeError | None = None
    for _ in range(TRIALS):
        trial = study.ask()
        places = tuple(_place(trial, *pair) for pair in zip(names, options, strict=True))
        free = np.array([trial.suggest_float(p.name, 0.0, 1.0) for p in trials.problem.free])
        told()
        try:
            objective, excess = trials.at(places, free)
        except ModelicaLikeError as error:
            failure = error
            study.tell(trial, state=optuna.trial.TrialState.FAIL)
            continue
        trial.set_constraint("limits", excess - FEASIBLE)
        study.tell(trial, objective)
        best[places] = min(best.get(places, (np.inf, np.inf)), (max(excess, FEASIBLE), objective))
    if not best:
        assert failure is not None
        raise failure
    found = sorted(best, key=lambda places: best[places])[:FINISHED]
    count = int(np.prod([len(choices) for choices in options]))
    return [trials.choice(places) for places in found], Promise(count, len(best), trials.runs)


def _place(trial: Any, name: str, choices: Sequence[Choice]) -> int:
    """Return which one to try: numbers have an order, rows of a table and words have none."""
    numbers = [value for choice in choices for value in choice.labels.values()]
    if all(isinstance(number, int | float) for number in numbers) and numbers == sorted(numbers):
        return trial.suggest_int(name, 0, len(choices) - 1)
    return trial.suggest_categorical(name, range(len(choices)))


class _Trials:
    """Runs combinations: of one model if that can have their values, or else of a model for each."""

    def __init__(self, drive: Component, question: Question, options: Sequence[Sequence[Choice]]) -> None:
        self.drive, self.question, self.options, self.runs = drive, question, options, 0
        self.problem = make_problem(drive, question)
        try:
            for choices in options:
                for choice in choices:
                    self.problem.model.with_parameters(dict(choice.values))
            self._one_model = True
        except ModelicaLikeError:
            self._one_model = False  # structure, words, parameters that are formulas
        self._known: dict[tuple[int, ...], Problem] = {}
        self._scale: Scale | None = None

    def choice(self, places: Sequence[int]) -> Choice:
        """Return a combination."""
        return together([choices[place] for choices, place in zip(self.options, places, strict=True)])

    def at(self, places: tuple[int, ...], free: Vector) -> tuple[float, float]:
        """Return the objective and the excess of a combination, with values of what is free within 0 and 1.

        Raises:
            ModelicaLikeError: it cannot be run, or has no such event.
        """
        choice = self.choice(places)
        problem, values = (self.problem, choice.values) if self._one_model else (self._of(places, choice), {})
        x = problem.low + problem.span * free
        given = {**values, **problem.named(x)}
        alone = Values(problem)
        self.runs += len(problem.cases)
        outputs = np.array([alone.at({**case.values, **given}) for case in problem.cases])
        if not np.all(np.isfinite(outputs)):
            raise does_not_happen(problem.outputs[int(np.argmin(np.isfinite(outputs).all(axis=0)))])
        self._scale = self._scale or Scale(problem, outputs)
        return self._scale.measures(outputs)

    def _of(self, places: tuple[int, ...], choice: Choice) -> Problem:
        if places not in self._known:
            self._known[places] = make_problem(with_choice(self.drive, choice), self.question)
        return self._known[places]
