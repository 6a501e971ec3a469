"""Results of tolerances, as numbers, tables and histograms."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from modelica_like.analyse.tolerance.scatter import Scatter
from modelica_like.analyse.tolerance.sequences import OtherSequence
from modelica_like.compile.buffers import Vector
from modelica_like.errors import UnknownName, did_you_mean
from modelica_like.language.units import Unit
from modelica_like.style import COLOURS, picture
from modelica_like.upper import Shown

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_BINS = 60


@dataclass(frozen=True, eq=False)
class Spread:
    """How an output scatters, in SI units.

    Attributes:
        name: of the output.
        unit: its unit.
        nominal: its value at the means of the parameters; nan without a first-order answer.
        linear_sigma: standard deviation to first order.
        mean: of the samples.
        mean_error: half width of the 95 % interval of the mean.
        sigma: standard deviation of the samples.
        quantiles: at `LEVELS`.
        shares: of the variance to first order, by parameter, shape (parameters,).
        low: value at the corner of all ranges that is lowest to first order.
        high: value at the highest one.
    """

    LEVELS: ClassVar[tuple[float, ...]] = (0.00135, 0.05, 0.5, 0.95, 0.99865)

    name: str
    unit: Unit
    nominal: float
    linear_sigma: float
    mean: float
    mean_error: float
    sigma: float
    quantiles: tuple[float, ...]
    shares: Vector
    low: float
    high: float

    @property
    def unit_text(self) -> str:
        """The unit as text; empty for plain numbers."""
        return "" if (shown := str(self.unit)) in ("1", "*") else shown


@dataclass(frozen=True)
class Probability:
    """The probability that a limit is broken, with its 95 % interval; `within` names the load case."""

    limit: str
    value: float
    low: float
    high: float
    within: str = ""

    def __str__(self) -> str:
        low, high = 100 * self.low, 100 * self.high
        return f"'{self.limit}'{self.within} is broken in {100 * self.value:.4g} % of runs ({low:.3g} to {high:.3g} %)."


@dataclass(frozen=True, eq=False)
class Tolerances(Shown):
    """What tolerances of parameters do.

    Attributes:
        model: name of the model.
        scatters: the parameters.
        outputs: how each output scatters.
        limits: how probably each is broken.
        runs: number of simulations.
        samples: outputs of all runs, shape (runs, outputs).
        variances: Sobol's indices `S1` and `ST` with `S1_conf`, `ST_conf`, shape (outputs, parameters); if asked for.
        sequences: mode changes that runs have and the one at all means has not, the most frequent first.
        notes: sentences: runs without a value, differences of sampling and first order.
    """

    model: str
    scatters: tuple[Scatter, ...]
    outputs: tuple[Spread, ...]
    limits: tuple[Probability, ...]
    runs: int
    samples: Vector = field(repr=False)
    variances: Mapping[str, Vector] = field(default_factory=dict, repr=False)
    sequences: tuple[OtherSequence, ...] = ()
    notes: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> Spread:
        """Return how an output scatters.

        Raises:
            UnknownName: there is no such output.
        """
        names = {spread.name: spread for spread in self.outputs}
        if name not in names:
            raise UnknownName(f"There is no output '{name}'{did_you_mean(name, names) or '.'}")
        return names[name]

    def plot(self) -> Figure:
        """Draw a histogram of each output, with its quantiles of 5 and 95 %."""
        with picture(f"{self.model}: {self.runs} runs", len(self.outputs), 2.2 * len(self.outputs), sharex=False) as (
            figure, panels,
        ):  # fmt: skip
            for k, (spread, axes) in enumerate(zip(self.outputs, panels, strict=True)):
                column = self.samples[:, k]
                axes.hist(column[np.isfinite(column)], bins=_BINS, color=COLOURS[5])
                for level in (1, 3):
                    share = f"{100 * spread.LEVELS[level]:g} % of runs are below"
                    axes.axvline(spread.quantiles[level], color=COLOURS[level], linewidth=0.8, label=share)
                axes.legend(loc="best")
                axes.set_xlabel(f"{spread.name} in {spread.unit_text}" if spread.unit_text else spread.name)
                axes.set_ylabel("runs")
        return figure

    def __str__(self) -> str:
        lines = [f"{self.model}: {self.runs} runs"]
        for spread in self.outputs:
            unit = spread.unit_text
            lines.append(f"  {spread.name}: {spread.mean:.6g} ± {spread.sigma:.3g} {unit}".rstrip())
            lines.append(f"    to first order {spread.nominal:.6g} ± {spread.linear_sigma:.3g} {unit}".rstrip())
            names = [(share, scatter.name) for share, scatter in zip(spread.shares, self.scatters, strict=True)]
            listed = ", ".join(f"{name} {100 * share:.3g} %" for share, name in sorted(names, key=lambda p: -abs(p[0])))
            lines.append(f"    shares {listed}")
        lines += [f"  {limit}" for limit in self.limits]
        return "\n".join([*lines, *self.notes])
