"""Runs of a sweep by the compiled run-time."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.analyse.sensitivity.outputs import Output, expression_of
from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.errors import ModelicaLikeError, ValueOutOfRange
from modelica_like.native.batch import Batch, Reading
from modelica_like.simulation import plan

_ENERGIES = ("loss_energy", "source_energy")


class NativeRuns:
    """Runs of a model that differ in some parameters and inputs; several threads may use it at once.

    Args:
        model: the compiled model.
        names: paths of these parameters and inputs.
        outputs: numbers to read off every run.
        settings: arguments of `simulate` besides parameters.

    Raises:
        ModelicaLikeError: the run-time cannot do these runs; the message says why.
    """

    def __init__(
        self, model: CompiledDae, names: Sequence[str], outputs: Sequence[Output], settings: Mapping[str, Any]
    ) -> None:
        given = {name: value for name, value in settings.items() if name not in ("start", "solver", "progress")}
        end, options = plan(model, **given)
        span = float(settings.get("t0", 0.0)), end
        for one in outputs:
            if one.kind == "at" and not span[0] <= one.moment <= end:
                raise ValueOutOfRange(f"{one.name} is not within the run, {span[0]:g} s to {end:g} s.")
        self._model, self._names = model, names
        known = _with_energies(model, [one.path for one in outputs if one.kind != "time"])
        parts = [_readings(known, one) for one in outputs]
        self._firsts = np.cumsum([0, *(len(part) for part in parts[:-1])])
        self._batch = Batch(known, [one for part in parts for one in part], options, span, settings.get("start"))
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
        values = np.full((len(points), len(self._firsts)), np.nan)
        values[kept] = np.add.reduceat(numbers, self._firsts, axis=1)
        values[kept[failed]] = np.nan
        return values, refused, kept[failed].tolist()

    def _refused(self, points: Any, p: Vector) -> dict[int, str]:
        """Invalid values with the reasons; only doubtful ones are checked one by one."""
        model = self._model
        fine = np.all(np.isfinite(points), axis=1)
        for column, place in enumerate(self._places):
            if place < len(model.flat_parameters):
                one = model.flat_parameters[place]
                fine &= _within(points[:, column], one.min, one.max) & one.tunable
        if any(one.min is not None or one.max is not None for one in model.flat_derived):
            for one, values in zip(model.flat_derived, model.derived(p.T).full(), strict=True):
                fine &= np.isfinite(values) & _within(values, one.min, one.max)
        told: dict[int, str] = {}
        for k in np.flatnonzero(~fine).tolist():
            try:
                model.with_parameters(dict(zip(self._names, points[k].tolist(), strict=True)))
            except ModelicaLikeError as error:
                told[k] = str(error)
        return told


def _within(values: Vector, low: float | None, high: float | None) -> Any:
    return (values >= (-np.inf if low is None else low)) & (values <= (np.inf if high is None else high))


def _with_energies(model: CompiledDae, paths: Sequence[str]) -> CompiledDae:
    """Return the model with energies and powers of components among its variables, if outputs need them."""
    more = tuple(dict.fromkeys(path for path in paths if path not in model.position))
    return model.once(("energies", more), lambda: _with(model, more)) if more else model


def _with(model: CompiledDae, more: tuple[str, ...]) -> CompiledDae:
    made = [expression_of(model, path) for path in more]
    column = ca.vertcat(model.variables(*model.arguments.values()), *(expression() for expression, _ in made))
    names = model.variables.name_in()
    variables = ca.Function("variables", [*model.arguments.values()], [ca.densify(column)], names, ["variables"])
    like = model.flat_variables[0]
    further = [replace(like, path=path, unit=unit, kind="local") for path, (_, unit) in zip(more, made, strict=True)]
    twin = model.twin(variables=variables, flat_variables=(*model.flat_variables, *further), _cache={})
    for name in ("position", "units"):
        twin.__dict__.pop(name, None)
    return twin


def _readings(model: CompiledDae, output: Output) -> list[Reading]:
    """Return the parts of an output, which is their sum."""
    owner, _, last = output.path.rpartition(".")
    if output.kind == "time":
        place = model.discrete_position[output.path]
        names = model.flat_discretes[place].names
        before, after = (names.index(name) if name else -1 for name in output.change[:2])
        return [Reading("change", place, (before, after, output.change[2]))]
    place = model.position[output.path]
    if output.kind == "integral" and last in _ENERGIES:
        strikes = [k for k, one in enumerate(model.holds) if owner in ("", one.component)]
        return [Reading("work", place), *(Reading("impact", k) for k in strikes if last == "loss_energy")]
    kind: Any = "area" if output.kind == "integral" else output.kind
    return [Reading(kind, place, moment=output.moment)]
