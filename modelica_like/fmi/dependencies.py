"""Dependencies of variables: the true sparsity, through implicit equations and the initialization."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca

from modelica_like.compile.compiled import CompiledDae
from modelica_like.fmi.interface import FmuVariable, Interface
from modelica_like.fmi.reach import Reach
from modelica_like.fmi.start_tables import AT_REST, StartTables

Known = tuple[str, int]
"""An argument of the model's functions: its name (t, x, p, u, start) and a position."""

Rows = list[set[Known]]


@dataclass(frozen=True)
class Following:
    """Direct dependencies through the implicit equations of a model."""

    model: CompiledDae

    def inputs_of(self, position: int) -> set[int]:
        """Numbers of the inputs on which a variable depends directly."""
        return {k for name, k in self._through_implicit(self._row("variables", position)) if name == "u"}

    @cached_property
    def _reaches(self) -> dict[str, Reach]:
        return {}

    def _row(self, name: str, position: int) -> set[Known]:
        if name not in self._reaches:
            self._reaches[name] = Reach(self.model.functions[name])
        return set(self._reaches[name].elements(position))

    @cached_property
    def _implicit(self) -> Rows:
        """Dependencies of each implicit unknown, by its own block and those before."""
        rows = sparsity_rows(self.model.equations.alg)
        implicit = [{k for name, k in row if name == "z"} for row in rows]
        return solved_rows(implicit, [{quantity for quantity in row if quantity[0] != "z"} for row in rows], len(rows))

    def _through_implicit(self, row: set[Known]) -> set[Known]:
        result = {quantity for quantity in row if quantity[0] != "z"}
        return result.union(*(self._implicit[k] for name, k in row if name == "z"))


@dataclass(frozen=True)
class Dependencies(Following):
    """Dependencies of a model's unknowns on the variables set by an importer, by value references."""

    interface: Interface

    def continuous(self, unknown: FmuVariable) -> list[int]:
        """Time, states and inputs on which a derivative, output or event indicator depends during a run."""
        quantities = self._through_implicit(self._own(unknown))
        return self._references(quantities, ("t", "x", "u"))

    def initial(self, unknown: FmuVariable) -> list[int]:
        """Time, parameters, inputs and start values on which an unknown depends in initialization mode."""
        kind, index = unknown.slot
        quantities = self._initial_states[index] if kind == "state" else self._at_start(self._own(unknown))
        return self._references(quantities, ("t", "p", "u", "start", "discrete"))

    @cached_property
    def _reaches(self) -> dict[str, Reach]:
        return {"variables": self.interface.reach}

    def _own(self, unknown: FmuVariable) -> set[Known]:
        kind, index = unknown.slot
        rows = {"der": "ode", "variable": "variables", "guard": "guards", "derived": "derived"}
        if kind in rows:
            return self._row(rows[kind], index)
        names = {"state": "x", "input": "u", "parameter": "p", "time": "t", "discrete": "d"}
        return {(names[kind], index)}

    # -- initialization ----------------------------------------------------------------------------------------------

    def _at_start(self, row: Iterable[Known]) -> set[Known]:
        """Replace states, implicit unknowns and modes by their dependencies at the start."""
        result: set[Known] = set()
        for name, k in self._through_implicit(set(row)):
            if name == "x":
                result |= self._initial_states[k]
            elif name == "d":
                result |= self._initial_modes[k]
            else:
                result.add((name, k))
        return result

    @cached_property
    def _initial_modes(self) -> Rows:
        """Modes depend on their start conditions, discrete values on their start, shares on all that decides modes."""
        rows: Rows = [set() for _ in range(self.model.discrete_size)]
        for circuit in self.model.held.circuits:
            rows[circuit.entries] = [self._everything] * (circuit.shares.end - circuit.first)
        if self.model.held.ideal:
            part = self.model.held.ideal.rows
            rows[part.entries] = [self._everything] * (part.end - part.first)
        starts = sparsity_rows(self.model.starts.discretes)
        for k, discrete in enumerate(self.model.flat_discretes):
            rows[k] = {("discrete", k)} if not discrete.names else {d for d in starts[k] if d[0] in "tpu"}
        conditions = sparsity_rows(self.model.starts.conditions)
        for row, (mode, _, _) in zip(conditions, self.model.starts.modes, strict=True):
            known = [one for one in self._through_implicit(row) if one[0] != "d"]
            rows[mode] = rows[mode].union(*(self._initial_states[one[1]] if one[0] == "x" else {one} for one in known))
        return rows

    def _start_value(self, position: int) -> set[Known]:
        """A start value: set by an importer, or its formula."""
        return {("start", position)} | {q for q in self._row("start_values", position) if q[0] in "tpu"}

    @cached_property
    def _initial_states(self) -> Rows:
        model, tables = self.model, self.interface.start
        everything = self._everything
        if tables.steady is not None:
            return [everything for _ in model.states]
        rows: Rows = [set() for _ in model.states]
        for state, position, _ in reversed(tables.direct):
            rows[state] = self._start_value(position)
        solved = self._solved_starts(tables, rows)
        for place, column in enumerate(tables.plan.columns):
            if column < len(model.states):
                rows[column] = solved[place]
        return rows

    def _solved_starts(self, tables: StartTables, direct: Rows) -> Rows:
        """Dependencies of the unknowns of the start system, by its block triangular form."""
        place = {column: k for k, column in enumerate(tables.plan.columns)}
        nx = len(self.model.states)
        ny = tables.plan.system.function.size1_out(0)
        offsets = {"x": 0, "y": nx, "z": nx + ny}
        given = {row: position for position, _, row in tables.rows if position != AT_REST}
        # Undetermined reactions keep their guesses.
        guessed = {nx + ny + z: self._start_value(position) for z, position, _ in tables.z_guesses}
        every = sparsity_rows(tables.plan.system.function, output=2) if tables.plan.columns else []
        causes_of: list[set[int]] = []
        outer: Rows = []
        for row in tables.plan.wanted:
            columns = {offsets[name] + k for name, k in every[row] if name in offsets}
            causes_of.append({place[column] for column in columns if column in place})
            causes = {quantity for quantity in every[row] if quantity[0] in "tpu"}
            outside = columns.difference(place)
            causes = causes.union(*(direct[k] if k < nx else guessed.get(k, set()) for k in outside))
            outer.append(causes | (self._start_value(given[row]) if row in given else set()))
        return solved_rows(causes_of, outer, len(tables.plan.columns))

    @cached_property
    def _everything(self) -> set[Known]:
        model = self.model
        counts = {"t": 1, "p": len(model.p), "u": len(model.u), "start": len(model.starts.entries)}
        return {(name, k) for name, count in counts.items() for k in range(count)}

    # -- value references --------------------------------------------------------------------------------------------

    @cached_property
    def _reference(self) -> dict[Known, int]:
        names = {"time": "t", "state": "x", "parameter": "p", "input": "u"}
        references = {
            (names[v.slot[0]], v.slot[1]): v.reference for v in self.interface.variables if v.slot[0] in names
        }
        for variable in self.interface.variables:
            if variable.start_entry is not None and variable.initial == "exact":
                references["start", variable.start_entry] = variable.reference
            if variable.slot[0] == "discrete" and variable.initial == "exact":
                references["discrete", variable.slot[1]] = variable.reference
        return references

    def _references(self, quantities: Iterable[Known], names: Sequence[str]) -> list[int]:
        return sorted(self._reference[q] for q in quantities if q[0] in names and q in self._reference)


def sparsity_rows(function: Any, output: int = 0) -> Rows:
    """For every row of a function's result the arguments on which it depends."""
    reach = Reach(function, output)
    return [set(reach.elements(row)) for row in range(len(reach.rows))]


def solved_rows(inner: Sequence[set[int]], outer: Rows, unknowns: int) -> Rows:
    """Dependencies of each unknown of a square system.

    Args:
        inner: unknowns in each equation.
        outer: known values in each equation.
        unknowns: their number.
    """
    if not unknowns:
        return []
    places = [(row, column) for row, columns in enumerate(inner) for column in columns]
    pattern = ca.Sparsity.triplet(len(inner), unknowns, [row for row, _ in places], [column for _, column in places])
    _, row_order, column_order, row_blocks, column_blocks, *_ = pattern.btf()
    result: Rows = [set() for _ in range(unknowns)]
    # The form is lower block triangular: a block needs those before it.
    for block in range(len(row_blocks) - 1):
        rows = row_order[row_blocks[block] : row_blocks[block + 1]]
        columns = set(column_order[column_blocks[block] : column_blocks[block + 1]])
        total: set[Known] = set().union(*(outer[row] for row in rows))
        total = total.union(*(result[column] for row in rows for column in inner[row] - columns))
        for column in columns:
            result[column] = total
    return result
