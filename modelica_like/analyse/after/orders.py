"""Order analysis: vibrations at multiples of the rotation, from the linear model and from a run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from modelica_like.analyse.linear.model import LinearModel
from modelica_like.arguments import checked
from modelica_like.compile.compiled import Vector
from modelica_like.errors import ValueOutOfRange
from modelica_like.runs.results import along
from modelica_like.runs.trajectories import Trajectories
from modelica_like.style import COLOURS, picture, with_unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_RPM = 30 / np.pi


@dataclass(frozen=True, eq=False)
class OrderResponse:
    """Steady vibration of a linear model that orders of a rotation excite.

    Attributes:
        linear: the linear model.
        orders: excitations per revolution.
        speeds: of the rotation in rad/s, shape (speeds,).
        response: complex amplitudes of the outputs, shape (outputs, orders, speeds); the real part belongs to the
            cosine of order times angle.
    """

    linear: LinearModel = field(repr=False)
    orders: tuple[float, ...]
    speeds: Vector = field(repr=False)
    response: Any = field(repr=False)

    def amplitudes(self, output: str) -> Vector:
        """Return the amplitudes of an output, shape (orders, speeds)."""
        return np.abs(self.response[self.linear.outputs.index(output)])

    def over_angle(self, output: str, speed: float, angles: Any) -> Vector:
        """Return the vibration of an output at a speed over the angle of the rotation in rad, shape (angles,).

        Raises:
            ValueOutOfRange: the speed is not one of the response.
        """
        rows = np.flatnonzero(np.isclose(self.speeds, speed))
        if not len(rows):
            raise ValueOutOfRange(f"{speed:g} rad/s is not one of the speeds of the response.")
        waves = np.exp(1j * np.outer(self.orders, np.asarray(angles, float)))
        return np.real(self.response[self.linear.outputs.index(output), :, rows[0]] @ waves)

    def resonances(self) -> dict[float, list[float]]:
        """Return the speeds in rad/s at which each order meets an eigenfrequency, within those of the response."""
        modes = sorted({round(value.imag, 9) for value in self.linear.eigenvalues() if value.imag > 0})
        low, high = self.speeds.min(), self.speeds.max()
        both_ways = [-w for w in reversed(modes)] + modes
        return {n: [w / n for w in both_ways if low <= w / n <= high] for n in self.orders}

    def plot(self, output: str) -> Figure:
        """Draw the amplitudes of an output over the speed, with the resonances as dotted lines."""
        with picture(f"Orders of {self.linear.model.name}", 1, 3.6) as (figure, (axes,)):
            for k, (n, curve) in enumerate(zip(self.orders, self.amplitudes(output), strict=True)):
                colour = COLOURS[k % len(COLOURS)]
                axes.semilogy(self.speeds * _RPM, curve, color=colour, label=f"order {n:g}")
                for speed in self.resonances()[n]:
                    axes.axvline(speed * _RPM, color=colour, linewidth=0.8, linestyle=":")
            axes.set(xlabel="speed in rpm", ylabel=with_unit(f"amplitude of {output}", self.linear.units[output]))
            axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
        return figure

    def __str__(self) -> str:
        head = f"Orders {', '.join(f'{n:g}' for n in self.orders)} of {self.linear.model.name}"
        lines = [f"  order {n:g} meets {abs(w) * n / (2 * np.pi):.4g} Hz at {w * _RPM:.5g} rpm"
                 for n, speeds in self.resonances().items() for w in speeds]  # fmt: skip
        return "\n".join([head, *lines])


@checked
def order_response(linear: LinearModel, excitation: Mapping[float, complex], speeds: Any) -> OrderResponse:
    """Return the steady vibration that torques or forces at orders of a rotation excite.

    Args:
        linear: a linear model with one input, that of the excitation.
        excitation: amplitude of each order, in the unit of the input; a complex one has a phase.
        speeds: of the rotation in rad/s.

    Raises:
        ValueOutOfRange: the linear model has another number of inputs, an order is not above zero, or a speed or
            amplitude is not finite.
    """
    if len(linear.inputs) != 1:
        raise ValueOutOfRange(f"An excitation acts on one input, and the linear model has {len(linear.inputs)}.")
    if not excitation or not all(0 < order < np.inf for order in excitation):
        raise ValueOutOfRange("Orders of an excitation must be above zero, and finite.")
    if not np.all(np.isfinite(list(excitation.values()))):
        raise ValueOutOfRange("Amplitudes of an excitation must be finite.")
    speeds = np.atleast_1d(np.asarray(speeds, float))
    if not speeds.size or not np.all(np.isfinite(speeds)):
        raise ValueOutOfRange("Speeds of an order response must be finite, and at least one.")
    responses = [size * linear.response(n * speeds / (2 * np.pi))[:, 0] for n, size in excitation.items()]
    return OrderResponse(linear, tuple(map(float, excitation)), speeds, np.stack(responses, axis=1))


@dataclass(frozen=True, eq=False)
class OrderMap:
    """Amplitudes of the orders of a signal over a run-up.

    Attributes:
        name: path of the signal.
        unit: its unit.
        orders: shape (orders,).
        times: middle of each window in s, shape (windows,).
        speeds: mean speed in each window in rad/s, shape (windows,).
        amplitudes: shape (orders, windows).
    """

    name: str
    unit: str
    orders: Vector = field(repr=False)
    times: Vector = field(repr=False)
    speeds: Vector = field(repr=False)
    amplitudes: Vector = field(repr=False)

    def order(self, order: float) -> Vector:
        """Return the amplitude of the nearest order in each window, shape (windows,)."""
        return self.amplitudes[np.argmin(np.abs(self.orders - order))]

    def plot(self) -> Figure:
        """Draw the amplitudes over speed and order."""
        with picture(f"Orders of {self.name}", 1, 4.2) as (figure, (axes,)):
            k = np.argsort(self.speeds, kind="stable")
            mesh = axes.pcolormesh(self.speeds[k] * _RPM, self.orders, self.amplitudes[:, k], shading="nearest")
            figure.colorbar(mesh, label=with_unit("amplitude", self.unit))
            axes.set(xlabel="speed in rpm", ylabel="order")
            axes.grid(visible=False)
        return figure


@checked
def order_map(run: Trajectories, signal: str, angle: str, *, most: float = 10.0, revolutions: float = 8.0) -> OrderMap:
    """Return the orders of a signal during a run: its spectra over the angle, in windows of some revolutions (Hann).

    Args:
        run: a run, or a measured table whose rows follow the fastest order.
        signal: path of a torque, speed or acceleration.
        angle: path of the angle that the orders count.
        most: highest order.
        revolutions: length of a window; orders closer than twice its inverse are not told apart.

    Raises:
        ValueOutOfRange: the shaft turns back, or too little, or the rows are too far apart.
        UnknownName: there is no such variable.
        MissingValue: the run has not kept what happens between its results.
    """
    if not (0 < most < np.inf and 0 < revolutions < np.inf):
        raise ValueOutOfRange(
            f"The highest order and the length of a window must be positive and finite, "
            f"not {most:g} and {revolutions:g}."
        )
    curves, unit = along(run, run.path(signal), run.path(angle))
    turned = curves.values[1] - curves.values[1, 0, 0]
    phi = turned * np.sign(turned[-1, -1]) / (2 * np.pi)
    end = float(phi[-1, -1])
    if np.any(np.diff(phi, append=phi[:, -1:]) < -1e-9 * (end or 1.0)) or end < revolutions:
        raise ValueOutOfRange(f"{angle} does not turn {revolutions:g} times in one direction.")
    per_turn = 4 * int(np.ceil(most))
    apart = float((phi[:, -1] - phi[:, 0]).max()) if run.measured else 0.0
    if apart > 0.5 / most:
        what = f"The rows are up to {apart:.3g} revolutions apart, and order {most:g} needs {0.5 / most:.3g}."
        raise ValueOutOfRange(what, advice="Measure more often, or ask for lower orders.")
    size = int(revolutions * per_turn)
    grid = np.arange(0, end, 1 / per_turn)
    pieces, places = replace(curves, values=phi[None]).places(0, grid)
    even, moments = curves.at(0, pieces, places), curves.times(pieces, places)
    begins = np.arange(0, len(grid) - size + 1, max(size // 4, 1))
    window = np.hanning(size + 1)[:-1]
    spectra = np.array([np.abs(np.fft.rfft(window * even[k : k + size])) * 2 / window.sum() for k in begins]).T
    spectra[0] /= 2
    orders: Any = np.fft.rfftfreq(size, 1 / per_turn)
    first, last = moments[begins], moments[begins + size - 1]
    speeds = 2 * np.pi * (size - 1) / per_turn / (last - first)
    kept = orders <= most
    return OrderMap(run.path(signal), unit, orders[kept], (first + last) / 2, speeds, spectra[kept])
