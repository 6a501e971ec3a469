"""Prescribed motions: accelerations that are known before any torque or force."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import casadi as ca

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
        equation_block, unknown_block = _blocks(residual, ca.vertcat(*(self.system.symbols[n] for n in unknowns)))
        block_of = dict(zip(unknowns, unknown_block, strict=True))
        values = [1.0] * len(self.variables)
        for row, column in zip(*ca.jacobian_sparsity(self._residual, self._symbols).get_triplet(), strict=True):
            rate = self._acceleration(self.variables[column])
            if rate in block_of and block_of[rate] == equation_block[row]:
                values[column] = 0.0
        self._put(ca.SX(ca.DM(values)))
        return True

    def _acceleration(self, variable: int) -> int | None:
        placed = self.system.node_level[variable]
        return None if placed is None else self.system.derivative(placed[0])


def _blocks(residual: Any, unknowns: Any) -> tuple[list[int], list[int]]:
    """Number of the block of every equation and of every unknown."""
    count, row_order, column_order, row_starts, column_starts, _, _ = ca.jacobian_sparsity(residual, unknowns).btf()
    results: list[list[int]] = []
    for order, starts in ((row_order, row_starts), (column_order, column_starts)):
        block = [0] * len(order)
        for number in range(count):
            for place in order[starts[number] : starts[number + 1]]:
                block[place] = number
        results.append(block)
    return results[0], results[1]
