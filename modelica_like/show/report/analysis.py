"""Results of analyses as tables: operating points, modes, sensitivities, sweeps, designs, calibrations, tolerances."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.console import Group, RenderableType
from rich.markup import escape

from modelica_like.analyse.optimize.result import Optimum
from modelica_like.analyse.sensitivity.result import COLUMNS, SHOWN
from modelica_like.show.report.tables import Listed, Shown, table

if TYPE_CHECKING:
    import xarray

    from modelica_like.analyse.calibration.calibrate import Calibration
    from modelica_like.analyse.linear.model import Mode, Modes
    from modelica_like.analyse.operating.curves import Curves
    from modelica_like.analyse.operating.steady import OperatingPoint
    from modelica_like.analyse.optimize.result import Front
    from modelica_like.analyse.sensitivity.result import Sensitivities
    from modelica_like.analyse.tolerance.result import Tolerances

_FAILURES_TOLD = 3
_SMALL = 1e-9
"""Share of the largest power that counts as rounding."""
_LEAST_SHARE = 0.005
_SHARES_SHOWN = 4


def point_report(point: OperatingPoint, names: Sequence[str] = ()) -> RenderableType:
    """Return the powers of an operating point, its efficiency, and the values of variables."""
    model = point.model
    powers = point.powers
    largest = max((abs(value) for pair in powers.values() for value in pair), default=0.0)
    rows = [
        (path or model.name, source, loss)
        for path, (source, loss) in powers.items()
        if max(abs(source), abs(loss)) > _SMALL * largest
    ]
    tables = table("powers in W", "component", "from outside>.6g", "lost>.6g", rows=rows)
    parts: list[RenderableType] = [f"[bold]{escape(model.name)}[/]  steady state", "", tables]
    if np.isfinite(point.efficiency):
        parts.append(f"Efficiency {100 * point.efficiency:.4g} %.")
    if point.stuck:
        parts.append(f"Sticking: {escape(', '.join(point.stuck))}.")
    parts += point.notices
    return Group(*parts, "", _values(point, names or model.states))


def _values(point: OperatingPoint, names: Sequence[str]) -> Listed:
    units = {v.path: str(v.unit) for v in (*point.model.flat_variables, *point.model.flat_parameters)}
    rows = ((name, point[name], units.get(name, "")) for name in names)
    return table("values", "name", "value>.8g", "unit", rows=rows)


def curves_report(curves: Curves, names: Sequence[str] = ()) -> Listed:
    """Return a characteristic curve, one row per operating point."""
    columns = [curves.over, *(name for name in names if name != curves.over), "efficiency"]
    columns = list(dict.fromkeys(columns))
    titles = [f"{name}{'' if (unit := curves.unit(name)) == '1' else f' in {unit}'}>.6g" for name in columns]
    rows = zip(*(map(float, curves[name]) for name in columns), strict=True)
    return table(curves.points[0].model.name, *titles, rows=rows, name="curve")


def modes_report(modes: Modes) -> RenderableType:
    """Return eigenvalues, damping, and the components that store and lose the energy of each mode."""
    linear = modes.linear
    head = f"[bold]{escape(linear.model.name)}[/]  {len(linear.states)} states at t = {linear.time:g} s"
    tables = table(
        "modes", "mode>", "eigenvalue in rad/s>.5g", "frequency in Hz>.4g", "damping>.3g", "time constant in s>.3g",
        "energy in", "lost in",
        rows=[(k, *_numbers(mode), _shares(mode.stored), _shares(mode.lost)) for k, mode in enumerate(modes, 1)],
    )  # fmt: skip
    parts: list[RenderableType] = [head, "", tables]
    if linear.held:
        parts.append(f"[dim]Held by modes that are active there: {escape(', '.join(linear.held))}.[/]")
    parts += map(escape, linear.notices)
    return Group(*parts)


def _numbers(mode: Mode) -> tuple[Any, ...]:
    value, nothing = mode.eigenvalue, Shown("", None)
    if mode.oscillates:
        text = f"{value.real:.5g} ± {value.imag:.5g}j"
        return Shown(text, [value.real, value.imag]), mode.frequency, mode.damping, mode.time_constant
    return Shown(f"{value.real:.5g}", [value.real, 0.0]), nothing, nothing, mode.time_constant if value else nothing


def _shares(share_of: dict[str, float]) -> Shown:
    return Shown(shares(share_of), share_of)


def shares(share_of: dict[str, float]) -> str:
    """Return the largest shares of components as text."""
    shown = [(path, share) for path, share in share_of.items() if abs(share) >= _LEAST_SHARE][:_SHARES_SHOWN]
    return ", ".join(f"{path} {100 * share:.0f} %" for path, share in shown)


def sensitivity_report(result: Sensitivities) -> RenderableType:
    """Return one ranking table per output, the most important parameters first."""
    parts: list[RenderableType] = []
    for output in result.outputs:
        title, texts = result.table(output.name)
        rows = (
            (name, Shown(value, quantity.value), unit, Shown(text, derivative), Shown(per_cent, relative))
            for (name, value, unit, text, per_cent), (quantity, derivative, relative) in zip(
                texts, result.ranking(output.name), strict=True
            )
        )
        parts += [table(title, *COLUMNS, rows=rows, name=output.name, most=SHOWN), ""]
    parts += [
        f"{escape(name)}: {rows.shape[0]} times, see Sensitivities.series" for name, rows in result.series.items()
    ]
    parts += [escape(sentence) for sentence in result.notes()]
    parts.append(f"[dim]derivatives in SI units; relative: percent per percent; {result.method} method[/]")
    return Group(*parts)


def sweep_report(dataset: xarray.Dataset) -> RenderableType:
    """Return smallest and largest value of every output with the parameters there, failures and differences."""
    names = [str(name) for name in dataset.data_vars if name != "failure"]
    failures = dataset["failure"].to_numpy().ravel()
    failed = int(np.sum(failures != ""))
    rows: list[tuple[Any, ...]] = []
    for name in names:
        values = dataset[name]
        if not np.any(np.isfinite(values.to_numpy())):
            rows.append((name, values.attrs["units"], "none"))
            continue
        low, high = values.argmin(...), values.argmax(...)
        smallest, largest = float(values.min()), float(values.max())
        rows.append((name, values.attrs["units"], smallest, _where(dataset, low), largest, _where(dataset, high)))
    tables = table("extremes", "output", "unit", "smallest>.6g", "smallest at", "largest>.6g", "largest at", rows=rows)
    parts: list[RenderableType] = [f"[bold]{escape(dataset.attrs['model'])}[/]  {failures.size} runs", "", tables]
    if failed:
        parts.append(f"{failed} runs failed:")
        parts += [
            f"  {escape(text.splitlines()[0])}" for text in dict.fromkeys(failures[failures != ""][:_FAILURES_TOLD])
        ]
    if dataset.attrs.get("notice"):
        parts.append(escape(dataset.attrs["notice"]))
    return Group(*parts)


def _where(dataset: xarray.Dataset, place: Mapping[Any, xarray.DataArray]) -> Shown:
    point = dataset.isel({str(key): value.item() for key, value in place.items()})
    values = {str(name): point[name].item() for name in point.coords}
    return Shown(", ".join(f"{name} = {value:.6g}" for name, value in values.items()), values)


def optimum_report(result: Optimum | Front) -> RenderableType:
    """Return the best design: what is free before and after, objectives and limits, what a limit costs."""
    if not isinstance(result, Optimum):
        return _front(result)
    free = [(p.name, p.before, p.value, p.unit_text, p.low, p.high) for p in result.parameters]
    measured = (*result.objectives, *result.limits)
    cases = any(m.case for m in measured)
    rows = [
        (m.name, *([m.case] if cases else []), m.before, m.value, m.unit_text, "" if np.isnan(m.limit) else m.text,
         "broken" * m.broken)
        for m in measured
    ]  # fmt: skip
    columns = "name", "before>.6g", "best>.6g", "unit", "from>.6g", "to>.6g"
    parts: list[RenderableType] = [f"[bold]{escape(result.model.name)}[/]  {result.runs} runs", ""]
    if result.chosen:
        parts += [table("chosen", "name", "value", rows=[(k, str(v)) for k, v in result.chosen.items()]), ""]
    case = ["case"] if cases else []
    outputs = table("outputs", "name", *case, "before>.6g", "best>.6g", "unit", "limit", "", rows=rows)
    parts += [table("free", *columns, rows=free), ""] if free else []
    parts += [outputs, ""]
    parts += [escape(sentence) for sentence in result.sentences()]
    return Group(*parts)


def _front(front: Front) -> RenderableType:
    first = front.points[0]
    units = {m.name: m.unit_text for m in first.objectives} | {p.name: p.unit_text for p in first.parameters}
    names = list(dict.fromkeys([*front.names, *(p.name for p in first.parameters)]))
    titles = [f"{name} in {units[name]}>.6g" if units[name] else f"{name}>.6g" for name in names]
    rows = [
        [{**point.values, **dict(zip(front.names, map(float, v), strict=True))}[name] for name in names]
        for v, point in zip(front.values, front.points, strict=True)
    ]
    head = f"[bold]{escape(first.model.name)}[/]  front of {len(rows)} designs, {front.runs} runs"
    return Group(head, "", table("front", *titles, rows=rows), *map(escape, front.notes))


def calibration_report(result: Calibration) -> RenderableType:
    """Return the values found with their intervals, what the data do not determine, and the largest deviations."""
    rows = [
        (name, value, half if np.isfinite(half) else Shown("not determined", None), unit,
         "at its bound" if name in result.at_bounds else "")
        for name, value, half, unit in zip(result.names, result.values, result.confidence, result.units, strict=True)
    ]  # fmt: skip
    head = f"[bold]{escape(result.model.name)}[/]  {len(result.residuals)} numbers, {len(result.names)} parameters"
    parts: list[RenderableType] = [head, ""]
    parts += [table("calibrated", "name", "value>.6g", "± 95 %>.2g", "unit", "", rows=rows), ""]
    for combination in result.undetermined:
        weights = ", ".join(f"{name} {100 * weight:+.0f} %" for name, weight in combination.items())
        parts.append(f"The data do not determine this combination: {escape(weights)}.")
    worst = np.argsort(-np.abs(result.residuals))[:_FAILURES_TOLD]
    deviations = [(result.labels[k], float(result.residuals[k])) for k in worst]
    parts.append(table("largest deviations", "measurement", "in uncertainties>+.3g", rows=deviations))
    return Group(*parts)


def tolerance_report(result: Tolerances) -> RenderableType:
    """Return how outputs scatter, by what, and how probably limits are broken."""
    rows = [
        (o.name, o.unit_text, o.nominal, o.linear_sigma, o.mean, o.sigma, o.quantiles[1], o.quantiles[3], o.low, o.high)
        for o in result.outputs
    ]
    columns = "first order>.6g", "its sigma>.3g", "mean>.6g", "sigma>.3g", "5 %>.6g", "95 %>.6g", "lowest corner>.6g"
    parts: list[RenderableType] = [f"[bold]{escape(result.model)}[/]  {result.runs} runs", ""]
    parts += [table("outputs", "name", "unit", *columns, "highest corner>.6g", rows=rows), ""]
    names = [scatter.name for scatter in result.scatters]
    shares = [(name, *(100.0 * float(o.shares[k]) for o in result.outputs)) for k, name in enumerate(names)]
    titles = [f"{o.name} in %>.3g" for o in result.outputs]
    parts += [table("shares to first order", "parameter", *titles, rows=shares)]
    for title, key in (("shares of the variance", "S1"), ("with interactions", "ST")):
        if key in result.variances:
            sampled = [(name, *(100.0 * float(v) for v in result.variances[key][:, k])) for k, name in enumerate(names)]
            parts += ["", table(title, "parameter", *titles, rows=sampled)]
    limits = [(p.limit, 100 * p.value, 100 * p.low, 100 * p.high) for p in result.limits]
    if limits:
        parts += ["", table("limits", "limit", "broken in %>.4g", "from>.3g", "to>.3g", rows=limits)]
    return Group(*parts, *map(escape, result.notes))
