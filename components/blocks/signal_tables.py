"""Tables over signals: characteristic curves and maps."""

from __future__ import annotations

from math import inf

from components import icons
from components.tabulated import Flat, Tabulated
from modelica_like.language import (
    Equations,
    Events,
    Input,
    Output,
    Parameter,
    column,
    param,
    rows,
    signal_in,
    signal_out,
)


class Table1D(Tabulated):
    """Characteristic curve: y from a table over a signal.

    Modelica Standard Library, Blocks.Tables.CombiTable1Ds; which continues the last slope beyond the rows.
    """

    icon = icons.TABLE_BLOCK
    u: Input = signal_in("*", "argument")
    table: tuple[tuple[float, float], ...] = rows(
        column("argument", scale="u_scale", rising=True), column("value", scale="scale")
    )
    u_scale: Parameter = param("*", "scale of the arguments", default=1.0)
    scale: Parameter = param("*", "scale of the values", default=1.0)
    y: Output = signal_out("*", "value")

    def equations(self) -> Equations:
        yield self.y == self.scale * self.look_up(self.u / self.u_scale, self.table)

    def events(self) -> Events:
        yield from self.leaving("table", self.u / self.u_scale, self.table, least=-inf)


class Table2D(Tabulated):
    """Map: y from a table over two signals, e.g. the torque of an engine over its speed and throttle.

    Row by row along u2, and then across the rows along u1. Modelica Standard Library, Blocks.Tables.CombiTable2Ds,
    whose first row and column are here `second` and `first`; which continues the last slope beyond the rows.
    """

    icon = icons.TABLE_BLOCK
    u1: Input = signal_in("*", "argument down the rows")
    u2: Input = signal_in("*", "argument along a row")
    first: Flat = rows(column("argument u1 of a row", scale="u1_scale", rising=True), flat=True)
    second: Flat = rows(column("argument u2 of a column", scale="u2_scale", rising=True), flat=True)
    table: tuple[Flat, ...] = rows(column("value", scale="scale"), more=True)
    u1_scale: Parameter = param("*", "scale of `first`", default=1.0)
    u2_scale: Parameter = param("*", "scale of `second`", default=1.0)
    scale: Parameter = param("*", "scale of the values", default=1.0)
    y: Output = signal_out("*", "value")

    def equations(self) -> Equations:
        u1, u2 = self.u1 / self.u1_scale, self.u2 / self.u2_scale
        yield self.y == self.scale * self.look_up_map(u1, self.first, u2, self.second, self.table)

    def events(self) -> Events:
        for name, u, grid in (
            ("first", self.u1 / self.u1_scale, self.first), ("second", self.u2 / self.u2_scale, self.second),
        ):  # fmt: skip
            yield from self.leaving(name, u, [(value,) for value in grid], least=-inf)
