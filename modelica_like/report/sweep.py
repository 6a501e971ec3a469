"""What a sweep found: a table of extremes, and a file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.console import Group, RenderableType
from rich.markup import escape

from modelica_like.report.types import table

if TYPE_CHECKING:
    import xarray

_TOLD = 3


def sweep_report(found: xarray.Dataset) -> RenderableType:
    """Return smallest and largest value of every output with the parameters there, and what failed."""
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
        parts += [f"  {escape(text.splitlines()[0])}" for text in dict.fromkeys(told[told != ""][:_TOLD])]
    return Group(*parts)


def _where(found: xarray.Dataset, place: Mapping[Any, xarray.DataArray]) -> str:
    point = found.isel({str(key): value.item() for key, value in place.items()})
    return ", ".join(f"{name} = {point[name].item():.6g}" for name in point.coords)
