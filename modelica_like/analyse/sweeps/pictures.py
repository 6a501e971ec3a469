"""Pictures of sweeps: lines, heat maps, parallel coordinates."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from modelica_like.arguments import checked
from modelica_like.errors import UnknownName, ValueOutOfRange, did_you_mean
from modelica_like.style import COLOURS, picture, text_width, with_unit

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

_FEW = 6
"""Values of a second parameter that are still drawn as lines."""
_MOST_LINES = 2000
_WIDEST = 30.0


@checked
def plot_sweep(found: xarray.Dataset, *outputs: str) -> Figure:
    """Draw a sweep: lines over one parameter, lines or a heat map over two, parallel coordinates over more or samples.

    Args:
        found: what `sweep` returns.
        outputs: names; by default all.

    Raises:
        UnknownName: the sweep has no such output.
        ValueOutOfRange: no run has succeeded.
    """
    plotted = [str(name) for name in found.data_vars if name != "failure"]
    for name in outputs:
        if name not in plotted:
            raise UnknownName(f"The sweep has no output '{name}'{did_you_mean(name, plotted) or '.'}")
    names = list(outputs) or plotted
    if not any(np.any(np.isfinite(found[name].to_numpy())) for name in names):
        raise ValueOutOfRange("No run of the sweep has succeeded, so there is nothing to draw.")
    failed = int(np.sum(found["failure"].to_numpy() != ""))
    notes = [f"{failed} of {found['failure'].size} runs failed."] if failed else []
    dims = [str(name) for name in found["failure"].dims]
    if dims == ["sample"] or len(dims) > 2:
        return _parallel(found, names, notes)
    if len(dims) == 1 or min(found.sizes[name] for name in dims) <= _FEW:
        return _lines(found, names, sorted(dims, key=lambda name: -found.sizes[name]), notes)
    return _maps(found, names, dims, notes)


def _label(dataset: xarray.Dataset, name: str) -> str:
    return with_unit(name, str(dataset[name].attrs.get("units", "1")))


def _lines(dataset: xarray.Dataset, names: list[str], dims: list[str], notes: list[str]) -> Figure:
    """Draw a panel per output over the first parameter, with a line for each value of the second."""
    along, across = dims[0], dims[1:]
    family = list(dataset[across[0]].to_numpy()) if across else [None]
    unit = with_unit("", str(dataset[across[0]].attrs.get("units", "1"))).replace(" in", "", 1) if across else ""
    marker = "o" if dataset.sizes[along] <= 40 else ""
    with picture(str(dataset.attrs["model"]), len(names), 0.8 + 1.9 * len(names), below=[notes]) as (figure, rows):
        for axes, name in zip(rows, names, strict=True):
            for k, value in enumerate(family):
                some = dataset[name].sel({across[0]: value}) if across else dataset[name]
                label = f"{across[0]} = {value:.6g}{unit}" if across else name
                look = {"color": COLOURS[k % len(COLOURS)], "marker": marker, "markersize": 3.0}
                axes.plot(dataset[along], some.transpose(along), label=label, **look)
            axes.set_ylabel(_wrapped(_label(dataset, name), 1.7))
        if across:
            rows[0].legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
        rows[-1].set_xlabel(_label(dataset, along))
        figure.align_ylabels(rows)
    return figure


def _maps(dataset: xarray.Dataset, names: list[str], dims: list[str], notes: list[str]) -> Figure:
    """Draw a coloured map per output; runs that failed are white."""
    with picture(str(dataset.attrs["model"]), len(names), 0.8 + 2.9 * len(names), below=[notes]) as (figure, rows):
        for axes, name in zip(rows, names, strict=True):
            values = dataset[name].transpose(dims[1], dims[0]).to_numpy()
            mesh = axes.pcolormesh(dataset[dims[0]], dataset[dims[1]], values, shading="nearest", cmap="viridis")
            figure.colorbar(mesh, ax=axes, label=_wrapped(_label(dataset, name), 2.5), pad=0.01)
            axes.set_ylabel(_label(dataset, dims[1]))
            axes.grid(visible=False)
        rows[-1].set_xlabel(_label(dataset, dims[0]))
    return figure


def _parallel(dataset: xarray.Dataset, names: list[str], notes: list[str]) -> Figure:
    """Draw each run as a line through its parameters and outputs, in the colour of the last output."""
    from matplotlib.collections import LineCollection

    table = dataset[names].to_dataframe().reset_index()
    columns = [*(str(name) for name in dataset.coords if str(name) != "sample"), *names]
    kept = table[columns].dropna()
    if len(kept) > _MOST_LINES:
        notes = [*notes, f"{_MOST_LINES} of {len(kept)} runs are drawn, evenly chosen."]
        kept = kept.iloc[np.linspace(0, len(kept) - 1, _MOST_LINES).astype(int)]
    values: Any = kept.to_numpy(float)
    low, high = values.min(axis=0), values.max(axis=0)
    share = np.where(high > low, (values - low) / np.where(high > low, high - low, 1.0), 0.5)
    labels = [_label(dataset, name).replace(" in ", "\nin ") for name in columns]
    apart = max(max(text_width(line, 9.0) for label in labels for line in label.split("\n")) + 0.25, 1.0)
    width = min(max(8.0, apart * (len(columns) - 1) + 2.0), _WIDEST)
    order = np.argsort(share[:, -1])
    with picture(str(dataset.attrs["model"]), 1, 4.0, width=width, below=[notes]) as (figure, (axes,)):
        paths = [list(zip(range(len(columns)), row, strict=True)) for row in share[order]]
        look: dict[str, Any] = {"linewidth": 1.0, "alpha": max(0.15, min(0.9, 40 / len(paths)))}
        axes.add_collection(LineCollection(paths, array=share[order, -1], cmap="viridis", **look))
        for k in range(len(columns)):
            axes.vlines(k, 0, 1, color="#444444", linewidth=0.9)
            for at, value in ((0.0, low[k]), (1.0, high[k])):
                place = {"xytext": (0, 4 if at else -4), "textcoords": "offset points", "fontsize": 8}
                axes.annotate(f"{value:.5g}", (k, at), ha="center", va="bottom" if at else "top", **place)
        axes.set(xlim=(-0.3, len(columns) - 0.7), ylim=(-0.1, 1.1), yticks=[])
        axes.set_xticks(range(len(columns)), labels)
        axes.tick_params(length=0)
        axes.spines[["left", "bottom"]].set_visible(False)
    return figure


def _wrapped(label: str, room: float) -> str:
    """Break a label that is longer than its axis, in inches."""
    return label if text_width(label, 9.0) < room else label.replace(" in ", "\nin ")
