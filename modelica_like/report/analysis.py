"""Results of analyses as tables: operating points, modes, sensitivities and sweeps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.console import Group, RenderableType
from rich.markup import escape
from rich.table import Table

from modelica_like.analyse.sensitivity.result import COLUMNS, SHOWN
from modelica_like.report.types import table

if TYPE_CHECKING:
    import xarray

    from modelica_like.analyse.linear.model import Mode, Modes
    from modelica_like.analyse.operating.curves import Curves
    from modelica_like.analyse.operating.steady import OperatingPoint
    from modelica_like.analyse.sensitivity.result import Sensitivities

_FAILURES_TOLD = 3
_SMALL = 1e-9
"""Share of the largest power that counts as rounding."""
_LEAST_SHARE = 0.005
_SHARES_SHOWN = 4


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


def modes_report(modes: Modes) -> RenderableType:
    """Return eigenvalues, damping, and the components that store and lose the energy of each mode."""
    linear = modes.linear
    head = f"[bold]{escape(linear.model.name)}[/]  {len(linear.states)} states at t = {linear.time:g} s"
    made = table(
        "modes", ">", "eigenvalue in rad/s>", "frequency in Hz>", "damping>", "time constant in s>", "energy in",
        "lost in",
        rows=[(str(k), *_numbers(mode), shares(mode.stored), shares(mode.lost)) for k, mode in enumerate(modes, 1)],
    )  # fmt: skip
    parts: list[RenderableType] = [head, "", made]
    if linear.held:
        parts.append(f"[dim]Held by modes that are active there: {escape(', '.join(linear.held))}.[/]")
    return Group(*parts)


def _numbers(mode: Mode) -> tuple[str, str, str, str]:
    value = mode.eigenvalue
    if mode.oscillates:
        text = f"{value.real:.5g} ± {value.imag:.5g}j"
        return text, f"{mode.frequency:.4g}", f"{mode.damping:.3g}", f"{mode.time_constant:.3g}"
    return f"{value.real:.5g}", "", "", f"{mode.time_constant:.3g}" if value else ""


def shares(found: dict[str, float]) -> str:
    """Return the largest shares of components as text."""
    shown = [(path, share) for path, share in found.items() if abs(share) >= _LEAST_SHARE][:_SHARES_SHOWN]
    return ", ".join(f"{path} {100 * share:.0f} %" for path, share in shown)


def sensitivity_report(result: Sensitivities) -> RenderableType:
    """Return one ranking table per output, the most important parameters first."""
    parts: list[RenderableType] = []
    for output in result.outputs:
        title, rows = result.table(output.name)
        parts += [table(title, *COLUMNS, rows=rows, most=SHOWN), ""]
    parts += [
        f"{escape(name)}: {rows.shape[0]} times, see Sensitivities.series" for name, rows in result.series.items()
    ]
    parts += [escape(sentence) for sentence in result.notes()]
    parts.append(f"[dim]derivatives in SI units; relative: percent per percent; {result.method} method[/]")
    return Group(*parts)


def sweep_report(found: xarray.Dataset) -> RenderableType:
    """Return smallest and largest value of every output with the parameters there, failures and differences."""
    names = [str(name) for name in found.data_vars if name != "failure"]
    told = found["failure"].to_numpy().ravel()
    failed = int(np.sum(told != ""))
    rows: list[tuple[str, ...]] = []
    for name in names:
        values = found[name]
        if not np.any(np.isfinite(values.to_numpy())):
            rows.append((name, values.attrs["units"], "none"))
            continue
        low, high = values.argmin(...), values.argmax(...)
        smallest, largest = (f"{value.item():.6g}" for value in (values.min(), values.max()))
        rows.append((name, values.attrs["units"], smallest, _where(found, low), largest, _where(found, high)))
    made = table("extremes", "output", "unit", "smallest>", "at", "largest>", "at", rows=rows)
    parts: list[RenderableType] = [f"[bold]{escape(found.attrs['model'])}[/]  {told.size} runs", "", made]
    if failed:
        parts.append(f"{failed} runs failed:")
        parts += [f"  {escape(text.splitlines()[0])}" for text in dict.fromkeys(told[told != ""][:_FAILURES_TOLD])]
    if found.attrs.get("notice"):
        parts.append(escape(found.attrs["notice"]))
    return Group(*parts)


def _where(found: xarray.Dataset, place: Mapping[Any, xarray.DataArray]) -> str:
    point = found.isel({str(key): value.item() for key, value in place.items()})
    return ", ".join(f"{name} = {point[name].item():.6g}" for name in point.coords)
