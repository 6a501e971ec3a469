"""Trajectories from other sources (an FMU, a table), read like a solution."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np

from modelica_like.compile.compiled import Vector
from modelica_like.errors import MissingValue, Source, UnknownName, did_you_mean
from modelica_like.runs.energy import EnergyBalance, EnergyRow
from modelica_like.runs.trajectories import ENERGY_TERMS, Statistics, Trajectories, Values
from modelica_like.solve.recorder import Event


@dataclass(frozen=True)
class RecordedVariable:
    """A column.

    Attributes:
        path: name.
        unit: as spelled in its source.
        description: from its source.
        kind: `output`, `local`, `input`, `discrete`.
        names: of the values of a mode; empty otherwise.
        hidden: always false: what stands in a file has been declared.
    """

    path: str
    unit: str = "1"
    description: str = ""
    kind: str = "output"
    names: Mapping[int, str] = field(default_factory=dict)
    hidden: bool = False


@dataclass(frozen=True)
class RecordedModel:
    """A model without known equations: its name, columns and parameters."""

    name: str
    flat_variables: tuple[RecordedVariable, ...]
    flat_discretes: tuple[RecordedVariable, ...]
    parameters: Mapping[str, float]
    held: ClassVar[Any] = SimpleNamespace(motions=())

    @cached_property
    def position(self) -> dict[str, int]:
        """Row of each continuous variable."""
        return {variable.path: k for k, variable in enumerate(self.flat_variables)}

    @cached_property
    def discrete_position(self) -> dict[str, int]:
        """Row of each mode or discrete value."""
        return {variable.path: k for k, variable in enumerate(self.flat_discretes)}

    @cached_property
    def components(self) -> tuple[str, ...]:
        """Paths that have an energy term."""
        owners = (path.rpartition(".") for path in self.position)
        return tuple(dict.fromkeys(owner for owner, _, term in owners if term in ENERGY_TERMS))


class RecordedSolution(Trajectories):
    """Trajectories of an FMU or of a table.

    All functions without equations work as for a `Solution`: `[...]`, `plot`, `at`, `final`, `events`, `to_pandas`.
    The energy balance is the integral of the columns `….loss_power`, `….stored_energy` and `….source_power`, if there
    are any.

    Args:
        model: names and units.
        time: shape (n,), in s; a repeated time gives the values before and after an event.
        values: continuous variables, shape (variables, n).
        discretes: modes and discrete values, shape (discretes, n).
        seconds: wall time of the run.

    Attributes:
        advice: how to learn a number for which results are not enough.
    """

    advice = "Ask before the run: run_fmu(…, readings=[…]), or simulate the netlist."

    def __init__(self, model: RecordedModel, time: Vector, values: Vector, discretes: Vector, seconds: float) -> None:
        self._time, self._values_table, self._discretes = time, values, discretes
        self.model: RecordedModel = model
        events: list[Event] = []
        for variable, row in zip(model.flat_discretes, discretes, strict=True):
            for k in np.flatnonzero(np.diff(row)):
                before, after = (variable.names.get(int(value), f"{value:g}") for value in row[k : k + 2])
                events.append(Event(float(time[k + 1]), variable.path, before, after, Source("")))
        self.events = tuple(sorted(events, key=lambda event: event.time))
        self.statistics = Statistics(len(time), 0, 0, len(self.events), seconds)

    @property
    def time(self) -> Vector:
        """Times of the results in s."""
        return self._time

    @property
    def continuous(self) -> Vector:
        """Values of the continuous variables, shape (variables, n)."""
        return self._values_table

    @property
    def discretes(self) -> Vector:
        """Values of modes and discrete variables, shape (discretes, n)."""
        return self._discretes

    def __getitem__(self, key: str | Any) -> Vector:
        path, model = self.path(key), self.model
        if path == "time":
            return self._time
        if path in model.position:
            return self._values_table[model.position[path]]
        if path in model.discrete_position:
            return self._discretes[model.discrete_position[path]]
        if path in model.parameters:
            return np.full(len(self._time), model.parameters[path])
        names = [*self.names, *model.parameters]
        raise UnknownName(f"{model.name} has no variable '{path}'{did_you_mean(path, names) or '.'}")

    def __contains__(self, key: object) -> bool:
        path, model = self.path(key), self.model
        return any(path in positions for positions in (model.position, model.discrete_position, model.parameters))

    def at(self, t: float | str) -> Values:
        """Return all variables at a time, interpolated between the results (after an event at that time).

        Raises:
            ValueOutOfRange: the time is not within the run.
        """
        t = self._within(t)
        k = int(np.searchsorted(self._time, t, side="right")) - 1
        column = self._values_table[:, k]
        if t > self._time[k]:
            share = (t - self._time[k]) / (self._time[k + 1] - self._time[k])
            column = column + share * (self._values_table[:, k + 1] - column)
        return self._one(t, column, k)

    @property
    def final(self) -> Values:
        """All variables at the end."""
        return self._one(self._time[-1], self._values_table[:, -1], -1)

    def _one(self, t: float, column: Vector, k: int) -> Values:
        return Values(RecordedSolution(self.model, np.array([t]), column[:, None], self._discretes[:, k, None], 0.0))

    def energy(self) -> EnergyBalance:
        """Return the energy balance from the columns.

        The power through connectors is not known; it is computed from each component's balance. So only the sum of
        all components is a check.

        Raises:
            MissingValue: there is no energy term.
        """
        if not self.model.components:
            raise MissingValue(
                f"{self.model.name} has no energies.",
                why="It has no variables ….stored_energy, ….loss_power or ….source_power.",
            )
        rows = tuple(self._energy_row(component) for component in self.model.components)
        throughput = max(
            sum(abs(row.inflow) for row in rows), sum(abs(row.source) for row in rows), sum(abs(r.lost) for r in rows)
        )
        return EnergyBalance(rows, throughput)

    def _energy_row(self, component: str) -> EnergyRow:
        def integral(term: str) -> float:
            name = f"{component}.{term}"
            return float(np.trapezoid(self[name], self._time)) if name in self else 0.0

        name = f"{component}.stored_energy"
        stored = float(self[name][-1] - self[name][0]) if name in self else 0.0
        lost, source = integral("loss_power"), integral("source_power")
        return EnergyRow(component, stored + lost - source, source, stored, lost, 0.0, 0.0, 0.0)

    def __repr__(self) -> str:
        span = f"t = {self._time[0]:g} … {self._time[-1]:g} s"
        return f"<Solution of {self.model.name}: {len(self.names)} variables, {span}, {len(self.events)} mode changes>"
