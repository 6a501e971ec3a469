"""What tolerances do: mean, scatter, quantiles, probabilities of breaking a limit, shares, the worst corner."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from modelica_like.analyse.optimize.sized import Outputs, Sized
from modelica_like.analyse.optimize.terms import Limit, read_limits
from modelica_like.analyse.sensitivity.by_run_time import mode_sequence
from modelica_like.analyse.sensitivity.derivatives import Sensitivities, sensitivities
from modelica_like.analyse.sensitivity.result import Quantity
from modelica_like.analyse.sweeps.plan import Samples, Sobol
from modelica_like.analyse.sweeps.sweep import sweep
from modelica_like.analyse.tolerance.intervals import clopper_pearson, half_width
from modelica_like.analyse.tolerance.result import Probability, Spread, Tolerances
from modelica_like.analyse.tolerance.scatter import Population, read_population
from modelica_like.analyse.tolerance.sequences import LOOKED, other_sequences, sentences
from modelica_like.analyse.written import placed
from modelica_like.arguments import checked
from modelica_like.compile.buffers import Vector
from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import NoGradient, ValueOutOfRange
from modelica_like.language import Assembly, Component
from modelica_like.language.inside import inside
from modelica_like.language.units import Unit
from modelica_like.runs.readings import listed, read_number
from modelica_like.simulation import Model, build, loaded, quick_run
from modelica_like.solve.initialize import StartKind

_MOST = 100_000
_BATCH, _BATCHES = 256, 8
"""Points of a scrambled Sobol sequence, and the fewest of these that tell how far their means scatter."""
_RARE = 20.0
"""Runs that break a limit, or keep it: with fewer, means of batches tell little, and the runs count as independent."""
_DIFFERENT = 0.1
"""Of the first-order standard deviation: a sampled one, or a mean, that is farther off is told."""
_NOTHING = 1e-9
"""Scatter relative to the output that is rounding."""


@checked
def tolerance(
    drive: Model, of: str | Sequence[str] = (), tolerances: Mapping[str, Any] | None = None, *,
    subject_to: str | Sequence[str] = (), correlated: Sequence[Mapping[str, Any]] | None = None,
    until: float | str | None = None, parameters: Mapping[str, Any] | None = None, start: StartKind | None = None,
    precision: float = 0.01, most: int = _MOST, shares: bool = False, seed: int = 0, processes: int | None = None,
) -> Tolerances:  # fmt: skip
    """Tell what tolerances of parameters do to outputs of a run.

    To first order by exact derivatives, and by native runs at the points of scrambled Sobol sequences, until means and
    probabilities are as precise as asked for.

    Args:
        drive: a component, a netlist file or a compiled model.
        of: outputs, named as for `sensitivities`, or lines of design checks, `shaft.safety`; those of `subject_to` are
            added.
        tolerances: text by path: `±10 %`, `±0.5 N.m` (anywhere in the range), `normal(20 N.m, 1 N.m)`, `normal(5 %)`,
            `uniform(18 N.m, 22 N.m)`, or a CSV file of measured values beside the netlist. By default the section
            [tolerances] of the netlist.
        subject_to: limits, `clutch.lock_time <= 0.4 s`: the probability of breaking each.
        correlated: tables with a list of parameters `of` and their correlation `rho`.
        until: end time, as in `simulate`.
        parameters: other values of parameters.
        start: kind of start, as in `simulate`.
        precision: half width of the 95 % intervals of means, relative to the standard deviation, and of probabilities.
        most: largest number of runs.
        shares: whether to find the shares of the variance by Sobol's indices, too; that takes further runs.
        seed: of the sequences.
        processes: parallel runs, as in `sweep`.

    Raises:
        UnknownName, UnitError, ValueOutOfRange: something does not fit the drive.
        ModelicaLikeError: the drive cannot be run as it is.
    """
    drive = loaded(drive)
    given, pairs, folder = scatter_of(drive, tolerances, correlated)
    model = build(drive, free=given).with_parameters(dict(parameters or {}))
    with placed(drive, "tolerances"):
        population = read_population(model, given, pairs, folder)
    texts = [subject_to] if isinstance(subject_to, str) else list(subject_to)
    run = {"until": until, "start": start}
    sized = Sized(drive, model, lambda: quick_run(model, until, start=start))
    limits = read_limits(lambda name: _unit(model, sized, name), texts)
    names = [of] if isinstance(of, str) else list(of)
    return spread(
        model, population, names, limits, run, sized, precision, most, shares=shares, sequences=True, seed=seed,
        processes=processes,
    )  # fmt: skip


def _unit(model: CompiledDae, sized: Sized, name: str) -> Unit:
    return sized.unit(name) if sized.has(name) else read_number(model, name).unit


def scatter_of(
    drive: Component | CompiledDae, given: Mapping[str, Any] | None, correlated: Sequence[Mapping[str, Any]] | None
) -> tuple[Mapping[str, Any], tuple[Mapping[str, Any], ...], Path]:
    """Return how parameters scatter, which together, and the folder of measured values: as given, or as written."""
    if not isinstance(drive, Assembly):
        return given or {}, tuple(correlated or ()), Path()
    written = dict(inside(drive).tolerances)
    pairs = written.pop("correlated", ())
    if given is not None:
        written, pairs = dict(given), ()
    return written, tuple(pairs if correlated is None else correlated), Path(inside(drive).origin).parent


def spread(
    model: CompiledDae, population: Population, of: Sequence[str], limits: Sequence[Limit], run: Mapping[str, Any],
    sized: Sized, precision: float, most: int = _MOST, *, shares: bool = False, sequences: bool = False, seed: int = 0,
    processes: int | None = None,
) -> Tolerances:  # fmt: skip
    """Return what a population of parameters does; see `tolerance`.

    `sized` knows the lines of design checks; `sequences` asks how often runs have other mode changes.
    """
    chance = next((limit.text for limit in limits if limit.probability < 1.0), None)
    if chance is not None:
        raise ValueOutOfRange(
            f"'{chance}' asks for a probability, which is the answer here.", advice="Write the limit alone."
        )
    names = list(dict.fromkeys([*of, *(limit.name for limit in limits)]))
    units = [_unit(model, sized, name) for name in listed(names, "output")]
    if not 0.0 < precision < 1.0 or most < _BATCH * _BATCHES:
        raise ValueOutOfRange(
            f"The precision must be between 0 and 1, and the runs at least {_BATCH * _BATCHES}: they are {precision:g} "
            f"and {most}."
        )
    study = _Study(model, population, names, units, limits, run, Outputs(names, sized), seed, processes)
    return study.result(precision, most, shares, sequences)


class _Study:
    def __init__(
        self, model: CompiledDae, population: Population, names: Sequence[str], units: Sequence[Unit],
        limits: Sequence[Limit], run: Mapping[str, Any], outputs: Outputs, seed: int, processes: int | None,
    ) -> None:  # fmt: skip
        self.model, self.population, self.names, self.limits = model, population, list(names), limits
        self.units, self.outputs = units, outputs
        self.run, self.seed, self.processes = run, seed, processes
        self.notices: dict[str, None] = {}

    def result(self, precision: float, most: int, shares: bool, sequences: bool) -> Tolerances:
        """Return the whole answer."""
        linear, why = self._linear()
        points, values = self._sampled(precision, most)
        spreads = tuple(self._spread(k, linear, values[..., k]) for k in range(len(self.names)))
        chances = tuple(self._chance(limit, values[..., self.names.index(limit.name)]) for limit in self.limits)
        variances = self._shares() if shares else {}
        flat = values.reshape(-1, len(self.names))
        others = other_sequences(self._sequence, self._middle, points[:LOOKED]) if sequences else []
        differences = self._differences(linear, spreads, points, flat)
        notes = [*why, *self._missing(flat), *differences, *sentences(others), *self.notices]
        return Tolerances(
            self.model.name, self.population.scatters, spreads, chances, len(points) + variances.pop("runs", 0),
            flat, variances, tuple(others), tuple(notes),
        )  # fmt: skip

    @property
    def _middle(self) -> Vector:
        return np.array([scatter.mean for scatter in self.population.scatters])

    def _linear(self) -> tuple[Sensitivities | None, list[str]]:
        """Return the derivatives at the middle of the distributions."""
        middle = {scatter.name: scatter.mean for scatter in self.population.scatters}
        model = self.model.with_parameters(middle)
        to = [scatter.name for scatter in self.population.scatters]
        try:
            of_runs = sensitivities(model, self.outputs.read, to, **self.run)
        except NoGradient as error:
            return None, [f"There is no first-order answer. {error.what}"]
        numbers = np.array([output.value for output in of_runs.outputs])
        values = map(float, self.outputs.values(numbers[None, :])[0])
        outputs = tuple(map(Quantity, self.names, values, self.units))
        return replace(of_runs, outputs=outputs, derivatives=self.outputs.slopes(numbers, of_runs.derivatives)), []

    def _sampled(self, precision: float, most: int) -> tuple[Vector, Vector]:
        """Return points and outputs of batches; shapes (runs, parameters) and (batches, points, outputs)."""
        points: list[Vector] = []
        values: list[Vector] = []
        while True:
            wanted = max(_BATCHES, 2 * len(values)) if values else _BATCHES
            count = min(wanted, most // _BATCH) - len(values)
            seeds = range(self.seed + len(values), self.seed + len(values) + count)
            cubes = [Sobol(_BATCH, seed).unit_cube(len(self.population.scatters)) for seed in seeds]
            new = self.population.values(np.vstack(cubes))
            points.append(new)
            values += list(self._runs(new).reshape(count, _BATCH, len(self.names)))
            if self._precise(np.array(values), precision):
                return np.vstack(points), np.array(values)
            if (len(values) + 1) * _BATCH > most:
                self.notices[f"After {len(values) * _BATCH} runs the answer is not as precise as asked for."] = None
                return np.vstack(points), np.array(values)

    def _runs(self, points: Vector) -> Vector:
        """Return the outputs of native runs, nan where one has none; shape (runs, outputs)."""
        names = [scatter.name for scatter in self.population.scatters]
        low, high = points.min(axis=0), points.max(axis=0)
        high = np.where(high > low, high, low + np.maximum(np.abs(low), 1.0))
        ranges = {name: (float(a), float(b)) for name, a, b in zip(names, low, high, strict=True)}
        settings = {key: value for key, value in self.run.items() if value is not None}
        found = sweep(
            self.model, ranges, self.outputs.read, sampling=Samples((points - low) / (high - low)),
            processes=self.processes, **settings,
        )  # fmt: skip
        if found.attrs["notice"]:
            self.notices[str(found.attrs["notice"])] = None
        return self.outputs.values(np.column_stack([found[name].to_numpy() for name in self.outputs.read]))

    def _precise(self, values: Vector, precision: float) -> bool:
        """Whether means and probabilities are known to the precision."""
        for k in range(len(self.names)):
            column = values[..., k]
            sigma = float(np.nanstd(column))
            if (
                sigma > _NOTHING * abs(float(np.nanmean(column)))
                and half_width(np.nanmean(column, axis=1)) > precision * sigma
            ):
                return False
        return all(
            half_width(self._broken(limit, values[..., self.names.index(limit.name)]).mean(axis=1)) <= precision
            for limit in self.limits
        )

    @staticmethod
    def _broken(limit: Limit, column: Vector) -> Vector:
        """Which values break a limit: those that there are not, do."""
        over = {"<=": column > limit.value, ">=": column < limit.value, "==": column != limit.value}[limit.sense]
        return over | ~np.isfinite(column)

    def _spread(self, k: int, linear: Sensitivities | None, column: Vector) -> Spread:
        row = linear.derivatives[k] if linear is not None else np.full(len(self.population.scatters), np.nan)
        variance = row @ self.population.covariance @ row
        parts = row * (self.population.covariance @ row)
        low, high = self._corners(k, row)
        quantiles = np.nanquantile(column, Spread.LEVELS)
        return Spread(
            self.names[k], self.units[k],
            float(linear.outputs[k].value) if linear is not None else np.nan, float(np.sqrt(variance)),
            float(np.nanmean(column)), half_width(np.nanmean(column, axis=1)), float(np.nanstd(column)),
            tuple(map(float, quantiles)), parts / variance if variance > 0.0 else np.zeros(len(row)), low, high,
        )  # fmt: skip

    def _corners(self, k: int, row: Vector) -> tuple[float, float]:
        """Return the output at the corners of all ranges that are worst to first order."""
        ends = np.array([(scatter.low, scatter.high) for scatter in self.population.scatters])
        if not np.all(np.isfinite(row)):
            return np.nan, np.nan
        upper = (row >= 0.0).astype(int)
        places = np.arange(len(row))
        values = self._runs(np.array([ends[places, 1 - upper], ends[places, upper]]))[:, k]
        return float(values[0]), float(values[1])

    def _chance(self, limit: Limit, column: Vector) -> Probability:
        means, runs = self._broken(limit, column).mean(axis=1), column.size
        value, half = float(means.mean()), half_width(means)
        if _RARE <= value * runs <= runs - _RARE:
            return Probability(limit.text, value, max(value - half, 0.0), min(value + half, 1.0))
        return Probability(limit.text, value, *clopper_pearson(value * runs, runs))

    def _missing(self, values: Vector) -> Iterator[str]:
        for k, name in enumerate(self.names):
            missing = int(np.sum(~np.isfinite(values[:, k])))
            if missing:
                yield f"{name} has no value in {missing} of {len(values)} runs; the numbers are those of the others."

    def _differences(
        self, linear: Sensitivities | None, spreads: Sequence[Spread], points: Vector, values: Vector
    ) -> Iterator[str]:
        """Tell where sampling and first order differ, and whether the mode sequence does in the farthest run."""
        if linear is None:
            return
        middle = self._middle
        for k, spread in enumerate(spreads):
            size = spread.linear_sigma
            apart = max(abs(spread.sigma - size), abs(spread.mean - spread.nominal))
            if apart <= _DIFFERENT * size or spread.sigma <= _NOTHING * abs(spread.mean):
                continue
            first_order = spread.nominal + (points - middle) @ linear.derivatives[k]
            farthest = int(np.nanargmax(np.abs(values[:, k] - first_order)))
            same = self._sequence(points[farthest]) == self._sequence(middle)
            yield (
                f"{spread.name}: sampling and first order differ. The run that is farthest off, "
                f"{values[farthest, k]:.6g} for {first_order[farthest]:.6g}, has "
                + ("the same sequence of modes." if same else "another sequence of modes.")
            )

    def _sequence(self, point: Vector) -> list[tuple[str, str, str]]:
        given = {s.name: float(v) for s, v in zip(self.population.scatters, point, strict=True)}
        return mode_sequence(quick_run(self.model, self.run["until"], parameters=given, start=self.run["start"]).events)

    def _shares(self) -> dict[str, Any]:
        """Return first-order and total shares of the variance, shape (outputs, parameters), and the runs."""
        from modelica_like.analyse.sweeps.importance import ranked

        if not np.array_equal(self.population.correlation, np.eye(len(self.population.scatters))):
            raise ValueOutOfRange(
                "Shares of the variance are defined for parameters that are independent.", advice="Leave out `shares`."
            )
        names = [scatter.name for scatter in self.population.scatters]
        runs_at = lambda cube: self._runs(self.population.values(cube))  # noqa: E731
        measures, runs, notes = ranked("sobol", names, runs_at, self.names, self.seed)
        self.notices |= dict.fromkeys(notes)
        return {**measures, "runs": runs}
