"""Operating points and curves as tables."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from rich.console import Group, RenderableType
from rich.markup import escape
from rich.table import Table

from modelica_like.analyse.operating.curves import Curves
from modelica_like.analyse.operating.steady import OperatingPoint
from modelica_like.report.types import table

_SMALL = 1e-9
"""Share of the largest power below which one is rounding."""


def point_report(point: OperatingPoint, names: Sequence[str] = ()) -> RenderableType:
    """Return the powers of an operating point, its efficiency, and the values of variables."""
    model = point.model
    powers = point.powers
    largest = max((abs(one) for pair in powers.values() for one in pair), default=0.0)
    rows = [
        (path or model.name, f"{source:.6g}", f"{loss:.6g}")
        for path, (source, loss) in powers.items()
        if max(abs(source), abs(loss)) > _SMALL * largest
    ]
    made = table("powers in W", "component", "from outside>", "lost>", rows=rows)
    parts: list[RenderableType] = [f"[bold]{escape(model.name)}[/]  steady state", "", made]
    if np.isfinite(point.efficiency):
        parts.append(f"Efficiency {100 * point.efficiency:.4g} %.")
    if point.stuck:
        parts.append(f"Sticking: {escape(', '.join(point.stuck))}.")
    return Group(*parts, "", _values(point, names or model.states))


def _values(point: OperatingPoint, names: Sequence[str]) -> Table:
    units = {one.path: str(one.unit) for one in (*point.model.flat_variables, *point.model.flat_parameters)}
    rows = ((name, f"{point[name]:.8g}", units.get(name, "")) for name in names)
    return table("values", "name", "value>", "unit", rows=rows)


def curves_report(curves: Curves, names: Sequence[str] = ()) -> Table:
    """Return a characteristic curve, one row per operating point."""
    columns = [curves.over, *(name for name in names if name != curves.over), "efficiency"]
    columns = list(dict.fromkeys(columns))
    titles = [f"{name} in {curves.unit(name)}>" if curves.unit(name) != "1" else f"{name}>" for name in columns]
    rows = ([f"{value:.6g}" for value in row] for row in zip(*(curves[name] for name in columns), strict=True))
    return table(curves.points[0].model.name, *titles, rows=rows)
