"""Sensitivities as tables and as tornado plots."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from modelica_like.solve.style import COLOURS, STYLE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from modelica_like.analyse.sensitivity.derivatives import Sensitivities

SHOWN = 20
"""Largest number of parameters in a table."""


def text(result: Sensitivities) -> str:
    """Return one ranking table per output, as plain text."""
    width = max([len("parameter"), *(len(one.name) for one in result.parameters)])
    blocks: list[str] = []
    for output in result.outputs:
        lines = [f"{output.name} = {output.value:.9g} {unit_text(output.unit)}".rstrip()]
        lines += [f"  {'parameter':{width}}  {'value':>12}  {'unit':12}  {'derivative':>13}  {'relative':>9}"]
        ranking = result.ranking(output.name)
        for parameter, derivative, relative in ranking[:SHOWN]:
            value = f"{parameter.value:12.6g}  {unit_text(parameter.unit):12}"
            lines.append(f"  {parameter.name:{width}}  {value}  {derivative:13.6g}  {relative_text(relative):>9}")
        if len(ranking) > SHOWN:
            lines.append(f"  … {len(ranking) - SHOWN} more")
        blocks.append("\n".join(lines))
    for name, table in result.series.items():
        blocks.append(f"{name}: derivatives at {table.shape[0]} times by {table.shape[1]} parameters")
    return "\n\n".join([*blocks, *left_out(result)])


def left_out(result: Sensitivities) -> list[str]:
    """Return a sentence about each parameter that was left out."""
    return [f"{name} is left out. {reason}" for name, reason in result.left_out.items()]


def unit_text(unit: Any) -> str:
    """Return a unit as text; none for plain numbers."""
    shown = str(unit)
    return "" if shown in ("1", "*") else shown


def relative_text(value: float) -> str:
    """Return a normalised derivative as text; a dash where it means nothing."""
    return "–" if np.isnan(value) else f"{value + 0.0:.4f}"


def tornado(result: Sensitivities, output: str, *, change: float = 0.1, most: int = 12) -> Figure:
    """Draw what a relative change of each parameter makes of an output, to first order."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    ranking = [one for one in result.ranking(output) if one[0].value * one[1]][:most]
    quantity = result.outputs[result._row(output)]
    effects = [change * parameter.value * derivative for parameter, derivative, _ in ranking]
    places = np.arange(len(ranking))[::-1]
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(8.0, 1.5 + 0.32 * len(ranking)), layout="constrained", dpi=150)
        axes = figure.subplots()
        for sign, colour in ((1.0, COLOURS[0]), (-1.0, COLOURS[4])):
            widths = [sign * abs(parameter.value) * change * d for parameter, d, _ in ranking]
            axes.barh(
                places, widths, height=0.66, color=colour, label=f"parameter {'+' if sign > 0 else '−'}{change:.0%}"
            )
        axes.set_yticks(places, [f"{p.name} = {p.value:.5g} {unit_text(p.unit)}".rstrip() for p, _, _ in ranking])
        axes.axvline(0.0, color="#666666", linewidth=0.8)
        axes.grid(visible=False, axis="y")
        axes.spines["left"].set_visible(False)
        axes.tick_params(axis="y", length=0)
        unit = unit_text(quantity.unit)
        axes.set_xlabel(f"change of {output}{f' in {unit}' if unit else ''}")
        figure.suptitle(
            f"{output} = {quantity.value:.6g} {unit}".rstrip(), x=0.01, ha="left", fontsize=11, fontweight="bold"
        )
        if effects:
            axes.legend(loc="best")
    return figure
