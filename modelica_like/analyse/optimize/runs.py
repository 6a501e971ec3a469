"""Runs of all load cases at a design: outputs, and their exact derivatives by what is free."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np

from modelica_like.analyse.optimize.designs import Design, Designs
from modelica_like.analyse.optimize.modal import is_modal, modal_slopes, modal_values
from modelica_like.analyse.optimize.problem import Problem
from modelica_like.analyse.optimize.sized import Outputs
from modelica_like.analyse.sensitivity.function import SimulationFunction
from modelica_like.compile.buffers import Vector
from modelica_like.errors import ModelicaLikeError
from modelica_like.runs.readings import does_not_happen
from modelica_like.runs.solution import Solution
from modelica_like.simulation import plan, quick_run

PRECISION = 1e-6
"""Of the derivatives; the values of limits are ten times as precise, and what IPOPT ends at follows from those."""


class Values:
    """Outputs of single runs of a problem, without derivatives.

    Attributes:
        modal: outputs of the linearized drive.
        read: what is read off a run.
        of_runs: outputs of that.
        places: where the outputs of the problem are, after those of runs those of the linearized drive.
    """

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.modal = [name for name in problem.outputs if is_modal(name)]
        runs = [name for name in problem.outputs if name not in self.modal]
        self.of_runs = Outputs(runs, problem.sized)
        self.read = self.of_runs.read
        order = [*runs, *self.modal]
        self.places = [order.index(name) for name in problem.outputs]

    def at(self, parameters: Mapping[str, Any], run: Callable[..., Solution] = quick_run) -> Vector:
        """Return the outputs with values of parameters, shape (outputs,).

        Raises:
            ModelicaLikeError: the drive cannot be run.
        """
        question, problem, values = self.problem.question, self.problem, np.zeros((1, 0))
        given = dict(parameters)
        if self.read:
            solution = run(problem.model, question.until, parameters=given, start=question.start, readings=self.read)
            values = self.of_runs.values(np.array(solution.read(*self.read), float).reshape(1, -1))
        modes = modal_values(problem.model.with_parameters(given), self.modal, question.start) if self.modal else []
        return np.array([*values[0], *modes], float)[self.places]


class Runs(Designs):
    """Runs designs in all load cases, each once.

    Args:
        problem: the problem.
        told: called after each design.

    Attributes:
        alone: runs without derivatives.
        others: number of these.
        seconds: what a design takes, about: as long as the first one.
    """

    def __init__(self, problem: Problem, told: Callable[[], None]) -> None:
        super().__init__(problem.free, told)
        self.problem = problem
        question, names = problem.question, [parameter.name for parameter in problem.free]
        self.functions: list[SimulationFunction] = []
        self.alone = Values(problem)
        self.modal, self.read, self._of_runs = self.alone.modal, self.alone.read, self.alone.of_runs
        self._places, self.others = self.alone.places, 0
        begin = perf_counter()
        for case in problem.cases if self.read and names else ():
            # Of a design on the way energies are not judged, which takes a sixth of it: where the search ends they are.
            options = replace(plan(problem.model, question.until)[1], on_energy_drift="off")
            given = dict(case.values)
            run = {"until": question.until, "start": question.start, "parameters": given, "options": options}
            try:
                function = SimulationFunction(
                    problem.model, names, self.read, run, precision=PRECISION, any_sequence=True
                )
            except ModelicaLikeError as error:
                place = f" in the load case '{case.name}'" if case.name else ""
                error.add_note(f"This is the drive as it is{place}, where the optimisation begins.")
                raise
            self.functions.append(function)
        self.seconds = perf_counter() - begin

    @property
    def count(self) -> int:
        """Number of runs so far."""
        return self.others + sum(function.runs + 1 for function in self.functions)

    def run(self, x: Vector) -> tuple[Vector, Vector]:
        """Return values and derivatives, as `Designs` says."""
        if not self.free:
            return self._as_it_is()
        parts = [self._modes(x, slopes=True)]
        if self.read:
            results = [function.at(x) for function in self.functions]
            values = np.array([[output.value for output in result.outputs] for result in results])
            slopes = np.array([result.derivatives for result in results])
            of_runs = [self._of_runs.slopes(*pair) for pair in zip(values, slopes, strict=True)]
            parts = [(self._of_runs.values(values), np.array(of_runs)), *parts]
        values, slopes = (np.concatenate(part, axis=1)[:, self._places] for part in zip(*parts, strict=True))
        return values, slopes

    def _as_it_is(self) -> tuple[Vector, Vector]:
        """Return the values of the only design where nothing is free."""
        self.others = len(self.problem.cases) if self.read else 0
        values = np.array([self.alone.at(case.values) for case in self.problem.cases])
        if not np.all(np.isfinite(values)):
            raise does_not_happen(self.problem.outputs[int(np.argmin(np.isfinite(values).all(axis=0)))])
        return values, np.zeros((*values.shape, 0))

    def values_at(self, x: Vector) -> Vector | None:
        """Return the outputs only, shape (cases, outputs), None where a run is refused: no derivatives are needed."""
        known = self._known.get(x.tobytes())
        if isinstance(known, Design):
            return known.values
        try:
            parts = [self._modes(x, slopes=False)[0]]
            if self.read:
                values = np.array([function.values_at(x) for function in self.functions])
                parts = [self._of_runs.values(values), *parts]
            return np.concatenate(parts, axis=1)[:, self._places]
        except ModelicaLikeError as error:
            self.refusals.append((x.copy(), error))
            return None

    def _modes(self, x: Vector, *, slopes: bool) -> tuple[Vector, Vector]:
        """Return outputs of modes, shape (cases, outputs), and their derivatives by x."""
        problem = self.problem
        values = np.zeros((len(problem.cases), len(self.modal)))
        derivatives = np.zeros((*values.shape, len(x)))
        given = self.named(x)
        for c, case in enumerate(problem.cases if self.modal else ()):
            model = problem.model.with_parameters({**case.values, **given})
            values[c] = modal_values(model, self.modal, problem.question.start)
            if slopes:
                derivatives[c] = modal_slopes(
                    model, self.modal, problem.question.start, given, problem.low, problem.span
                )
        return values, derivatives
