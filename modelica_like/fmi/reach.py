"""Arguments on which the results of a function depend: exact, in a time linear in the size of the function.

CasADi's `jac_sparsity` gives the same, but takes quadratic time for a long chain of components.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import casadi as ca
import numpy as np


class Reach:
    """Dependencies of one result of a function of scalar expressions (SX).

    Args:
        function: the function.
        output: number of the result, a column.

    Attributes:
        rows: a number for every element of the result; its bits are the elements of all arguments, one after the other.
    """

    def __init__(self, function: Any, output: int = 0) -> None:
        self._elements: list[tuple[str, int]] = []
        first: list[int] = []
        for number, name in enumerate(function.name_in()):
            first.append(len(self._elements))
            self._elements += [(name, k) for k in range(function.nnz_in(number))]
        self.rows = [0] * function.numel_out(output)
        places = function.sparsity_out(output).row()
        held: dict[int, int] = {}
        for k in range(function.n_instructions()):
            code = function.instruction_id(k)
            read, written = function.instruction_input(k), function.instruction_output(k)
            if code == ca.OP_INPUT:
                held[written[0]] = 1 << (first[read[0]] + read[1])
            elif code == ca.OP_OUTPUT:
                if written[0] == output:
                    self.rows[places[written[1]]] = held[read[0]]
            elif code == ca.OP_CONST:
                held[written[0]] = 0
            else:
                held[written[0]] = held[read[0]] | held[read[-1]]

    def mask(self, *names: str) -> int:
        """Return the bits of all elements of some arguments."""
        return sum(1 << bit for bit, (name, _) in enumerate(self._elements) if name in names)

    def elements(self, row: int) -> Iterator[tuple[str, int]]:
        """Yield name and element of every argument on which an element of the result depends."""
        bits = self.rows[row]
        octets = np.frombuffer(bits.to_bytes((bits.bit_length() + 7) // 8, "little"), np.uint8)
        yield from (self._elements[bit] for bit in np.flatnonzero(np.unpackbits(octets, bitorder="little")))
