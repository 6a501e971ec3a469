"""Measurements for a calibration: operating points, trajectories, single numbers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from modelica_like.analyse.operating.steady import OperatingPoint, steady, steady_slopes
from modelica_like.analyse.sensitivity.derivatives import sensitivities
from modelica_like.arguments import checked_fields
from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import DuplicateName, UnknownName, ValueOutOfRange, did_you_mean
from modelica_like.language.units import Unit, parse_unit, to_si
from modelica_like.runs.measured import read_columns, title_and_unit
from modelica_like.runs.readings import read_output
from modelica_like.simulation import quick_run

_SECOND = parse_unit("s")
Matrix = np.ndarray[Any, np.dtype[np.float64]]


Residuals = tuple[Matrix, Matrix, list[str]]
"""Deviations over uncertainties, shape (numbers,), their derivatives by parameters in SI units, and their labels."""


class Measurement(ABC):
    """Data for a comparison with a model."""

    @abstractmethod
    def check(self, names: Sequence[str]) -> None:
        """Refuse what contradicts itself, before the first run of a search for the parameters `names`.

        Raises:
            UnknownName, ValueOutOfRange: a name fits nothing, or the measurement sets what is to be found.
        """

    @abstractmethod
    def residuals(self, model: CompiledDae, names: Sequence[str]) -> Residuals:
        """Compare a model that has the values under test, and differentiate by the parameters `names`."""


@checked_fields
@dataclass(frozen=True)
class Numbers(Measurement):
    """Numbers read off one run, such as a lock-up time.

    Attributes:
        values: by output, as `sensitivities` names it: numbers in SI units or quantities.
        uncertainty: by output, in the same units; by default a hundredth of the value.
        until: end of the run; by default that of the netlist.
        parameters: values of this run.
    """

    values: Mapping[str, Any]
    uncertainty: Mapping[str, Any] = field(default_factory=dict)
    until: float | str | None = None
    parameters: Mapping[str, Any] = field(default_factory=dict)

    def check(self, names: Sequence[str]) -> None:
        """Refuse uncertainties of what is not measured, and parameters that are to be found."""
        _check(names, self.parameters, self.values, self.uncertainty)

    def residuals(self, model: CompiledDae, names: Sequence[str]) -> Residuals:
        """Run the model with its sensitivities."""
        outputs = [read_output(model, name) for name in self.values]
        wanted = np.array([to_si(v, o.unit, o.name) for v, o in zip(self.values.values(), outputs, strict=True)])
        named = zip(self.values, outputs, wanted, strict=True)
        sizes = np.array([_uncertainty(self.uncertainty, name, output.unit, value) for name, output, value in named])
        run = quick_run(model, until=self.until, parameters=self.parameters, readings=[*self.values])
        sensitivity = sensitivities(run, list(self.values), names)
        now = np.array([output.value for output in sensitivity.outputs])
        return (now - wanted) / sizes, sensitivity.derivatives / sizes[:, None], list(self.values)


@checked_fields
@dataclass(frozen=True)
class OperatingPoints(Measurement):
    """Steady states: a table whose rows set some parameters and measure some variables.

    Attributes:
        table: columns by name, or a CSV file, a pandas DataFrame or an xarray Dataset with such columns; a name may
            carry its unit in brackets: `motor.w [rpm]`.
        given: columns that are set: paths of parameters or inputs. All others are measured variables.
        uncertainty: by variable, numbers in SI units or quantities; by default a hundredth of the largest value.
    """

    table: Any
    given: Sequence[str]
    uncertainty: Mapping[str, Any] = field(default_factory=dict)

    def check(self, names: Sequence[str]) -> None:
        """Refuse columns that are not there, and given ones that are to be found."""
        columns = read_table(self.table)
        for name in self.given:
            if name not in columns:
                raise UnknownName(f"The table of operating points has no column '{name}'{_hint(name, columns)}")
        _check(names, self.given, [name for name in columns if name not in self.given], self.uncertainty)

    def residuals(self, model: CompiledDae, names: Sequence[str]) -> Residuals:
        """Find the steady state of every row, each starting from the one before."""
        columns = _in_si(model, read_table(self.table))
        measured = [name for name in columns if name not in self.given]
        sizes = np.array([_of_column(model, self.uncertainty, name, columns[name]) for name in measured])
        near: OperatingPoint | None = None
        deviations: list[Matrix] = []
        slopes: list[Matrix] = []
        rows = range(len(next(iter(columns.values()))))
        for row in rows:
            near = steady(model, parameters={name: columns[name][row] for name in self.given}, near=near)
            deviations.append(np.array([near[name] - columns[name][row] for name in measured]) / sizes)
            slopes.append(steady_slopes(near.model, near.point, measured, names) / sizes[:, None])
        labels = [f"{name} in row {row + 1}" for row in rows for name in measured]
        return np.concatenate(deviations), np.concatenate(slopes), labels


@checked_fields
@dataclass(frozen=True)
class Trajectories(Measurement):
    """Measured curves over time.

    Attributes:
        table: a column `time` and columns of variables, as in `OperatingPoints`.
        uncertainty: by variable; by default a hundredth of the largest value.
        parameters: values of this run.
    """

    table: Any
    uncertainty: Mapping[str, Any] = field(default_factory=dict)
    parameters: Mapping[str, Any] = field(default_factory=dict)

    def check(self, names: Sequence[str]) -> None:
        """Refuse a table without times, uncertainties of what is not measured, and parameters that are to be found."""
        columns = read_table(self.table)
        if "time" not in columns:
            raise UnknownName("Measured trajectories need a column 'time'.")
        _check(names, self.parameters, [name for name in columns if name != "time"], self.uncertainty)

    def residuals(self, model: CompiledDae, names: Sequence[str]) -> Residuals:
        """Run the model with the sensitivities of every number."""
        table = read_table(self.table)
        columns = _in_si(model, table)
        times = columns.pop("time")
        sizes = [_of_column(model, self.uncertainty, name, columns[name]) for name in columns]
        run = quick_run(model, until=float(times.max()), parameters=self.parameters)
        wanted = [f"at({name}, {float(t)!r})" for name in columns for t in times]
        sensitivity = sensitivities(run, wanted, names)
        scale = np.repeat(sizes, len(times))
        deviations = np.array([output.value for output in sensitivity.outputs]) - np.concatenate(list(columns.values()))
        shown, unit = table["time"]
        labels = [f"{name} at {t:g} {unit or 's'}" for name in columns for t in shown]
        return deviations / scale, sensitivity.derivatives / scale[:, None], labels


Columns = dict[str, tuple[Any, str]]
"""Columns by name: numbers and their unit (empty: SI)."""


def read_table(table: Any) -> Columns:
    """Read columns with units from a mapping, a CSV file, a DataFrame or a Dataset.

    Raises:
        NetlistError: a file is not a table of numbers.
        DuplicateName: two columns have one name.
        ValueOutOfRange: columns are no numbers, differ in length, or there are none.
    """
    if isinstance(table, str | Path):
        return dict(read_columns(Path(table)))
    columns: Columns = {}
    for title in getattr(table, "variables", None) or table:
        name, unit = title_and_unit(str(title))
        if name in columns:
            raise DuplicateName(f"Two columns are called '{name}'.", advice="Rename one of them.")
        values = table[title]
        try:
            numbers = np.atleast_1d(np.asarray(values, float))
        except (TypeError, ValueError):
            numbers = np.empty((0, 0))
        if numbers.ndim != 1:
            raise ValueOutOfRange(f"The column '{title}' is no list of numbers.")
        columns[name] = numbers, unit or getattr(values, "attrs", {}).get("units", "")
    lengths = {len(values) for values, _ in columns.values()}
    if len(lengths) != 1 or 0 in lengths:
        raise ValueOutOfRange("Measured columns must have the same length, and at least one row.")
    return columns


def _in_si(model: CompiledDae, columns: Columns) -> dict[str, Matrix]:
    values: dict[str, Matrix] = {}
    for name, (numbers, unit) in columns.items():
        si_unit = _SECOND if name == "time" else _unit(model, name)
        if not np.isfinite(numbers).all():
            row = int(np.argmin(np.isfinite(numbers))) + 1
            advice = "Leave the row out; variables with gaps at other times are measurements of their own."
            raise ValueOutOfRange(f"{name} in row {row} is {numbers[row - 1]:g}, no finite number.", advice=advice)
        values[name] = np.array(
            [to_si(f"{n!r} {unit}" if unit else float(n), si_unit, name) for n in map(float, numbers)]
        )
    return values


def _unit(model: CompiledDae, name: str) -> Unit:
    if name not in model.units:
        raise UnknownName(f"{model.name} has no variable or parameter '{name}'{_hint(name, model.units)}")
    return model.units[name]


def _hint(name: str, known: Iterable[str]) -> str:
    return did_you_mean(name, known) or "."


def _check(names: Sequence[str], given: Iterable[str], measured: Collection[str], stated: Iterable[str]) -> None:
    """Check what a measurement sets, measures and states uncertainties of."""
    if not measured:
        raise ValueOutOfRange("A measurement has nothing that is measured.")
    for name in given:
        if name in names:
            raise ValueOutOfRange(
                f"{name} is to be found, and a measurement sets it.", advice="Leave it out at one of the two places."
            )
    for name in stated:
        if name not in measured:
            raise UnknownName(f"The uncertainty of '{name}' belongs to nothing measured{_hint(name, measured)}")


def _of_column(model: CompiledDae, stated: Mapping[str, Any], name: str, values: Matrix) -> float:
    return _uncertainty(stated, name, _unit(model, name), float(np.abs(values).max()))


def _uncertainty(stated: Mapping[str, Any], name: str, unit: Unit, value: float) -> float:
    size = to_si(stated[name], unit, name, difference=True) if name in stated else 0.01 * abs(value)
    if not size > 0:
        raise ValueOutOfRange(
            f"{name}: the uncertainty of a measurement must be positive, not {size:g}.",
            advice=f'State it, e.g. uncertainty={{"{name}": …}}.',
        )
    return size
