"""The result of a simulation."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.errors import UnknownName, ValueOutOfRange, did_you_mean
from modelica_like.language.transition import NAME_IN_NOTICE
from modelica_like.options import Options
from modelica_like.runs.energy import EnergyBalance, energy_balance
from modelica_like.runs.reading import TOGETHER, energy_term, rate_along, variables
from modelica_like.runs.trajectories import ENERGY_TERMS, Statistics, Trajectories, Values
from modelica_like.solve.dense import Dense
from modelica_like.solve.idas import Integrator
from modelica_like.solve.initialize import Impact, Point, StartKind
from modelica_like.solve.recorder import Ended, Event, Segment

_PAGE = 2**17
"""Numbers that are read at once where those of all variables are too many: to make a function takes as long."""


@dataclass(eq=False)
class Solution(Trajectories):
    """Trajectories of all variables of the unreduced model, in SI units.

    Attributes:
        model: the compiled model with the parameter values of the run.
        options: the options of the run.
        segments: smooth pieces with fixed modes.
        events: mode changes.
        statistics: of the run.
        impacts: losses in impacts.
        notices: messages about the run.
        start: kind of its start.
        dense: returns its dense output, or None if that was not kept.
    """

    model: CompiledDae
    options: Options
    segments: tuple[Segment, ...]
    events: tuple[Event, ...]
    statistics: Statistics
    impacts: tuple[Impact, ...] = ()
    notices: tuple[str, ...] = ()
    start: StartKind = "given"
    readings: Mapping[str, Any] = field(default_factory=dict, repr=False)
    dense: Callable[[], Dense] | None = field(default=None, repr=False)
    _balances: dict[tuple[float | str | None, float | str | None], EnergyBalance] = field(
        default_factory=dict, init=False, repr=False
    )
    _pages: dict[int, Vector] = field(default_factory=dict, init=False, repr=False)

    @property
    def time(self) -> Vector:
        """Times of the results in s: a regular grid, and both sides of every event."""
        return self._time

    @cached_property
    def _time(self) -> Vector:
        return np.concatenate([s.times for s in self.segments])

    @property
    def ended(self) -> Ended | None:
        """Where and why a component has ended the run, or None."""
        ends = (e for e in self.events if e.transition >= 0 and self.model.events.transitions[e.transition].ends)
        if (event := next(ends, None)) is None:
            return None
        component, dot, _ = event.mode.rpartition(".")
        text = self.model.events.transitions[event.transition].notice
        reason = NAME_IN_NOTICE.sub(lambda name: f"{self.final[component + dot + name[1]]:g}", text)
        return Ended(event.time, component or self.model.name, reason)

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
            return self._all[row] if self._small else self._page(row)
        if path in model.discrete_position:
            row = model.discrete_position[path]
            return np.repeat([s.d[row] for s in self.segments], [len(s.times) for s in self.segments])
        if path in model.parameter_position:
            return np.full(len(self.time), model.p[model.parameter_position[path]])
        if path in model.derived_position:
            return np.full(len(self.time), float(model.equations.derived(model.p)[model.derived_position[path]]))
        if name := differentiated(path):
            if name not in model.position:
                near = did_you_mean(name, list(model.position)) or "."
                raise UnknownName(f"{model.name} has no continuous variable '{name}'{near}")
            return rate_along(model, self.segments, model.position[name])
        owner, _, term = path.rpartition(".")
        if term in ENERGY_TERMS and owner in model.components:
            return energy_term(model, self.segments, model.components.index(owner), ENERGY_TERMS.index(term))
        names = [*model.position, *model.discrete_position, *model.parameter_position, *model.derived_position]
        raise UnknownName(f"{model.name} has no variable '{path}'{did_you_mean(path, names) or '.'}")

    def __contains__(self, key: object) -> bool:
        path = self.path(key)  # type: ignore[arg-type]
        model = self.model
        positions = (model.position, model.discrete_position, model.parameter_position, model.derived_position)
        return any(path in position for position in positions) or differentiated(path) in model.position

    @property
    def _small(self) -> bool:
        return len(self.time) * len(self.model.flat_variables) <= TOGETHER

    @cached_property
    def _all(self) -> Vector:
        return variables(self.model, self.segments, None)

    def _page(self, row: int) -> Vector:
        """Return one variable of a large run: it is read with its neighbours, which are often asked for next."""
        count, size = len(self.model.flat_variables), max(1, _PAGE // len(self.time))
        number, place = divmod(row, size)
        rows = range(number * size, min((number + 1) * size, count))
        if len(self.time) > _PAGE:
            return variables(self.model, self.segments, rows)[place]
        if number not in self._pages:
            for oldest in list(self._pages)[: max(0, len(self._pages) - TOGETHER // _PAGE + 1)]:
                del self._pages[oldest]
            self._pages[number] = variables(self.model, self.segments, rows)
        return self._pages[number][place]

    def together(self, *keys: str | Any) -> dict[str, Vector]:
        """Return several trajectories by path, each of shape (len(time),); faster than one by one.

        Raises:
            UnknownName: there is no such variable.
        """
        paths = [self.path(key) for key in keys]
        names = list(dict.fromkeys(path for path in paths if path in self.model.position and not self._small))
        rows = [self.model.position[path] for path in names]
        columns = dict(zip(names, variables(self.model, self.segments, rows), strict=True)) if names else {}
        return {path: columns[path] if path in columns else self[path] for path in paths}

    def at(self, t: float | str) -> Values:
        """Return all variables at a time, integrated from the result before (after an event at that time).

        Raises:
            ValueOutOfRange: the time is not within the run.
        """
        return self._values(self.point(t))

    def point(self, t: float | str) -> Point:
        """Return states, implicit unknowns and modes at a time, integrated from the result before.

        Raises:
            ValueOutOfRange: the time is not within the run.
        """
        t = self._within(t)
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
        return self._values(self.segments[-1].point(-1))

    def _values(self, now: Point) -> Values:
        segment = Segment(np.array([now.t]), now.x[:, None], now.z[:, None], now.d)
        return Values(replace(self, segments=(segment,)))

    def energy(self, begin: float | str | None = None, end: float | str | None = None) -> EnergyBalance:
        """Return the energy balance of every component over the run, or over a part of it.

        Args:
            begin: time, a number in s or a quantity; an event at that time counts.
            end: time, likewise; an event at that time does not count, unless the run ends there.

        Raises:
            ValueOutOfRange: a time is not within the run, or the end is not after the beginning.
            UnitError: a text is no time.
        """
        if (begin, end) not in self._balances:
            first, last = (self.time[k] if t is None else self._within(t) for k, t in ((0, begin), (-1, end)))
            if first >= last and (begin, end) != (None, None):
                raise ValueOutOfRange(f"The end of a balance, {last:g} s, is not after its beginning, {first:g} s.")
            segments = self.segments if (begin, end) == (None, None) else tuple(self._part(first, last))
            until = np.inf if last == self.time[-1] else last
            events = [event for event in self.events if first <= event.time < until]
            impacts = [impact for impact in self.impacts if first <= impact.time < until]
            dense = None if self.dense is None else self.dense()
            self._balances[begin, end] = energy_balance(self.model, segments, self.options, events, impacts, dense)
        return self._balances[begin, end]

    def _part(self, begin: float, end: float) -> Iterator[Segment]:
        """Yield the segments between two times."""
        edges = {t: self.point(t) for t in (begin, end)}
        for segment in self.segments:
            inside = (segment.times >= begin) & (segment.times <= end)
            cuts = [
                edges[t]
                for t in (begin, end)
                if segment.times[0] < t < segment.times[-1] and t not in segment.times[inside]
            ]
            times = np.concatenate([segment.times[inside], [cut.t for cut in cuts]])
            order = np.argsort(times, kind="stable")
            if len(order) > 1:
                x, z = (np.column_stack([getattr(segment, n)[:, inside], *(getattr(c, n) for c in cuts)]) for n in "xz")
                yield Segment(times[order], x[:, order], z[:, order], segment.d)

    def __getstate__(self) -> dict[str, Any]:
        return vars(replace(self, dense=None))

    def __repr__(self) -> str:
        span = f"t = {self.time[0]:g} … {self.time[-1]:g} s"
        return (
            f"<Solution of {self.model.name}: {len(self.model.flat_variables)} variables, {span}, "
            f"{len(self.events)} mode changes, {self.statistics.steps} steps in {self.statistics.seconds * 1e3:.1f} ms>"
        )


def differentiated(path: str) -> str:
    """Return the variable in `der(variable)`, or an empty text for other paths."""
    return path[4:-1].strip() if path.startswith("der(") and path.endswith(")") else ""
