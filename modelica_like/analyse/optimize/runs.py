"""Runs of all load cases at a design: outputs, and their exact derivatives by what is free."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from modelica_like.analyse.optimize.problem import Problem
from modelica_like.analyse.sensitivity.function import SimulationFunction, simulation_function
from modelica_like.compile.buffers import Vector
from modelica_like.errors import ModelicaLikeError

PRECISION = 1e-7
"""Of the derivatives: the values of limits are as precise as a tenth of a thousandth of a thousandth."""


@dataclass(frozen=True, eq=False)
class Design:
    """A design that was run.

    Attributes:
        x: values of what is free in SI units, shape (free,).
        values: shape (cases, outputs).
        slopes: derivatives by x, shape (cases, outputs, free); empty if only values were asked for.
    """

    x: Vector
    values: Vector
    slopes: Vector = field(repr=False)


class Runs:
    """Runs designs, each once.

    Attributes:
        count: number of runs so far.
        designs: in the order in which they were tried.
        refusals: designs at which a run fails or has no derivative, and the reasons.
    """

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        question, names = problem.question, [parameter.name for parameter in problem.free]
        self.functions: list[SimulationFunction] = []
        for case in problem.cases:
            run = {"until": question.until, "start": question.start, "parameters": dict(case.values)}
            try:
                function = simulation_function(
                    problem.model, names, problem.outputs, **run, precision=PRECISION, any_sequence=True
                )
            except ModelicaLikeError as error:
                place = f" in the load case '{case.name}'" if case.name else ""
                error.add_note(f"This is the drive as it is{place}, where the optimisation begins.")
                raise
            self.functions.append(function)
        self.designs: list[Design] = []
        self.refusals: list[tuple[Vector, ModelicaLikeError]] = []
        self._known: dict[bytes, Design | ModelicaLikeError] = {}

    @property
    def count(self) -> int:
        """Number of runs so far."""
        return sum(function.runs + 1 for function in self.functions)

    def at(self, x: Vector) -> Design | None:
        """Return the design at values of what is free with its derivatives, None where a run is refused."""
        known = self._known.get(x.tobytes())
        if known is None:
            known = self._known[x.tobytes()] = self._run(x)
        return known if isinstance(known, Design) else None

    def _run(self, x: Vector) -> Design | ModelicaLikeError:
        try:
            results = [function.at(x) for function in self.functions]
        except ModelicaLikeError as error:
            self.refusals.append((x.copy(), error))
            return error
        values = np.array([[output.value for output in result.outputs] for result in results])
        design = Design(x.copy(), values, np.array([result.derivatives for result in results]))
        self.designs.append(design)
        return design

    def values_at(self, x: Vector) -> Vector | None:
        """Return the outputs only, shape (cases, outputs), None where a run is refused: no replay is needed."""
        known = self._known.get(x.tobytes())
        if isinstance(known, Design):
            return known.values
        try:
            return np.array([function.values_at(x) for function in self.functions])
        except ModelicaLikeError as error:
            self.refusals.append((x.copy(), error))
            return None
