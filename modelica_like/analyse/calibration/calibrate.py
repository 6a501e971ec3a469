"""Calibration: parameters from measurements, by least squares with exact gradients."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from modelica_like.analyse.calibration.measurements import Measurement, Numbers, OperatingPoints, Trajectories
from modelica_like.analyse.calibration.pictures import ellipses
from modelica_like.analyse.optimize.terms import read_free, starts_of
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
    extra_module,
)
from modelica_like.language import Assembly, Component
from modelica_like.simulation import Model, build, loaded

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Calibration", "Numbers", "OperatingPoints", "Trajectories", "calibrate"]

Matrix = np.ndarray[Any, np.dtype[np.float64]]
_RANK = 1e-8
"""Relative size of a singular value below which the data do not determine a combination of parameters."""
_CONFIDENCE = 0.95
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
        return "\n".join(lines)


@checked
def calibrate(
    drive: Model, data: Sequence[Measurement] | Measurement, parameters: Mapping[str, tuple[Any, Any]], *,
    guess: Mapping[str, Any] | None = None, starts: int = 1, seed: int = 0,
) -> Calibration:  # fmt: skip
    """Find the parameters that fit measurements best, by weighted least squares.

    Residuals are deviations over the uncertainties that the data state; gradients are exact.

    Args:
        drive: a component, a netlist file or a compiled model.
        data: measurements: `OperatingPoints`, `Trajectories`, `Numbers`.
        parameters: path of each parameter with its lower and upper bound.
        guess: start values; by default those of the model, moved into the bounds.
        starts: number of starts; all but the first from a Latin hypercube between the bounds. The best result is kept.
        seed: of the Latin hypercube.

    Raises:
        UnknownName: a name is not known.
        ValueOutOfRange: there are no data, they set what is to be found, or bounds are not in order.
        CalibrationFailed: the model could not be solved from any start.
        MissingExtra: scipy is not installed.
    """
    drive = loaded(drive)
    model = build(drive, free=parameters)
    measured = _measurements(data, parameters, starts)
    problem = _Problem(model, measured, parameters, guess or {})
    begins = problem.starts(starts, seed)
    results: list[Any] = []
    failures: list[InitializationError | SolveError] = []
    for begin in begins:
        try:
            results.append(problem.solve(begin))
        except (InitializationError, SolveError) as error:
            failures.append(error)
    if not results:
        raise CalibrationFailed(
            f"{model.name} could not be calibrated: {failures[-1].what}", where=failures[-1].where,
            advice="Give a guess for which the model can be solved, or narrower bounds.",
        )  # fmt: skip
    best = min(results, key=lambda r: r.cost)
    result = problem.result(best, tuple(2 * result.cost for result in results))
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


class _Problem:
    """Residuals and their Jacobian in values scaled by the bounds."""

    def __init__(
        self, model: CompiledDae, data: Sequence[Measurement], parameters: Mapping[str, tuple[Any, Any]],
        guess: Mapping[str, Any],
    ) -> None:  # fmt: skip
        self.model, self.data, self.names = model, data, tuple(parameters)
        self.free = read_free(model.with_parameters(dict(guess)), parameters, moved=True)
        self.units = tuple(str(parameter.unit) for parameter in self.free)
        self.low = np.array([parameter.low for parameter in self.free])
        self.span = np.array([parameter.span for parameter in self.free])
        self.labels: tuple[str, ...] = ()
        self._at: tuple[bytes, Matrix, Matrix] | None = None

    def starts(self, count: int, seed: int) -> list[Matrix]:
        """Return starts in [0, 1]."""
        return [(x - self.low) / self.span for x in starts_of(self.free, count, seed)]

    def solve(self, begin: Matrix) -> Any:
        """Run the least-squares solver from one start."""
        return extra_module("scipy.optimize", "analyse").least_squares(
            lambda q: self.evaluate(q)[0], begin, lambda q: self.evaluate(q)[1], bounds=(0.0, 1.0), x_scale="jac",
            ftol=1e-14, xtol=1e-12, gtol=1e-12,
        )  # fmt: skip

    def evaluate(self, q: Matrix) -> tuple[Matrix, Matrix]:
        """Return residuals and Jacobian; the solver asks for both at the same point."""
        key = q.tobytes()
        if self._at is None or self._at[0] != key:
            model = self.at(q)
            residuals, slopes, labels = zip(
                *(measured.residuals(model, self.names) for measured in self.data), strict=True
            )
            self.labels = tuple(chain(*labels))
            self._at = key, np.concatenate(residuals), np.concatenate(slopes) * self.span
        return self._at[1], self._at[2]

    def at(self, q: Matrix) -> CompiledDae:
        values = self.low + self.span * q
        return self.model.with_parameters(dict(zip(self.names, map(float, values), strict=True)))

    def result(self, fit: Any, costs: tuple[float, ...]) -> Calibration:
        """Compute covariance and rank at the solution."""
        residuals, slopes = self.evaluate(fit.x)
        values = self.low + self.span * fit.x
        sizes = np.maximum(np.abs(values), _SMALL * self.span)
        by_values = slopes / self.span
        relative = by_values * sizes
        _, singular, right = np.linalg.svd(relative, full_matrices=True)
        padded = np.concatenate([singular, np.zeros(len(self.names) - len(singular))])
        determined = padded > _RANK * padded.max(initial=1e-300)
        covariance = self._covariance(right, padded, determined, residuals, sizes)
        lost = tuple(
            {name: float(w) for name, w in zip(self.names, row, strict=True) if abs(w) > 1e-3}
            for row in right[~determined]
        )
        edges = tuple(name for name, q in zip(self.names, fit.x, strict=True) if q <= 1e-9 or q >= 1 - 1e-9)
        return Calibration(
            self.at(fit.x), self.names, values, self.units, residuals, self.labels, covariance,
            by_values.T @ by_values, int(determined.sum()), lost, edges, costs,
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
