"""Characteristic curves: operating points over a parameter, or over a variable that a parameter controls."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from modelica_like.analyse.operating.steady import OperatingPoint, steady
from modelica_like.arguments import checked
from modelica_like.errors import InitializationError, UnknownName, ValueOutOfRange, did_you_mean
from modelica_like.runs.display import Display
from modelica_like.runs.solution import Solution
from modelica_like.simulation import Model, build
from modelica_like.style import COLOURS, picture, text_width, with_unit
from modelica_like.upper import Shown

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False)
class Curves(Shown):
    """Operating points along a curve.

    Attributes:
        over: path of the varied quantity.
        points: one per value.
    """

    over: str
    points: tuple[OperatingPoint, ...] = field(repr=False)

    def __getitem__(self, path: str) -> Any:
        """Return a column, shape (points,); `efficiency` and `loss` are those of the drive, in 1 and W."""
        if path == "efficiency":
            return np.array([point.efficiency for point in self.points])
        if path == "loss":
            return np.array([sum(point.losses.values()) for point in self.points])
        return np.array([point[path] for point in self.points])

    def plot(self, *paths: str, over: str = "", display: Mapping[str, str] | None = None) -> Figure:
        """Draw columns, one panel each.

        Args:
            paths: columns to draw.
            over: the horizontal axis; by default the varied quantity.
            display: units by path, pattern or quantity, in addition to those of the netlist.

        Raises:
            UnknownName: there is no such column.
            UnitError: it cannot be shown in a unit.
        """
        over, number, shown = over or self.over, max(len(paths), 1), Display(self.points[0].model, display)

        def column(path: str) -> tuple[Any, str]:
            si_unit = self.unit(path)
            unit = shown.of(path) if path in shown else shown.of_quantity(si_unit)
            return shown.converted(self[path], si_unit, unit), with_unit(path, unit)

        along, label = column(over)
        with picture(self.points[0].model.name, number, 0.8 + 1.7 * number) as (figure, rows):
            for k, path in enumerate(paths):
                values, name = column(path)
                rows[k].plot(along, values, color=COLOURS[k % len(COLOURS)])
                rows[k].set_ylabel(name if text_width(name, 9.0) < 1.5 else name.replace(" in ", "\nin "))
            rows[-1].set_xlabel(label)
            figure.align_ylabels(rows)
        return figure

    def unit(self, path: str) -> str:
        """Return the coherent SI unit of a column.

        Raises:
            UnknownName: there is no such column.
        """
        if path in ("efficiency", "loss"):
            return "1" if path == "efficiency" else "W"
        if path not in (units := self.points[0].model.units):
            raise UnknownName(f"There is no '{path}' in these curves{did_you_mean(path, units) or '.'}")
        return str(units[path])

    def __len__(self) -> int:
        return len(self.points)

    def __str__(self) -> str:
        values = self[self.over]
        name = self.points[0].model.name
        return f"Curves of {name}: {len(self)} operating points, {self.over} = {values[0]:.6g} … {values[-1]:.6g}"


@checked
def characteristic(
    drive: Model, over: Mapping[str, Iterable[Any]], *, by: str = "", near: OperatingPoint | Solution | None = None,
) -> Curves:  # fmt: skip
    """Follow the steady states of a drive over a parameter, or over a variable that a parameter controls.

    n(M), I(M) and eta(M) of a motor: `characteristic(motor, {"load.tau_constant": torques})`.

    Args:
        drive: a component, a netlist file or a compiled model.
        over: path of one parameter, input or variable, and its values; each point starts from the one before.
        by: for a variable: the parameter that controls it.
        near: where to start, as in `steady`.

    Raises:
        ValueOutOfRange: `over` is not one name with at least one value.
        UnknownName: a name is not known.
        InitializationError: there is no steady state for a value; the message names it.
    """
    if len(over) != 1:
        raise ValueOutOfRange(f"A characteristic curve varies one quantity, not {len(over)}.")
    (path, values) = next(iter(over.items()))
    model = build(drive, free=[path, by])
    points: list[OperatingPoint] = []
    for value in values:
        near = points[-1] if points else near
        wanted: dict[str, Any] = {"hold": {path: value}, "by": by} if by else {"parameters": {path: value}}
        try:
            points.append(steady(model, **wanted, near=near))
        except InitializationError as error:
            error.what = f"At {path} = {value}: {error.what}"
            raise
    if not points:
        raise ValueOutOfRange(f"{path}: no values are given.")
    return Curves(path, tuple(points))
