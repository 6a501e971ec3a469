"""The use of start values: chosen once, for simulation, export and derivatives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.compile.cached import Cached
from modelica_like.compile.compiled import CompiledDae, StartEntry, StartSystem, Vector
from modelica_like.errors import MissingStart
from modelica_like.flatten.generic import spread
from modelica_like.netlist.sections import StartKind as StartKind
from modelica_like.solve.initialize.point import Point
from modelica_like.structure.matching import Elimination, Matching

_DENSE = 100
_WELL_CONDITIONED = 1e9
_KNOWN = 16


@dataclass(frozen=True)
class StartPlan:
    """The use of start values.

    Attributes:
        kind: kind of start, which replaces missing start values.
        system: the start system.
        direct: (state, start value) of given states; the first of several counts.
        rows: start values that are equations for the other states.
        dependent: fixed start values that must follow from the others.
        resting: variables (nodes) that are zero because nothing else is given.
        zero: states that are zero for the same reason.
        columns: unknowns of the start system among (x, y, z); none if there is nothing to solve.
        wanted: its rows: those of y and z, of `rows`, of `resting`.
    """

    kind: StartKind
    system: StartSystem
    direct: tuple[tuple[int, int], ...]
    rows: tuple[int, ...] = ()
    dependent: tuple[int, ...] = ()
    resting: tuple[int, ...] = ()
    zero: tuple[int, ...] = ()
    columns: tuple[int, ...] = ()
    wanted: tuple[int, ...] = ()

    @property
    def own(self) -> int:
        """Number of explicit and implicit equations at the beginning of the start system."""
        return len(self.wanted) - len(self.rows) - len(self.resting)

    @property
    def choice(self) -> tuple[tuple[int, ...], ...]:
        """All that tells it from other plans of the same model and kind."""
        return self.rows, self.dependent, self.resting, self.zero, self.columns, self.wanted

    @cached_property
    def _part(self) -> tuple[ca.Sparsity, Any]:
        """Pattern of the wanted rows and columns, and positions of its entries in the system's Jacobian."""
        pattern, places = self.system.function.sparsity_out(1).sub(list(self.wanted), list(self.columns))
        return pattern, np.array(places, int)

    def entries(self, jacobian: Vector) -> Vector:
        """Return the nonzeros of the plan's matrix, from those of the whole Jacobian."""
        return jacobian[self._part[1]]

    def matrix(self, entries: Vector) -> ca.DM:
        """Return the plan's matrix, sparse."""
        return ca.DM(self._part[0], entries)

    def targets(self, values: Vector) -> Vector:
        """Values that the wanted rows must have.

        Args:
            values: one value, or one row, for every start value.
        """
        shape = values.shape[1:]
        parts = [np.zeros((self.own, *shape)), values[list(self.rows)], np.zeros((len(self.resting), *shape))]
        return np.concatenate(parts)


def start_plan(model: CompiledDae, kind: StartKind, point: Point) -> StartPlan:
    """Choose the use of the start values of a model.

    The structure decides. If the chosen rows are numerically dependent (several clutches between the same shafts),
    numbers decide: redundant defaults and zeros are left out, redundant given start values must be
    consistent.

    Args:
        model: the compiled model.
        kind: kind of start, which replaces missing start values.
        point: a point with the modes that count.

    Raises:
        MissingStart: the start values do not determine all states.
    """
    plan = model.once((Cached.START_PLAN, kind), lambda: _Choice(model, kind).plan(None))
    if plan.columns and not _is_regular(model, plan, point):
        matrix = _generic_matrix(model, plan.system, point)
        if matrix is not None:
            return _Choice(model, kind, _generic_matrix(model, plan.system, point, moving=True)).plan(matrix)
    return plan


def _is_regular(model: CompiledDae, plan: StartPlan, point: Point) -> bool:
    """Return whether the plan's matrix is far from singular, without motion from rest.

    The last positive answer of each combination of modes is kept: a start often looks at two of them in turn.
    """
    function = plan.system.function
    fast = model.fast((Cached.START_MATRIX, plan.kind), lambda: function, (1,))
    x, y = point.x.copy(), np.zeros(function.size1_out(0))
    x[[k for k in plan.system.rates if k < len(x)]] = 0.0
    entries = fast(point.t, x, y, point.z, model.p, model.u, point.d)[0]
    entries = plan.entries(entries)
    regulars: dict[bytes, Vector] = model.once((Cached.REGULAR_STARTS, plan.kind), dict)
    modes = point.d.tobytes()
    if np.array_equal(regulars.get(modes, ()), entries):
        return True
    regular = _regular(plan.matrix(entries), entries)
    if regular:
        if len(regulars) >= _KNOWN:
            regulars.clear()
        regulars[modes] = entries
    return regular


def matrix_and_values(model: CompiledDae, system: StartSystem, point: Point, y: Vector) -> tuple[Any, Vector]:
    """Return the Jacobian of the whole start system by (x, y, z), sparse, and its values.

    Args:
        model: the compiled model.
        system: the start system.
        point: where.
        y: the variables that start values need.
    """
    _, jacobian, values = system.function(point.t, point.x, y, point.z, model.p, model.u, point.d)
    return jacobian, np.asarray(values.full()).ravel()


def _regular(matrix: Any, entries: Vector) -> bool:
    """Return whether a square matrix with these entries is far from singular."""
    if not np.all(np.isfinite(entries)):
        return False
    sizes, rows = np.zeros(matrix.size1()), np.array(matrix.sparsity().row(), int)
    np.maximum.at(sizes, rows, np.abs(entries))
    if not np.all(sizes > 0.0):
        return False
    scaled = ca.DM(matrix.sparsity(), entries / sizes[rows])
    if matrix.size1() <= _DENSE:
        return bool(np.linalg.cond(scaled.full()) < _WELL_CONDITIONED)
    upper = ca.qr_sparse(scaled)[1]
    on_diagonal = np.equal(*upper.sparsity().get_triplet())
    factor = np.array(upper.nonzeros())[on_diagonal]  # norms
    return bool(factor.max() < _WELL_CONDITIONED * factor.min())


def _generic_matrix(model: CompiledDae, system: StartSystem, point: Point, *, moving: bool = False) -> Any:
    """Jacobian of the start system at a generic point nearby, None if it is not finite.

    Where the start is from rest, nothing moves there: speeds that are zero do not determine positions. With `moving`,
    states move that do so at the point: those of which a start value says so.
    """
    moved, ends = point.copy(), np.cumsum([len(point.x), len(point.z)])
    of_x, of_z, y = np.split(spread(0.5, 1.0, ends[-1] + system.function.size1_out(0)), ends)
    for part, by in ((moved.x, of_x), (moved.z, of_z)):
        part += 0.1 * (1.0 + np.abs(part)) * by
    for k in system.rates:
        part, place = (moved.x, k) if k < len(moved.x) else (y, k - len(moved.x))
        if not (moving and part is moved.x and point.x[place]):
            part[place] = 0.0
    matrix, _ = matrix_and_values(model, system, moved, y)
    return matrix if np.all(np.isfinite(matrix.nonzeros())) else None


def direct_starts(model: CompiledDae) -> dict[int, int]:
    """Return the number of the first fixed start value of every state that has one, by state."""
    starts: dict[int, int] = {}
    for number, entry in enumerate(model.starts.entries):
        if entry.strength == "fixed" and entry.state is not None:
            starts.setdefault(entry.state[0], number)
    return starts


class _Choice:
    """Start values are taken as long as they add information: fixed ones, defaults, zeros."""

    def __init__(self, model: CompiledDae, kind: StartKind, moving: Any = None) -> None:
        self.model = model
        self.kind: StartKind = kind
        self.system = model.rest_system if kind == "rest" else model.start_system
        self.direct = direct_starts(model)
        nx, ny, nz = len(model.states), self.system.function.size1_out(0), len(model.implicit)
        self.free = [k for k in range(nx) if k not in self.direct]
        self.columns = [*self.free, *range(nx, nx + ny + nz)]
        self.place = {column: k for k, column in enumerate(self.columns)}
        self.own = ny + nz
        self.row_of = {node: self.own + k for k, node in enumerate(self.system.nodes)}
        self.moving = None if moving is None else self._by_rows(moving)

    def plan(self, matrix: Any, still: Sequence[int] = ()) -> StartPlan:
        """Choose by structure, or by the numbers of a Jacobian.

        Args:
            matrix: the Jacobian, None for the structure.
            still: states at rest whatever the modes, which determine them otherwise.
        """
        direct = tuple(self.direct.items())
        general = [k for k, e in enumerate(self.model.starts.entries) if e.strength == "fixed" and e.state is None]
        if self.kind == "steady" or not (self.free or general):
            return StartPlan(self.kind, self.system, direct)
        # Where modes do not determine reactions, redundant implicit equations and as many reactions are left out.
        implicit = self._begin(matrix, still)
        kept = self._keep(len(implicit) < self.own)
        by_modes = [] if still else self._at_rest_by_modes()
        moving = self._moving(implicit, general)
        rows = [k for k in general if self._accept(self.model.starts.entries[k].node, moving.get(k))]
        taken = set(rows)
        dependent = [k for k in general if k not in taken]
        # What nothing else determines starts at its guess rather than at rest.
        rows += [
            k for k in (*self.system.guesses, *self._defaults()) if self._accept(self.model.starts.entries[k].node)
        ]
        resting, zero = self._rest()
        if self.choice.size < len(self.columns):
            if by_modes and not self._states_left():
                return self.plan(matrix, by_modes)
            raise self._missing()
        zero = [*still, *zero]
        if still and len(zero) == len(self.free) and not rows:
            # All states are known, and what is implicit follows in any mode.
            return StartPlan(self.kind, self.system, direct, dependent=tuple(dependent), zero=tuple(zero))
        fixed = {*zero, *kept}
        columns = [column for column in self.columns if column not in fixed]
        nodes = [*(self.model.starts.entries[k].node for k in rows), *resting]
        wanted = [*implicit, *(self.row_of[node] for node in nodes)]
        lists = (rows, dependent, resting, zero, columns, wanted)
        return StartPlan(self.kind, self.system, direct, *map(tuple, lists))

    def _at_rest_by_modes(self) -> list[int]:
        """States that rest, of which the modes leave no choice: currents that ideal elements block.

        Such elements leave potentials open instead, and other modes at the same instant leave the states open.
        """
        left = {self.columns[k] for k in self.choice.undetermined()}
        return [s for _, s in self.system.rest if s is not None and s in self.place and s not in left]

    def _states_left(self) -> bool:
        return any(k < len(self.free) for k in self.choice.undetermined())

    def _begin(self, matrix: Any, still: Sequence[int]) -> list[int]:
        """Start with the explicit equations, which determine y, and the implicit ones, which determine z."""
        self.entries = self._by_rows(matrix)
        self.choice: Matching | Elimination = (Matching if matrix is None else Elimination)(len(self.columns))
        if matrix is None:  # each has its own unknown, whatever structure solves it
            for row in range(self.own):
                self.entries[row][len(self.free) + row] = 1.0
        for state in still:
            self.choice.add({self.place[state]: 1.0})
        return [row for row in range(self.own) if self.choice.add(self.entries[row])]

    def _by_rows(self, matrix: Any) -> list[dict[int, float]]:
        """Return the rows of a Jacobian by free columns; None has a one wherever there may be an entry."""
        pattern = self.system.function.sparsity_out(1)
        numbers = [1.0] * pattern.nnz() if matrix is None else matrix.nonzeros()
        rows: list[dict[int, float]] = [{} for _ in range(pattern.size1())]
        for row, column, number in zip(*pattern.get_triplet(), numbers, strict=True):
            if column in self.place:
                rows[row][self.place[column]] = number
        return rows

    def _keep(self, some: bool) -> list[int]:
        """Implicit unknowns that keep their values."""
        implicit = self.columns[len(self.columns) - len(self.model.implicit) :] if some else []
        return [column for column in implicit if self.choice.add({self.place[column]: 1.0})]

    def _accept(self, node: int, moving: Mapping[int, float] | None = None) -> bool:
        return self.choice.add(moving or self.entries[self.row_of[node]])

    def _moving(self, own: Sequence[int], general: Sequence[int]) -> dict[int, dict[int, float]]:
        """Rows of what says nothing at rest, and something where speeds are not zero: an equation for an energy."""
        if self.moving is None or isinstance(self.choice, Matching):
            return {}
        rows = {k: self.row_of[self.model.starts.entries[k].node] for k in general}
        alone = Elimination(len(self.columns))
        for row in own:
            alone.add(self.moving[row], len(self.free))
        return {k: alone.left(self.moving[row]) for k, row in rows.items() if not self.choice.left(self.entries[row])}

    def _defaults(self) -> list[int]:
        """Defaults in an order that does not depend on the order of lines."""
        chosen = [k for k, e in enumerate(self.model.starts.entries) if e.strength == "default"]
        return sorted(chosen, key=lambda k: start_name(self.model, self.model.starts.entries[k]))

    def _rest(self) -> tuple[list[int], list[int]]:
        """Variables and states at rest."""
        resting: list[int] = []
        zero: list[int] = []
        for node, state in self.system.rest:
            if state is None and self._accept(node):
                resting.append(node)
            elif state is not None and state in self.place and self.choice.add({self.place[state]: 1.0}):
                zero.append(state)
        return resting, zero

    def _missing(self) -> MissingStart:
        model, count = self.model, len(self.columns) - self.choice.size
        left = [k for k in self.choice.undetermined() if k < len(self.free)]
        # Where modes determine states, and leave potentials open instead, the states need values in other modes.
        names = [model.states[self.free[k]] for k in left or range(len(self.free))]
        parts = dict.fromkeys(name.removeprefix("der(").rstrip(")").rpartition(".")[0] for name in names)
        names = [_to_give(model, name) for name in names]
        if count == 1:
            what = f"one equation: give {' or '.join(names[:4]) + (' …' if len(names) > 4 else '')} a start value"
        else:
            shown = ", ".join(names[:8]) + (", …" if len(names) > 8 else "")
            which = "" if count == len(names) else f"{count} of "
            what = f"{count} equations: give {which}{shown} start values"
        return MissingStart(
            f"Initialization (not the model) lacks {what}.",
            where=model.places_of(parts)[:3],
            advice='Or start from rest (start = "rest") or in the steady state (start = "steady").',
        )


def _to_give(model: CompiledDae, name: str) -> str:
    """Return what can get a start value: a state, or a variable of one that follows the motion."""
    base = name.removeprefix("der(").removesuffix(")")
    if base not in model.following:
        return name
    return f"{'' if name == base else 'a rate of '}{' or '.join(model.following[base])}"


def start_name(model: CompiledDae, entry: StartEntry) -> str:
    """Path of the variable of a start value."""
    return model.flat_variables[entry.node].path


def near_states(model: CompiledDae) -> list[tuple[int, StartEntry]]:
    """Return the start values at which the search for states begins, with their numbers; of several the last counts."""
    near = ((k, e) for k, e in enumerate(model.starts.entries) if e.state is not None and is_near(model, e))
    return sorted(near, key=lambda one: one[1].strength == "guess")


def is_near(model: CompiledDae, entry: StartEntry) -> bool:
    """Whether the search for a variable begins at a start value; at a default, if its class has no guess."""
    if entry.strength == "default":
        return not model.flat_variables[entry.node].guess
    return entry.strength == "guess" or entry.state is None
