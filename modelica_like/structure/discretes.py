"""Parts of d, which are values that only events change.

Modes and discrete values of components come first, as in `FlatModel.discretes`. Behind them stand what follows them:
an approach per held motion, the switches and the shares of every circuit, and a row per ideal element.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Part:
    """Entries of d that form a table, row by row.

    Attributes:
        first: position in d of the first one.
        rows: of the table.
        columns: of the table.
    """

    first: int
    rows: int
    columns: int

    @property
    def end(self) -> int:
        """Position in d behind the last one."""
        return self.first + self.rows * self.columns

    @property
    def entries(self) -> slice:
        """Positions in d."""
        return slice(self.first, self.end)

    def of(self, d: Any) -> Any:
        """Return the table among the values of d; shape (rows, columns)."""
        return d[self.entries].reshape(self.rows, self.columns)
