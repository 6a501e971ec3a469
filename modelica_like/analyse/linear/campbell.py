"""Campbell diagram: frequencies of the modes over a speed, and where orders of excitation meet them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from modelica_like.analyse.linear.linearize import LinearModel, linearize
from modelica_like.analyse.linear.points import At
from modelica_like.errors import ValueOutOfRange
from modelica_like.initialize import call
from modelica_like.simulation import Model, build

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Crossing:
    """A critical speed: an order of the rotation excites a mode at its frequency.

    Attributes:
        order: excitations per revolution.
        mode: number of the curve.
        speed: in rad/s.
        frequency: in Hz.
    """

    order: float
    mode: int
    speed: float
    frequency: float

    def __str__(self) -> str:
        rpm = self.speed * 30 / np.pi
        return f"order {self.order:g} meets mode {self.mode + 1} at {self.frequency:.4g} Hz, {rpm:.5g} rpm"


@dataclass(frozen=True, eq=False)
class Campbell:
    """Modes over a speed.

    Attributes:
        name: name of the model.
        speed: path of the speed.
        speeds: in rad/s, shape (points,).
        eigenvalues: of each mode at each speed in rad/s, complex, shape (modes, points).
        orders: excitations per revolution.
    """

    name: str
    speed: str
    speeds: Any = field(repr=False)
    eigenvalues: Any = field(repr=False)
    orders: tuple[float, ...] = (1.0,)

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
        found: list[Crossing] = []
        for order in self.orders:
            line = order * self.speeds / (2 * np.pi)
            for mode, curve in enumerate(self.frequencies):
                gap = line - curve
                for k in np.flatnonzero(gap[:-1] * gap[1:] <= 0):
                    share = gap[k] / (gap[k] - gap[k + 1]) if gap[k] != gap[k + 1] else 0.0
                    speed = float(self.speeds[k] + share * (self.speeds[k + 1] - self.speeds[k]))
                    found.append(Crossing(order, mode, speed, order * speed / (2 * np.pi)))
        return tuple(found)

    def plot(self) -> Figure:
        """Draw frequencies over speed with the lines of the orders and their crossings."""
        from modelica_like.analyse.linear.pictures import draw_campbell

        return draw_campbell(self)

    def __str__(self) -> str:
        low, high = (float(value) * 30 / np.pi for value in (self.speeds[0], self.speeds[-1]))
        head = (
            f"Campbell diagram of {self.name}: {len(self.eigenvalues)} modes, {self.speed} = {low:.4g} … {high:.4g} rpm"
        )
        return "\n".join([head, *(f"  {one}" for one in self.crossings())])


def campbell(
    drive: Model, over: Mapping[str, Iterable[Any]], speed: str, *, at: At = "steady", orders: Sequence[float] = (1.0,),
) -> Campbell:  # fmt: skip
    """Follow the oscillating modes of a drive over a parameter that changes its speed.

    Args:
        drive: a component, a netlist file or a compiled model.
        over: path of one parameter or input, and the values that it takes.
        speed: path of the speed that the orders count, a variable in rad/s.
        at: where to linearise for each value, as in `linearize`.
        orders: excitations per revolution, such as 1 for an imbalance, or a number of teeth.

    Raises:
        ValueOutOfRange: `over` is not one parameter with at least two values.
        UnknownName: a name is not known.
        ModelicaLikeError: a point cannot be found.
    """
    if len(over) != 1:
        raise ValueOutOfRange(f"A Campbell diagram goes over one parameter, not {len(over)}.")
    (path, values) = next(iter(over.items()))
    model = build(drive, free=[path])
    linear = [linearize(model.with_parameters({path: value}), at, outputs=[speed]) for value in values]
    if len(linear) < 2:
        raise ValueOutOfRange(f"A Campbell diagram needs at least two values of {path}.")
    row = model.position[speed]
    speeds = np.array([call(one.model, one.model.variables, one.point)[row] for one in linear])
    order = np.argsort(speeds, kind="stable")
    curves = _follow([linear[k] for k in order])
    return Campbell(model.name, speed, speeds[order], curves, tuple(float(one) for one in orders))


def _follow(linear: Sequence[LinearModel]) -> Any:
    """Join the oscillating eigenvalues of successive points: each goes on as the nearest one."""
    sets = [one.eigenvalues() for one in linear]
    first = np.array(sorted((v for v in sets[0] if v.imag > 0), key=lambda v: v.imag))
    curves = [first]
    for values in sets[1:]:
        ahead = values[values.imag > 0]
        curves.append(_nearest(curves[-1], ahead))
    return np.array(curves).T


def _nearest(before: Any, after: Any) -> Any:
    """Assign eigenvalues one to one, the closest pairs first; a mode that is overdamped now has none (nan)."""
    result = np.full(len(before), np.nan + 0j)
    if not len(after):
        return result
    distance = np.abs(np.nan_to_num(before, nan=np.inf)[:, None] - after[None, :])
    for _ in range(min(distance.shape)):
        row, column = np.unravel_index(np.argmin(distance), distance.shape)
        if not np.isfinite(distance[row, column]):
            break
        result[row] = after[column]
        distance[row, :] = distance[:, column] = np.inf
    return result
