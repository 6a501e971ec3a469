"""Parameter values of a sweep: full grids, Latin hypercubes, Sobol sequences."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from modelica_like.analyse.sweeps.ranges import MOST_RUNS, too_many
from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import LanguageError, ValueOutOfRange, extra_module
from modelica_like.language.units import Unit, to_si
from modelica_like.solve.initialize.slopes import columns_of


@dataclass(frozen=True, eq=False)
class Plan:
    """Points of a sweep.

    Attributes:
        names: paths of parameters and inputs.
        units: their coherent SI units.
        points: values in SI units, shape (runs, names).
        axes: values along each dimension of a full grid; None for samples.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    points: Any = field(repr=False)
    axes: tuple[Any, ...] | None = field(default=None, repr=False)

    def __len__(self) -> int:
        return len(self.points)

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the results: that of the grid, or (samples,)."""
        return tuple(len(axis) for axis in self.axes) if self.axes is not None else (len(self.points),)

    @property
    def dims(self) -> tuple[str, ...]:
        """Names of the dimensions of the results."""
        return self.names if self.axes is not None else ("sample",)


@dataclass(frozen=True)
class LatinHypercube:
    """Samples that fill every parameter's range evenly.

    Attributes:
        count: number of runs.
        seed: of the random numbers, to repeat a sweep.

    Raises:
        ValueOutOfRange: there is no run.
    """

    count: int
    seed: int = 0

    def __post_init__(self) -> None:
        if self.count < 1:
            raise ValueOutOfRange(f"{self.count} samples are too few: a sweep needs at least 1.")

    def unit_cube(self, dimensions: int) -> Any:
        """Return samples in [0, 1], shape (count, dimensions)."""
        return _qmc().LatinHypercube(dimensions, rng=self.seed).random(self.count)


class Sobol(LatinHypercube):
    """A scrambled Sobol sequence (I. M. Sobol, 1967): low discrepancy; a power of two runs keeps its balance."""

    def unit_cube(self, dimensions: int) -> Any:
        """Return samples in [0, 1], shape (count, dimensions)."""
        power = max(int(np.ceil(np.log2(max(self.count, 1)))), 0)
        return _qmc().Sobol(dimensions, rng=self.seed).random_base2(power)[: self.count]


@dataclass(frozen=True, eq=False)
class Samples:
    """Given samples.

    Attributes:
        cube: in [0, 1] between the bounds, shape (runs, parameters).
    """

    cube: Any = field(repr=False)

    def unit_cube(self, dimensions: int) -> Any:
        """Return them."""
        return np.asarray(self.cube, float).reshape(-1, dimensions)


Sampling = LatinHypercube | Samples


def make_plan(model: CompiledDae, over: Mapping[str, Iterable[Any]], sampling: Sampling | None) -> Plan:
    """Return the points of a sweep.

    Args:
        model: the compiled model.
        over: path of every parameter or input with its values; with a `sampling`, the lower and the upper bound.
        sampling: how to sample; by default the full grid.

    Raises:
        UnknownName: there is no such parameter or input.
        ValueOutOfRange: there are no values, not two bounds, or too many runs.
        UnitError: a value has the wrong unit.
    """
    if not over:
        raise ValueOutOfRange("A sweep needs at least one parameter.")
    units = {name: _unit(model, name) for name in over}
    values = {name: np.array([to_si(v, units[name], name) for v in given]) for name, given in over.items()}
    names, texts = tuple(values), tuple(str(unit) for unit in units.values())
    for name, numbers in values.items():
        if not len(numbers) or (sampling is not None and (len(numbers) != 2 or not numbers[0] < numbers[1])):
            needed = "a lower and an upper bound" if sampling is not None else "at least one value"
            raise ValueOutOfRange(f"{name}: a sweep needs {needed}, not {list(map(float, numbers))}.")
    if sampling is None:
        if math.prod(len(numbers) for numbers in values.values()) > MOST_RUNS:
            raise too_many(" × ".join(names))
        points = np.stack(np.meshgrid(*values.values(), indexing="ij"), axis=-1).reshape(-1, len(names))
        return Plan(names, texts, points, tuple(values.values()))
    low, high = np.array(list(values.values())).T
    return Plan(names, texts, low + (high - low) * sampling.unit_cube(len(names)))


def _unit(model: CompiledDae, name: str) -> Unit:
    if name in model.derived_position:
        raise LanguageError(f"{name} follows from other parameters.", advice="Vary those, or sweep the netlist itself.")
    columns_of(model, [name])
    return model.units[name]


def _qmc() -> Any:
    return extra_module("scipy.stats", "analyse").qmc
