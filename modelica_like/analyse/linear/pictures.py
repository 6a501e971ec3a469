"""Pictures of small motions: Bode plot, mode shapes, Campbell diagram."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from modelica_like.solve.style import COLOURS, STYLE, headline, panels

if TYPE_CHECKING:
    from modelica_like.analyse.linear.campbell import Campbell
    from modelica_like.analyse.linear.linearize import LinearModel
    from modelica_like.analyse.linear.modes import Modes

_POINTS = 600
_DECADES = 1.0
"""Decades beyond the lowest and highest frequency of the modes."""


def draw_bode(linear: LinearModel, frequencies: Any = None) -> Figure:
    """Draw magnitude and phase of every output by every input.

    Args:
        linear: the linear model.
        frequencies: in Hz; by default around the frequencies of the modes.
    """
    f = _around(linear) if frequencies is None else np.asarray(frequencies, float)
    gains = linear.response(f)
    with mpl.rc_context(STYLE):
        figure, (size, phase) = panels(2, 4.6)
        curves = [(o, i) for o, i in np.ndindex(gains.shape[:2]) if np.any(gains[o, i])]
        for k, (o, i) in enumerate(curves):
            label, colour = f"{linear.outputs[o]} by {linear.inputs[i]}", COLOURS[k % len(COLOURS)]
            size.loglog(f, np.abs(gains[o, i]), color=colour, label=label)
            phase.semilogx(f, np.degrees(np.unwrap(np.angle(gains[o, i]))), color=colour)
        for mode in linear.modes():
            if mode.oscillates and f[0] <= mode.frequency <= f[-1]:
                size.axvline(mode.frequency, color="#999999", linewidth=0.8, linestyle=":", zorder=0)
        units = {f"{linear.units[linear.outputs[o]]} / ({linear.units[linear.inputs[i]]})" for o, i in curves}
        size.set_ylabel(f"gain in {units.pop()}" if len(units) == 1 else "gain")
        size.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
        phase.set(ylabel="phase in °", xlabel="frequency in Hz")
        phase.yaxis.set_major_locator(MultipleLocator(90))
        headline(figure, f"{linear.model.name} at t = {linear.time:g} s")
    return figure


def draw_shapes(modes: Modes, names: Sequence[str], count: int = 4) -> Figure:
    """Draw the deviations of variables in the first oscillating modes, at the instant of the largest deviation.

    Args:
        modes: the modes.
        names: variables along the drive, of one unit.
        count: at most so many modes.
    """
    chosen = [k for k, mode in enumerate(modes) if mode.oscillates][:count]
    with mpl.rc_context(STYLE):
        figure, rows = panels(max(len(chosen), 1), 0.8 + 1.4 * max(len(chosen), 1))
        for row, k in enumerate(chosen):
            shape = modes.shape(k, names)
            top = shape[np.argmax(np.abs(shape))]
            values = np.real(shape / top) if top else np.real(shape)
            axes, mode = rows[row], modes[k]
            axes.axhline(0.0, color="#666666", linewidth=0.8)
            axes.plot(range(len(names)), values, "o-", color=COLOURS[row % len(COLOURS)])
            axes.set(ylim=(-1.2, 1.2), ylabel="relative")
            text = f"{mode.frequency:.4g} Hz, damping {mode.damping:.3g}"
            axes.set_title(text, loc="left", fontsize=9)
        rows[-1].set_xticks(range(len(names)), names)
        headline(figure, f"Modes of {modes.linear.model.name}")
    return figure


def draw_campbell(diagram: Campbell) -> Figure:
    """Draw frequencies over speed with the lines of the orders and their crossings."""
    rpm = diagram.speeds * 30 / np.pi
    with mpl.rc_context(STYLE):
        figure, (axes,) = panels(1, 4.2)
        for mode, curve in enumerate(diagram.frequencies):
            axes.plot(rpm, curve, color=COLOURS[mode % len(COLOURS)], label=f"mode {mode + 1}")
        top = 1.1 * float(np.nanmax(diagram.frequencies, initial=1.0))
        for order in diagram.orders:
            line = order * diagram.speeds / (2 * np.pi)
            axes.plot(rpm, line, color="#888888", linewidth=0.9, linestyle="--")
            end = min(rpm[-1], 60 * top / order)
            place = (0.97 * end, 0.97 * order * end / 60)
            axes.annotate(f"{order:g}×", place, xytext=(-4, 2), textcoords="offset points", fontsize=8, ha="right")
        for one in diagram.crossings():
            axes.plot(one.speed * 30 / np.pi, one.frequency, "o", color="#000000", markersize=4)
        axes.set(xlabel=f"{diagram.speed} in rpm", ylabel="frequency in Hz", ylim=(0, top), xlim=(rpm[0], rpm[-1]))
        axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
        headline(figure, f"Campbell diagram of {diagram.name}")
    return figure


def _around(linear: LinearModel) -> Any:
    found = np.abs(linear.eigenvalues()) / (2 * np.pi)
    found = found[found > 1e-9 * found.max(initial=1.0)]
    low, high = (found.min(), found.max()) if len(found) else (0.1, 10.0)
    return np.logspace(np.log10(low) - _DECADES, np.log10(high) + _DECADES, _POINTS)
