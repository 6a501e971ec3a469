"""Readings off the dense output of a run, stretch by stretch as it comes."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np

from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import MissingValue
from modelica_like.runs.polynomials import SAME, Curves
from modelica_like.runs.readings import CONDITIONS, Output, Part, joined, leaves, met, read_number
from modelica_like.runs.recorded import RecordedSolution
from modelica_like.runs.solution import Solution
from modelica_like.runs.trajectories import Trajectories
from modelica_like.solve.dense import Dense
from modelica_like.solve.recorder import Recorder, Segment

_SAME_END = 1e-6
"""Of a run: events are located within its tolerances, so a moment so near to its end is its end."""


class Number(float):
    """A number read off a run.

    Attributes:
        name: of the reading.
        unit: its coherent SI unit.
        time: of an extreme in s, else nan.
        sign: of the value of which it is the largest amount, else 1.
        change: of runs of FMUs: by how much twice as many results have changed it; else 0.
    """

    name: str
    unit: str
    time: float
    sign: int
    change: float = 0.0


class Collector:
    """Reads parts off the stretches of a run as they come.

    Args:
        model: the compiled model.
        outputs: readings, without series.
        atol: absolute tolerance of the run.
    """

    def __init__(self, model: CompiledDae, outputs: Sequence[Output], atol: float) -> None:
        self._model, self.outputs, self._leaves = model, list(outputs), leaves(outputs)
        self._parts = [leaf.parts(model) for leaf in self._leaves]
        self._every = [part for parts in self._parts for part in parts]
        self._along = [k for k, part in enumerate(self._every) if part.kind not in ("change", "impact")]
        self._between = [k for k in self._along if self._every[k].kind in ("integral", "max", *CONDITIONS)]
        self._curves, self._fits = (self._curves_of(numbers, atol) for numbers in (self._along, self._between))
        self._values = np.array([0.0 if part.kind in ("integral", "impact") else np.nan for part in self._every])
        self._times = np.full(len(self._every), np.nan)

    @property
    def along(self) -> bool:
        """Whether dense output is needed."""
        return any(self._every[k].kind != "end" for k in self._along)

    def _curves_of(self, numbers: Sequence[int], atol: float) -> Curves:
        parts = [self._every[k] for k in numbers]
        key = tuple((part.text, part.form, part.change) for part in parts)
        make = lambda: [ca.SX(part.expression(self._model)) for part in parts]  # noqa: E731
        return Curves(self._model, key, make, atol, [part.text for part in parts])

    def feed(self, dense: Dense) -> None:
        """Read stretches that follow those before."""
        if not self._along or not len(dense.begins):
            return
        for row, k in enumerate(self._along):
            if self._every[k].kind == "at":
                piece = int(np.searchsorted(dense.begins, self._every[k].moment, side="right")) - 1
                if piece >= 0 and self._every[k].moment <= dense.ends[piece]:
                    pieces, times = np.array([piece]), np.array([self._every[k].moment])
                    x, z = dense.points(pieces, times)
                    self._values[k] = self._curves.at(times, x, z, dense.d[:, pieces])[row, 0]
        if not self._between:
            return
        fitted = self._fits.fitted(dense)
        integrals = fitted.integrals()
        for row, k in enumerate(self._between):
            part = self._every[k]
            if part.kind == "integral":
                self._values[k] += integrals[row]
            elif part.kind == "max":
                self._take(k, *fitted.largest(row))
            elif np.isnan(self._values[k]):
                self._values[k] = fitted.first(row, reached=part.kind == "reach")

    def _take(self, k: int, value: float, time: float) -> None:
        previous = self._values[k]
        if not value <= previous + SAME * abs(previous):
            self._times[k] = time
        self._values[k] = np.fmax(previous, value)

    def finish(self, record: Recorder | Solution) -> list[Number]:
        """Return the numbers, with both sides of every event of the run and with its end."""
        segments = record.segments
        if self._along:
            self._read_ends(segments)
        for k, part in enumerate(self._every):
            if part.kind == "impact":
                self._values[k] = sum(impact.energy for impact in record.impacts if part.text in ("", impact.component))
            elif part.kind == "change":
                self._values[k] = self._change(record, part)
        span, first = float(segments[-1].times[-1] - segments[0].times[0]), 0
        numbers: list[Number] = []
        for leaf, parts in zip(self._leaves, self._parts, strict=True):
            values, times = (x[first : first + len(parts)] for x in (self._values, self._times))
            best = int(np.argmax(values)) if leaf.kind == "peak" else 0
            numbers.append(_number(leaf, float(leaf.combined(values, span)), float(times[best]), -1 if best else 1))
            first += len(parts)
        pairs = zip(self.outputs, joined(self.outputs, numbers), strict=True)
        return [_number(output, value[0]) if output.operands else value for output, value in pairs]

    def _read_ends(self, segments: Sequence[Segment]) -> None:
        places = [(segment, k) for segment in segments for k in (0, -1)]
        times = np.array([piece.times[k] for piece, k in places])
        x, z = (np.array([getattr(piece, name)[:, k] for piece, k in places]).T for name in "xz")
        values = self._curves.at(times, x, z, np.array([piece.d for piece, _ in places]).T)
        latest = times[-1] + _SAME_END * (times[-1] - times[0])
        for row, k in enumerate(self._along):
            part = self._every[k]
            if part.kind == "end" or (part.kind == "at" and times[-1] <= part.moment <= latest):
                self._values[k] = values[row, -1]
            elif part.kind == "max":
                best = int(np.argmax(values[row]))
                self._take(k, float(values[row, best]), float(times[best]))
            elif part.kind in CONDITIONS and (true := met(part.kind, values[row])).any():
                self._values[k] = np.fmin(self._values[k], times[int(np.argmax(true))])

    def _change(self, record: Recorder | Solution, part: Part) -> float:
        before, after, number = part.change
        names = self._model.flat_discretes[self._model.discrete_position[part.text]].names
        times = [
            event.time
            for event in record.events
            if event.mode == part.text
            and (before < 0 or event.before == names[before])
            and (after < 0 or event.after == names[after])
        ]
        return times[number - 1] if len(times) >= number else np.nan


def _number(output: Output, value: float, time: float = np.nan, sign: int = 1) -> Number:
    number = Number(value)
    number.name, number.unit, number.time, number.sign = output.name, str(output.unit), time, sign
    return number


def collector(model: CompiledDae, names: Sequence[str], atol: float) -> Collector:
    """Return a collector of readings by name.

    Raises:
        UnknownName: a reading is not known.
        ValueOutOfRange: it is a trajectory.
    """
    return Collector(model, [read_number(model, name) for name in names], atol)


def dense_of(solution: Trajectories, what: str) -> Dense:
    """Return the dense output that a run has kept.

    Raises:
        MissingValue: it has none.
    """
    if isinstance(solution, RecordedSolution):
        raise MissingValue(
            f"{what} cannot be read off {solution.model.name}: between its results nothing is known.",
            advice=solution.advice,
        )
    assert isinstance(solution, Solution)
    if solution.dense is None:
        raise MissingValue(
            f"{what} cannot be read off this run: what happens between its results was not kept.",
            advice=f'Ask before the run: simulate(…, readings=["{what}"]).',
        )
    return solution.dense()
