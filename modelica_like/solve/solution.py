"""The result of a simulation."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.errors import UnknownName, ValueOutOfRange, did_you_mean, missing_extra
from modelica_like.initialize import Impact, Point
from modelica_like.language.expr import Symbol
from modelica_like.language.mode import BoundMode
from modelica_like.solve.energy import EnergyBalance, energy_balance
from modelica_like.solve.idas import Integrator
from modelica_like.solve.options import Options
from modelica_like.solve.rates import differentiated, rate_along
from modelica_like.solve.reading import TOGETHER, blocks, energy_term, variables
from modelica_like.solve.recorder import Event, Segment

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.figure import Figure

ENERGY_TERMS = ("stored_energy", "loss_power", "source_power")


@dataclass(frozen=True)
class Statistics:
    """What a run took.

    Attributes:
        steps: integrator steps.
        evaluations: evaluations of the equations.
        integrations: calls of the integrator (panels and event locations).
        events: mode changes.
        seconds: wall time of initialisation and integration.
    """

    steps: int
    evaluations: int
    integrations: int
    events: int
    seconds: float


class Values(Mapping[str, float]):
    """All variables at one instant, by path."""

    def __init__(
        self, solution: Solution, time: float, column: Vector, discrete: Vector, point: Point | None = None
    ) -> None:
        self.time = time
        self._point = point
        self._solution = solution
        self._column = column
        self._discrete = discrete

    def __getitem__(self, key: str | Any) -> float:
        path = self._solution.path(key)
        model = self._solution.model
        if path in model.position:
            return float(self._column[model.position[path]])
        if path in model.discrete_position:
            return float(self._discrete[model.discrete_position[path]])
        if self._point is not None and (name := differentiated(path)):
            now = self._point
            return float(rate_along(model, name, np.array([now.t]), *(v[:, None] for v in (now.x, now.z, now.d)))[0])
        owner, _, term = path.rpartition(".")
        if self._point is not None and term in ENERGY_TERMS and owner in model.components:
            terms = model.energy(self._point.t, self._point.x, self._point.z, model.p, model.u, self._point.d)
            return float(terms[model.components.index(owner), ENERGY_TERMS.index(term)])
        return float(self._solution[path][0])

    def __iter__(self) -> Iterator[str]:
        model = self._solution.model
        yield from model.position
        yield from model.discrete_position

    def __len__(self) -> int:
        return len(self._solution.model.flat_variables) + len(self._solution.model.flat_discretes)

    def __repr__(self) -> str:
        return f"<{len(self)} values at t = {self.time:g} s>"


@dataclass(eq=False)
class Solution:
    """Trajectories of all variables of the unreduced model, in SI units.

    Attributes:
        model: the compiled model with the parameter values of the run.
        options: the options of the run.
        segments: smooth pieces with fixed modes.
        events: mode changes.
        statistics: what the run took.
        impacts: what impacts have dissipated.
        notices: what should be known about the run, as sentences.
    """

    model: CompiledDae
    options: Options
    segments: tuple[Segment, ...]
    events: tuple[Event, ...]
    statistics: Statistics
    impacts: tuple[Impact, ...] = ()
    notices: tuple[str, ...] = ()
    _cache: dict[str, Any] = field(default_factory=dict, repr=False)

    @property
    def time(self) -> Vector:
        """Times of the results in s: a regular grid, and both sides of every event."""
        if "time" not in self._cache:
            self._cache["time"] = np.concatenate([s.times for s in self.segments])
        return self._cache["time"]

    def path(self, key: Any) -> str:
        """Return the path of a variable given by its path, as `drive.clutch.tau` or `drive.clutch.mode`."""
        if isinstance(key, BoundMode):
            key = key.symbol
        if isinstance(key, Symbol):
            owner = key.owner.path
            name = f"{owner}.{key.name}" if owner else key.name
            return f"{'der(' * key.order}{name}{')' * key.order}"
        return str(key)

    def __getitem__(self, key: str | Any) -> Vector:
        """Return a trajectory, shape (len(time),).

        Args:
            key: path of a variable, mode, discrete value, parameter, or of an energy term (`clutch.loss_power`), the
                time derivative of a variable (`der(load.w)`), or a component's attribute.

        Raises:
            UnknownName: there is no such variable.
        """
        path = self.path(key)
        if path == "time":
            return self.time
        model = self.model
        if path in model.position:
            row = model.position[path]
            return self._all()[row] if self._small else variables(model, self.segments, [row])[0]
        if path in model.discrete_position:
            row = model.discrete_position[path]
            return np.repeat([s.d[row] for s in self.segments], [len(s.times) for s in self.segments])
        if path in model.parameter_position:
            return np.full(len(self.time), model.p[model.parameter_position[path]])
        if path in model.derived_position:
            return np.full(len(self.time), float(model.derived(model.p)[model.derived_position[path]]))
        if name := differentiated(path):
            return np.concatenate([rate_along(model, name, *block) for block in blocks(self.segments)])
        owner, _, term = path.rpartition(".")
        if term in ENERGY_TERMS and owner in model.components:
            return energy_term(model, self.segments, model.components.index(owner), ENERGY_TERMS.index(term))
        known = [*model.position, *model.discrete_position, *model.parameter_position, *model.derived_position]
        raise UnknownName(f"{model.name} has no variable '{path}'{did_you_mean(path, known) or '.'}")

    def __contains__(self, key: object) -> bool:
        path = self.path(key)  # type: ignore[arg-type]
        model = self.model
        known = (model.position, model.discrete_position, model.parameter_position, model.derived_position)
        return any(path in one for one in known) or differentiated(path) in model.position

    @property
    def names(self) -> tuple[str, ...]:
        """Paths of all variables, modes and discrete values."""
        return (*self.model.position, *self.model.discrete_position)

    @property
    def _small(self) -> bool:
        return len(self.time) * len(self.model.flat_variables) <= TOGETHER

    def _all(self) -> Vector:
        if "variables" not in self._cache:
            self._cache["variables"] = variables(self.model, self.segments, None)
        return self._cache["variables"]

    def together(self, *keys: str | Any) -> dict[str, Vector]:
        """Return several trajectories by path; variables are evaluated together, which is faster than one by one.

        Raises:
            UnknownName: there is no such variable.
        """
        paths = [self.path(key) for key in keys]
        found = list(dict.fromkeys(path for path in paths if path in self.model.position and not self._small))
        rows = [self.model.position[path] for path in found]
        known = dict(zip(found, variables(self.model, self.segments, rows), strict=True)) if found else {}
        return {path: known[path] if path in known else self[path] for path in paths}

    def _check_within(self, t: float) -> None:
        first, last = float(self.time[0]), float(self.time[-1])
        if not first <= t <= last:
            raise ValueOutOfRange(f"t = {t:g} s is not within the run, {first:g} s to {last:g} s.")

    def at(self, t: float) -> Values:
        """Return all variables at a time, integrated there from the result before (right side of an event).

        Raises:
            ValueOutOfRange: the time is not within the run.
        """
        point = self.point(t)
        return self._values(point.t, point.x, point.z, point.d)

    def point(self, t: float) -> Point:
        """Return states, implicit unknowns and modes at a time, integrated there from the result before.

        Raises:
            ValueOutOfRange: the time is not within the run.
        """
        self._check_within(t)
        segment = next(s for s in reversed(self.segments) if s.times[0] <= t)
        k = int(np.searchsorted(segment.times, t, side="right")) - 1
        point = segment.point(k)
        if t > point.t:
            x, z = Integrator(self.model, self.options).run(point, t - point.t)
            point.t, point.x, point.z = t, x[:, 0], z[:, 0]
        return point

    @property
    def final(self) -> Values:
        """All variables at the end."""
        segment = self.segments[-1]
        return self._values(float(segment.times[-1]), segment.x[:, -1], segment.z[:, -1], segment.d)

    def _values(self, t: float, x: Vector, z: Vector, d: Vector) -> Values:
        column = np.array(self.model.variables(t, x, z, self.model.p, self.model.u, d)).ravel()
        return Values(self, t, column, d, Point(t, np.ravel(x), np.ravel(z), d))

    def energy(self) -> EnergyBalance:
        """Return the energy balance of every component over the run."""
        if "balance" not in self._cache:
            self._cache["balance"] = energy_balance(self.model, self.segments, self.options, self.events, self.impacts)
        return self._cache["balance"]

    def plot(self, *patterns: str, title: str = "") -> Figure:
        """Draw trajectories over time, one panel per unit, with events as dotted lines.

        Args:
            patterns: names or patterns (`*.w`) of what to draw; by default speeds, torques and forces of the parts.
            title: heading; by default the name of the model.

        Raises:
            UnknownName: nothing fits a pattern.
        """
        from modelica_like.solve.plot import plot

        return plot(self, patterns, title=title)

    def to_pandas(self) -> pandas.DataFrame:
        """Return a table with time as index and one column per variable.

        Raises:
            MissingExtra: pandas is not installed.
        """
        try:
            import pandas
        except ImportError:
            raise missing_extra("pandas", "data") from None
        columns = self.together(*self.names)
        return pandas.DataFrame(columns, index=pandas.Index(self.time, name="time"))

    def to_xarray(self) -> xarray.Dataset:
        """Return a dataset over time, with units and descriptions as attributes.

        Raises:
            MissingExtra: xarray is not installed.
        """
        try:
            import xarray
        except ImportError:
            raise missing_extra("xarray", "data") from None
        info = {
            v.path: {"units": str(v.unit), "long_name": v.description}
            for v in (*self.model.flat_variables, *self.model.flat_discretes)
        }
        arrays = {name: ("time", values, info[name]) for name, values in self.together(*self.names).items()}
        return xarray.Dataset(arrays, coords={"time": ("time", self.time, {"units": "s"})})

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_cache": {}}

    def __repr__(self) -> str:
        span = f"t = {self.time[0]:g} … {self.time[-1]:g} s"
        return (
            f"<Solution of {self.model.name}: {len(self.model.flat_variables)} variables, {span}, "
            f"{len(self.events)} mode changes, {self.statistics.steps} steps in {self.statistics.seconds * 1e3:.1f} ms>"
        )
