"""Readings off results alone, of runs without equations: polynomials through neighbours, repeated until they settle."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import ceil
from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.compile.compiled import Vector
from modelica_like.errors import MissingValue, UnitError
from modelica_like.language.units import ONE, Unit, parse_unit
from modelica_like.runs.collect import Collector, Number, collector, dense_of
from modelica_like.runs.polynomials import Curves, Fitted
from modelica_like.runs.readings import CONDITIONS, Output, by_output, expression_of, leaves, read_output
from modelica_like.runs.recorded import RecordedModel, RecordedSolution
from modelica_like.runs.solution import Solution
from modelica_like.runs.trajectories import ENERGY_TERMS, Trajectories
from modelica_like.solve.dense import Dense
from modelica_like.solve.recorder import Segment

_WIDE, _NARROW, _STRAIGHT = 6, 4, 2
"""Results that a polynomial goes through: the best, the one that it is compared with, and a straight line."""
_ROUGH = 0.01
"""Difference of both, over the range of the results, above which what happens in between is unknown: a line is safe."""
_TESTED = (0.25, 0.5, 0.75)
_NOISE = 1e-12
_TIMES = ("time", *CONDITIONS, "duration")
SETTLED = 1e-5
"""Of the largest amount (of times: of the run): what may change with twice as many results, twice in a row."""
_LEAST, _MOST = 200, 100_000
"""Numbers of results with which repeating begins and ends."""


class OfResults(Dense):
    """What results tell of the time between them: lines in a table, polynomials of degree five in runs of FMUs."""

    def __init__(self, run: RecordedSolution) -> None:
        self._time, self._values = run.time, run.continuous
        rows = np.arange(len(run.time))
        # Time stands still at an event, and modes change.
        breaks = (np.diff(run.time) <= 0) | (np.diff(run.discretes) != 0).any(axis=0)
        stretch = np.concatenate([[0], np.cumsum(breaks)])
        first, last = (np.searchsorted(stretch, stretch, side=side) for side in ("left", "right"))
        self._left = rows[:-1][np.diff(run.time) > 0]
        self._first, self._last = first[self._left], last[self._left] - 1
        # A mode changes at an unknown time between two results: there is a straight line.
        self._last = np.maximum(self._last, self._left + 1)
        self.begins, self.ends = run.time[self._left], run.time[self._left + 1]
        self.d = run.discretes[:, self._left]
        self.stretches = tuple(
            Segment(run.time[some], run.continuous[:, some], np.zeros((0, len(some))), run.discretes[:, some[0]])
            for some in np.split(rows, np.flatnonzero(breaks) + 1)
        )
        every = np.arange(len(self._left))
        self._straight = np.full((len(self._values), len(every)), run.measured) | breaks[self._left]
        for share in _TESTED if not run.measured else ():
            times = self.begins + share * (self.ends - self.begins)
            (wide, spread), (narrow, _) = (self._through(every, times, width) for width in (_WIDE, _NARROW))
            self._straight |= np.abs(wide - narrow) > _ROUGH * spread

    def points(self, pieces: Any, times: Vector) -> tuple[Vector, Vector]:
        """Return the values of all columns."""
        straight = self._straight[:, pieces]
        values = self._through(pieces, times, _STRAIGHT)[0]
        if not straight.all():
            values = np.where(straight, values, self._through(pieces, times, _WIDE)[0])
        return values, np.zeros((0, len(times)))

    def _through(self, pieces: Any, times: Vector, width: int) -> tuple[Vector, Vector]:
        """Values at times of the polynomials through results around pieces, and the ranges of those results."""
        left, low, high = (x[pieces] for x in (self._left, self._first, self._last))
        widths = np.minimum(width, high - low + 1)
        values, spread = np.zeros((2, len(self._values), len(times)))
        for size in np.unique(widths).tolist():
            some = np.flatnonzero(widths == size)
            begin = np.clip(left[some] - (size // 2 - 1), low[some], high[some] - size + 1)
            near = begin[:, None] + np.arange(size)
            knots, others = self._time[near], ~np.eye(size, dtype=bool)
            ratios = (times[some, None, None] - knots[:, None, :]) / np.where(
                others, knots[:, :, None] - knots[:, None, :], 1.0
            )
            weights = np.prod(ratios, axis=2, where=others)
            values[:, some] = np.einsum("cnk,nk->cn", self._values[:, near], weights)
            spread[:, some] = np.ptp(self._values[:, near], axis=2)
        return values, spread


@dataclass(frozen=True)
class _Columns:
    """The columns of results as a model whose states are its variables."""

    recorded: RecordedModel

    def __post_init__(self) -> None:
        recorded, attributes = self.recorded, vars(self)
        constants = {name: value for name, value in recorded.parameters.items() if np.isscalar(value)}
        attributes.update(
            name=recorded.name, position=recorded.position, discrete_position=recorded.discrete_position,
            components=recorded.components, flat_variables=recorded.flat_variables, u=np.zeros(0),
            parameter_position={name: k for k, name in enumerate(constants)}, p=np.array([*constants.values()], float),
            units={v.path: _unit(v.unit) for v in (*recorded.flat_variables, *recorded.flat_discretes)},
            flat_discretes=[SimpleNamespace(path=d.path, names=_names(d.names)) for d in recorded.flat_discretes],
        )  # fmt: skip
        attributes |= {"held": recorded.held, "equations": SimpleNamespace(variables=lambda *given: given[1])}
        sizes = {
            "t": 1,
            "x": len(recorded.position),
            "z": 0,
            "p": len(constants),
            "u": 0,
            "d": len(attributes["flat_discretes"]),
        }
        attributes["arguments"] = {name: ca.SX.sym(name, size) for name, size in sizes.items()}

    def energy(self, *arguments: Any) -> Any:
        rows = [[f"{component}.{term}" for term in ENERGY_TERMS] for component in self.recorded.components]
        x, position = arguments[1], self.recorded.position
        return ca.vertcat(
            *(ca.horzcat(*(x[position[value]] if value in position else 0 for value in row)) for row in rows)
        )

    def once(self, _: Any, make: Callable[[], Any]) -> Any:
        return make()


def _unit(text: str) -> Unit:
    try:
        return parse_unit(text or "1")
    except UnitError:  # a unit of another tool
        return ONE


def _names(names: Any) -> tuple[str, ...]:
    return tuple(names.get(k, "") for k in range(int(max(names)) + 1)) if names else ()


def read_results(run: RecordedSolution, names: Sequence[str]) -> tuple[list[Number], Vector]:
    """Read numbers off results alone, and the size of each: the largest amount of what is read, or of times the run.

    Raises:
        UnknownName: a reading is not known.
    """
    model: Any = _Columns(run.model)
    outputs, dense = [read_output(model, name) for name in names], OfResults(run)
    parts = leaves(outputs)
    sized = [replace(part, kind="peak") if part.kind not in _TIMES else replace(part, kind="end", path="time")
             for part in parts]  # fmt: skip
    readings = Collector(model, [*outputs, *parts, *sized], _NOISE)
    readings.feed(dense)
    record: Any = SimpleNamespace(segments=dense.stretches, events=run.events, impacts=())
    numbers, span = readings.finish(record), float(run.time[-1] - run.time[0])
    values, largest = (numbers[len(outputs) + k * len(parts) :][: len(parts)] for k in (0, 1))
    sizes = [span if part.kind in _TIMES else abs(size) * (span if part.kind == "integral" else 1.0)
             for part, size in zip(parts, largest, strict=True)]  # fmt: skip
    return numbers[: len(outputs)], _sizes(outputs, values, sizes)


def _sizes(outputs: Sequence[Output], values: Sequence[float], sizes: Sequence[float]) -> Vector:
    """Sizes of outputs from the values and sizes of their leaves: that of a formula is the sum of what these do."""
    result: list[float] = []
    for output, some, of in zip(outputs, by_output(outputs, values), by_output(outputs, sizes), strict=True):
        slopes = np.abs(output.formula()(np.array(some))[1].full()[0]) if output.operands else np.ones(1)
        result.append(float(slopes @ np.array(of)))
    return np.nan_to_num(np.array(result))


def read_after(run: Trajectories, names: Sequence[str]) -> list[Number]:
    """Read numbers off the dense output that a run has kept, or off the rows of a measured table.

    Raises:
        UnknownName: a reading is not known.
        MissingValue: its dense output was not kept, or a value waves too often for it (`Curves.fitted`).
    """
    if isinstance(run, RecordedSolution) and run.measured:
        return read_results(run, names)[0]
    source: Any = run if isinstance(run, Solution) else dense_of(run, names[0])
    readings = collector(source.model, names, source.options.atol)
    if readings.along:
        readings.feed(dense_of(source, names[0]))
    return readings.finish(source)


def along(run: Any, *texts: str) -> tuple[Fitted, str]:
    """Return variables and formulas as polynomials over a whole run, and the unit of the first one.

    Raises:
        UnknownName: there is no such variable.
        MissingValue: the dense output of the run was not kept, or a value waves too often for it (`Curves.fitted`).
    """
    dense: Dense = OfResults(run) if run.measured else dense_of(run, texts[0])
    model: Any = _Columns(run.model) if run.measured else run.model
    noise = _NOISE if run.measured else run.options.atol
    expressions = [expression_of(model, text) for text in texts]
    curves = Curves(model, texts, lambda: [ca.SX(make()) for make, _ in expressions], noise, texts)
    return curves.fitted(dense), str(expressions[0][1])


def needed_outputs(run: RecordedSolution, readings: Sequence[str]) -> list[str]:
    """Return modes, which tell where values jump, and what readings may name, energies of parts included."""
    owners = [(variable.path, variable.path.rpartition(".")[0]) for variable in run.model.flat_variables]
    named = [path for path, owner in owners if any((owner or path) in name for name in readings)]
    return [*named, *run.model.discrete_position]


def settled(run: RecordedSolution, again: Callable[[int], RecordedSolution], names: Sequence[str]) -> dict[str, Number]:
    """Read numbers off a run that is repeated with twice as many results until they no longer change.

    Args:
        run: its results.
        again: repeats it with so many times as many.
        names: of the readings.

    Raises:
        UnknownName: a reading is not known.
        MissingValue: a number still changes with many results.
    """
    before, _ = read_results(run, names)
    calm, times, here, changes = 0, max(ceil(_LEAST / len(run.time)) // 2, 1), run, np.full(len(names), np.inf)
    unsettled = changes > 0
    while calm < 2 and len(here.time) < _MOST:
        times *= 2
        here = again(times)
        now, sizes = read_results(here, names)
        changes = np.where(np.isnan(now) & np.isnan(before), 0.0, np.abs(np.subtract(now, before)))
        unsettled = ~(changes <= SETTLED * sizes + _NOISE)
        calm, before = 0 if unsettled.any() else calm + 1, now
    if calm < 2:
        worst = int(np.argmax(unsettled))
        raise MissingValue(
            f"{names[worst]} of {run.model.name} is not known: it changes by {changes[worst]:.2g} between "
            f"{len(here.time) // 2} and {len(here.time)} results.",
            advice="Ask for a shorter run, or simulate the netlist.",
        )
    for number, change in zip(before, changes, strict=True):
        number.change = float(change)
    return dict(zip(names, before, strict=True))
