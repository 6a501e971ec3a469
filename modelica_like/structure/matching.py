"""Independent rows: by structure (a bipartite matching) or by numbers (Gaussian elimination)."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from heapq import heapify, heappop, heappush

_ROUNDING = 1e-9
"""Size of an entry that counts as rounding, relative to its added and subtracted terms."""


class Matching:
    """Rows matched with columns; a row is accepted if each row so far can still have its own column.

    Args:
        columns: number of columns.
    """

    def __init__(self, columns: int) -> None:
        self.columns = columns
        self._rows: list[Collection[int]] = []
        self._row_of: dict[int, int] = {}
        self._column_of: dict[int, int] = {}
        self._taken: set[int] = set()

    @property
    def size(self) -> int:
        """Number of matched columns."""
        return len(self._row_of)

    def add(self, row: Collection[int]) -> bool:
        """Add a row with its columns; False if it gets no column of its own."""
        number = len(self._rows)
        self._rows.append(row)
        came_from: dict[int, int] = {}
        pending = [number]
        for current in pending:
            for column in self._rows[current]:
                if column in came_from or column in self._taken:
                    continue
                came_from[column] = current
                if column not in self._row_of:
                    self._flip(came_from, column)
                    return True
                pending.append(self._row_of[column])
        # No path leads from these columns to an open one, and rows added later cannot create one.
        self._taken.update(came_from)
        return False

    def _flip(self, came_from: dict[int, int], column: int | None) -> None:
        while column is not None:
            row = came_from[column]
            released = self._column_of.get(row)
            self._row_of[column] = row
            self._column_of[row] = column
            column = released

    def undetermined(self) -> list[int]:
        """Columns that another choice of the matching could leave open, in order."""
        users: dict[int, list[int]] = {}
        for row in set(self._row_of.values()):
            for column in self._rows[row]:
                users.setdefault(column, []).append(row)
        pending = [column for column in range(self.columns) if column not in self._row_of]
        reached = set(pending)
        for column in pending:
            for row in users.get(column, ()):
                other = self._column_of[row]
                if other not in reached:
                    reached.add(other)
                    pending.append(other)
        return sorted(reached)


class Elimination:
    """The same by numbers: a row is accepted if it is linearly independent of the rows so far.

    Args:
        columns: number of columns.
    """

    def __init__(self, columns: int) -> None:
        self.columns = columns
        self._rows: list[tuple[int, dict[int, float]]] = []
        self._row_of: dict[int, int] = {}

    @property
    def size(self) -> int:
        """Number of determined columns."""
        return len(self._rows)

    @property
    def pivot(self) -> int:
        """Column that the row accepted last determines."""
        return self._rows[-1][0]

    def add(self, row: Mapping[int, float], first: int = 0) -> bool:
        """Add a row, entries by columns; False if it depends on the rows so far.

        Args:
            row: the entries.
            first: the row determines a column from this one on, if it can.
        """
        left = self.left(row)
        if not left:
            return False
        pivot = max(left, key=lambda column: (column >= first, abs(left[column])))
        self._row_of[pivot] = len(self._rows)
        self._rows.append((pivot, left))
        return True

    def left(self, row: Mapping[int, float]) -> dict[int, float]:
        """Return what is left of a row in the columns that have no row; nothing if it depends on the rows so far."""
        values = dict(row)
        sizes = {column: abs(value) for column, value in values.items()}
        pending = [self._row_of[column] for column in values if column in self._row_of]
        heapify(pending)
        while pending:
            pivot, pivot_row = self._rows[heappop(pending)]
            value = values.pop(pivot)
            if abs(value) <= _ROUNDING * sizes[pivot]:
                continue
            for column, entry in pivot_row.items():
                if column == pivot:
                    continue
                if column not in values and column in self._row_of:
                    heappush(pending, self._row_of[column])
                change = value * entry / pivot_row[pivot]
                values[column] = values.get(column, 0.0) - change
                sizes[column] = sizes.get(column, 0.0) + abs(change)
        return {column: value for column, value in values.items() if abs(value) > _ROUNDING * sizes[column]}

    def undetermined(self) -> list[int]:
        """Columns that another choice of pivots could leave open, in order: giving their value would be new."""
        return [column for column in range(self.columns) if self.left({column: 1.0})]
