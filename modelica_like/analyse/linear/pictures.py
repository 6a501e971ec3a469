"""Pictures of frequency responses."""

from __future__ import annotations

from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np

from modelica_like.style import COLOURS, numbered, picture, text_width

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from modelica_like.analyse.linear.model import LinearModel, Mode

_LEAST = 1e-15
"""Share of the largest gain that counts as none."""
_NAMED, _LEAST_SHARE = 3, 0.1
_REACH = 2.5
"""Half of the complex plane that shows the point -1 well."""


def mode_name(mode: Mode) -> str:
    """Return the components that store most of the energy of a mode."""
    some = [path for path, share in mode.stored.items() if share >= _LEAST_SHARE][:_NAMED]
    return ", ".join(some or list(mode.stored)[:1])


def bode(linear: LinearModel, f: Any = None) -> Figure:
    """Draw gain in dB and phase of every output by every input.

    Args:
        linear: the linear model; a `Loop` has margins.
        f: frequencies in Hz, rising; by default around those of the modes and margins.
    """
    margins = getattr(linear, "margins", lambda: None)()
    if f is None:
        f, limits = linear.around(), [at for at, _ in (*margins.gain, *margins.phase)] if margins else []
        f = np.unique([*f, *(np.geomspace(min(limits) / 3, max(limits) * 3, 300) if limits else ())])
    gains = linear.response(f)
    curves = _curves(linear, gains)
    modes = [m for m in linear.modes() if m.oscillates and f[0] <= m.frequency <= f[-1]]
    texts = [f"{k}  {m.frequency:.4g} Hz, damping {m.damping:.3g}: {mode_name(m)}" for k, m in enumerate(modes, 1)]
    labels = max((text_width(label, 8.0) for label in curves), default=0.0) + 0.5
    width = max(8.0, 5.0 + labels)
    below = [margins.lines() if margins else [], texts]
    with picture(_title(linear), 2, 4.8, width=width, below=below) as (figure, (size, phase)):
        for (label, (o, i)), colour in zip(curves.items(), cycle(COLOURS), strict=False):
            size.semilogx(f, 20 * np.log10(np.maximum(np.abs(gains[o, i]), 1e-300)), color=colour, label=label)
            phase.semilogx(f, _angles(gains[o, i]), color=colour)
        units = {_unit(linear, o, i) for o, i in curves.values()}
        one_unit = units.pop() if len(units) == 1 else "the SI units"
        size.set(ylabel="gain in dB" if one_unit == "1" else f"gain in dB\n(0 dB: 1 {one_unit})", xlim=(f[0], f[-1]))
        if len(curves) > 1 or not margins:
            size.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
        phase.set(ylabel="phase in \u00b0", xlabel="frequency in Hz")
        from matplotlib.ticker import MultipleLocator

        low, high = phase.get_ylim()
        step = next((degrees for degrees in (45, 90, 180, 360) if (high - low) / degrees <= 6), 720)
        phase.yaxis.set_major_locator(MultipleLocator(step))
        for axes in (size, phase):
            for mode in modes:
                axes.axvline(mode.frequency, color="#999999", linewidth=0.7, linestyle=":", zorder=0.5)
        numbered(size, [float(np.log(m.frequency / f[0]) / np.log(f[-1] / f[0])) for m in modes], width - 1.2 - labels)
        if margins:
            _mark_margins(size, phase, margins, gains[0, 0], f)
        figure.align_ylabels([size, phase])
    return figure


def nyquist(linear: LinearModel, f: Any) -> Figure:
    """Draw frequency responses in the complex plane; negative frequencies are dashed.

    Args:
        linear: the linear model; a `Loop` has margins.
        f: frequencies in Hz, rising.
    """
    gains = linear.response(f)
    margins = getattr(linear, "margins", lambda: None)()
    reach = _REACH if margins else 1.1 * float(np.abs(gains).max(initial=1e-12))
    with picture(_title(linear), 1, 5.2, width=6.4, below=[margins.lines() if margins else []]) as (figure, (axes,)):
        for (label, (o, i)), colour in zip(_curves(linear, gains).items(), cycle(COLOURS), strict=False):
            curve = gains[o, i]
            axes.plot(curve.real, curve.imag, color=colour, label=label)
            axes.plot(curve.real, -curve.imag, color=colour, linestyle="--", linewidth=0.8)
        if margins:
            turn = np.linspace(0, 2 * np.pi, 361)
            axes.plot(np.cos(turn), np.sin(turn), color="#999999", linewidth=0.8, linestyle=":")
            axes.plot(-1, 0, "+", color="#d55e00", markersize=9, markeredgewidth=1.8)
        else:
            axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=2)
        axes.axhline(0, color="#666666", linewidth=0.6)
        axes.axvline(0, color="#666666", linewidth=0.6)
        axes.set(
            xlim=(-reach, reach), ylim=(-reach, reach), xlabel="real part", ylabel="imaginary part", aspect="equal"
        )
    return figure


def _title(linear: LinearModel) -> str:
    where = f"{linear.model.name} at t = {linear.time:g} s"
    return f"{where}, opened at {linear.inputs[0]}" if hasattr(linear, "margins") else where


def _curves(linear: LinearModel, gains: Any) -> dict[str, tuple[int, int]]:
    """Return output and input of each response that is not zero, by its name."""
    least = _LEAST * np.abs(gains).max(initial=0.0)
    return {
        f"{linear.outputs[o]} by {linear.inputs[i]}": (o, i)
        for o, i in np.ndindex(gains.shape[:2]) if np.any(np.abs(gains[o, i]) > least)
    }  # fmt: skip


def _unit(linear: LinearModel, o: int, i: int) -> str:
    above, below = (linear.units.get(name, "1") for name in (linear.outputs[o], linear.inputs[i]))
    if above == below:
        return "1"
    above = above.replace(".", "\u00b7")
    return above if below == "1" else f"{above} / ({below})".replace(".", "\u00b7")


def _angles(gains: Any) -> Any:
    """Return continuous phases in degrees that end between -360 and 0, as many poles more than zeros have it."""
    angles = np.degrees(np.unwrap(np.angle(gains)))
    return angles - 360 * np.ceil(angles[-1] / 360 - 1e-6)


def _mark_margins(size: Any, phase: Any, margins: Any, gains: Any, f: Any) -> None:
    """Draw the margins as lines from the curves to their limits."""
    look = {"color": "#d55e00", "linewidth": 1.8}
    angles = _angles(gains)
    size.axhline(0, color="#666666", linewidth=0.7)
    limits = np.arange(np.floor(angles.min() / 360) * 360 - 180, angles.max() + 360, 360)
    for limit in limits[(limits > angles.min() - 60) & (limits < angles.max() + 60)]:
        phase.axhline(limit, color="#666666", linewidth=0.7)
    for at, factor in margins.gain:
        size.plot([at, at], [-20 * np.log10(factor), 0], **look)
    for at, lag in margins.phase:
        angle = float(np.interp(np.log(at), np.log(f), angles))
        phase.plot([at, at], [angle, angle - lag], **look)
