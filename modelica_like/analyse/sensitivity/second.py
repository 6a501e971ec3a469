"""Second derivatives of a simulation, by differences of its exact Jacobian, with a bound of their error."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from modelica_like.analyse.sensitivity.callback import NamedCallback
from modelica_like.compile.buffers import Vector
from modelica_like.errors import NoGradient

if TYPE_CHECKING:
    from modelica_like.analyse.sensitivity.function import SimulationFunction

_CHANGE = 1e-3
"""Relative change of a parameter for second derivatives, and twice it: gradients known to 1e-8 give about 1e-5."""
_UNCERTAIN = 1e-2
"""Error of second derivatives over the largest one, each by relative changes, from which on they are refused."""


class SecondDerivatives(NamedCallback):
    """d²y/dp² of a simulation: CasADi's own differences have a step of 1e-8, in which a parameter of 1e4 drowns.

    Central differences of the exact Jacobian with two steps, extrapolated (L. F. Richardson, 1911). What both differ by
    bounds the error: where it is not small, a mode sequence changes within the steps, or the gradient bends sharply.
    """

    def __init__(self, simulation: SimulationFunction, size: tuple[int, int]) -> None:
        super().__init__()
        self._simulation, self._size, dense = simulation, size, ca.Sparsity.dense
        count = size[0] * size[1]
        arguments = {"p": dense(size[1]), "out_y": ca.Sparsity(size[0], 1), "out_jac_y_p": ca.Sparsity(*size)}
        results = {"jac_jac_y_p_p": dense(count, size[1]), "jac_jac_y_p_out_y": ca.Sparsity(count, size[0])}
        self.declare("second", arguments, results)

    def eval(self, arg: Any) -> list[Any]:
        """Differentiate twice."""
        p = np.array(arg[0], float).ravel()
        derivatives = self._simulation.attempt(self._derivatives, p)
        if derivatives is None:
            derivatives = np.full((*self._size, self._size[1]), np.nan)
        flat = derivatives.reshape(self._size[0] * self._size[1], -1, order="F")
        return [ca.DM(flat), ca.DM(self._size[0] * self._size[1], self._size[0])]

    def _derivatives(self, p: Vector) -> Vector:
        """Return second derivatives, shape (outputs, parameters, parameters).

        Raises:
            NoGradient: they are not certain.
        """
        sizes = _sizes(p)
        parts = [self._along(p, size * unit, sizes) for size, unit in zip(sizes, np.eye(len(p)), strict=True)]
        derivatives, errors = (np.stack([part[k] for part in parts], axis=2) for k in (0, 1))
        self._check(derivatives, errors, np.max([part[2] for part in parts], axis=0), self._simulation.inputs)
        return derivatives / sizes[:, None] / sizes

    def products(self, p: Vector, direction: Vector) -> Vector:
        """Return second derivatives times a direction, shape (outputs, parameters).

        Raises:
            NoGradient: they are not certain.
        """
        sizes = _sizes(p)
        length = float(np.max(np.abs(direction) / sizes))
        product, errors, effects = self._along(p, direction / length, sizes)
        self._check(product[..., None], errors[..., None], effects, ("this direction",))
        return length * product / sizes

    def _along(self, p: Vector, move: Vector, sizes: Vector) -> tuple[Vector, Vector, Vector]:
        """Return second derivatives times a move, by relative changes, and their errors; shape (outputs, parameters).

        And how large outputs are, or their first derivatives by relative changes; shape (outputs,).
        """
        differences: list[Vector] = []
        effects = np.zeros(self._size[0])
        for change in (_CHANGE, 2.0 * _CHANGE):
            above, below = (self._simulation.at(p + sign * change * move) for sign in (1.0, -1.0))
            differences.append((above.derivatives - below.derivatives) * sizes / (2.0 * change))
            largest = np.abs(above.derivatives * sizes).max(axis=1)
            effects = np.maximum(largest, [abs(output.value) for output in above.outputs])
        near, far = differences
        return (4.0 * near - far) / 3.0, np.abs(near - far) / 3.0, effects

    def _check(self, derivatives: Vector, errors: Vector, effects: Vector, names: Sequence[str]) -> None:
        """Refuse what is not certain; shapes (outputs, parameters, names), and (outputs,) of effects.

        A second derivative that the precision of the first ones hides is zero: a time may be linear in a mass.
        """
        hidden = effects * self._simulation.precision / _CHANGE
        largest = np.maximum(np.abs(derivatives).max(axis=(1, 2)), hidden / _UNCERTAIN)
        relative = errors.max(axis=1) / np.where(largest > 0.0, largest, 1.0)[:, None]
        self._simulation.second_error = float(relative.max())
        row, column = (int(k) for k in np.unravel_index(np.argmax(relative), relative.shape))
        if relative[row, column] > _UNCERTAIN:
            of, by = self._simulation.outputs[row], names[int(column)]
            raise NoGradient(
                f"The second derivatives of {of} by {by} are not certain: steps of {_CHANGE:g} and {2 * _CHANGE:g} of "
                f"its value differ by {relative[row, column]:.2g} of the largest one.",
                why="Within these steps the mode sequence changes, or the gradient bends sharply.",
                advice="Use the gradient alone: hessian_approximation = limited-memory in IPOPT.",
            )


def _sizes(p: Vector) -> Vector:
    return np.where(p == 0.0, 1.0, np.abs(p))
