"""Prescribed motions: accelerations that are known before any torque or force."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import casadi as ca

from modelica_like.structure.blocks import triangular
from modelica_like.structure.system import System


class Flags:
    """Replaces the symbols for prescribed motions by numbers, once the structure is known.

    Args:
        system: with these symbols in its residual.
    """

    def __init__(self, system: System) -> None:
        self.system = system
        self.variables = [variable for _, variable in system.model.flags]
        self._model, self._residual = system.model, system.residual
        self._symbols = ca.vertcat(*(symbol for symbol, _ in system.model.flags))
        # Until they are settled, a symbol of unknown value keeps both alternatives in the structure.
        self._put(ca.repmat(system.model.time, len(self.variables), 1))

    def _put(self, values: Any) -> None:
        if self.variables:
            self.system.residual = ca.substitute(self._residual, self._symbols, values)
            q = ca.substitute(self._model.q, self._symbols, values)
            self.system.model = replace(self._model, q=q, flags=())

    def settle(self, residual: Any, unknowns: list[int]) -> bool:
        """Find which motions are prescribed; return whether there were any symbols.

        In the block triangular form, the equation with the symbol is in the block of the acceleration if it
        influences it, and in a later block if the acceleration is known without it.

        Args:
            residual: of all equations, differentiated ones included.
            unknowns: levels to solve for.
        """
        if not self.variables:
            return False
        jacobian = ca.jacobian_sparsity(residual, ca.vertcat(*(self.system.symbols[n] for n in unknowns)))
        block_of_row, block_of_level = dict[int, int](), dict[int | None, int]()
        for number, (rows, columns) in enumerate(triangular(jacobian)):
            block_of_row |= dict.fromkeys(rows, number)
            block_of_level |= dict.fromkeys((unknowns[column] for column in columns), number)
        values = ca.SX.ones(len(self.variables))
        for row, column in zip(*ca.jacobian_sparsity(self._residual, self._symbols).get_triplet(), strict=True):
            placed = self.system.node_level[self.variables[column]]
            if block_of_level.get(None if placed is None else self.system.derivative(placed[0])) == block_of_row[row]:
                values[column] = 0
        self._put(values)
        return True
