"""Trajectories over time from any source: everything that can be read without equations."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from modelica_like import upper
from modelica_like.compile.compiled import Vector
from modelica_like.errors import NetlistError, UnknownName, ValueOutOfRange, did_you_mean, extra_module
from modelica_like.language.expr import Symbol
from modelica_like.language.mode import BoundMode
from modelica_like.language.units import parse_unit, to_si
from modelica_like.solve.initialize import Point
from modelica_like.solve.recorder import Ended, Event
from modelica_like.upper import Shown

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.figure import Figure

    from modelica_like.runs.energy import EnergyBalance
    from modelica_like.runs.trajectories import Trajectories


_SECOND = parse_unit("s")
ENERGY_TERMS = ("stored_energy", "loss_power", "source_power")


@dataclass(frozen=True)
class Statistics:
    """Statistics of a run.

    Attributes:
        steps: integrator steps.
        evaluations: evaluations of the equations.
        integrations: calls of the integrator (panels and event locations).
        events: mode changes.
        seconds: wall time of initialization and integration.
    """

    steps: int
    evaluations: int
    integrations: int
    events: int
    seconds: float


class Values(Mapping[str, float]):
    """All variables at one time, by path."""

    def __init__(self, trajectories: Trajectories) -> None:
        self.time = float(trajectories.time[0])
        self._one = trajectories

    def __getitem__(self, key: str | Any) -> float:
        return float(self._one[key][0])

    def __iter__(self) -> Iterator[str]:
        yield from self._one.names

    def __len__(self) -> int:
        return len(self._one.names)

    def __repr__(self) -> str:
        return f"<{len(self)} values at t = {self.time:g} s>"


class Trajectories(Shown, ABC):
    """Trajectories of all variables, in SI units: a `Solution`, or recorded data of an FMU or a table.

    Attributes:
        model: names, units and parameters.
        events: mode changes.
        statistics: of the run.
        notices: messages about the run.
        readings: numbers that were asked for before the run, by name.
        measured: whether they are a table, to be drawn as dots.
    """

    _ended: Ended | None = None

    model: Any
    events: tuple[Event, ...]
    statistics: Statistics
    notices: tuple[str, ...] = ()
    readings: Mapping[str, Any] = MappingProxyType({})
    measured: bool = False

    def __getattr__(self, name: str) -> Any:
        """Return a variable, or the variables of a part: `run.clutch.tau`."""
        if name.startswith("_") or "model" not in self.__dict__:
            raise AttributeError(f"'{type(self).__name__}' has no attribute '{name}'")
        return member(self, name)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *next_names(self.names, "")]

    def _ipython_key_completions_(self) -> list[str]:
        return list(self.names)

    @property
    def ended(self) -> Ended | None:
        """Where and why a component or an FMU has ended the run, or None."""
        return self._ended

    @property
    @abstractmethod
    def time(self) -> Vector:
        """Times of the results in s."""

    @abstractmethod
    def __getitem__(self, key: str | Any) -> Vector: ...

    @abstractmethod
    def __contains__(self, key: object) -> bool: ...

    @abstractmethod
    def at(self, t: float | str) -> Values:
        """Return all variables at a time."""

    @property
    @abstractmethod
    def final(self) -> Values:
        """All variables at the end."""

    @abstractmethod
    def energy(self) -> EnergyBalance:
        """Return the energy balance over the run."""

    def point(self, t: float | str) -> Point:
        """Return states, implicit unknowns and modes at a time.

        Raises:
            NetlistError: they are unknown, as in recorded data.
        """
        raise needs_equations(self)

    def path(self, key: Any) -> str:
        """Return the path of a variable given by its path, as `drive.clutch.tau` or `drive.clutch.mode`."""
        if isinstance(key, BoundMode):
            key = key.symbol
        if isinstance(key, Symbol):
            owner = key.owner.path
            name = f"{owner}.{key.name}" if owner else key.name
            return f"{'der(' * key.order}{name}{')' * key.order}"
        return str(key)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Paths of all variables, modes and discrete values that somebody has declared."""
        every = (*self.model.flat_variables, *self.model.flat_discretes)
        return tuple(variable.path for variable in every if not variable.hidden)

    def unit_of(self, name: str) -> str:
        """Return the coherent SI unit of a variable; that of a mode is `1`."""
        model = self.model
        if name in model.position:
            return str(model.flat_variables[model.position[name]].unit)
        return str(model.flat_discretes[model.discrete_position[name]].unit)

    def together(self, *keys: str | Any) -> dict[str, Vector]:
        """Return several trajectories by path, each of shape (len(time),).

        Raises:
            UnknownName: there is no such variable.
        """
        return {self.path(key): self[key] for key in keys}

    def read(self, *names: str) -> list[Any]:
        """Return numbers of the run: those asked for before it, others off the dense output that it has kept.

        Those of a measured table are those of straight lines between its rows.

        Raises:
            UnknownName: a reading is not known.
            MissingValue: its dense output was not kept, is not known, or a value waves too often for it.
        """
        from modelica_like.runs.results import read_after  # which has trajectories as results

        more = [name for name in names if name not in self.readings]
        values = {**self.readings, **(dict(zip(more, read_after(self, more), strict=True)) if more else {})}
        return [values[name] for name in names]

    def _within(self, time: float | str) -> float:
        """Return a time, a number in s or a quantity, that is within the run."""
        t = to_si(time, _SECOND, "t") if isinstance(time, str) else float(time)
        first, last = float(self.time[0]), float(self.time[-1])
        if not first <= t <= last:
            raise ValueOutOfRange(f"t = {t:g} s is not within the run, {first:g} s to {last:g} s.")
        return t

    def plot(self, *patterns: str, title: str = "", display: Mapping[str, str] | None = None) -> Figure:
        """Draw trajectories over time: a panel per quantity, modes as bands, events as numbers.

        Args:
            patterns: names, patterns (`*.w`) or formulas (`2*pi*motor.w`) of the curves; by default what one usually
                wants to see: speeds, positions, torques, forces, currents and powers of the parts.
            title: heading; by default the name of the model.
            display: units by path, pattern or quantity, in addition to those of the netlist, such as {"speed": "rpm"}.

        Raises:
            UnknownName: nothing matches a pattern.
            UnitError: a variable cannot be shown in a unit, or the units in a formula do not fit together.
        """
        return upper.plot(self, patterns, title=title, display=display)

    def to_pandas(self) -> pandas.DataFrame:
        """Return a table with time as index and one column per variable.

        Raises:
            MissingExtra: pandas is not installed.
        """
        pandas = extra_module("pandas", "data")
        return pandas.DataFrame(self.together(*self.names), index=pandas.Index(self.time, name="time"))

    def to_xarray(self) -> xarray.Dataset:
        """Return a dataset over time, with units and descriptions as attributes.

        Raises:
            MissingExtra: xarray is not installed.
        """
        info = {
            v.path: {"units": str(v.unit), "long_name": v.description}
            for v in (*self.model.flat_variables, *self.model.flat_discretes)
        }
        arrays = {name: ("time", values, info[name]) for name, values in self.together(*self.names).items()}
        time = {"time": ("time", self.time, {"units": "s"})}
        return extra_module("xarray", "data").Dataset(arrays, coords=time)


def needs_equations(run: Trajectories) -> NetlistError:
    """Return the error about trajectories in place of a drive with equations."""
    return NetlistError(
        f"{run.model.name}: this needs the drive with its equations, not trajectories.",
        advice="Give the netlist, the component or the compiled model.",
    )


def fitting(candidates: Sequence[str], patterns: Sequence[str], missing: str) -> list[str]:
    """Return the names that match patterns, a name itself before all; `missing` begins the message where none does.

    Raises:
        UnknownName: nothing matches a pattern.
    """
    names: dict[str, None] = {}
    every = set(candidates)
    for pattern in patterns:
        some = [pattern] if pattern in every else [name for name in candidates if fnmatchcase(name, pattern)]
        if not some:
            raise UnknownName(f"{missing} '{pattern}'{did_you_mean(pattern, candidates) or '.'}")
        names.update(dict.fromkeys(some))
    return list(names)


class Branch:
    """Variables of a run below a path.

    Args:
        run: the run.
        path: path of a part.
    """

    def __init__(self, run: Trajectories, path: str) -> None:
        self._run, self._path = run, path

    def __getattr__(self, name: str) -> Any:
        return member(self._run, f"{self._path}.{name}")

    def __dir__(self) -> list[str]:
        return next_names(self._run.names, f"{self._path}.")

    def __repr__(self) -> str:
        return f"<{self._path}: {', '.join(dir(self))}>"


def member(run: Trajectories, path: str) -> Any:
    """Return a variable, shape (n,), or what is below a part.

    Raises:
        AttributeError: there is no such path.
    """
    if path in run.names:
        return run[path]
    if next_names(run.names, f"{path}."):
        return Branch(run, path)
    before, dot, name = path.rpartition(".")
    near = did_you_mean(name, next_names(run.names, before + dot))
    raise AttributeError(f"The run of {run.model.name} has no '{path}'{near or '.'}")


def next_names(names: Iterable[str], before: str) -> list[str]:
    """Return the words that follow the beginning of a path, each once."""
    after = (name.removeprefix(before) for name in names if name.startswith(before))
    return [*dict.fromkeys(word for name in after if (word := name.partition(".")[0]).isidentifier())]
