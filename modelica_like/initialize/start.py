"""Start values: from what is given to all states."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.compile.buffers import buffered
from modelica_like.compile.compiled import CompiledDae, StartEntry, Vector
from modelica_like.errors import ContradictingStart, InitializationError, MissingStart
from modelica_like.initialize.matching import Matching
from modelica_like.initialize.point import Point, call, solve_implicit

_CONSISTENT = 1e-8
_MAX_NEWTON = 50
_DENSE = 100


@dataclass
class Rows:
    """Start values that must hold: node and value, or a state that begins at zero."""

    entries: list[StartEntry] = field(default_factory=list)
    states: list[int] = field(default_factory=list)


class StartProblem:
    """From start values to states.

    Those of states are taken as they are; those of other variables are equations for the states that are left.
    The equations are solved together with the explicit equations between states and those variables (as sparse as the
    model itself), and with
    the implicit ones.
    """

    def __init__(self, model: CompiledDae, point: Point) -> None:
        self.model = model
        values = call(model, model.start_values, point)
        self.values = {id(entry): float(value) for entry, value in zip(model.starts, values, strict=True)}
        self.direct: dict[int, StartEntry] = {}
        self.general: list[StartEntry] = []
        for entry in model.starts:
            if entry.strength == "guess":
                self._guess(point, entry)
            elif entry.strength == "fixed" and entry.state is not None:
                self._direct(entry)
            elif entry.strength == "fixed":
                self.general.append(entry)

    def name(self, entry: StartEntry) -> str:
        """Path of the variable."""
        return self.model.flat_variables[entry.node].path

    def value(self, entry: StartEntry) -> float:
        """Start value in SI units."""
        return self.values[id(entry)]

    def state_value(self, entry: StartEntry) -> float:
        """Value of the state that the variable is up to a factor."""
        assert entry.state is not None
        return self.value(entry) / entry.state[1]

    def _guess(self, point: Point, entry: StartEntry) -> None:
        if entry.state is not None:
            point.x[entry.state[0]] = self.state_value(entry)
        elif self.name(entry) in self.model.implicit:
            point.z[self.model.implicit.index(self.name(entry))] = self.value(entry)

    def _direct(self, entry: StartEntry) -> None:
        assert entry.state is not None
        position = entry.state[0]
        earlier = self.direct.setdefault(position, entry)
        number, other = self.state_value(entry), self.state_value(earlier)
        if abs(number - other) > _CONSISTENT * (1.0 + abs(other)):
            raise ContradictingStart(
                f"{self.name(earlier)} = {self.value(earlier):g} and {self.name(entry)} = {self.value(entry):g} "
                "contradict each other: they are the same motion.",
                advice="Remove one of the two start values.",
            )

    def apply(self, point: Point) -> None:
        """Give states their own start values, or defaults."""
        for entry in self.model.starts:
            if entry.strength == "default" and entry.state is not None:
                point.x[entry.state[0]] = self.state_value(entry)
        for position, entry in self.direct.items():
            point.x[position] = self.state_value(entry)

    def solve(self, point: Point, rest: bool) -> None:
        """Determine all states.

        Raises:
            MissingStart, ContradictingStart, InitializationError: the start values do not determine them.
        """
        for position, entry in self.direct.items():
            point.x[position] = self.state_value(entry)
        free = [k for k in range(len(self.model.states)) if k not in self.direct]
        if not free and not self.general:
            solve_implicit(self.model, point)
            return
        system = _StartSystem(self.model, point, free)
        rows, dependent = self._choose(system, free, rest)
        system.solve(point, [(e.node, self.value(e)) for e in rows.entries], rows.states)
        solve_implicit(self.model, point)
        for entry in dependent:
            self._check_dependent(point, entry)

    def _choose(self, system: _StartSystem, free: list[int], rest: bool) -> tuple[Rows, list[StartEntry]]:
        """Take start values as long as they say something new, the fixed ones first."""
        rows = Rows()
        dependent: list[StartEntry] = []
        for entry in self.general:
            if system.accept(entry.node):
                rows.entries.append(entry)
            else:
                dependent.append(entry)
        for entry in self.model.starts:
            if entry.strength == "default" and system.accept(entry.node):
                rows.entries.append(entry)
        open_states = system.open_states()
        if open_states and not rest:
            raise self._missing(open_states, system.lacking())
        for state in open_states:
            if system.accept_state(state):
                rows.states.append(state)
        return rows, dependent

    def _check_dependent(self, point: Point, entry: StartEntry) -> None:
        present = call(self.model, self.model.variables, point)
        actual, value = present[entry.node], self.value(entry)
        if abs(actual - value) <= _CONSISTENT * (1.0 + abs(value)):
            return
        fixed = [e for e in self.model.starts if e.strength == "fixed" and e is not entry]
        partners = [f"{self.name(e)} = {present[e.node]:g}" for e in fixed if self._coupled(entry, e)]
        what = f"{self.name(entry)} = {value:g}"
        together = (
            f"{' and '.join([*partners[:2], what])} contradict each other" if partners else f"{what} cannot be met"
        )
        raise ContradictingStart(
            f"{together}: {self.name(entry)} follows to be {actual:g}.",
            where=[o.source for o in self.model.differentiated if o.source.file][:3],
            advice="Remove one of the start values, or make one a guess.",
        )

    def _coupled(self, first: StartEntry, second: StartEntry) -> bool:
        """Tell whether two variables depend on a common state."""
        by_variable = self.model.variables.jac_sparsity(0, 1).T
        starts, states = by_variable.colind(), by_variable.row()
        columns = [set(states[starts[e.node] : starts[e.node + 1]]) for e in (first, second)]
        return bool(columns[0] & columns[1])

    def _missing(self, states: list[int], count: int) -> MissingStart:
        names = [self.model.states[k] for k in states]
        if count == 1:
            shown = " or ".join(names[:4]) + (" …" if len(names) > 4 else "")
            what = f"one equation: give {shown} a start value"
        else:
            shown = ", ".join(names[:8]) + (", …" if len(names) > 8 else "")
            which = "" if count == len(names) else f"{count} of "
            what = f"{count} equations: give {which}{shown} start values"
        parts = dict.fromkeys(name.removeprefix("der(").rstrip(")").rpartition(".")[0] for name in names)
        return MissingStart(
            f"Initialisation (not the model) lacks {what}.",
            where=[self.model.places[part] for part in parts if part in self.model.places][:3],
            advice='Or start from rest (start = "rest") or in the steady state (start = "steady").',
        )


class _StartSystem:
    """Equations between free states, the variables that follow from them, and start values."""

    def __init__(self, model: CompiledDae, point: Point, free: list[int]) -> None:
        self.model = model
        self.free = free
        self.nodes = {node: k for k, node in enumerate(model.start_nodes)}
        nx, ny, nz = len(model.states), model.start_system.size1_out(0), len(model.implicit)
        self.columns = [*free, *range(nx, nx + ny + nz)]
        place = {column: k for k, column in enumerate(self.columns)}
        self.own = ny + nz
        pattern = model.start_system.sparsity_out(1)
        self.rows: list[list[int]] = [[] for _ in range(pattern.size1())]
        for row, column in zip(*pattern.get_triplet(), strict=True):
            if column in place:
                self.rows[row].append(place[column])
        self.matching = Matching(len(self.columns))
        # The explicit equations determine their own variables, the implicit ones z; start values must find something
        # else.
        for k in range(self.own):
            self.matching.add([len(free) + k, *self.rows[k]])

    def accept(self, node: int) -> bool:
        """Add a start value if it determines something that is still open."""
        return self.matching.add(self.rows[self.own + self.nodes[node]])

    def accept_state(self, state: int) -> bool:
        """Add a start value of a free state itself."""
        return self.matching.add([self.free.index(state)])

    def open_states(self) -> list[int]:
        """States that could take the place of one that is not determined."""
        return [self.free[k] for k in self.matching.undetermined() if k < len(self.free)]

    def lacking(self) -> int:
        """Number of start values that are missing."""
        return len(self.columns) - self.matching.size

    def solve(self, point: Point, given: list[tuple[int, float]], zero: list[int]) -> None:
        """Newton's method on the sparse system."""
        model = self.model
        wanted = [*range(self.own), *(self.own + self.nodes[node] for node, _ in given)]
        target = np.array([0.0] * self.own + [value for _, value in given])
        point.x[zero] = 0.0
        held = set(zero)
        columns = [column for column in self.columns if column not in held]
        y = np.zeros(model.start_system.size1_out(0))
        nx, ny = len(model.states), len(y)
        state = np.concatenate([point.x, y, point.z])
        error = np.zeros(len(target))
        system = _Evaluation(model, wanted, columns)
        for _ in range(_MAX_NEWTON):
            matrix, values = system(
                point.t, state[:nx], state[nx : nx + ny], state[nx + ny :], model.p, model.u, point.d
            )
            error = values - target
            step = _solve(matrix, -error)
            state[columns] += step
            if step.size == 0 or np.max(np.abs(step) / (1.0 + np.abs(state[columns]))) < 1e-13:
                break
        if not np.all(np.isfinite(state)) or np.max(np.abs(error) / (1.0 + np.abs(target)), initial=0.0) > _CONSISTENT:
            solve_implicit(model, point)  # where the implicit equations are singular, that is the reason
            names = ", ".join(model.flat_variables[node].path for node, _ in given[:6])
            raise InitializationError(
                f"No start was found at which {names} {'have' if len(given) > 1 else 'has'} the value asked for.",
                advice="Give guesses near the solution, or start values of states.",
            )
        point.x, point.z = state[:nx], state[nx + ny :]


class _Evaluation:
    """Some rows of the start system, and their Jacobian by some columns: a small one dense, a large one sparse."""

    def __init__(self, model: CompiledDae, rows: list[int], columns: list[int]) -> None:
        self._fast = buffered(model._cache, "start system", lambda: _dense_values(model.start_system), (1, 2))
        self._pattern = model.start_system.sparsity_out(1)
        self._entries = self._pattern.get_triplet()
        self._rows, self._columns = rows, columns

    def __call__(self, *arguments: Any) -> tuple[Any, Vector]:
        entries, values = self._fast(*arguments)
        if max(self._pattern.shape) > _DENSE:
            return ca.DM(self._pattern, entries)[self._rows, self._columns], values[self._rows]
        whole = np.zeros(self._pattern.shape)
        whole[self._entries] = entries
        return whole[np.ix_(self._rows, self._columns)], values[self._rows]


def _dense_values(system: ca.Function) -> ca.Function:
    """The start system with all of its values, also those that are always zero."""
    arguments = system.mx_in()
    own, jacobian, values = system(*arguments)
    return ca.Function("start", arguments, [own, jacobian, ca.densify(values)])


def _solve(matrix: Any, right: Vector) -> Vector:
    """Solve a square system; nan where it is singular."""
    if not right.size:
        return right
    if isinstance(matrix, ca.DM):
        return np.array(ca.solve(matrix, ca.DM(right))).ravel()
    try:
        return np.linalg.solve(matrix, right)
    except np.linalg.LinAlgError:
        return np.full(right.shape, np.nan)
