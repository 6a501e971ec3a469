"""Runs of a sweep by the compiled run-time."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.errors import ModelicaLikeError, ValueOutOfRange
from modelica_like.native.batch import Batch, Reading
from modelica_like.native.expressions import key_of, with_expressions
from modelica_like.runs.readings import Output, Part, joined, leaves
from modelica_like.simulation import plan


class NativeRuns:
    """Runs of a model that differ in some parameters and inputs; several threads may use it at once.

    Args:
        model: the compiled model.
        names: paths of these parameters and inputs.
        outputs: numbers to read off every run.
        settings: arguments of `simulate` besides parameters.

    Attributes:
        notice: as of `Batch`.

    Raises:
        ModelicaLikeError: the run-time cannot do these runs; the message says why.
    """

    def __init__(
        self, model: CompiledDae, names: Sequence[str], outputs: Sequence[Output], settings: Mapping[str, Any]
    ) -> None:
        given = {name: value for name, value in settings.items() if name not in ("start", "solver", "progress")}
        end, options = plan(model, **given)
        span = float(settings.get("t0", model.begin)), end
        for output in outputs:
            if output.kind == "at" and not span[0] <= output.moment <= end:
                raise ValueOutOfRange(f"{output.name} is not within the run, {span[0]:g} s to {end:g} s.")
        self._model, self._names, self._outputs, self._begin = model, names, outputs, span[0]
        # The last reading is the time at the end, where a component may end a run earlier.
        parts = [*(x.parts(model) for x in leaves(outputs)), [Part("end", "time")]]
        extended = with_expressions(model, [part for some in parts for part in some], edges=True)
        readings = [[reading for part in some for reading in _readings(model, extended, part)] for some in parts]
        self._lasts = np.cumsum([len(some) for some in readings])
        self._batch = Batch(
            extended, [part for some in readings for part in some], options, span, settings.get("start")
        )
        self.notice = self._batch.notice
        self._places = [model.fixed_position[name] for name in names]

    def run(self, points: Any, stop: ctypes.c_int | None = None) -> tuple[Vector, dict[int, str], list[int]]:
        """Do runs one after the other.

        Args:
            points: values, shape (runs, names).
            stop: becomes nonzero when the results are no longer needed.

        Returns:
            Outputs, shape (runs, outputs), messages about invalid values by run, and the failed runs.
        """
        fixed = np.tile(np.concatenate([self._model.p, self._model.u]), (len(points), 1))
        fixed[:, self._places] = points
        p, u = np.split(fixed, [len(self._model.p)], axis=1)
        refused = self._refused(points, p)
        kept = np.array([k for k in range(len(points)) if k not in refused], int)
        numbers, failed = self._batch.run(p[kept], u[kept], stop)
        values = np.full((len(points), len(self._outputs)), np.nan)
        spans = numbers[:, -1] - self._begin
        pairs = zip(leaves(self._outputs), np.split(numbers, self._lasts, axis=1), strict=False)
        of_leaves = [leaf.combined(some, spans) for leaf, some in pairs]
        for k, number in enumerate(joined(self._outputs, of_leaves)):
            values[kept, k] = number
        values[kept[failed]] = np.nan
        return values, refused, kept[failed].tolist()

    def _refused(self, points: Any, p: Vector) -> dict[int, str]:
        """Invalid values with the reasons; only doubtful ones are checked one by one."""
        model = self._model
        fine = np.all(np.isfinite(points), axis=1)
        for column, place in enumerate(self._places):
            if place < len(model.flat_parameters):
                parameter = model.flat_parameters[place]
                fine &= _within(points[:, column], parameter.min, parameter.max) & parameter.tunable
        if any(f.min is not None or f.max is not None for f in model.flat_derived):
            for parameter, values in zip(model.flat_derived, model.equations.derived(p.T).full(), strict=True):
                fine &= np.isfinite(values) & _within(values, parameter.min, parameter.max)
        refusals: dict[int, str] = {}
        for k in np.flatnonzero(~fine).tolist():
            try:
                model.with_parameters(dict(zip(self._names, points[k].tolist(), strict=True)))
            except ModelicaLikeError as error:
                refusals[k] = str(error)
        return refusals


def _within(values: Vector, low: float | None, high: float | None) -> Any:
    return (values >= (-np.inf if low is None else low)) & (values <= (np.inf if high is None else high))


def _readings(model: CompiledDae, extended: CompiledDae, part: Part) -> list[Reading]:
    """Return what a part is in the run-time: their sum."""
    if part.kind == "change":
        return [Reading("change", model.discrete_position[part.text], part.change)]
    if part.kind == "impact":
        places = [k for k, hold in enumerate(model.held.motions) if part.text in ("", hold.component)]
        return [Reading("impact", k) for k in places]
    return [Reading(part.kind, extended.position[key_of(part)], moment=part.moment)]
