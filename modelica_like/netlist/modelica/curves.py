"""Tables of the standard library: what its external functions interpolate, from numbers and from files."""

from __future__ import annotations

import csv
import math
import re
from bisect import bisect_right
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from modelica_like.language import mod, where
from modelica_like.netlist.document import read_text
from modelica_like.netlist.modelica.fold import Unfit

LINEAR, AKIMA, CONSTANT, FRITSCH_BUTLAND, STEFFEN, MODIFIED_AKIMA = range(1, 7)
HOLD, LAST_TWO, PERIODIC, NEVER = range(1, 5)
Rows = np.ndarray[Any, np.dtype[np.float64]]
_FEW = 2
"""Points that only a straight line goes through."""


@dataclass(frozen=True, eq=False)
class Axis:
    """Where the pieces of a curve begin, and how it goes on beyond.

    Attributes:
        points: abscissae, not falling.
        smoothness: 1 to 6, as of the library.
        beyond: extrapolation, 1 to 4, likewise.
        events: whether every piece begins with an event; else only one that jumps.
    """

    points: Rows
    smoothness: int
    beyond: int
    events: bool | None = None

    @property
    def cells(self) -> list[int]:
        """Numbers of the points at which pieces begin; where two points are equal, the curve jumps."""
        return [k for k, (a, b) in enumerate(pairwise(self.points)) if b > a]

    def chosen(self, x: Any, pieces: list[Any]) -> Any:
        """Return the piece that holds at x: the first before all points, the last behind them."""
        starts = [float(self.points[k]) for k in self.cells]
        starts = starts[1:] if self.beyond == PERIODIC else [*starts, float(self.points[-1])]
        return _tree(x, starts or [float(self.points[0])], pieces, self.events)

    def within(self, x: Any) -> Any:
        """Return x, brought into the range of a curve that is periodic."""
        first, span = float(self.points[0]), float(self.points[-1] - self.points[0])
        if self.beyond != PERIODIC or span <= 0:
            return x
        return first + ((x - first) % span if isinstance(x, float) else mod(x - first, span))

    def polynomials(self, values: Rows, slopes: Rows | None = None) -> tuple[list[float], list[Rows]]:
        """Return the origins of the pieces and their coefficients, by rising powers.

        Args:
            values: at the points, in the first dimension.
            slopes: there, if others determine them.
        """
        xs, cells = self.points, self.cells
        if not cells:
            return [xs[0], xs[0]], [_powers(values[0]), _powers(values[-1])]
        slopes = self.slopes(values) if slopes is None else slopes
        pieces: list[Rows] = []
        for k in cells:
            h, rise = xs[k + 1] - xs[k], values[k + 1] - values[k]
            a, b = (slopes[k], slopes[k + 1]) if slopes is not None else (rise / h, rise / h)
            cubic = [3 * rise / h**2 - (2 * a + b) / h, (a + b) / h**2 - 2 * rise / h**3]
            pieces.append(_powers(values[k], a, *cubic))
        first, last, h = pieces[0], pieces[-1], xs[cells[-1] + 1] - xs[cells[-1]]
        goes_on = float(self.beyond == LAST_TWO)
        ends = first[1] * goes_on, (last[1] + 2 * last[2] * h + 3 * last[3] * h**2) * goes_on
        if self.smoothness == CONSTANT:
            pieces = [_powers(values[k]) for k in cells]
        origins = [xs[k] for k in cells]
        if self.beyond == PERIODIC:
            return origins, pieces
        # Two points at one place have no slope between them.
        left, right = ends[0] * (cells[0] == 0), ends[1] * (cells[-1] == len(xs) - 2)
        return [xs[0], *origins, xs[-1]], [_powers(values[0], left), *pieces, _powers(values[-1], right)]

    def slopes(self, values: Rows) -> Rows | None:
        """Return the slopes at the points, None where the curve is straight between them."""
        if self.smoothness in (LINEAR, CONSTANT) or len(values) <= _FEW:
            return None
        widths = np.diff(self.points)
        secants = np.diff(values, axis=0) / widths.reshape(-1, *(1 for _ in values.shape[1:]))
        if self.smoothness in (AKIMA, MODIFIED_AKIMA):
            ends = self.beyond == PERIODIC and bool(np.all(values[0] == values[-1]))
            d = _extended(secants, ends)
            left, right = _weights(d, self.smoothness == MODIFIED_AKIMA)
            return left * d[1:-2] + right * d[2:-1]
        return np.apply_along_axis(_monotone, 0, secants, widths, self.smoothness == STEFFEN)


def _powers(*coefficients: Any) -> Rows:
    return np.stack([*(np.asarray(c, float) for c in coefficients), *(4 - len(coefficients)) * [0 * coefficients[0]]])


def _tree(x: Any, starts: list[float], pieces: list[Any], events: bool | None) -> Any:
    """Choose by halves, so that a long table is not deep."""
    if isinstance(x, float):
        return pieces[bisect_right(starts, x)]
    if len(pieces) == 1:
        return pieces[0]
    middle = len(pieces) // 2
    low = _tree(x, starts[: middle - 1], pieces[:middle], events)
    high = _tree(x, starts[middle:], pieces[middle:], events)
    return where(x < starts[middle - 1], low, high, events=events)


def _extended(secants: Rows, periodic: bool = False) -> Rows:
    """Return secants with two more at each end, after Akima (1970)."""
    d = np.concatenate([np.zeros((2, *secants.shape[1:])), secants, np.zeros((2, *secants.shape[1:]))])
    if periodic:
        d[:2], d[-2:] = secants[-2:], secants[:2]
        return d
    d[1], d[-2] = 2 * d[2] - d[3], 2 * d[-3] - d[-4]
    d[0], d[-1] = 2 * d[1] - d[2], 2 * d[-2] - d[-3]
    return d


def _weights(d: Rows, modified: bool = False) -> tuple[Rows, Rows]:
    """Return the weights of the secants on both sides of a point; the modified ones keep flat what is flat."""
    step = np.abs(np.diff(d, axis=0)) + (np.abs(d[1:] + d[:-1]) / 2 if modified else 0.0)
    right, left = step[:-2], step[2:]
    total, even = left + right, 0.0 if modified else 0.5
    safe = np.where(total > 0, total, 1.0)
    return np.where(total > 0, left / safe, even), np.where(total > 0, right / safe, even)


def _akima_slopes(xs: Rows, ys: Rows, z: Rows) -> tuple[Rows, Rows]:
    """Return the slopes of a map along its second axis, and its cross derivatives, after Akima (1974)."""
    along_x, along_y = np.diff(z, axis=0) / np.diff(xs)[:, None], (np.diff(z, axis=1) / np.diff(ys)).T
    dx, dy = _extended(along_x), _extended(along_y)
    (x_left, x_right), (y_left, y_right) = _weights(dx), (tuple(w.T for w in _weights(dy)))
    cross = _extended(_extended(np.diff(along_x, axis=1) / np.diff(ys)).T).T
    left, right = slice(1, -2), slice(2, -1)
    mixed = x_left * (y_left * cross[left, left] + y_right * cross[left, right])
    mixed += x_right * (y_left * cross[right, left] + y_right * cross[right, right])
    return y_left * dy[left].T + y_right * dy[right].T, mixed


def _monotone(secants: Rows, widths: Rows, steffen: bool) -> Rows:
    """Return slopes that make no overshoot, after Fritsch and Butland (1984) or Steffen (1990)."""
    slopes = [secants[0]]
    for (s, t), (h, g) in zip(pairwise(secants), pairwise(widths), strict=True):
        if s * t <= 0:
            slopes.append(0.0)
        elif steffen:
            middle = abs(s * g + t * h) / (h + g)
            slopes.append(math.copysign(2 * min(middle / 2, abs(s), abs(t)), s))
        else:
            slopes.append(3 * (h + g) / ((h + 2 * g) / s + (2 * h + g) / t))
    return np.array([*slopes, secants[-1]])


@dataclass(frozen=True, eq=False)
class Table:
    """A table that was read.

    Attributes:
        rows: numbers.
        axes: one, or two of a map, whose first row and column they are.
        columns: of the outputs, from 1.
        start: before that time the output is zero.
        shift: of the time.
    """

    rows: Rows
    axes: tuple[Axis, ...]
    columns: tuple[int, ...] = ()
    start: float = -math.inf
    shift: float = 0.0

    def curve(self, output: int = 0) -> Curve:
        """Return the curve of an output, counted from 1, or that of a map."""
        if len(self.axes) > 1:
            return Curve(self, self.rows[1:, 1:])
        if not (1 <= output <= len(self.columns) and 1 <= self.columns[output - 1] <= self.rows.shape[1]):
            raise Unfit(f"The table has {self.rows.shape[1]} columns, and another one is asked for")
        return Curve(self, self.rows[:, self.columns[output - 1] - 1])


@dataclass(frozen=True, eq=False)
class Curve:
    """A table's output as a function of its one or two inputs.

    Attributes:
        table: it belongs to.
        values: at the points of its axes.
    """

    table: Table
    values: Rows = field(repr=False)
    whole = False

    def __call__(self, *inputs: Any) -> Any:
        """Return the value at inputs, which are numbers or in symbols."""
        table = self.table
        axis, x = table.axes[0], table.axes[0].within(inputs[0] - table.shift)
        origins, pieces = axis.polynomials(self.values)
        if len(table.axes) == 1:
            result = axis.chosen(x, [_polynomial(x - o, piece) for o, piece in zip(origins, pieces, strict=True)])
            if isinstance(x, float):
                return 0.0 if inputs[0] < table.start else result
            return where(inputs[0] < table.start, 0.0, result) if table.start > -math.inf else result
        other, y = table.axes[1], table.axes[1].within(inputs[1])
        rises: list[Any] = [4 * [None] for _ in pieces]
        if axis.smoothness == AKIMA and min(self.values.shape) > _FEW:
            along, cross = _akima_slopes(axis.points, other.points, self.values)
            rises = axis.polynomials(along, cross)[1]
        rows: list[Any] = []
        for origin, piece, rise in zip(origins, pieces, rises, strict=True):
            # A coefficient of x is a function of y, by the same rule.
            below = [other.polynomials(c, slopes) for c, slopes in zip(piece, rise, strict=True)]
            cells = [
                _polynomial(x - origin, [_polynomial(y - starts[k], parts[k]) for starts, parts in below])
                for k in range(len(below[0][0]))
            ]
            rows.append(other.chosen(y, cells))
        return axis.chosen(x, rows)


def _polynomial(v: Any, coefficients: Any) -> Any:
    result: Any = 0.0
    for coefficient in reversed(list(coefficients)):
        result = result * v + coefficient
    return result


def read_rows(path: Path, name: str, delimiter: str = ",", skip: int = 0) -> Rows:
    """Return a table of a file.

    Args:
        path: `.txt` in the library's form, `.csv` or `.mat`.
        name: of the table; a `.csv` has one only.
        delimiter: between the numbers of a `.csv`.
        skip: lines of its head.

    Raises:
        Unfit: there is no such file or table, or it is no table.
        NetlistError: the file is no text.
    """
    if not path.is_file():
        raise Unfit(f"There is no file '{path.name}' for the table {name}")
    try:
        if path.suffix.lower() == ".csv":
            lines = read_text(path).splitlines()[skip:]
            return np.array([[float(cell) for cell in row] for row in csv.reader(lines, delimiter=delimiter) if row])
        if path.suffix.lower() == ".mat":
            return _of_matlab(path, name)
        return _of_text(read_text(path), name)
    except (ValueError, KeyError, IndexError, NotImplementedError):
        raise Unfit(f"'{path.name}' has no table {name} that can be read") from None


def _of_text(text: str, name: str) -> Rows:
    head = re.search(rf"^\s*(?:double|float)\s+{re.escape(name)}\s*\(\s*(\d+)\s*,\s*(\d+)\s*\)", text, re.MULTILINE)
    if head is None:
        raise KeyError(name)
    size = int(head[1]), int(head[2])
    body = re.sub(r"#.*|//.*|/\*.*?\*/", "", text[head.end() :])
    words = re.split(r"[\s,;]+", body.strip())[: size[0] * size[1]]
    return np.array([float(word) for word in words]).reshape(size)


def _of_matlab(path: Path, name: str) -> Rows:
    from scipy.io import loadmat  # few tables are of this kind

    head, *fields = name.split(".")  # of structures in structures
    value: Any = loadmat(path, variable_names=[head])[head]
    for field_name in fields:
        value = value[field_name][0, 0]
    return np.atleast_2d(np.asarray(value, float))
