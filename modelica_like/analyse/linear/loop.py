"""Loops opened at a signal: what comes back, and how far the closed loop is from its limit of stability."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from modelica_like.analyse.linear.linearize import At, linearize
from modelica_like.analyse.linear.model import LinearModel
from modelica_like.arguments import checked
from modelica_like.compile import compile
from modelica_like.errors import LanguageError, ValueOutOfRange
from modelica_like.flatten import flatten
from modelica_like.language import Component
from modelica_like.netlist import load
from modelica_like.solve.initialize.memory import listed
from modelica_like.structure import reduce

_ROUNDS = 60
_ALGEBRAIC = 1e-9
"""Distance from 1 of the direct response at which nothing determines the opened signal."""
_STILL = 1e-9
"""Eigenvalues below this share of the largest are zero."""
_ROUNDING = 1e-10
_DECADES, _POINTS = 3.0, 3000


@dataclass(frozen=True)
class Margins:
    """Distances of a closed loop from its limit of stability, for a negative feedback.

    Attributes:
        gain: pairs of a frequency in Hz where the phase is -180\u00b0, and the factor that the gain may have there.
        phase: pairs of a frequency in Hz where the gain is one, and the lag in degrees that may come there.
        distance: frequency in Hz where the response is nearest to -1, and the distance.
        stable: whether no eigenvalue of the closed loop has a positive real part; None where samples are held constant,
            which decide that, too.
        sampled: names of those.
    """

    gain: tuple[tuple[float, float], ...]
    phase: tuple[tuple[float, float], ...]
    distance: tuple[float, float]
    stable: bool | None
    sampled: tuple[str, ...] = ()

    def lines(self) -> list[str]:
        """Return a line for each margin."""
        lines = [f"gain margin {20 * np.log10(factor):.3g} dB at {f:.4g} Hz" for f, factor in self.gain]
        lines += [f"phase margin {lag:.3g}\u00b0 at {f:.4g} Hz" for f, lag in self.phase]
        lines.append(f"nearest to -1 at {self.distance[0]:.4g} Hz, by {self.distance[1]:.3g}")
        lines = [line.replace("-", "\u2212") for line in lines]
        if self.stable is None:
            held = f"{listed(self.sampled)} {'is' if len(self.sampled) == 1 else 'are'} held constant"
            return [*lines, f"Whether the closed loop is stable is not told: {held}, but sampled. Simulate it."]
        return [*lines, "The closed loop is stable." if self.stable else "The closed loop is not stable."]

    def __str__(self) -> str:
        return "\n".join(self.lines())


class Loop(LinearModel):
    """A loop opened at a signal: what is sent on comes back with the sign of a negative feedback."""

    def margins(self) -> Margins:
        """Return where gain and phase cross their limits, refined from the frequency response itself."""
        f = self.around(_DECADES, _POINTS)
        gains = self.response(f)[0, 0]

        def at(frequency: float) -> complex:
            return complex(self.response(frequency)[0, 0, 0])

        real = _crossings(f, gains.imag, lambda g: at(g).imag)
        turned = [(phase, 1 / abs(at(phase))) for phase in real if at(phase).real < 0]
        unity = _crossings(f, np.abs(gains) - 1, lambda g: abs(at(g)) - 1)
        phases = [(gain, (np.degrees(np.angle(at(gain))) + 360) % 360 - 180) for gain in unity]
        k = int(np.argmin(np.abs(1 + gains)))
        closed = self.A - self.B @ self.C / (1 + self.D)
        values = np.linalg.eigvals(closed) if len(closed) else np.zeros(0)
        stable = bool(np.all(values.real <= _STILL * np.abs(values).max(initial=0.0)))
        near = float(f[k]), float(abs(1 + gains[k]))
        return Margins(tuple(turned), tuple(phases), near, None if self.sampled else stable, self.sampled)


def _crossings(f: Any, values: Any, at: Callable[[float], float]) -> list[float]:
    """Return where a function of the frequency changes its sign, by bisection between the points of a grid."""
    crossings: list[float] = []
    for k in np.flatnonzero(np.sign(values[:-1]) * np.sign(values[1:]) < 0):
        low, high = np.log(f[k]), np.log(f[k + 1])
        for _ in range(_ROUNDS):
            middle = (low + high) / 2
            low, high = (middle, high) if at(np.exp(middle)) * values[k] > 0 else (low, middle)
        crossings.append(float(np.exp((low + high) / 2)))
    return crossings


@checked
def open_loop(drive: Component | str | Path, signal: str, at: At = None) -> Loop:
    """Open a loop at a signal; the operating point is that of the closed loop.

    Args:
        drive: a component or a netlist file.
        signal: path of a connected signal: an output (all that it drives is cut off), or an input (only that one).
        at: where to linearize, as in `linearize`.

    Raises:
        UnknownName: no signal of this path is connected.
        LanguageError: the drive is compiled already.
        ValueOutOfRange: nothing determines the signal when it is opened.
        ModelicaLikeError: the drive cannot be built, started or simulated.
    """
    if not isinstance(drive, Component | str | Path):
        raise LanguageError("A compiled drive has no loop to open.", advice="Give the component or the netlist.")
    flat = flatten(drive if isinstance(drive, Component) else load(drive), disturbed=signal)
    added = flat.inputs[-1]
    sends = any(flat.variables[e.terms[0][0]].path == signal for e in flat.linear if added in dict(e.terms))
    name = flat.variables[added].path
    closed = linearize(compile(reduce(flat)), at, inputs=[name], outputs=[signal])
    # What arrives at an input is what comes back, and what is added.
    direct = float(closed.D[0, 0]) - (not sends)
    if abs(1 + direct) < _ALGEBRAIC:
        raise ValueOutOfRange(f"{signal} is in a loop that determines nothing when it is opened.")
    # What is sent on is w = y + added; so added = w - y, and y = C x + D added = (C x + D w)/(1 + D).
    share = 1 / (1 + direct)
    back = closed.B @ closed.C * share
    a = closed.A - back
    # What is left of two equal numbers would make slow oscillations of a chain of integrators.
    a[np.abs(a) < _ROUNDING * (np.abs(closed.A) + np.abs(back))] = 0.0
    given: dict[str, Any] = dict(vars(closed))
    given |= {"A": a, "B": closed.B * share, "C": -closed.C * share, "D": np.array([[-direct * share]])}
    given["inputs"] = given["outputs"] = (signal,)
    return Loop(**given)
