"""Inputs over time: trajectories that drive the open inputs of a model."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, cast

import numpy as np

from modelica_like.errors import DuplicateName, LanguageError, UnknownName, ValueOutOfRange, did_you_mean
from modelica_like.language import Assembly, Component, Input, signal_out
from modelica_like.language.assembly import declare
from modelica_like.language.inside import inside
from modelica_like.language.units import ANY, parse_unit, to_si
from modelica_like.netlist.convert import as_assembly
from modelica_like.netlist.read import load
from modelica_like.netlist.registry import find_type
from modelica_like.runs.measured import read_columns, title_and_unit

_SECOND = parse_unit("s")
_PAIRS = (
    'Give pairs of time in s and value, arrays (times, values), {"time": …, "path": …}, a pandas table, or a CSV file.'
)
Columns = dict[str, tuple[Any, str]]


def driven(drive: Any, inputs: Any) -> Assembly:
    """Return a drive whose inputs follow trajectories: linear in between, before and beyond them the next value stays.

    Args:
        drive: a component or a netlist file with open inputs.
        inputs: by path a number, a quantity, pairs of time in s and value, two arrays (times, values), a pandas Series
            or an xarray DataArray over time; or a table with a column (or index) `time`: a dictionary, a pandas
            DataFrame, or the path of a CSV file. Names of columns may have a unit in brackets: `motor.tau [N.mm]`;
            without one values are in SI units.

    Raises:
        UnknownName: there is no such input.
        DuplicateName: one input is given two trajectories.
        LanguageError: it is connected already, or what is given is no trajectory.
        UnitError, ValueOutOfRange: values have another dimension or are not finite, or times do not rise.
    """
    if isinstance(drive, str | Path):
        drive = load(drive)
    if not isinstance(drive, Component):
        what = "What has been compiled keeps its inputs during a run."
        raise LanguageError(what, advice="Give inputs over time with the component, or with its netlist.")
    whole = drive.copy() if isinstance(drive, Assembly) else as_assembly(drive)
    for path, (times, values, unit) in _trajectories(inputs).items():
        _drive(whole, path, _rows(whole, path, times, values, unit))
    return whole


def _trajectories(inputs: Any) -> dict[str, tuple[Any, Any, str]]:
    """Return times, values and the unit of each input."""
    if isinstance(inputs, str | Path):
        return _of_table(dict(read_columns(Path(inputs))), f"'{Path(inputs).name}'")
    if hasattr(inputs, "columns"):  # a DataFrame
        columns: Columns = _by_name((title, np.asarray(inputs[title])) for title in inputs.columns)
        return _of_table(columns if "time" in columns else {"time": (np.asarray(inputs.index), ""), **columns}, "It")
    if not isinstance(inputs, Mapping):
        raise LanguageError(f"Something of type {type(inputs).__name__} is no trajectory of inputs.", advice=_PAIRS)
    given = _by_name(cast("Mapping[str, Any]", inputs).items())
    if "time" in given:
        return _of_table({name: (np.asarray(value), unit) for name, (value, unit) in given.items()}, "It")
    return {name: (*_series(name, value), unit or _unit_of(value)) for name, (value, unit) in given.items()}


def _by_name(given: Iterable[tuple[Any, Any]]) -> dict[str, tuple[Any, str]]:
    """Return values and units by name, of titles that may say a unit."""
    named: dict[str, tuple[Any, str]] = {}
    for title, value in given:
        name, unit = title_and_unit(str(title))
        if name in named:
            raise DuplicateName(f"Two trajectories are given for '{name}'.", advice="Leave one of them out.")
        named[name] = value, unit
    return named


def _unit_of(array: Any) -> str:
    """Return the unit that an xarray.DataArray says."""
    return str(getattr(array, "attrs", {}).get("units", ""))


def _of_table(columns: Columns, label: str) -> dict[str, tuple[Any, Any, str]]:
    if "time" not in columns:
        raise LanguageError(f"{label} has no column `time`.", advice=_PAIRS)
    times, unit = columns.pop("time")
    times = times if not unit else [to_si(f"{float(t)!r} {unit}", _SECOND, "time") for t in times]
    return {name: (times, values, unit) for name, (values, unit) in columns.items()}


def _series(name: str, value: Any) -> tuple[Any, Any]:
    """Split what one input is given into times and values."""
    if hasattr(value, "dims"):  # a DataArray over time
        times = value[value.dims[0]]
        unit = _unit_of(times) or "s"
        return [to_si(f"{float(t)!r} {unit}", _SECOND, "time") for t in times.to_numpy()], value.to_numpy()
    if hasattr(value, "index") and hasattr(value, "to_numpy"):  # a Series over time
        return np.asarray(value.index), np.asarray(value)
    if isinstance(value, tuple) and [hasattr(part, "dtype") for part in cast("tuple[Any, ...]", value)] == [True] * 2:
        return np.asarray(value[0]), np.asarray(value[1])
    if isinstance(value, int | float | str | np.number):
        return [0.0], [value]
    try:
        pairs: Any = np.asarray(value, float)
    except (TypeError, ValueError):
        pairs = np.empty(0)
    if pairs.ndim != 2 or pairs.shape[1] != 2 or not len(pairs):
        raise LanguageError(f"The input '{name}' is given no trajectory.", advice=_PAIRS)
    return pairs[:, 0], pairs[:, 1]


def _rows(drive: Assembly, path: str, times: Any, values: Any, unit: str) -> list[list[float]]:
    owner, _, name = path.rpartition(".")
    fields = drive.find(owner).fields if owner == "" or _has(drive, owner) else {}
    if not isinstance(fields.get(name), Input):
        paths = [f"{node.path}.{key}".lstrip(".") for node in drive.walk() for key, field in node.fields.items()
                 if isinstance(field, Input)]  # fmt: skip
        raise UnknownName(f"{drive.label} has no input '{path}'{did_you_mean(path, paths) or '.'}")
    si_unit = fields[name].unit
    try:
        moments = [float(t) for t in times]
    except (TypeError, ValueError):
        raise LanguageError(f"The times of '{path}' are no numbers in s.", advice=_PAIRS) from None
    if len(moments) != len(values) or not moments:
        raise ValueOutOfRange(f"The input '{path}' has {len(moments)} times and {len(values)} values.")
    if not np.all(np.diff(moments) > 0) or not np.all(np.isfinite(moments)):
        raise ValueOutOfRange(
            f"The times of the input '{path}' do not rise.", advice="For a jump, write two times close to each other."
        )
    plain = [value.item() if isinstance(value, np.generic) else value for value in values]
    numbers = [to_si(f"{float(value)!r} {unit}" if unit else value, si_unit, path) for value in plain]
    return [list(row) for row in zip(moments, numbers, strict=True)]


def _has(drive: Assembly, path: str) -> bool:
    try:
        drive.find(path)
    except UnknownName:
        return False
    return True


def _drive(drive: Assembly, path: str, rows: list[list[float]]) -> None:
    """Connect an input with a table over time; an exposed one inside."""
    inner = dict(drive.exposed).get(path, path)
    owner, _, name = inner.rpartition(".")
    part = drive.find(owner)
    own = not owner and path in inside(drive).own_fields  # its equations use it: a signal takes its place
    if not (owner or own) or any(inner in ends or path in ends for ends in drive.wires.values()):
        raise LanguageError(
            f"The input '{path}' is connected already.", advice="Inputs over time are for open inputs of parts."
        )
    inside(part).values.pop(name, None)  # the trajectory replaces the value
    field, unit = part.fields[name], part.fields[name].unit
    scale = 1.0 if unit == ANY or str(unit) == "1" else f"1 {unit}"
    label = f"{inner}_over_time".translate(str.maketrans(".[", "__", "]"))
    setattr(drive, label, find_type("Table")(table=rows, scale=scale))
    inside(drive).exposed = tuple(pair for pair in drive.exposed if pair[0] != path)
    inside(drive).own_fields = {key: field for key, field in inside(drive).own_fields.items() if key != path}
    if own:
        declare(drive, name, signal_out(field.unit_text, field.description))
    inside(drive).wires = {**drive.wires, label: (f"{label}.y", inner)}
