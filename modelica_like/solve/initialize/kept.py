"""Quantities that equilibrium leaves open and motion conserves: slip of a stuck clutch, momentum of a free shaft."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.solve.initialize.holds import holding
from modelica_like.solve.initialize.point import Point, call
from modelica_like.solve.initialize.slopes import variable_slopes

Matrix = np.ndarray[Any, np.dtype[np.float64]]
RANK = 1e-12
"""Relative size below which a combination of equations is zero."""
_SAME = 1e-9


@dataclass(frozen=True)
class Kept:
    """Equations that replace redundant ones: combinations of rates that are always zero.

    Attributes:
        held: variables (nodes) that the present modes hold, such as the slip of a stuck clutch.
        missing: remaining change of each of them.
        rows: slopes of these variables, then of other conserved quantities, by the given states; shape
            (held + conserved, states).
    """

    held: tuple[int, ...]
    missing: Vector
    rows: Matrix


def find_kept(model: CompiledDae, point: Point, states: list[int], jacobian: Matrix) -> Kept:
    """Return the conserved quantities near a point.

    Args:
        model: the compiled model.
        point: a point with the present modes.
        states: positions of the states that may change.
        jacobian: slopes of their rates, and of the implicit equations, by these states and the implicit unknowns.
    """
    left, sizes, _ = np.linalg.svd(jacobian)
    silent = left[:, sizes <= RANK * sizes.max(initial=0.0)].T[:, : len(states)]
    conserved = _orthonormal(silent)
    held: list[int] = []
    rows = np.zeros((0, len(states)))
    for k in holding(model, point) if len(conserved) else ():
        row = variable_slopes(model, point, [model.held.motions[k].motion])[0][states]
        if _lies_in(conserved, row) and not _lies_in(_orthonormal(rows), row):
            held.append(model.held.motions[k].motion)
            rows = np.vstack([rows, row])
    basis = _orthonormal(rows)
    others = _orthonormal(conserved - conserved @ basis.T @ basis)
    missing = -call(model, model.equations.variables, point)[held] if held else np.zeros(0)
    return Kept(tuple(held), missing, np.vstack([rows, others]))


def _lies_in(basis: Matrix, row: Vector) -> bool:
    """Return whether a row is a combination of orthonormal ones; a row of zeros is one."""
    return bool(np.linalg.norm(row - basis.T @ (basis @ row)) <= _SAME * np.linalg.norm(row))


def solve_kept(kept: Kept, jacobian: Matrix, right: Matrix, of_held: Matrix) -> Any:
    """Solve underdetermined linear equations together with conserved quantities.

    Args:
        kept: the conserved quantities.
        jacobian: the equations; their first unknowns are the states.
        right: right sides, shape (equations,) or (equations, columns).
        of_held: right sides for the held variables; zero for all other conserved quantities.
    """
    states, size = kept.rows.shape[1], float(np.abs(jacobian).max(initial=0.0)) or 1.0
    rows = np.zeros((len(kept.rows), jacobian.shape[1]))
    rows[:, :states] = size * kept.rows
    values = np.zeros((len(kept.rows), *right.shape[1:]))
    values[: len(kept.held)] = size * of_held
    return np.linalg.lstsq(np.vstack([jacobian, rows]), np.concatenate([right, values]), rcond=RANK)[0]


def _orthonormal(rows: Matrix) -> Matrix:
    """Orthonormal rows that span the same space."""
    _, sizes, right = np.linalg.svd(rows, full_matrices=False)
    return right[sizes > _SAME]
