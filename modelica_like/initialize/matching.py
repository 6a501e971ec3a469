"""Bipartite matching that grows row by row."""

from __future__ import annotations


class Matching:
    """Rows matched with columns; a row is accepted if all rows so far can still have a column each.

    Args:
        columns: number of columns.
    """

    def __init__(self, columns: int) -> None:
        self.columns = columns
        self._rows: list[list[int]] = []
        self._row_of: dict[int, int] = {}
        self._column_of: dict[int, int] = {}

    @property
    def size(self) -> int:
        """Number of matched columns."""
        return len(self._row_of)

    def add(self, row: list[int]) -> bool:
        """Add a row with the columns it contains; False if it finds no column of its own."""
        number = len(self._rows)
        self._rows.append(row)
        came_from: dict[int, int] = {}
        pending = [number]
        for current in pending:
            for column in self._rows[current]:
                if column in came_from:
                    continue
                came_from[column] = current
                if column not in self._row_of:
                    self._flip(came_from, column, number)
                    return True
                pending.append(self._row_of[column])
        self._rows.pop()
        return False

    def _flip(self, came_from: dict[int, int], column: int, start: int) -> None:
        while True:
            row = came_from[column]
            released = self._column_of.get(row)
            self._row_of[column] = row
            self._column_of[row] = column
            if row == start or released is None:
                return
            column = released

    def undetermined(self) -> list[int]:
        """Columns that some other choice of the matching would leave open, in order."""
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
