"""Load spectra: cycles counted in a trajectory, damage by a Wöhler line, and the spectrum of each gear."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from modelica_like.arguments import checked, fits, wrong_kind
from modelica_like.compile.compiled import Vector
from modelica_like.errors import ValueOutOfRange, extra_module
from modelica_like.runs.polynomials import WEIGHTS, Fitted
from modelica_like.runs.results import along
from modelica_like.runs.trajectories import Trajectories
from modelica_like.style import COLOURS, picture, with_unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_BELOW = "elementary", "haibach", "original"
_NO_CYCLE = 1e-9
"""Share of the largest amount: a smaller range is rounding of the integrator, which would count with its mean."""
_ON_LIMIT = 1e-9
"""Share of a class by which rounding may leave a torque below a limit, on which it counts for the class above."""


@dataclass(frozen=True)
class WoehlerLine:
    """Cycles to failure of a part over the amplitude of its load: N = cycles·(amplitude/load)^slope.

    Attributes:
        amplitude: at the knee, in the SI unit of the load.
        cycles: at the knee.
        slope: exponent above the knee.
        below: line below the knee: the same slope (`elementary`), that of E. Haibach, 2·slope - 1 (`haibach`), or
            nothing (`original`).
    """

    amplitude: float
    cycles: float
    slope: float
    below: Literal["elementary", "haibach", "original"] = "elementary"

    def __post_init__(self) -> None:
        for name in ("amplitude", "cycles", "slope"):
            if not fits(getattr(self, name), float):
                raise wrong_kind(name, getattr(self, name), float, of="WoehlerLine: ")
        if not all(0 < number < np.inf for number in (self.amplitude, self.cycles, self.slope)):
            raise ValueOutOfRange(f"Amplitude, cycles and slope of a Wöhler line must be above zero, not {self}.")
        if self.below not in _BELOW:
            raise ValueOutOfRange(f"WoehlerLine: below = '{self.below}' must be {' or '.join(_BELOW)}.")
        if self.below == "haibach" and self.slope < 1:
            raise ValueOutOfRange(f"Haibach's line needs a Wöhler line of slope 1 or more, not {self.slope:g}.")

    def life(self, amplitudes: Any) -> Vector:
        """Return the cycles to failure at amplitudes, of their shape; infinite where there is no damage."""
        share = np.abs(np.asarray(amplitudes, float)) / self.amplitude
        slope = {"elementary": self.slope, "haibach": 2 * self.slope - 1, "original": np.inf}[self.below]
        with np.errstate(divide="ignore", over="ignore"):
            return self.cycles * np.where(share >= 1, share**-self.slope, share**-slope)

    def damage(self, amplitudes: Any, counts: Any) -> float:
        """Return the damage sum of A. Palmgren and M. A. Miner; at 1 the part fails."""
        return float(np.sum(np.asarray(counts) / self.life(amplitudes)))


@dataclass(frozen=True, eq=False)
class LoadSpectrum:
    """Cycles of a load, the largest first.

    Attributes:
        name: path of the load.
        unit: its SI unit.
        amplitudes: half of the ranges, shape (cycles,).
        means: shape (cycles,).
        counts: 1 for a closed cycle, 0.5 for half of one, times the number of repetitions; shape (cycles,).
    """

    name: str
    unit: str
    amplitudes: Vector = field(repr=False)
    means: Vector = field(repr=False)
    counts: Vector = field(repr=False)

    def __mul__(self, times: float) -> LoadSpectrum:
        """Return the spectrum of so many repetitions.

        Raises:
            ValueOutOfRange: there are fewer than none.
        """
        if not 0 <= times < np.inf:
            raise ValueOutOfRange(f"A load spectrum cannot be repeated {times:g} times.")
        return LoadSpectrum(self.name, self.unit, self.amplitudes, self.means, self.counts * times)

    def damage(self, line: WoehlerLine, mean_sensitivity: float = 0.0) -> float:
        """Return the damage sum by a Wöhler line for a mean of zero.

        Args:
            line: amplitudes in the unit of the load.
            mean_sensitivity: M of W. Schütz: a mean counts as M·mean more amplitude.
        """
        return line.damage(np.maximum(self.amplitudes + mean_sensitivity * self.means, 0.0), self.counts)

    def equivalent(self, slope: float, cycles: float) -> float:
        """Return the amplitude that does the same damage in so many cycles.

        Raises:
            ValueOutOfRange: slope or cycles are not above zero.
        """
        if not (0 < slope < np.inf and 0 < cycles < np.inf):
            raise ValueOutOfRange(f"Slope and cycles must be above zero, not {slope:g} and {cycles:g}.")
        return float((np.sum(self.counts * self.amplitudes**slope) / cycles) ** (1 / slope))

    def plot(self) -> Figure:
        """Draw amplitudes over the number of cycles that exceed them."""
        with picture(f"Load spectrum of {self.name}", 1, 3.2) as (figure, (axes,)):
            above = np.concatenate([self.counts[:1] / 2, np.cumsum(self.counts)])
            axes.step(above, np.concatenate([self.amplitudes[:1], self.amplitudes]), color=COLOURS[0])
            axes.set(xscale="log", xlabel="cumulative cycles", ylabel=with_unit("amplitude", self.unit), ylim=(0, None))
        return figure

    def __str__(self) -> str:
        largest = f", amplitudes up to {self.amplitudes[0]:.5g} {self.unit}" if len(self.amplitudes) else ""
        return f"Load spectrum of {self.name}: {np.sum(self.counts):g} cycles{largest}"


@checked
def load_spectrum(run: Trajectories, load: str) -> LoadSpectrum:
    """Count the cycles of a load by rainflow counting (ASTM E1049-85), with what is left over as half cycles.

    Turning points are those between the results, too; a measured table has no others. Ranges of less than 1e-9 of the
    largest amount are no cycles.

    Args:
        run: a run of this tool, or a measured table.
        load: path of a torque, force or stress, or a formula.

    Raises:
        MissingExtra: the package rainflow is not installed.
        UnknownName: there is no such variable.
        MissingValue: the run has not kept what happens between its results.
    """
    rainflow = extra_module("rainflow", "analyse")
    curve, unit = along(run, run.path(load))
    turning = curve.turning(0)
    cycles = sorted(rainflow.extract_cycles(turning.tolist()), key=lambda cycle: -cycle[0])
    table = np.array([cycle[:3] for cycle in cycles], float).reshape(-1, 3)
    table = table[table[:, 0] > _NO_CYCLE * np.abs(turning).max(initial=0.0)]
    return LoadSpectrum(run.path(load), unit, table[:, 0] / 2, table[:, 1], table[:, 2])


@dataclass(frozen=True, eq=False)
class Duty:
    """How long and how often a shaft turns under which torque, in each gear.

    Attributes:
        torque: path of the torque.
        gears: values of the gear, or names of the mode.
        torques: largest torque of each class in N.m, shape (classes,).
        times: in s, shape (gears, classes).
        revolutions: shape (gears, classes).
        work: in J, shape (gears, classes).
    """

    torque: str
    gears: tuple[str, ...]
    torques: Vector = field(repr=False)
    times: Vector = field(repr=False)
    revolutions: Vector = field(repr=False)
    work: Vector = field(repr=False)

    def damage(self, line: WoehlerLine) -> dict[str, float]:
        """Return the damage sum of each gear, if each revolution is a cycle of its torque, as for a tooth."""
        return {gear: line.damage(self.torques, n) for gear, n in zip(self.gears, self.revolutions, strict=True)}

    def equivalent(self, slope: float) -> dict[str, float]:
        """Return the torque of each gear in N.m that does the same damage in as many revolutions."""
        total = np.maximum(self.revolutions.sum(axis=1), np.finfo(float).tiny)
        same = (np.sum(self.revolutions * self.torques**slope, axis=1) / total) ** (1 / slope)
        return dict(zip(self.gears, same.tolist(), strict=True))

    def __str__(self) -> str:
        lines = [f"Duty of {self.torque}"]
        for k, gear in enumerate(self.gears):
            most = self.torques[np.flatnonzero(self.times[k])].max(initial=0.0)
            lines.append(
                f"  {gear}: {self.times[k].sum():.5g} s, {self.revolutions[k].sum():.5g} revolutions, "
                f"{self.work[k].sum() / 1e3:.5g} kJ, up to {most:.4g} N.m"
            )
        return "\n".join(lines)


@checked
def duty(run: Trajectories, torque: str, speed: str, gear: str = "", classes: int = 16) -> Duty:
    """Sort a run by gear and torque, as gears are designed by: so many revolutions under so much torque.

    Args:
        run: a run.
        torque: path of the torque in a shaft; its size counts.
        speed: path of the speed of that shaft.
        gear: path of a mode or of a signal that says which gear is engaged; without one there is one gear.
        classes: number of classes of torque, of equal width.

    Raises:
        ValueOutOfRange: there is no class.
        UnknownName: there is no such variable.
        MissingValue: the run has not kept what happens between its results.
    """
    if classes < 1:
        raise ValueOutOfRange(f"A duty needs at least one class of torque, not {classes}.")
    curves, _ = along(run, *map(run.path, (torque, speed, *[gear][: len(gear)])))
    turned = Fitted(curves.begins, curves.ends, -curves.values)
    top = max(curves.largest(0)[0], turned.largest(0)[0], 0.0) or 1.0
    limits = top * np.arange(-classes + 1, classes) / classes
    # Within a part the torque stays in its class and the speed keeps its sign.
    parts, owners = curves.cut({0: limits, 1: np.zeros(1)})
    lengths, means = parts.ends - parts.begins, parts.values @ WEIGHTS
    power = (parts.values[0] * parts.values[1]) @ WEIGHTS
    which = np.clip(np.abs(means[0]) / top * classes + _ON_LIMIT, 0, classes - 1).astype(int)
    engaged = curves.values[2, owners, len(WEIGHTS) // 2] if gear else np.zeros(len(owners))
    gears, row = np.unique(engaged, return_inverse=True)

    def sorted_by(amounts: Vector) -> Vector:
        table = np.zeros((len(gears), classes))
        np.add.at(table, (row, which), amounts * lengths)
        return table

    torques = top * np.arange(1, classes + 1) / classes
    return Duty(run.path(torque), _gears(run, gear, gears), torques, sorted_by(np.ones(len(lengths))),
                sorted_by(np.abs(means[1]) / (2 * np.pi)), sorted_by(power))  # fmt: skip


def _gears(run: Trajectories, gear: str, values: Vector) -> tuple[str, ...]:
    names = (
        {discrete.path: discrete.names for discrete in run.model.flat_discretes}.get(run.path(gear), ()) if gear else ()
    )
    return tuple(names[int(value)] if names else f"gear {value:g}" if gear else "all" for value in values)
