"""What is locked several times over: frictions of Modelica text that stick together on one shaft.

Each says that it stands. Where one of them would do, these equations leave open what holds each, and the block that
they are in is singular while all are locked. There, and only there, they yield by tiny terms (`Equation.creeps`).
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.flatten.model import FlatModel
from modelica_like.structure.blocks import Block, BlockSolver

_RANK = 1e-10
"""Singular values that count as zero, relative to the largest: numbers are of the size of one, and known to 1e-16."""


@dataclass(frozen=True)
class Lock:
    """An equation that says that something stands.

    Attributes:
        component: path of its component.
        row: its position in the residual.
        discrete: position in d of what makes it say so.
        creeps: whether it yields.
    """

    component: str
    row: int
    discrete: int
    creeps: bool


def find_locks(model: FlatModel) -> list[Lock]:
    """Return the locks of all components."""
    row_of = {pair: row for row, pair in enumerate(model.general)}
    locks: list[Lock] = []
    for number, instance in enumerate(model.instances):
        place = dict(zip(instance.template.discretes, instance.discretes, strict=True))
        for row, name, creeps in instance.template.locks:
            if (number, row) in row_of:
                locks.append(Lock(instance.path, row_of[number, row], place[name], creeps))
    return locks


def left_open(locks: Collection[Lock], solver: BlockSolver, d: Any) -> set[str]:
    """Return the components whose locks leave each other's loads open; none where they yield already."""
    if len(locks) < 2 or any(lock.creeps for lock in locks):
        return set()
    result: set[str] = set()
    for block in solver.solved.blocks:
        inside = [lock for lock in locks if lock.row in block.equations]
        if len(inside) > 1 and _singular(solver, block, d, {lock.discrete for lock in inside}):
            result |= {lock.component for lock in inside}
    return result


def _singular(solver: BlockSolver, block: Block, d: Any, locked: set[int]) -> bool:
    """Tell whether a block is singular with locks locked, and all else in d zero, for any values of the rest."""
    unknowns = ca.vertcat(*(solver.unknowns[column] for column in block.unknowns))
    residual = ca.vertcat(*(solver.residual[row] for row in block.equations))
    slopes = ca.densify(ca.jacobian(residual, unknowns))
    fixed = {symbol.__hash__(): float(k in locked) for k, symbol in enumerate(ca.vertsplit(d))}
    symbols = ca.symvar(slopes)
    some = np.random.default_rng(0).uniform(0.5, 1.5, len(symbols))
    values = [fixed.get(symbol.__hash__(), value) for symbol, value in zip(symbols, some, strict=True)]
    matrix = ca.Function("slopes", [ca.vertcat(*symbols)], [slopes])(ca.DM(values)).full()
    rank = np.linalg.matrix_rank(matrix, tol=_RANK * np.abs(matrix).max()) if np.isfinite(matrix).all() else len(matrix)
    return bool(rank < len(matrix))
