"""Solve the equations in block lower triangular order: explicitly if possible, otherwise by tearing."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from math import prod
from typing import Any

import casadi as ca

from modelica_like.errors import StructureError
from modelica_like.flatten.steps import STEPS
from modelica_like.language.elements import inserted
from modelica_like.structure.decided import vanishing
from modelica_like.structure.isolate import isolate, isolate_inverse

SMALL = 3
"""Torn linear blocks up to this size are solved symbolically; larger ones stay implicit."""

_UNIT = 1e-150
"""Keeps the relative size of a single coefficient defined where it is zero."""


@dataclass(frozen=True)
class Block:
    """Equations that must be solved together.

    Attributes:
        equations: positions in the residual.
        unknowns: positions in the unknowns.
        tears: guessed unknowns, from which the others follow one by one.
        kind: `explicit`, `linear` (tears solved symbolically) or `implicit` (tears become algebraic variables z).
    """

    equations: tuple[int, ...]
    unknowns: tuple[int, ...]
    tears: tuple[int, ...]
    kind: str


@dataclass
class Solved:
    """Solution of all blocks.

    Attributes:
        order: unknowns with their expressions in earlier ones, states and z.
        z: unknowns that stay implicit.
        alg: their residuals.
        rows: positions of their equations.
        determinants: (block number, expression) of relative determinants: a block is singular where one is zero.
    """

    blocks: list[Block] = field(default_factory=list)
    order: list[tuple[int, Any]] = field(default_factory=list)
    z: list[int] = field(default_factory=list)
    alg: list[Any] = field(default_factory=list)
    rows: list[int] = field(default_factory=list)
    determinants: list[tuple[int, Any]] = field(default_factory=list)


def _decides(expression: Any, unknown: Any) -> bool:
    """Return whether a condition or a step depends on an unknown, which no slope shows."""
    function = ca.Function("row", [unknown], [expression], {"allow_free": True})
    moving: set[int] = set()
    for k in range(function.n_instructions()):
        code, inputs = function.instruction_id(k), function.instruction_input(k)
        moves = code == ca.OP_INPUT or not moving.isdisjoint(inputs)
        if moves and code in STEPS:
            return True
        (moving.update if moves else moving.difference_update)(function.instruction_output(k))
    return False


class BlockSolver:
    """Solves a square system block by block.

    Args:
        residual: column of residuals.
        unknowns: column of symbols to solve for.
        volatile: column of the symbols that change during a run (states, unknowns, modes, time); a coefficient
            without them, of parameters only, is a safe divisor.
        rates: positions of the derivatives of states among the unknowns.
        kept: positions of equations whose blocks stay implicit.
    """

    def __init__(
        self, residual: Any, unknowns: Any, volatile: Any, rates: Sequence[int], kept: Collection[int] = ()
    ) -> None:
        self.unknowns = ca.vertsplit(unknowns)
        self.jacobian = ca.jacobian(residual, unknowns)
        self.residual = self._without_cancelled(residual)
        # Columns in each row, with the place of the entry among all.
        sparsity = self.jacobian.sparsity()
        rows: list[dict[int, int]] = [{} for _ in range(sparsity.size1())]
        for place, (k, column) in enumerate(zip(*sparsity.get_triplet(), strict=True)):
            rows[k][column] = place
        self.rows = rows
        # Entries that depend on parameters only cannot become zero during a run.
        moving = ca.which_depends(self.jacobian.nz[:], volatile, 1, True)
        places = zip(*self.jacobian.sparsity().get_triplet(), strict=True)
        self.safe = {place for place, moves in zip(places, moving, strict=True) if not moves}
        self.safe -= vanishing(self.jacobian)
        self.rates, self.kept = set(rates), set(kept)
        self.first = self.rates - {c for r, row in enumerate(self.rows) for c in row if (r, c) not in self.safe}
        self.solved = Solved()

    def _without_cancelled(self, residual: Any) -> list[Any]:
        """Take out unknowns that cancel: the current of a loop that hangs at one node enters and leaves it."""
        rows = ca.vertsplit(residual)
        kept: list[tuple[int, int, Any]] = []
        for row, column, slope in zip(*self.jacobian.sparsity().get_triplet(), self.jacobian.nonzeros(), strict=True):
            if slope.is_zero() and not _decides(rows[row], self.unknowns[column]):
                rows[row] = ca.substitute(rows[row], self.unknowns[column], ca.SX(0))
            else:
                kept.append((row, column, slope))
        pattern = ca.Sparsity.triplet(*self.jacobian.shape, [k[0] for k in kept], [k[1] for k in kept])
        self.jacobian = ca.SX(pattern, ca.vertcat(ca.SX(0, 1), *(k[2] for k in kept)))
        return rows

    def run(self) -> Solved:
        """Solve all blocks."""
        for rows, columns in triangular(self.jacobian.sparsity()):
            if len(rows) != len(columns):
                names = ", ".join(str(self.unknowns[column]) for column in columns[:6])
                raise (
                    StructureError(
                        f"After index reduction the equations do not determine {names or 'all unknowns'}.",
                        advice="Look for rigid parts that form a loop, or a part whose motion needs the "
                        "derivative of an input.",
                    )
                )
            self._solve(tuple(rows), tuple(columns))
        return self.solved

    def _solve(self, rows: tuple[int, ...], columns: tuple[int, ...]) -> None:
        sequence, tears, rest = self._tear(rows, columns)
        inner = [(column, self._explicit(row, column)) for row, column in sequence]
        kind = self._solve_tears(tears, self._substitute([self.residual[row] for row in rest], inner), rest)
        self.solved.order += inner
        self.solved.blocks.append(Block(rows, columns, tuple(tears), kind))

    def _explicit(self, row: int, column: int) -> Any:
        """Solve one equation for one unknown that it contains linearly with a safe coefficient."""
        residual, unknown = self.residual[row], self.unknowns[column]
        expression = isolate(residual, unknown)
        if expression is None and (row, column) not in self.safe:
            expression = isolate_inverse(residual, unknown)
        if expression is None:
            slope = self.jacobian.nz[self.rows[row][column]]
            rest = ca.substitute(residual, unknown, ca.SX(0))
            expression = -rest / slope
        return expression

    def _tear(
        self, rows: tuple[int, ...], columns: tuple[int, ...]
    ) -> tuple[list[tuple[int, int]], list[int], list[int]]:
        """Return pairs (equation, unknown) to solve one after the other, the torn unknowns, and the equations left."""
        if len(rows) == 1 and self._is_explicit(rows[0], columns[0]):  # most blocks
            return [(rows[0], columns[0])], [], []
        open_unknowns = {r: self.rows[r].keys() & {*columns} for r in rows}
        users: dict[int, list[int]] = {}
        for row, unknowns in open_unknowns.items():
            for column in unknowns:
                users.setdefault(column, []).append(row)
        sequence: list[tuple[int, int]] = []
        tears: list[int] = []
        ready = deque(r for r in rows if self._solvable(r, open_unknowns[r]))

        def settle(column: int) -> None:
            for row in users[column]:
                open_unknowns[row].discard(column)
                if self._solvable(row, open_unknowns[row]):
                    ready.append(row)

        while len(sequence) + len(tears) < len(columns):
            if ready:
                row = ready.popleft()
                if self._solvable(row, open_unknowns[row]):  # another equation may have given its unknown
                    (column,) = open_unknowns[row]
                    sequence.append((row, column))
                    settle(column)
            else:
                tears.append(self._best_tear(open_unknowns, users))
                settle(tears[-1])
        used = {row for row, _ in sequence}
        return sequence, tears, [r for r in rows if r not in used]

    def _is_explicit(self, row: int, column: int) -> bool:
        if (row, column) in self.safe:
            return True
        return row not in self.kept and isolate_inverse(self.residual[row], self.unknowns[column]) is not None

    def _solvable(self, row: int, unknowns: set[int]) -> bool:
        return len(unknowns) == 1 and (row, next(iter(unknowns))) in self.safe

    def _best_tear(self, open_unknowns: dict[int, set[int]], users: dict[int, list[int]]) -> int:
        """Choose the unknown of the shortest open equations, most used and least safe to solve for.

        The rate of a state that nothing holds comes first. Behind a chain it would follow from the torque that is left
        for its inertia: between a light one and a heavy one, half of its digits are rounding. An equation that is
        waiting for one unknown, but cannot give it in every mode, says nothing: a switch whose voltage is taken from
        there gets the rounding of all other currents, over the conductance of its open contacts.
        """
        rows = [unknowns for unknowns in open_unknowns.values() if unknowns]
        telling = [unknowns for unknowns in rows if len(unknowns) > 1 or unknowns & self.rates] or rows
        shortest = min(map(len, telling))
        near = Counter(column for unknowns in telling if len(unknowns) == shortest for column in unknowns)
        return max(
            set[int]().union(*telling),
            key=lambda column: (column in self.first, near[column], len(users[column]), -column),
        )

    def _solve_tears(self, tears: list[int], remaining: list[Any], rest: list[int]) -> str:
        """Solve equations for the torn unknowns by symbols, or leave them implicit; return the kind of the block."""
        if not tears:
            return "explicit"
        guesses = ca.vertcat(*(self.unknowns[column] for column in tears))
        slopes = ca.jacobian(ca.vertcat(*remaining), guesses)
        if not ca.depends_on(slopes, guesses) and len(tears) <= SMALL and self.kept.isdisjoint(rest):
            constants = ca.substitute(ca.vertcat(*remaining), guesses, ca.SX.zeros(len(tears)))
            solution, determinant = cramer(ca.densify(slopes), -constants)
            # Relative to Hadamard's bound, so that "nearly zero" has a meaning without units.
            bound = prod(ca.vertsplit(ca.sqrt(ca.sum2(slopes**2)))) + _UNIT
            self.solved.determinants.append((len(self.solved.blocks), determinant / bound))
            self.solved.order += zip(tears, solution, strict=True)
            return "linear"
        self.solved.z += tears
        self.solved.alg += remaining
        self.solved.rows += rest
        return "implicit"

    def _substitute(self, expressions: list[Any], inner: list[tuple[int, Any]]) -> list[Any]:
        if not (inner and expressions):
            return expressions
        symbols = [self.unknowns[column] for column, _ in inner]
        return inserted(symbols, [expression for _, expression in inner], expressions)


def cramer(matrix: Any, right: Any) -> tuple[list[Any], Any]:
    """Solve a small linear system by Cramer's rule, without pivots that could be zero in some mode.

    Returns:
        The solution and the determinant.
    """
    determinant = ca.det(matrix)
    solution: list[Any] = []
    for column in range(matrix.shape[1]):
        replaced = ca.SX(matrix)
        replaced[:, column] = right
        solution.append(ca.det(replaced) / determinant)
    return solution, determinant


def triangular(sparsity: ca.Sparsity) -> Iterator[tuple[list[int], list[int]]]:
    """Yield rows and columns of each block of the block lower triangular form."""
    _, rows, columns, row_starts, column_starts, _, _ = sparsity.btf()
    for at_rows, at_columns in zip(pairwise(row_starts), pairwise(column_starts), strict=True):
        yield rows[slice(*at_rows)], columns[slice(*at_columns)]
