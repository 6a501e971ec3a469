"""What is at rest relative to each other first in a start from rest: the two sides of springs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import casadi as ca

from modelica_like.structure.alias import PREFERRED
from modelica_like.structure.matching import Elimination
from modelica_like.structure.reduce import ReducedDae
from modelica_like.structure.system import System

_MOVES = 3
"""Levels of a chain with an acceleration: something with inertia moves along it."""
_TIME = -1
"""Number of the motion that is prescribed over time, among the chains."""
_SMALL = 1e-9
"""Relative size below which a coefficient is rounding."""

Row = dict[int, Any]
"""Coefficients of the rates of chains in an equation between speeds."""


@dataclass(frozen=True)
class Elastic:
    """Speeds that are zero where all springs keep their twists.

    Attributes:
        rates: levels that are rates of springs between parts with inertia.
        rows: what is zero in addition, where springs meet without inertia in between: name of the first spring,
            expression, levels in it.
    """

    rates: frozenset[int]
    rows: tuple[tuple[str, Any, tuple[int, ...]], ...]


def elastic(reduced: ReducedDae) -> Elastic:
    """Find the springs of a model, and what their speeds say about others.

    Where springs meet without an inertia in between, the speed there follows from forces. Only what does not depend
    on it is said: of a damper and a spring in series nothing, of two springs in series that both ends turn alike.
    """
    system = reduced.system
    kinematic = _kinematic_rows(system)
    springs = _springs(reduced, kinematic.keys())
    rates = frozenset(chain[1] for k in springs if len(chain := system.chains[k]) >= _MOVES)
    return Elastic(rates, tuple(_without_inertia(system, springs, kinematic)))


def _springs(reduced: ReducedDae, kinematic: Iterable[int]) -> set[int]:
    """Chains of relative positions that a force follows in every mode.

    A gap couples nothing before it closes: its force follows the position in some modes only. The angle of a clutch
    or damper occurs in kinematic equations, and perhaps in an output, by which nothing moves.
    """
    system, model = reduced.system, reduced.flat
    relative = [k for k in range(len(system.chains)) if _is_relative(system, k)]
    bases = system.column(system.chains[k][0] for k in relative)
    slopes = ca.jacobian(system.residual, bases)
    by_mode = {*ca.jacobian_sparsity(ca.vertcat(ca.SX(0, 1), *slopes.nonzeros()), model.d).row()}
    forces = _force_rows(system).difference(kinematic)
    read = {column for k, (row, column) in enumerate(_entries(slopes.sparsity())) if row in forces and k not in by_mode}
    states, moving = (
        {column for _, column in _entries(ca.jacobian_sparsity(expressions, bases))}
        for expressions in (reduced.x, ca.vertcat(reduced.ode, reduced.alg))
    )
    return {relative[k] for k in read - (states - moving)}


def _is_relative(system: System, chain: int) -> bool:
    """Whether a motion is one between others: positions or speeds of such prefer to be states."""
    return any(system.levels[level].preference >= PREFERRED for level in system.chains[chain][:2])


def _force_rows(system: System) -> set[int]:
    """Equations with an unknown that has no derivatives and is no place of a connector: not kinematic ones."""
    incidence = _entries(ca.jacobian_sparsity(system.residual, system.everything))
    single = {chain[0] for chain in system.chains if len(chain) == 1} - _places(system)
    return {row for row, level in incidence if level in single}


def _places(system: System) -> set[int]:
    kinds, nodes = system.model.variables, zip(system.model.nodes, system.node_level, strict=True)
    return {placed[0] for (k, _), placed in nodes if placed is not None and kinds[k].kind == "potential"}


def _kinematic_rows(system: System) -> dict[int, Row]:
    """Equations between positions only, or speeds only, whatever the modes: coefficients of the rates in each."""
    places = _places(system)
    moves = {
        k
        for k, chain in enumerate(system.chains)
        if len(chain) >= _MOVES or chain[0] in places or _is_relative(system, k)
    }
    used: dict[int, set[int]] = {}
    for row, level in _entries(ca.jacobian_sparsity(system.residual, system.everything)):
        used.setdefault(row, set()).add(level)
    by_mode = {*ca.jacobian_sparsity(system.residual, system.model.d).row()}
    rows: dict[int, Row] = {}
    for row, some in used.items():
        orders = {system.levels[level].order for level in some}
        if row not in by_mode and orders in ({0}, {1}) and all(system.levels[level].chain in moves for level in some):
            residual = system.residual[row]
            rows[row] = {system.levels[k].chain: ca.jacobian(residual, system.symbols[k]) for k in sorted(some)}
            if orders == {0} and ca.depends_on(residual, system.model.time):
                rows[row][_TIME] = ca.jacobian(residual, system.model.time)
            elif orders == {1}:
                slopes = (rows[row][system.levels[k].chain] * system.symbols[k] for k in sorted(some))
                if not (rest := ca.simplify(residual - sum(slopes, ca.SX(0)))).is_zero():
                    rows[row][_TIME] = rest
    return rows


def _without_inertia(
    system: System, springs: set[int], kinematic: dict[int, Row]
) -> Iterable[tuple[str, Any, tuple[int, ...]]]:
    """Say what springs at rest mean for parts with inertia, where there are none in between."""
    short = {k for k, chain in enumerate(system.chains) if len(chain) < _MOVES}
    rows = [row for row in kinematic.values() if not short.isdisjoint(row)]
    free = {k for row in rows for k in row if k >= 0 and k not in springs and (k in short or _is_relative(system, k))}
    chosen = Elimination(len(system.chains) + 1)
    for row in _eliminated(_numbered(system, rows), free):
        names = sorted(system.levels[system.chains[k][0]].name for k in row if k in springs)
        held = [k for k in row if k not in springs and k != _TIME]
        if names and held and chosen.add({k: row[k].number for k in held}):
            levels = tuple(system.chains[k][1] for k in held)
            moved = (row[k].value * system.symbols[level] for k, level in zip(held, levels, strict=True))
            yield names[0], sum(moved, row[_TIME].value if _TIME in row else ca.SX(0)), levels


@dataclass(frozen=True)
class _Coefficient:
    """An expression, and its value at a point that is not special: whether it vanishes is known from that."""

    value: Any
    number: float


def _numbered(system: System, rows: list[Row]) -> list[dict[int, _Coefficient]]:
    values = [value for row in rows for value in row.values()]
    numbers = iter(system.generic(ca.vertcat(ca.SX(0, 1), *values)).full().ravel().tolist())
    return [{k: _Coefficient(value, next(numbers)) for k, value in row.items()} for row in rows]


def _eliminated(rows: list[dict[int, _Coefficient]], free: set[int]) -> Iterable[dict[int, _Coefficient]]:
    """Gaussian elimination of the free rates; what remains does not contain them."""
    left = dict(enumerate(rows))
    having: dict[int, set[int]] = {rate: set() for rate in free}
    for number, row in left.items():
        for rate in free.intersection(row):
            having[rate].add(number)
    # Those in few equations first, and the shortest equation for each: the rows stay sparse.
    for rate in sorted(free, key=lambda rate: (len(having[rate]), rate)):
        some = sorted(k for k in having[rate] if k in left and rate in left[k])
        largest = max((abs(left[k][rate].number) for k in some), default=0.0)
        usable = [k for k in some if abs(left[k][rate].number) > _SMALL * largest]
        if usable:
            chosen = min(usable, key=lambda k: len(left[k]))
            pivot = left.pop(chosen)
            for k in some:
                if k != chosen:
                    _subtract(left[k], pivot, rate)
                    for other in free.intersection(pivot):
                        having[other].add(k)
        else:  # only by structure
            for k in some:
                del left[k]
    return left.values()


def _subtract(row: dict[int, _Coefficient], pivot: dict[int, _Coefficient], column: int) -> None:
    """Take a multiple of one row from another, so that a coefficient vanishes."""
    leading = row.pop(column)
    value, number = leading.value / pivot[column].value, leading.number / pivot[column].number
    for k, other in pivot.items():
        if k != column:
            before = row.pop(k, _Coefficient(ca.SX(0), 0.0))
            after = before.number - number * other.number
            if abs(after) > _SMALL * abs(before.number):
                row[k] = _Coefficient(before.value - value * other.value, after)


def _entries(pattern: ca.Sparsity) -> list[tuple[int, int]]:
    return [*zip(*pattern.get_triplet(), strict=True)]
