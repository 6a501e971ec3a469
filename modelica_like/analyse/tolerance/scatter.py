"""How parameters scatter: ranges, distributions, measured values, correlations."""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from modelica_like.compile.buffers import Vector
from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import (
    NetlistError,
    Source,
    UnitError,
    UnknownName,
    ValueOutOfRange,
    did_you_mean,
    extra_module,
)
from modelica_like.language.units import Unit, parse_unit, read_quantity, to_si

_CALL = re.compile(r"(?P<kind>\w+)\s*\((?P<inside>.*)\)", re.DOTALL)
_WITHIN = re.compile(r"(±|\+-|\+/-)\s*(?P<half>.+)")
_WIDE = 3.0
"""Standard deviations of a normal distribution that count as its range in the worst corner."""
_KINDS = "±10 %, ±0.5 N.m, normal(20 N.m, 1 N.m), normal(5 %), uniform(18 N.m, 22 N.m), measured.csv"
_EDGE = 1e-12
"""Distance of probabilities from 0 and 1, where a normal distribution has no value."""


@dataclass(frozen=True, eq=False)
class Scatter:
    """A parameter that scatters, in SI units.

    Attributes:
        name: its path.
        unit: its unit.
        kind: `uniform` between `low` and `high`, `normal` with `mean` and `sigma`, or `data`.
        nominal: value of the drive.
        mean: of the distribution.
        sigma: standard deviation.
        low: lower end of the range, or three standard deviations below the mean.
        high: upper end.
        data: measured values, sorted.
    """

    name: str
    unit: Unit
    kind: str
    nominal: float
    mean: float
    sigma: float
    low: float
    high: float
    data: Vector = field(default_factory=lambda: np.zeros(0), repr=False)

    def quantile(self, probability: Vector) -> Vector:
        """Return the values below which it is with these probabilities."""
        if self.kind == "uniform":
            return self.low + (self.high - self.low) * probability
        if self.kind == "normal":
            normal = extra_module("scipy.special", "analyse").ndtri
            return self.mean + self.sigma * normal(np.clip(probability, _EDGE, 1.0 - _EDGE))
        return np.quantile(self.data, probability)


@dataclass(frozen=True, eq=False)
class Population:
    """Parameters that scatter together.

    Attributes:
        scatters: the parameters.
        correlation: of their normal scores, shape (parameters, parameters).
    """

    scatters: tuple[Scatter, ...]
    correlation: Vector

    def values(self, cube: Vector) -> Vector:
        """Return values of the parameters from evenly spread points, shapes (runs, parameters)."""
        special = extra_module("scipy.special", "analyse")
        if not np.array_equal(self.correlation, np.eye(len(self.scatters))):
            scores = special.ndtri(np.clip(cube, _EDGE, 1.0 - _EDGE)) @ np.linalg.cholesky(self.correlation).T
            cube = special.ndtr(scores)
        return np.column_stack([scatter.quantile(cube[:, k]) for k, scatter in enumerate(self.scatters)])

    @property
    def covariance(self) -> Vector:
        """Of the parameters, to first order; shape (parameters, parameters)."""
        sigma = np.array([scatter.sigma for scatter in self.scatters])
        return self.correlation * np.outer(sigma, sigma)


def read_population(
    model: CompiledDae, given: Mapping[str, Any], correlated: Sequence[Mapping[str, Any]] = (), folder: Path = Path()
) -> Population:
    """Read how parameters scatter.

    Args:
        model: the compiled model.
        given: text by path: a range about the drive's value, a distribution, or a file with measured values.
        correlated: tables with `of`, a list of paths, and `rho`, the correlation of each pair.
        folder: of files.

    Raises:
        UnknownName: there is no such parameter.
        ValueOutOfRange, UnitError, NetlistError: a text says nothing, or correlations contradict each other.
    """
    if not given:
        raise ValueOutOfRange(
            "Nothing scatters.", advice='Give parameters with their tolerances: { "clutch.mu_static" = "±10 %" }.'
        )
    scatters = tuple(_scatter(model, name, str(text), folder) for name, text in given.items())
    names = [scatter.name for scatter in scatters]
    correlation = np.eye(len(names))
    for table in correlated:
        group, rho = table.get("of", ()), table.get("rho")
        for name in group:
            if name not in names:
                raise UnknownName(f"correlated: '{name}' does not scatter{did_you_mean(name, names) or '.'}")
        if isinstance(rho, bool) or not isinstance(rho, int | float) or not -1.0 < rho < 1.0 or len({*group}) < 2:
            raise ValueOutOfRange(
                "correlated needs at least two parameters `of`, and `rho` between -1 and 1.",
                advice='Write { of = ["shaft1.c", "shaft2.c"], rho = 0.8 }.',
            )
        places = [names.index(name) for name in group]
        for k in places:
            correlation[k, [place for place in places if place != k]] = rho
    if np.linalg.eigvalsh(correlation).min() <= 0.0:
        raise ValueOutOfRange("The correlations contradict each other.", advice="Use smaller ones.")
    return Population(scatters, correlation)


def _scatter(model: CompiledDae, name: str, text: str, folder: Path) -> Scatter:
    if name not in model.fixed_position:
        if name in model.derived_position:
            model.with_parameters({name: 0.0})  # says why not
        near = did_you_mean(name, [*model.fixed_position, *model.derived_position]) or "."
        raise UnknownName(f"{model.name} has no parameter '{name}'{near}")
    unit = model.units[name]
    nominal = float(np.concatenate([model.p, model.u])[model.fixed_position[name]])
    within, called = _WITHIN.fullmatch(text.strip()), _CALL.fullmatch(text.strip())
    if within is not None:
        half = _width(name, within["half"], unit, nominal)
        return _uniform(name, unit, nominal, nominal - half, nominal + half)
    if called is not None and called["kind"] in ("normal", "uniform"):
        inside = [part.strip() for part in called["inside"].split(",")]
        return _distribution(name, unit, nominal, called["kind"], inside)
    if text.lower().endswith(".csv"):
        return _measured(name, unit, nominal, folder / text)
    raise ValueOutOfRange(f"{name}: '{text}' says nothing about how it scatters.", advice=f"Write one of {_KINDS}.")


def _width(name: str, text: str, unit: Unit, nominal: float) -> float:
    """Return a positive difference: per cent are those of the drive's value."""
    number = read_quantity(text)
    relative = number is not None and text.strip().endswith("%")
    width = number[0] / 100.0 * abs(nominal) if relative and number else to_si(text, unit, name, difference=True)
    if not width > 0.0:
        nothing = relative and nominal == 0.0
        what = f"{name} is 0, and per cent of it are nothing" if nothing else f"{name}: {text} is not positive"
        raise ValueOutOfRange(f"{what}.", advice="Give a positive tolerance in the parameter's unit.")
    return width


def _uniform(name: str, unit: Unit, nominal: float, low: float, high: float) -> Scatter:
    if not low < high:
        raise ValueOutOfRange(f"{name}: the lower bound {low:g} is not below the upper bound {high:g}.")
    return Scatter(name, unit, "uniform", nominal, (low + high) / 2, (high - low) / np.sqrt(12.0), low, high)


def _distribution(name: str, unit: Unit, nominal: float, kind: str, values: Sequence[str]) -> Scatter:
    if kind == "uniform" and len(values) == 2:
        return _uniform(name, unit, nominal, *(to_si(value, unit, name) for value in values))
    if kind == "normal" and len(values) in (1, 2):
        mean = to_si(values[0], unit, name) if len(values) == 2 else nominal
        sigma = _width(name, values[-1], unit, mean)
        return Scatter(name, unit, kind, nominal, mean, sigma, mean - _WIDE * sigma, mean + _WIDE * sigma)
    raise ValueOutOfRange(
        f"{name}: {kind}({', '.join(values)}) has not the values that it needs.", advice=f"Write one of {_KINDS}."
    )


def _measured(name: str, unit: Unit, nominal: float, file: Path) -> Scatter:
    try:
        with file.open(newline="", encoding="utf-8-sig") as stream:
            rows = [row for row in csv.reader(stream) if row and row[0].strip()]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        why = error.strerror if isinstance(error, OSError) else error
        raise NetlistError(f"{name}: the measured values in '{file.name}' cannot be read: {why}.") from None
    try:
        head = [] if _is_number(rows[0][0]) else rows.pop(0)
        given = parse_unit(head[1].strip()) if len(head) > 1 else unit
        data = np.array([to_si(f"{float(row[0])!r} {given}", unit, name) for row in rows])
    except (ValueError, IndexError, UnitError):
        raise NetlistError(
            f"{name}: '{file.name}' has no column of numbers.", where=Source(str(file)),
            advice="One value a line, in SI units; a first line may have a title and, behind a comma, the unit.",
        ) from None  # fmt: skip
    if len(data) < 2 or np.ptp(data) == 0.0:
        raise ValueOutOfRange(f"{name}: '{file.name}' has no scatter.", where=Source(str(file)))
    data = np.sort(data)
    mean, sigma, low, high = map(float, (data.mean(), data.std(), data[0], data[-1]))
    return Scatter(name, unit, "data", nominal, mean, sigma, low, high, data)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
