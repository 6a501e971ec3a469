"""Campbell diagram: frequencies of the modes over a speed, and their crossings with orders of excitation."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from modelica_like.analyse.linear.linearize import At, linearize
from modelica_like.analyse.linear.model import LinearModel
from modelica_like.analyse.linear.pictures import mode_name
from modelica_like.arguments import checked
from modelica_like.errors import ValueOutOfRange
from modelica_like.simulation import Model, build
from modelica_like.solve.initialize import call
from modelica_like.style import COLOURS, numbered, picture, text_width

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_RPM = 30 / np.pi
_NONE = complex(np.nan, np.nan)


@dataclass(frozen=True)
class Crossing:
    """A critical speed: an order of the rotation excites a mode at its frequency.

    Attributes:
        order: excitations per revolution.
        mode: number of the curve.
        speed: in rad/s.
        frequency: in Hz.
        name: components that store most of the energy of the mode.
    """

    order: float
    mode: int
    speed: float
    frequency: float
    name: str = ""

    def __str__(self) -> str:
        where = f"{self.frequency:.4g} Hz, {self.speed * _RPM:.5g} rpm"
        return f"order {self.order:g} meets mode {self.mode + 1}{self.name and f' ({self.name})'} at {where}"


@dataclass(frozen=True, eq=False)
class Campbell:
    """Modes over a speed.

    Attributes:
        name: name of the model.
        speed: path of the speed.
        speeds: in rad/s, shape (points,).
        eigenvalues: of each mode at each speed in rad/s, complex, shape (modes, points); nan where it is overdamped.
        orders: excitations per revolution.
        modes: for each mode, the components that store most of its energy at the lowest speed at which it oscillates.
    """

    name: str
    speed: str
    speeds: Any = field(repr=False)
    eigenvalues: Any = field(repr=False)
    orders: tuple[float, ...] = (1.0,)
    modes: tuple[str, ...] = ()

    @property
    def frequencies(self) -> Any:
        """Frequencies in Hz, shape (modes, points)."""
        return self.eigenvalues.imag / (2 * np.pi)

    @property
    def damping(self) -> Any:
        """Damping ratios, shape (modes, points)."""
        return -self.eigenvalues.real / np.abs(self.eigenvalues)

    def crossings(self) -> tuple[Crossing, ...]:
        """Return the critical speeds, interpolated between the points."""
        crossings: list[Crossing] = []
        for order in self.orders:
            for mode, curve in enumerate(self.frequencies):
                name = self.modes[mode] if self.modes else ""
                # A shaft that turns backwards excites as well.
                for line in (order * self.speeds / (2 * np.pi), -order * self.speeds / (2 * np.pi)):
                    crossings += [
                        Crossing(order, mode, speed, order * abs(speed) / (2 * np.pi), name)
                        for speed in _roots(self.speeds, line - curve)
                    ]
        return tuple(crossings)

    def plot(self) -> Figure:
        """Draw frequencies over speed with the lines of the orders; crossings have numbers, with their text below."""
        rpm, top = self.speeds * _RPM, 1.1 * float(np.nanmax(self.frequencies, initial=1.0))
        met = sorted(self.crossings(), key=lambda c: c.speed)
        labels = [f"{k}: {name}" for k, name in enumerate(self.modes or [""] * len(self.frequencies), 1)]
        legend = 0.5 + max((text_width(label, 8.0) for label in labels), default=0.0)
        width, below = max(8.0, 5.0 + legend), [[f"{k}  {c}" for k, c in enumerate(met, 1)]]
        with picture(f"Campbell diagram of {self.name}", 1, 4.2, width=width, below=below) as (figure, (axes,)):
            for mode, curve in enumerate(self.frequencies):
                axes.plot(rpm, curve, color=COLOURS[mode % len(COLOURS)], label=labels[mode])
            far = max(rpm[0], rpm[-1], key=abs)
            bends = np.union1d(rpm, [0.0]) if rpm[0] < 0 < rpm[-1] else rpm
            for order in self.orders:
                axes.plot(bends, order * np.abs(bends) / 60, color="#888888", linewidth=0.9, linestyle="--")
                place = 0.97 * np.sign(far) * min(abs(far), 60 * top / order)
                at = {"xytext": (-4, 2), "textcoords": "offset points", "fontsize": 8, "ha": "right"}
                axes.annotate(f"{order:g}\u00d7", (place, order * abs(place) / 60), **at)
            for crossing in met:
                axes.plot(crossing.speed * _RPM, crossing.frequency, "o", color="#000000", markersize=4)
                axes.vlines(
                    crossing.speed * _RPM, crossing.frequency, top, color="#999999", linewidth=0.7, linestyle=":"
                )
            axes.set(xlabel=f"{self.speed} in rpm", ylabel="frequency in Hz", ylim=(0, top), xlim=(rpm[0], rpm[-1]))
            axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), title="modes", title_fontsize=8)
            numbered(axes, [(c.speed * _RPM - rpm[0]) / (rpm[-1] - rpm[0]) for c in met], width - 1.0 - legend)
        return figure

    def __str__(self) -> str:
        over = f"{self.speed} = {self.speeds[0] * _RPM:.4g} … {self.speeds[-1] * _RPM:.4g} rpm"
        head = f"Campbell diagram of {self.name}: {len(self.eigenvalues)} modes, {over}"
        return "\n".join([head, *(f"  {crossing}" for crossing in self.crossings())])


@checked
def campbell(
    drive: Model, over: Mapping[str, Iterable[Any]], speed: str, *, at: At = "steady", orders: Sequence[float] = (1.0,),
) -> Campbell:  # fmt: skip
    """Follow the oscillating modes of a drive over a parameter that changes its speed.

    Args:
        drive: a component, a netlist file or a compiled model.
        over: path of one parameter or input, and the values that it takes.
        speed: path of the speed that the orders count, a variable in rad/s.
        at: where to linearize for each value, as in `linearize`.
        orders: excitations per revolution, such as 1 for an imbalance, or a number of teeth.

    Raises:
        ValueOutOfRange: `over` is not one parameter with at least two values.
        UnknownName: a name is not known.
        ModelicaLikeError: a point cannot be found.
    """
    if len(over) != 1:
        raise ValueOutOfRange(f"A Campbell diagram varies one parameter, not {len(over)}.")
    (path, values) = next(iter(over.items()))
    model = build(drive, free=[path])
    linear = [linearize(model.with_parameters({path: value}), at, outputs=[speed]) for value in values]
    if len(linear) < 2:
        raise ValueOutOfRange(f"A Campbell diagram needs at least two values of {path}.")
    row = model.position[speed]
    speeds = np.array([call(m.model, m.model.equations.variables, m.point)[row] for m in linear])
    order = np.argsort(speeds, kind="stable")
    ahead = [(values := linear[k].eigenvalues())[values.imag > 0] for k in order]
    curves = _followed(ahead)
    names = tuple(_name(curve, [linear[k] for k in order]) for curve in curves)
    return Campbell(model.name, speed, speeds[order], curves, tuple(map(float, orders)), names)


def _name(curve: Any, linear: Sequence[LinearModel]) -> str:
    """Return the name of a mode, where it begins to oscillate."""
    begin = int(np.flatnonzero(np.isfinite(curve))[0])
    swings = [mode for mode in linear[begin].modes() if mode.oscillates]
    return mode_name(min(swings, key=lambda mode: abs(mode.eigenvalue - curve[begin])))


def _roots(speeds: Any, gap: Any) -> list[float]:
    """Return the speeds at which a gap closes, between points by straight lines; nan where there is none."""
    before, after = gap[:-1], gap[1:]
    closes = (before < 0) & (after >= 0) | (before > 0) & (after <= 0)
    begins = [float(speeds[0])] if gap[0] == 0 else []
    shares = ((k, gap[k] / (gap[k] - gap[k + 1])) for k in np.flatnonzero(closes))
    return [*begins, *(float(speeds[k] + share * (speeds[k + 1] - speeds[k])) for k, share in shares)]


def _followed(ahead: Sequence[Any]) -> Any:
    """Follow modes from point to point, shape (modes, points): each continues as the nearest one, the rest begin."""
    curves = np.full((0, 0), _NONE)
    for k, values in enumerate(ahead):
        chosen = _nearest(curves[:, -1] if k else np.zeros(0), values)
        begin = [j for j in np.argsort(values.imag, kind="stable") if j not in chosen]
        # A mode that becomes overdamped has none (nan).
        column = np.array([values[j] if j >= 0 else _NONE for j in [*chosen, *begin]], complex)
        curves = np.hstack([np.vstack([curves, np.full((len(begin), k), _NONE)]), column[:, None]])
    return curves


def _nearest(before: Any, after: Any) -> list[int]:
    """Assign eigenvalues one to one, the closest pairs first: for each one before the index of that after, or -1."""
    chosen = [-1] * len(before)
    distance = np.abs(np.nan_to_num(before, nan=np.inf)[:, None] - after[None, :])
    for _ in range(min(distance.shape)):
        row, column = np.unravel_index(np.argmin(distance), distance.shape)
        if not np.isfinite(distance[row, column]):
            break
        chosen[int(row)] = int(column)
        distance[row, :] = distance[:, column] = np.inf
    return chosen
