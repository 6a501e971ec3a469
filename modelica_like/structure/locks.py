"""What is locked several times over: frictions of Modelica text that stick together on one shaft.

Each says that it stands. Where one of them would do, these equations leave open what holds each, and the block that
they are in is singular while all are locked. There, and only there, they yield by tiny terms (`Lock.creeps`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.flatten.generic import spread
from modelica_like.flatten.model import FlatModel, Origin, evaluate
from modelica_like.structure.blocks import Block, BlockSolver

_ZERO = 1e-10
"""What counts as zero of singular values and slopes, relative to the largest: numbers are of the size of one."""


@dataclass(frozen=True)
class Locked:
    """An equation that may say that something stands.

    Attributes:
        component: path of its component.
        row: its position in the residual.
        discrete: position in d of what makes it say so.
        creeps: whether it yields.
        origin: where it is from.
    """

    component: str
    row: int
    discrete: int
    creeps: bool
    origin: Origin


def find_locks(model: FlatModel) -> list[Locked]:
    """Return what all components may lock."""
    row_of = {pair: row for row, pair in enumerate(model.general)}
    locks: list[Locked] = []
    for number, instance in enumerate(model.instances):
        place = dict(zip(instance.template.discretes, instance.discretes, strict=True))
        for form in instance.template.locks:
            origin = model.origin(number, form.row)
            row = row_of[number, form.row]
            locks.append(Locked(instance.path, row, place[form.discrete], form.creeps, origin))
    return locks


def left_open(locks: Sequence[Locked], solver: BlockSolver, d: Any) -> dict[str, tuple[int, ...]]:
    """Return the components whose locks leave each other's loads open, each with its block and speed there.

    Those of one block with equal speeds turn together, whatever the parameters are.
    """
    result: dict[str, tuple[int, ...]] = {}
    for number, block in enumerate(solver.solved.blocks):
        inside = [lock for lock in locks if lock.row in block.equations]
        if len(inside) > 1 and (speeds := _speeds(solver, block, d, inside)) is not None:
            result |= {lock.component: (number, speed) for lock, speed in zip(inside, speeds, strict=True)}
    return result


def _speeds(solver: BlockSolver, block: Block, d: Any, locks: Sequence[Locked]) -> list[int] | None:
    """Number the speeds of what locks would hold; None where a block is regular with all of them locked.

    All else in d is zero, and the rest has generic values.
    """
    unknowns = ca.vertcat(*(solver.unknowns[column] for column in block.unknowns))
    residual = ca.vertcat(*(solver.residual[row] for row in block.equations))
    slopes = ca.densify(ca.jacobian(residual, unknowns))
    locked = {lock.discrete for lock in locks}
    fixed = {symbol.__hash__(): float(k in locked) for k, symbol in enumerate(ca.vertsplit(d))}
    symbols = ca.symvar(slopes)
    generic = spread(0.5, 1.5, len(symbols))
    values = [fixed.get(symbol.__hash__(), value) for symbol, value in zip(symbols, generic, strict=True)]
    matrix = ca.Function("slopes", [ca.vertcat(*symbols)], [slopes])(ca.DM(values)).full()
    if not np.isfinite(matrix).all() or _rank(matrix) == len(matrix):
        return None
    rows = [block.equations.index(lock.row) for lock in locks]
    others = np.delete(matrix, rows, axis=0)
    _, _, space = np.linalg.svd(others)
    motions = matrix[rows] @ space[_rank(others) :].T  # of each lock, in what the other equations leave free
    speeds: list[int] = []
    for k, motion in enumerate(motions):
        apart = np.minimum(abs(motions[:k] - motion).max(axis=1), abs(motions[:k] + motion).max(axis=1))
        same = np.flatnonzero(apart < _ZERO)
        speeds.append(speeds[same[0]] if len(same) else k)
    return speeds


def _rank(matrix: np.ndarray) -> int:
    return int(np.linalg.matrix_rank(matrix, tol=_ZERO * np.abs(matrix).max(initial=1.0)))


def contradictions(
    model: FlatModel, locks: Sequence[Locked], speeds: Mapping[str, tuple[int, ...]], values: Any
) -> Iterator[tuple[tuple[str, ...], tuple[Origin, ...], Any]]:
    """Yield what may not be zero: of two locks at different speeds, that both are locked, and their limits fall.

    Which one keeps its limit until the shaft moves is open then.
    """
    if len(speeds) < 2:
        return
    columns = evaluate(model, "lock_terms", values)
    falls = ca.vertsplit(ca.vertcat(*(columns[k] for k in sorted(columns))))
    hold = [fall * model.d[lock.discrete] for fall, lock in zip(falls, locks, strict=True)]
    sharing = [k for k, lock in enumerate(locks) if lock.component in speeds]
    for j, k in combinations(sharing, 2):
        one, other = speeds[locks[j].component], speeds[locks[k].component]
        if one[0] == other[0] and one[1] != other[1]:
            yield (), (locks[j].origin, locks[k].origin), 1 - hold[j] * hold[k]
