"""Symbolic analysis of sparse QR factorisations: orderings and patterns, once, for numbers that come later."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class QrPattern:
    """A square matrix by columns, with orderings and patterns of its Householder vectors V and of R.

    Attributes:
        size: number of rows and columns.
        colind, row: columns of the matrix.
        v_colind, v_row: columns of V, in permuted rows.
        r_colind, r_row: columns of R, the diagonal last.
        row_place: permuted position of every row.
        column_order: column of the matrix that stands at each permuted position.
    """

    size: int
    colind: tuple[int, ...]
    row: tuple[int, ...]
    v_colind: tuple[int, ...]
    v_row: tuple[int, ...]
    r_colind: tuple[int, ...]
    r_row: tuple[int, ...]
    row_place: tuple[int, ...]
    column_order: tuple[int, ...]


def qr_pattern(pattern: Any) -> QrPattern:
    """Analyse a square pattern (approximate minimum degree of columns, then elimination tree).

    Args:
        pattern: a `casadi.Sparsity` that is structurally regular.
    """
    if not pattern.size1():
        return QrPattern(0, (0,), (), (0,), (), (0,), (), (), ())
    v, r, rows, columns = pattern.qr_sparse(True)
    columns_of = {"": pattern, "v_": v, "r_": r}
    named: dict[str, Any] = {f"{name}colind": tuple(one.colind()) for name, one in columns_of.items()}
    named |= {f"{name}row": tuple(one.row()) for name, one in columns_of.items()}
    return QrPattern(size=pattern.size1(), row_place=tuple(rows), column_order=tuple(columns), **named)
