"""Solve the equations in block lower triangular order: explicitly if possible, otherwise by tearing."""

from __future__ import annotations

import operator
from collections import deque
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from functools import reduce
from typing import Any

import casadi as ca

from modelica_like.errors import StructureError
from modelica_like.structure.isolate import isolate

SMALL = 3
"""Torn linear blocks up to this size are solved symbolically; larger ones stay implicit."""

_STEPS = {ca.OP_LT, ca.OP_LE, ca.OP_EQ, ca.OP_NE, ca.OP_NOT, ca.OP_AND, ca.OP_OR, ca.OP_SIGN, ca.OP_FLOOR, ca.OP_CEIL}
"""Operations whose slope is zero."""
_CONSTANTS = {ca.OP_CONST, ca.OP_PARAMETER}

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
        moves = code == ca.OP_INPUT or (code not in _CONSTANTS and not moving.isdisjoint(inputs))
        if moves and code in _STEPS:
            return True
        if code != ca.OP_OUTPUT:
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
        self.unknowns = ca.vertsplit(unknowns) if unknowns.numel() else []
        self.jacobian = ca.jacobian(residual, unknowns)
        self.residual = self._without_cancelled(residual)
        self.rows = _places_by_row(self.jacobian.sparsity())
        self.safe = self._safe_entries(volatile)
        self.rates, self.kept = set(rates), set(kept)
        self.first = self.rates - {c for r, row in enumerate(self.rows) for c in row if (r, c) not in self.safe}
        self.solved = Solved()

    def _without_cancelled(self, residual: Any) -> list[Any]:
        """Take out unknowns that cancel: the current of a loop that hangs at one node enters and leaves it."""
        rows = ca.vertsplit(residual) if residual.numel() else []
        slopes = list(zip(*self.jacobian.sparsity().get_triplet(), self.jacobian.nonzeros(), strict=True))
        kept: list[tuple[int, int, Any]] = []
        for row, column, slope in slopes:
            if slope.is_zero() and not _decides(rows[row], self.unknowns[column]):
                rows[row] = ca.substitute(rows[row], self.unknowns[column], ca.SX(0))
            else:
                kept.append((row, column, slope))
        if len(kept) < len(slopes):
            pattern = ca.Sparsity.triplet(*self.jacobian.shape, [k[0] for k in kept], [k[1] for k in kept])
            self.jacobian = ca.SX(pattern, ca.vertcat(*(k[2] for k in kept)))
        return rows

    def _safe_entries(self, volatile: Any) -> set[tuple[int, int]]:
        """Entries of the Jacobian that depend on parameters only: they cannot become zero during a run."""
        entries = self.jacobian.nz[:]
        moving = ca.which_depends(entries, volatile, 1, True) if entries.numel() else []
        rows, columns = self.jacobian.sparsity().get_triplet()
        return {(r, c) for r, c, moves in zip(rows, columns, moving, strict=True) if not moves}

    def run(self) -> Solved:
        """Solve all blocks."""
        _, row_order, column_order, row_starts, column_starts, _, _ = self.jacobian.sparsity().btf()
        count = len(row_starts) - 1
        for number in range(count):
            if row_starts[number + 1] - row_starts[number] != column_starts[number + 1] - column_starts[number]:
                raise self._not_square(column_order[column_starts[number] : column_starts[number + 1]])
        for number in range(count):
            rows = row_order[row_starts[number] : row_starts[number + 1]]
            columns = column_order[column_starts[number] : column_starts[number + 1]]
            self._solve(tuple(rows), tuple(columns))
        return self.solved

    def _not_square(self, columns: list[int]) -> StructureError:
        names = ", ".join(str(self.unknowns[column]) for column in columns[:6])
        return StructureError(
            f"After index reduction the equations do not determine {names or 'all unknowns'}.",
            advice="Look for rigid parts that form a loop, or a part whose motion needs the derivative of an input.",
        )

    def _solve(self, rows: tuple[int, ...], columns: tuple[int, ...]) -> None:
        if len(rows) == 1 and (rows[0], columns[0]) in self.safe:
            expression = self._explicit(rows[0], columns[0])
            if expression is not None:
                self.solved.order.append((columns[0], expression))
                self.solved.blocks.append(Block(rows, columns, (), "explicit"))
                return
        sequence, tears, rest = self._tear(rows, columns)
        self._solve_torn(rows, columns, sequence, tears, rest)

    def _explicit(self, row: int, column: int) -> Any | None:
        """Solve one equation for one unknown that it contains linearly with a safe coefficient."""
        residual, unknown = self.residual[row], self.unknowns[column]
        expression = isolate(residual, unknown)
        if expression is None:
            slope = self.jacobian.nz[self.rows[row][column]]
            rest = ca.substitute(residual, unknown, ca.SX(0))
            expression = -rest / slope
        return expression

    def _tear(
        self, rows: tuple[int, ...], columns: tuple[int, ...]
    ) -> tuple[list[tuple[int, int]], list[int], list[int]]:
        """Return pairs (equation, unknown) to solve one after the other, the torn unknowns, and the equations left."""
        inside = set(columns)
        open_unknowns = {r: {c for c in self.rows[r] if c in inside} for r in rows}
        users: dict[int, list[int]] = {}
        for row, unknowns in open_unknowns.items():
            for column in unknowns:
                users.setdefault(column, []).append(row)
        sequence: list[tuple[int, int]] = []
        tears: list[int] = []
        used: set[int] = set()
        done: set[int] = set()
        ready = deque(r for r in rows if self._solvable(r, open_unknowns[r]))

        def settle(column: int) -> None:
            done.add(column)
            for row in users[column]:
                open_unknowns[row].discard(column)
                if row not in used and self._solvable(row, open_unknowns[row]):
                    ready.append(row)

        while len(done) < len(columns):
            if ready:
                row = ready.popleft()
                if row in used or not self._solvable(row, open_unknowns[row]):
                    continue
                column = next(iter(open_unknowns[row]))
                used.add(row)
                sequence.append((row, column))
                settle(column)
            else:
                tear = self._best_tear(rows, used, open_unknowns, users)
                tears.append(tear)
                settle(tear)
        return sequence, tears, [r for r in rows if r not in used]

    def _solvable(self, row: int, unknowns: set[int]) -> bool:
        return len(unknowns) == 1 and (row, next(iter(unknowns))) in self.safe

    def _best_tear(
        self, rows: tuple[int, ...], used: set[int], open_unknowns: dict[int, set[int]], users: dict[int, list[int]]
    ) -> int:
        """Choose the unknown of the shortest open equations, most used and least safe to solve for.

        The rate of a state that nothing holds comes first. Behind a chain it would follow from the torque that is left
        for its inertia: between a light one and a heavy one, half of its digits are rounding. An equation that is
        waiting for one unknown, but cannot give it in every mode, says nothing: a switch whose voltage is taken from
        there gets the rounding of all other currents, over the conductance of its open contacts.
        """
        telling = [r for r in rows if r not in used and (len(open_unknowns[r]) > 1 or open_unknowns[r] & self.rates)]
        telling = telling or [r for r in rows if r not in used and open_unknowns[r]]
        shortest = min(len(open_unknowns[r]) for r in telling)
        scores: dict[int, tuple[bool, int, int, int]] = {}
        for row in telling:
            for column in open_unknowns[row]:
                near = scores.get(column, (False, 0, 0, 0))[1]
                near += len(open_unknowns[row]) == shortest
                scores[column] = (column in self.first, near, len(users[column]), -column)
        return max(scores, key=lambda column: scores[column])

    def _solve_torn(
        self,
        rows: tuple[int, ...],
        columns: tuple[int, ...],
        sequence: list[tuple[int, int]],
        tears: list[int],
        rest: list[int],
    ) -> None:
        inner = [(column, self._explicit(row, column)) for row, column in sequence]
        remaining = self._substitute([self.residual[row] for row in rest], inner)
        guesses = ca.vertcat(*(self.unknowns[column] for column in tears))
        slopes = ca.jacobian(ca.vertcat(*remaining), guesses)
        linear = not any(ca.which_depends(ca.vertcat(*slopes.nonzeros()), guesses, 1, True)) if slopes.nnz() else False
        number = len(self.solved.blocks)
        if linear and len(tears) <= SMALL and self.kept.isdisjoint(rest):
            constants = ca.substitute(ca.vertcat(*remaining), guesses, ca.SX.zeros(len(tears)))
            matrix = ca.densify(slopes)
            solution, determinant = cramer(matrix, -constants)
            # Relative to Hadamard's bound, so that "nearly zero" has a meaning without units.
            norms = ca.vertsplit(ca.sqrt(ca.sum2(matrix**2))) if len(tears) > 1 else [ca.fabs(determinant)]
            bound = reduce(operator.mul, norms) + _UNIT
            self.solved.determinants.append((number, determinant / bound))
            self.solved.order += [(column, solution[k]) for k, column in enumerate(tears)]
            kind = "linear"
        else:
            self.solved.z += tears
            self.solved.alg += remaining
            self.solved.rows += rest
            kind = "implicit"
        self.solved.order += inner
        self.solved.blocks.append(Block(rows, columns, tuple(tears), kind))

    def _substitute(self, expressions: list[Any], inner: list[tuple[int, Any]]) -> list[Any]:
        if not inner:
            return expressions
        symbols = [self.unknowns[column] for column, _ in inner]
        _, replaced = ca.substitute_inplace(symbols, [expression for _, expression in inner], expressions, False)
        return list(replaced)


def cramer(matrix: Any, right: Any) -> tuple[Any, Any]:
    """Solve a small linear system by Cramer's rule, without pivots that could be zero in some mode.

    Returns:
        The solution and the determinant.
    """
    size = matrix.shape[0]
    determinant = _determinant(matrix, list(range(size)), list(range(size)))
    solution = []
    for column in range(size):
        replaced = ca.SX(matrix)
        replaced[:, column] = right
        solution.append(_determinant(replaced, list(range(size)), list(range(size))) / determinant)
    return ca.vertcat(*solution), determinant


def _determinant(matrix: Any, rows: list[int], columns: list[int]) -> Any:
    if len(rows) == 1:
        return matrix[rows[0], columns[0]]
    total: Any = 0
    for k, column in enumerate(columns):
        minor = _determinant(matrix, rows[1:], columns[:k] + columns[k + 1 :])
        term = matrix[rows[0], column] * minor
        total = total + term if k % 2 == 0 else total - term
    return total


def _places_by_row(sparsity: ca.Sparsity) -> list[dict[int, int]]:
    """Columns in each row, with the place of the entry among all."""
    rows: list[dict[int, int]] = [{} for _ in range(sparsity.size1())]
    for place, (row, column) in enumerate(zip(*sparsity.get_triplet(), strict=True)):
        rows[row][column] = place
    return rows
