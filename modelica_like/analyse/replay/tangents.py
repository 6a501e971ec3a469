"""A derivative along the run in one direction, which tells how short steps must be.

States at rest tell nothing about the motions that a change of a parameter excites: with the steps that they allow, a
derivative by the free angle of a spring was a fifth off. Nor do states tell how fast the integrands are that are read
along them: with the steps of a steady speed, which have no end, an integral over an angle was anything.
"""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from modelica_like.analyse.replay.jumps import Jump
from modelica_like.analyse.replay.start import product
from modelica_like.analyse.replay.step import Step, Tangent
from modelica_like.analyse.replay.tolerances import Tolerances
from modelica_like.compile.buffers import Vector
from modelica_like.compile.compiled import CompiledDae

_UNFELT = 1e-6
"""Derivatives of a state that are so much smaller than others, in nominal values, count as much as these; those of an
integral as much as such a share of it."""


class Tangents:
    """Derivatives of (x, theta) at the nodes of a replay, in a direction that excites all that any parameter does.

    Args:
        model: the compiled model.
        tolerances: of the steps.
    """

    def __init__(self, model: CompiledDae, tolerances: Tolerances) -> None:
        self._model, self._tolerances = model, tolerances
        self._carried: list[Vector] = []
        self._gained: list[Any] = []
        self._tried: tuple[Step | None, Tangent | None] = None, None
        self._largest = np.zeros(len(model.states))

    def begin(self, x: ca.DM, d: ca.DM) -> None:
        """Start from the derivatives of states and discrete variables by (p, u)."""
        values = np.abs(np.concatenate([self._model.p, self._model.u]))
        # Each changes by about its size, those that are zero by one; no two of them cancel out.
        changes = np.where(values > 0.0, values, 1.0) * np.random.default_rng(1).uniform(0.5, 1.0, len(values))
        self._add(np.concatenate([product(x, changes)[:, 0], changes, product(d, changes)[:, 0]]))

    def carry(self, move: Step | Jump) -> None:
        """Go on over a move."""
        last, (tried, tangent) = self._carried[-1], self._tried
        if isinstance(move, Step):
            if tangent is None or move is not tried:
                tangent = move.tangent(last)
            self._add(tangent.end, tangent.sizes)
        else:
            self._add(move.forward(last[:, None])[0][:, 0])

    def go_back(self) -> None:
        """Forget the last move."""
        self._carried.pop()
        self._gained.pop()

    def error(self, step: Step) -> float:
        """Return the largest estimated error in a step over what is allowed.

        That of the derivatives is relative to the largest ones so far. That of the quadratures and of their derivatives
        is relative to their amounts so far: what they become until the end is not known.
        """
        tangent = step.tangent(self._carried[-1])
        self._tried = step, tangent
        nominals = self._model.equations.nominals
        largest = np.fmax(self._largest, np.abs(tangent.end[: len(self._largest)]))
        scale = np.maximum(largest, _UNFELT * np.max(largest / nominals) * nominals)
        of_states = self._tolerances.norm(tangent.error / scale) if np.all(scale > 0.0) else 0.0
        amounts, terms, noise = self._gained[-1] + tangent.sizes
        amounts[1] = np.maximum(amounts[1], _UNFELT * amounts[0])
        return max(of_states, self._tolerances.of_integrals(tangent.errors, amounts, terms, noise))

    def _add(self, tangent: Vector, gained: Any = 0.0) -> None:
        self._carried.append(tangent)
        self._gained.append((self._gained[-1] if self._gained else 0.0) + gained)
        self._largest = np.fmax(self._largest, np.abs(tangent[: len(self._largest)]))
