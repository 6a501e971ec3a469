"""What equilibrium leaves open and the motion keeps: the slip of a clutch that sticks, the momentum of a free shaft."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.initialize.holds import holding
from modelica_like.initialize.point import Point, call, variable_slopes

Matrix = np.ndarray[Any, np.dtype[np.float64]]
RANK = 1e-12
"""Relative size below which a combination of equations says nothing."""
_SAME = 1e-9


@dataclass(frozen=True)
class Kept:
    """Equations that take the place of those that say nothing: combinations of rates that are zero by themselves.

    Attributes:
        held: variables (nodes) that the present modes hold, such as the slip of a clutch that sticks.
        missing: what each of them still has to change.
        rows: slopes of these variables, and then of everything else that is conserved, by the states looked at; shape
            (held + conserved, states).
    """

    held: tuple[int, ...]
    missing: Vector
    rows: Matrix


def find_kept(model: CompiledDae, point: Point, states: list[int], jacobian: Matrix) -> Kept:
    """Return what the motion keeps near a point.

    Args:
        model: the compiled model.
        point: a point, with the modes that count.
        states: positions of the states that may change.
        jacobian: slopes of their rates, and of the implicit equations, by these states and the implicit unknowns.
    """
    left, sizes, _ = np.linalg.svd(jacobian) if jacobian.size else (np.eye(0), np.zeros(0), None)
    silent = left[:, sizes <= RANK * sizes.max(initial=0.0)].T[:, : len(states)]
    conserved = _orthonormal(silent)
    held: list[int] = []
    missing: list[float] = []
    rows = np.zeros((0, len(states)))
    for k in holding(model, point) if len(conserved) else ():
        node = model.holds[k].motion
        row = variable_slopes(model, point, [node])[0][states]
        size = float(np.linalg.norm(row))
        inside = size > 0.0 and np.linalg.norm(row - conserved.T @ (conserved @ row)) <= _SAME * size
        if inside and np.linalg.matrix_rank(np.vstack([rows, row]), tol=_SAME * size) > len(rows):
            held.append(node)
            missing.append(-float(call(model, model.variables, point)[node]))
            rows = np.vstack([rows, row])
    known = _orthonormal(rows)
    rest = _orthonormal(conserved - conserved @ known.T @ known)
    return Kept(tuple(held), np.array(missing), np.vstack([rows, rest]))


def solve_kept(kept: Kept, jacobian: Matrix, right: Matrix, of_held: Matrix) -> Any:
    """Solve linear equations that leave something open, together with what is kept.

    Args:
        kept: what is kept.
        jacobian: the equations; their first unknowns are the states.
        right: right sides, shape (equations,) or (equations, columns).
        of_held: right sides for the held variables; what else is conserved has zeros.
    """
    states, size = kept.rows.shape[1], float(np.abs(jacobian).max(initial=0.0)) or 1.0
    rows = np.zeros((len(kept.rows), jacobian.shape[1]))
    rows[:, :states] = size * kept.rows
    values = np.zeros((len(kept.rows), *right.shape[1:]))
    values[: len(kept.held)] = size * of_held
    return np.linalg.lstsq(np.vstack([jacobian, rows]), np.concatenate([right, values]), rcond=RANK)[0]


def _orthonormal(rows: Matrix) -> Matrix:
    """Orthonormal rows that span the same space."""
    if not rows.size:
        return np.zeros((0, rows.shape[1]))
    _, sizes, right = np.linalg.svd(rows, full_matrices=False)
    return right[sizes > _SAME]
