"""A derivative along the run in one direction, which tells how short steps must be.

States at rest tell nothing about the motions that a change of a parameter excites: with the steps that they allow, a
derivative by the free angle of a spring was a fifth off.
"""

from __future__ import annotations

import casadi as ca
import numpy as np

from modelica_like.analyse.replay.jumps import Jump
from modelica_like.analyse.replay.start import product
from modelica_like.analyse.replay.step import Step
from modelica_like.analyse.replay.steps import Tolerances
from modelica_like.compile.buffers import Vector
from modelica_like.compile.compiled import CompiledDae

_UNFELT = 1e-6
"""Derivatives of a state that are so much smaller than others, in nominal values, count as much as these."""


class Tangents:
    """Derivatives of (x, theta) at the nodes of a replay, in a direction that excites all that any parameter does.

    Args:
        model: the compiled model.
        tolerances: of the steps.
    """

    def __init__(self, model: CompiledDae, tolerances: Tolerances) -> None:
        self._model, self._tolerances = model, tolerances
        self._carried: list[Vector] = []
        self._tried: tuple[Step | None, Vector] = None, np.zeros(0)
        self._largest = np.zeros(len(model.states))

    def begin(self, x: ca.DM, d: ca.DM) -> None:
        """Start from the derivatives of states and discrete variables by (p, u)."""
        values = np.abs(np.concatenate([self._model.p, self._model.u]))
        # Each changes by about its size, those that are zero by one; no two of them cancel out.
        changes = np.where(values > 0.0, values, 1.0) * np.random.default_rng(1).uniform(0.5, 1.0, len(values))
        self._add(np.concatenate([product(x, changes)[:, 0], changes, product(d, changes)[:, 0]]))

    def carry(self, move: Step | Jump) -> None:
        """Go on over a move."""
        last, (tried, end) = self._carried[-1], self._tried
        if isinstance(move, Step):
            end = end if move is tried else move.tangent(last)[0]
        else:
            end = move.forward(last[:, None])[0][:, 0]
        self._add(end)

    def go_back(self) -> None:
        """Forget the last move."""
        self._carried.pop()

    def error(self, step: Step) -> float:
        """Return the estimated error in a step over what is allowed, relative to the largest derivatives so far."""
        end, error = step.tangent(self._carried[-1])
        self._tried = step, end
        nominals, largest = self._model.equations.nominals, np.fmax(self._largest, np.abs(end[: len(self._largest)]))
        scale = np.maximum(largest, _UNFELT * np.max(largest / nominals) * nominals)
        return self._tolerances.norm(error / scale) if np.all(scale > 0.0) else 0.0

    def _add(self, tangent: Vector) -> None:
        self._carried.append(tangent)
        self._largest = np.fmax(self._largest, np.abs(tangent[: len(self._largest)]))
