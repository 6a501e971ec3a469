"""Calibration: parameters from measurements, by least squares with exact gradients."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from modelica_like.analyse.calibration.measurements import Measurement, Numbers, OperatingPoints, Trajectories
from modelica_like.analyse.calibration.pictures import ellipses
from modelica_like.analyse.optimize.designs import Designs, Progress, better, counted
from modelica_like.analyse.optimize.problem import build_free
from modelica_like.analyse.optimize.squares import MOST, least_squares
from modelica_like.analyse.optimize.terms import Free, starts_of
from modelica_like.analyse.written import with_values
from modelica_like.arguments import checked
from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import (
    CalibrationFailed,
    InitializationError,
    LanguageError,
    SolveError,
    UnknownName,
    ValueOutOfRange,
)
from modelica_like.language import Assembly, Component
from modelica_like.simulation import Model, loaded

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Calibration", "Numbers", "OperatingPoints", "Trajectories", "calibrate"]

Matrix = np.ndarray[Any, np.dtype[np.float64]]
_RANK = 1e-8
"""Relative size of a singular value below which the data do not determine a combination of parameters."""
_CONFIDENCE = 0.95
_AT_BOUND = 1e-9
"""Distance from a bound, relative to that of both: at it."""
_SMALL = 1e-4
"""Of the bounds' distance: a parameter nearer to zero has no relative change that could say what data determine."""


@dataclass(frozen=True, eq=False)
class Calibration:
    """Parameters that fit measurements best.

    Attributes:
        model: the compiled model with the parameters found.
        names: paths of the parameters.
        values: their values in SI units, shape (parameters,).
        units: their coherent SI units.
        residuals: deviations of the model, each divided by the uncertainty of its measurement, shape (numbers,).
        labels: what each residual belongs to.
        covariance: of the values, shape (parameters, parameters), scaled to the scatter of the residuals (with no more
            numbers than parameters, by the stated uncertainties); nan for undetermined parameters.
        fisher: the Fisher information of the data about the values, by the stated uncertainties, shape (parameters,
            parameters), in SI units: what they do not determine is in its null space.
        rank: number of combinations of parameters that the data determine.
        undetermined: combinations that the data do not determine, as weights of relative changes, by parameter (near
            zero, of changes relative to 1e-4 of the distance of the bounds).
        at_bounds: parameters that stopped at a bound.
        starts: sum of squares reached from each start.
        drive: the drive as it was.
        notes: sentences about the search.
    """

    model: CompiledDae = field(repr=False)
    names: tuple[str, ...]
    values: Matrix
    units: tuple[str, ...]
    residuals: Matrix = field(repr=False)
    labels: tuple[str, ...] = field(repr=False)
    covariance: Matrix = field(repr=False)
    fisher: Matrix = field(repr=False)
    rank: int
    undetermined: tuple[dict[str, float], ...]
    at_bounds: tuple[str, ...]
    starts: tuple[float, ...] = field(repr=False)
    drive: Component | None = field(default=None, repr=False)
    notes: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> float:
        if name not in self.names:
            raise UnknownName(f"'{name}' was not calibrated: {', '.join(self.names)}.")
        return float(self.values[self.names.index(name)])

    @property
    def identifiable(self) -> bool:
        """Whether the data determine all parameters."""
        return self.rank == len(self.names)

    @property
    def cost(self) -> float:
        """Half the sum of squares of the residuals."""
        return 0.5 * float(self.residuals @ self.residuals)

    @property
    def confidence(self) -> Matrix:
        """Half widths of the 95 % intervals of the values, shape (parameters,).

        They are those of Student's t; of the normal distribution where only the stated uncertainties count.
        """
        from scipy.stats import t

        freedom = len(self.residuals) - self.rank or np.inf
        return np.sqrt(np.diag(self.covariance)) * float(t.ppf(0.5 + _CONFIDENCE / 2, freedom))

    @property
    def correlation(self) -> Matrix:
        """Correlations of the values, shape (parameters, parameters)."""
        size = np.sqrt(np.diag(self.covariance))
        return self.covariance / np.outer(size, size)

    def save(self, path: str | Path) -> None:
        """Write the drive with the values found as a netlist.

        Raises:
            LanguageError: the drive is no netlist.
        """
        from modelica_like.netlist import save

        if not isinstance(self.drive, Assembly):
            raise LanguageError(
                "Only a drive of a netlist can be saved as one.", advice="The values are in `values`, by `names`."
            )
        save(with_values(self.drive, dict(zip(self.names, map(float, self.values), strict=True))), path)

    def plot(self) -> Figure:
        """Draw the 95 % ellipse of every pair of parameters that the data determine, and their intervals.

        Within an ellipse both values lie together with that probability, to first order; the intervals are those of
        single values.

        Raises:
            ValueOutOfRange: the data determine less than two parameters.
        """
        return ellipses(self)

    def __str__(self) -> str:
        width = max(map(len, self.names))
        lines = [f"Calibration of {self.model.name}: {len(self.residuals)} numbers, {len(self.names)} parameters"]
        for name, value, unit, half in zip(self.names, self.values, self.units, self.confidence, strict=True):
            spread = f"± {half:.2g}" if np.isfinite(half) else "not determined"
            note = "  (at its bound)" if name in self.at_bounds else ""
            lines.append(f"  {name:{width}}  {value:.6g} {spread} {unit}{note}".rstrip())
        for combination in self.undetermined:
            parts = ", ".join(f"{name} {100 * weight:+.0f} %" for name, weight in combination.items())
            lines.append(f"  The data do not determine this combination: {parts}.")
        worst = int(np.argmax(np.abs(self.residuals)))
        lines.append(f"  largest residual {self.residuals[worst]:+.3g} of its uncertainty: {self.labels[worst]}")
        return "\n".join([*lines, *(f"  {note}" for note in self.notes)])


@checked
def calibrate(
    drive: Model, data: Sequence[Measurement] | Measurement, parameters: Mapping[str, Any], *,
    guess: Mapping[str, Any] | None = None, starts: int = 1, seed: int = 0, progress: Progress | None = None,
) -> Calibration:  # fmt: skip
    """Find the parameters that fit measurements best, by weighted least squares.

    Residuals are deviations over the uncertainties that the data state; gradients are exact.

    Args:
        drive: a component, a netlist file or a compiled model.
        data: measurements: `OperatingPoints`, `Trajectories`, `Numbers`.
        parameters: lower and upper bound by path, as `free` of `optimize`: of a table with two columns
            `{"points": 5, "from": "0 N", "to": "9 kN"}` or `rows` of it.
        guess: start values; by default those of the model, moved into the bounds.
        starts: number of starts; all but the first from a Latin hypercube between the bounds. The best result is kept.
        seed: of the Latin hypercube.
        progress: called after each design with the number of those tried, and the most that there can be.

    Raises:
        UnknownName: a name is not known.
        ValueOutOfRange: there are no data, they set what is to be found, or bounds are not in order.
        KeyboardInterrupt: the search was interrupted; the note has the best values until then.
        CalibrationFailed: the model could not be solved from any start.
        MissingExtra: scipy is not installed.
    """
    drive = loaded(drive)
    measured = _measurements(data, parameters, starts)
    model, free, ordered = build_free(drive, parameters, guess or {}, moved=True)
    if ordered:
        raise ValueOutOfRange(
            "A calibration knows no order of values.", advice="Leave out `rising` and `falling`: the data tell."
        )
    designs = _Deviations(model, free, measured, counted(progress, MOST * len(free) * starts))
    try:
        outcomes = designs.from_starts(starts_of(free, starts, seed), partial(least_squares, designs))
    except (InitializationError, SolveError) as failure:
        raise CalibrationFailed(
            f"{model.name} could not be calibrated: {failure.what}", where=failure.where,
            advice="Give a guess for which the model can be solved, or narrower bounds.",
        ) from None  # fmt: skip
    result = designs.result(better(outcomes).x, tuple(outcome.objective for outcome in outcomes))
    return replace(result, drive=drive if isinstance(drive, Component) else None)


def _measurements(data: Any, parameters: Mapping[str, Any], starts: int) -> list[Measurement]:
    """Return the measurements, after checking that something can be found from them."""
    given = [data] if isinstance(data, Measurement | str | Path) else list(data)
    measured: list[Measurement] = []
    if not given or not parameters or starts < 1:
        raise ValueOutOfRange(
            "A calibration needs data, at least one parameter, and at least one start.",
            advice='Write calibrate(drive, [Trajectories("meas.csv")], {"clutch.mu": (0.1, 0.5)}), or on the command '
            "line --data meas.csv --free clutch.mu=0.1:0.5.",
        )
    for item in given:
        if not isinstance(item, Measurement):
            raise ValueOutOfRange(
                f"{repr(item) if isinstance(item, str | Path) else type(item).__name__} is no measurement.",
                advice='Say what it measures: Trajectories("meas.csv"), OperatingPoints(…) or Numbers(…), with the '
                "uncertainties.",
            )
        item.check([*parameters])
        measured.append(item)
    return measured


class _Deviations(Designs):
    """The deviations of a model from measurements, and their derivatives: experiments are the load cases."""

    def __init__(
        self, model: CompiledDae, free: tuple[Free, ...], data: Sequence[Measurement], told: Callable[[], None]
    ) -> None:  # fmt: skip
        super().__init__(free, told)
        self.model, self.data, self.names = model, data, tuple(parameter.name for parameter in free)
        self.labels: tuple[str, ...] = ()

    def run(self, x: Matrix) -> tuple[Matrix, Matrix]:
        """Return the deviations of all experiments as one row, and their derivatives."""
        model = self.model.with_parameters(self.named(x))
        residuals, slopes, labels = zip(*(one.residuals(model, self.names) for one in self.data), strict=True)
        self.labels = tuple(chain(*labels))
        return np.concatenate(residuals)[None, :], np.concatenate(slopes)[None, :, :]

    def result(self, x: Matrix, costs: tuple[float, ...]) -> Calibration:
        """Compute covariance and rank at the solution."""
        best = self.at(x)
        assert best is not None
        residuals, by_values = best.values[0], best.slopes[0]
        sizes = np.maximum(np.abs(x), _SMALL * self.span)
        _, singular, right = np.linalg.svd(by_values * sizes, full_matrices=True)
        padded = np.concatenate([singular, np.zeros(len(self.names) - len(singular))])
        determined = padded > _RANK * padded.max(initial=1e-300)
        covariance = self._covariance(right, padded, determined, residuals, sizes)
        lost = tuple(
            {name: float(w) for name, w in zip(self.names, row, strict=True) if abs(w) > 1e-3}
            for row in right[~determined]
        )
        near = np.minimum(x - self.low, self.low + self.span - x) <= _AT_BOUND * self.span
        edges = tuple(name for name, edge in zip(self.names, near, strict=True) if edge)
        return Calibration(
            self.model.with_parameters(self.named(x)), self.names, x, tuple(str(p.unit) for p in self.free), residuals,
            self.labels, covariance, by_values.T @ by_values, int(determined.sum()), lost, edges, costs,
            notes=tuple(self.remarks()),
        )  # fmt: skip

    def _covariance(self, right: Matrix, singular: Matrix, determined: Any, residuals: Matrix, sizes: Matrix) -> Matrix:
        rank = int(determined.sum())
        freedom = len(residuals) - rank
        # As many numbers as parameters: there is no scatter, only the stated uncertainties.
        scatter = float(residuals @ residuals) / freedom if freedom > 0 else 1.0
        covariance = (right[determined].T / singular[determined] ** 2) @ right[determined] * scatter
        touched = np.any(np.abs(right[~determined]) > 1e-3, axis=0)
        covariance[touched, :] = covariance[:, touched] = np.nan
        return covariance * np.outer(sizes, sizes)
