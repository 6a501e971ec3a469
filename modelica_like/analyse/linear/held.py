"""Motions that modes hold: the plates of a stuck clutch move as one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.native.holds import share
from modelica_like.solve.initialize import Point, holding, variable_slopes
from modelica_like.solve.initialize.slopes import slopes

Matrix = np.ndarray[Any, np.dtype[np.float64]]
_ZERO = 1e-9
"""Relative size below which a speed or a slope counts as zero."""


@dataclass(frozen=True)
class Motions:
    """The motions that modes leave free.

    Attributes:
        keep: positions of the states that can move on their own.
        shape: deviations of all states by those that are kept, shape (states, kept).
    """

    keep: list[int]
    shape: Matrix

    def without(self, lines: Matrix) -> Motions:
        """Hold linear combinations of the kept states at zero deviation, shape (combinations, kept)."""
        pivots: list[int] = []
        lines = lines.copy()
        for row in range(len(lines)):
            pivot = int(np.argmax(np.abs(lines[row])))
            lines[row] /= lines[row, pivot]
            for other in range(len(lines)):
                if other != row:
                    lines[other] -= lines[other, pivot] * lines[row]
            pivots.append(pivot)
        free = [n for n in range(len(self.keep)) if n not in pivots]
        follow = np.zeros((len(self.keep), len(free)))
        follow[free, range(len(free))] = 1.0
        follow[pivots] = -lines[:, free]
        return Motions([self.keep[n] for n in free], self.shape @ follow)


def free_motions(model: CompiledDae, point: Point) -> Motions:
    """Return the motions that the present modes leave free.

    A mode declares the motion that it holds, such as the slip speed of a clutch that is stuck; with the speed the slip
    angle stands still.
    """
    count = len(model.states)
    motions = Motions(list(range(count)), np.eye(count))
    # Combinations that follow from those before are dropped.
    slopes = list(_held_speeds(model, point))
    kept: list[Vector] = []
    for slope in slopes:
        if np.linalg.matrix_rank(np.array([*kept, slope]), tol=_ZERO) > len(kept):
            kept.append(slope)
    speeds = np.array(kept)
    if not len(speeds):
        return motions
    motions = motions.without(speeds)
    angles = _held_angles(model, point, motions)
    return motions.without(angles) if len(angles) else motions


def _held_speeds(model: CompiledDae, point: Point) -> Iterator[Vector]:
    """Slopes (by the states) of the motions that the present modes hold."""
    held = [model.held.motions[k] for k in holding(model, point)]
    if not held:
        return
    free = point.copy()
    for hold in held:
        free.d[hold.mode] = free.d[hold.mode] if hold.loose < 0 else hold.loose
    share(model, free)
    rates = _rate_slopes(model, point), _rate_slopes(model, free)
    for slope in variable_slopes(model, point, [h.motion for h in held]):
        # A creep speed follows its torque: its rate depends on something; compare it with the rate of a free motion.
        present, let_go = (np.abs(slope @ rate).max() for rate in rates)
        if np.any(slope) and not present > _ZERO * let_go:
            yield slope / np.linalg.norm(slope)


def _held_angles(model: CompiledDae, point: Point, motions: Motions) -> Matrix:
    """Combinations of the kept states whose rates depended only on speeds that are held, shape (combinations, kept).

    The rates of some are these speeds; they have no slopes while they are held.
    """
    count, full = len(model.states), _rate_slopes(model, point)
    positions = {model.held.motions[k].position for k in holding(model, point)}
    resting = [n for n, k in enumerate(motions.keep) if k in positions and not np.any(full[k])]
    gone = [k for k in range(count) if k not in set(motions.keep)]
    rows = [n for n, k in enumerate(motions.keep) if np.any(full[k, gone])]
    full = full[[motions.keep[n] for n in rows]]
    scale = np.abs(full).max(axis=1, keepdims=True, initial=1e-300)
    by_states = (full[:, :count] / model.equations.nominals) @ motions.shape * model.equations.nominals[motions.keep]
    left = np.hstack([by_states, full[:, count:]]) / scale
    still = _null(left.T)
    # Of all motions at rest, those that rest only because the speeds are held.
    moved = (full / scale).T @ still
    _, sizes, right = np.linalg.svd(moved, full_matrices=False) if still.size else (None, np.zeros(0), np.zeros((0, 0)))
    held = still @ right[sizes > _ZERO].T if still.size else np.zeros((len(rows), 0))
    lines = np.zeros((held.shape[1], len(motions.keep)))
    lines[:, rows] = (held / scale).T
    return np.vstack([lines, np.eye(len(motions.keep))[resting]])


def _null(matrix: Matrix) -> Matrix:
    """Orthonormal basis of what a matrix maps to zero, as columns."""
    if not matrix.size:
        return np.eye(matrix.shape[1])
    _, sizes, right = np.linalg.svd(matrix)
    rank = int(np.sum(sizes > _ZERO * sizes.max(initial=1e-300)))
    return right[rank:].T


def _rate_slopes(model: CompiledDae, point: Point) -> Matrix:
    """Slopes of the rates by [x, p, u, t], times the sizes of those, shape (states, …)."""
    rates, fixed = slopes(model, point, "ode"), np.concatenate([model.p, model.u])
    sizes = np.concatenate(
        [model.equations.nominals, np.where(fixed == 0.0, 1.0, np.abs(fixed)), [max(1.0, abs(point.t))]]
    )
    return np.hstack([rates.x, rates.theta[:, : len(fixed)], rates.t[:, None]]) * sizes
