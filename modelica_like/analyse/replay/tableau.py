"""Radau IIA collocation: its coefficients, and the decoupling of its stages.

Source: E. Hairer, G. Wanner: Solving Ordinary Differential Equations II, sections IV.5 and IV.8 (RADAU5).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property

import casadi as ca
import numpy as np

from modelica_like.compile.buffers import Vector

_REAL = 1e-12


@dataclass(frozen=True)
class Tableau:
    """Radau IIA collocation.

    Attributes:
        nodes: shape (s,), in (0, 1], the last is 1.
        matrix: integrals of the Lagrange polynomials up to each node, shape (s, s).
        gamma: weight of the beginning of the step in the error estimate.
        estimate: weights of the stages in the error estimate.
    """

    nodes: Vector
    matrix: Vector
    gamma: float
    estimate: Vector

    @property
    def weights(self) -> Vector:
        """Weights of the quadrature over the step."""
        return self.matrix[-1]

    @cached_property
    def real_form(self) -> tuple[Vector, list[Vector]]:
        """Return T and blocks B with matrix = T B T⁻¹: 1 x 1 of real eigenvalues, 2 x 2 of complex pairs."""
        columns: list[Vector] = []
        blocks: list[Vector] = []
        values, vectors = np.linalg.eig(self.matrix)
        for value, vector in zip(values, vectors.T, strict=True):
            a, b = value.real, value.imag
            if abs(b) < _REAL:
                columns.append(vector.real)
                blocks.append(np.array([[a]]))
            elif b > 0.0:
                columns += [vector.real, vector.imag]
                blocks.append(np.array([[a, b], [-b, a]]))
        return np.column_stack(columns), blocks

    @cached_property
    def _coefficients(self) -> Vector:
        return np.asarray(np.linalg.inv(np.vander(self.nodes, increasing=True)), np.float64)

    def continued(self, stages: Vector, begin: float, ratio: float) -> Vector:
        """Values of the polynomial through the stages of a step, at the stages of another one.

        Args:
            stages: those of the step, one after the other.
            begin: start of the other one, in lengths of this one.
            ratio: its length over that of this one.
        """
        values = np.vander(begin + self.nodes * ratio, len(self.nodes), increasing=True) @ self._coefficients
        return (values @ stages.reshape(len(self.nodes), -1)).ravel()


@cache
def radau(stages: int) -> Tableau:
    """Return the Radau IIA method with an odd number of stages; its order is 2 stages - 1."""
    nodes = np.array(ca.collocation_points(stages, "radau"))
    powers = np.arange(1, stages + 1)
    vandermonde = nodes[:, None] ** (powers - 1)
    matrix = np.asarray(np.linalg.solve(vandermonde.T, (nodes[:, None] ** powers / powers).T).T, np.float64)
    gamma = next(float(eigenvalue.real) for eigenvalue in np.linalg.eigvals(matrix) if abs(eigenvalue.imag) < _REAL)
    estimate = np.linalg.solve(vandermonde.T, np.append(-gamma, np.zeros(stages - 1)))
    return Tableau(nodes, matrix, gamma, estimate)
