"""Deviations between two solutions of one system, signal by signal and event by event."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from modelica_like.compile.compiled import Vector
from modelica_like.errors import UnitError, UnknownName, ValueOutOfRange
from modelica_like.language.units import parse_unit, same_dimension
from modelica_like.runs.display import Display
from modelica_like.runs.trajectories import Trajectories, fitting
from modelica_like.solve.recorder import Event
from modelica_like.style import COLOURS, picture, text_width, with_unit
from modelica_like.upper import Shown

if TYPE_CHECKING:
    from matplotlib.figure import Figure


_Rows = np.ndarray[Any, np.dtype[np.intp]]
_Marks = np.ndarray[Any, np.dtype[np.bool_]]

_MOST_CURVES = 4
_SAME_TIME = 1e-9
_SAME_START = 1e-6
"""Of the range: start values are solved to 1e-10, but tables have six digits."""
_AT_ONCE = 2**22
"""Numbers of a run that are read together."""
_SAME_INSTANT = 1e-8
"""Time within which a mode that is left again counts as transient."""


@dataclass(frozen=True)
class Deviation:
    """Deviation of one signal.

    Attributes:
        signal: name.
        unit: of `largest`.
        largest: largest difference.
        relative: the same over the signal's range in the first of the two.
        time: of the largest difference, in s.
    """

    signal: str
    unit: str
    largest: float
    relative: float
    time: float


@dataclass(frozen=True)
class StartDifference:
    """A variable with two start values: `first` and `second`, in `unit`."""

    signal: str
    unit: str
    first: float
    second: float


@dataclass(frozen=True)
class EventDifference:
    """A mode change that both have, or only one of them.

    Attributes:
        mode: path of the mode.
        after: name of the last mode entered at that instant.
        first: its time in the first of the two, in s, or None.
        second: the same for the second.
    """

    mode: str
    after: str
    first: float | None
    second: float | None

    @property
    def difference(self) -> float | None:
        """Second time minus first, in s."""
        return None if self.first is None or self.second is None else self.second - self.first


@dataclass(frozen=True)
class Curves(Shown):
    """Two trajectories, signal by signal and event by event.

    Attributes:
        first: one of them.
        second: the other.
        deviations: largest first.
        events: by time.
        labels: names of the two: their files, or their models.
        interpolated: whether the result times differ and the second is interpolated, which costs precision.
        unlike: signals that are not compared, with their two units: their numbers do not mean the same.
    """

    first: Trajectories
    second: Trajectories
    deviations: tuple[Deviation, ...]
    events: tuple[EventDifference, ...]
    labels: tuple[str, str]
    interpolated: bool
    unlike: tuple[tuple[str, str, str], ...] = ()

    @property
    def largest(self) -> float:
        """Largest deviation of all signals, relative to their ranges."""
        return max((deviation.relative for deviation in self.deviations), default=0.0)

    @property
    def largest_event_difference(self) -> float:
        """Largest difference of the times of an event, in s; infinite if an event is missing in one of them."""
        return max((abs(e.difference) if e.difference is not None else np.inf for e in self.events), default=0.0)

    @property
    def starts(self) -> tuple[StartDifference, ...]:
        """Start values that differ, of states where the first has equations; none if the two begin at other times."""
        if abs(self.first.time[0] - self.second.time[0]) > _SAME_TIME:
            return ()
        states = set(getattr(self.first.model, "states", ()))
        rows = [row for row in self.deviations if row.relative and (row.signal in states or not states)]
        names = [row.signal for row in rows]
        ours, theirs = (run.together(*names) for run in (self.first, self.second))
        # After the events at the start: what writes a table may leave out the values before.
        k, n = (int(np.searchsorted(run.time, run.time[0], "right")) - 1 for run in (self.first, self.second))
        differences = (
            StartDifference(r.signal, r.unit, float(ours[r.signal][k]), float(theirs[r.signal][n])) for r in rows
        )
        scales = (row.largest / row.relative for row in rows)
        return tuple(
            d for d, scale in zip(differences, scales, strict=True) if abs(d.second - d.first) > _SAME_START * scale
        )

    def __getitem__(self, signal: str) -> Deviation:
        return next(deviation for deviation in self.deviations if deviation.signal == signal)

    def difference(self, signal: str) -> tuple[Vector, Vector]:
        """Return the common times, and second minus first there."""
        grid = _Grid.of(self.first, self.second, self.events)
        return grid.times, _difference(self.second, self.first[signal], self.second[signal], grid)

    def plot(self, *patterns: str) -> Figure:
        """Draw signals of both in the units of the first's netlist, and below each the difference over its range.

        Args:
            patterns: of the signals; by default those that deviate most.

        Raises:
            UnknownName: nothing matches a pattern.
        """
        names = [row.signal for row in self.deviations]
        rest = 0 if patterns else len(names) - _MOST_CURVES
        names = fitting(names, patterns, "Neither has a signal") if patterns else names[:_MOST_CURVES]
        first, second, count, shown = self.first, self.second, len(names), Display(self.first.model)
        below = [[f"Not drawn: {rest} signals that deviate less."]] if rest > 0 else []
        title, ratios, height = " and ".join(self.labels), [2.0, 1.0] * count, 0.8 + 2.4 * count
        with picture(title, 2 * count, height, below=below, height_ratios=ratios) as (figure, rows):
            for name, upper, lower in zip(names, rows[::2], rows[1::2], strict=True):
                upper.plot(first.time, shown.values(name, first[name]), color=COLOURS[0], label=self.labels[0])
                upper.plot(second.time, shown.values(name, second[name]), "--", color=COLOURS[1], label=self.labels[1])
                label = with_unit(name, shown.of(name))
                upper.set_ylabel(label if text_width(label, 9.0) < 1.4 else label.replace(" in ", "\nin "))
                scale = self[name].largest / self[name].relative if self[name].relative else 1.0
                times, difference = self.difference(name)
                lower.plot(times, difference / scale, color="#444444", linewidth=1.0)
                lower.set_ylabel("difference\nover range", fontsize=7)
            rows[0].legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2)
            rows[-1].set_xlabel("time in s")
            figure.align_ylabels(rows)
        return figure


def compare_solutions(
    first: Trajectories, second: Trajectories, signals: Sequence[str], labels: tuple[str, str], least: float = 1e-6
) -> Curves:
    """Compare two solutions by the names of their signals.

    Around events only the smooth pieces are compared: between the two times of a mode change nothing is compared, and
    the difference of the times is reported instead.

    Args:
        first: one of them.
        second: the other.
        signals: names or patterns (`*.w`); empty: all continuous variables that both have.
        labels: names of the two.
        least: smallest range of a signal, over the largest value of its unit; see `ranges`.

    Raises:
        UnknownName: nothing matches a pattern, or they have no signal in common.
        ValueOutOfRange: they have no time in common.
        UnitError: no signal has the same unit in both.
    """
    if min(first.time[-1], second.time[-1]) <= max(first.time[0], second.time[0]):
        raise ValueOutOfRange(f"{' and '.join(labels)} have no time in common.")
    common = [name for name in first.names if name in first.model.position and name in second.model.position]
    if not common:
        raise UnknownName(
            f"{' and '.join(labels)} have no signal in common.",
            advice="Signals are compared by their names, such as clutch.tau.",
        )
    names = fitting(common, signals, "They have no common signal") or common
    unlike = tuple((name, *units) for name in names if not _alike(*(units := _units(name, first, second))))
    names = [name for name in names if name not in {name for name, *_ in unlike}]
    if not names:
        name, mine, other = unlike[0]
        raise UnitError(f"{name} is in {mine} in {labels[0]} and in {other} in {labels[1]}: this cannot be compared.")
    events = tuple(_match_events(first, second))
    grid = _Grid.of(first, second, events)
    if not len(grid.rows):
        raise ValueOutOfRange(
            f"No time of {labels[0]}, but those of events, lies within the times of {labels[1]}.",
            advice="Compare them the other way round.",
        )
    scales = ranges(first, names, least)
    both = zip(_each(first, names), _each(second, names), strict=True)
    deviations = [
        Deviation(name, first.unit_of(name), largest, largest / scales[name], time)
        for (name, mine), (_, other) in both
        for largest, time in [_largest(second, mine, other, grid)]
    ]
    ordered = tuple(sorted(deviations, key=lambda deviation: -deviation.relative))
    return Curves(first, second, ordered, events, labels, grid.interpolated, unlike)


def _units(name: str, first: Trajectories, second: Trajectories) -> tuple[str, str]:
    return first.unit_of(name), second.unit_of(name)


def _alike(mine: str, other: str) -> bool:
    """Return whether numbers in both units mean the same; `1` may be a unit that was not said."""
    if mine == other or "1" in (mine, other):
        return True
    try:
        one, two = parse_unit(mine), parse_unit(other)
    except UnitError:  # a word of another tool
        return False
    return same_dimension(one, two) and (one.factor, one.offset) == (two.factor, two.offset)


def _instants(events: Sequence[Event], start: float, modes: set[str]) -> dict[str, list[tuple[float, str]]]:
    """Return time and last mode of every instant after the start, by mode."""
    by_mode: dict[str, list[tuple[float, str]]] = {}
    for event in events:
        if event.mode in modes and event.time > start + _SAME_INSTANT:
            instants = by_mode.setdefault(event.mode, [])
            if instants and event.time - instants[-1][0] < _SAME_INSTANT:
                instants.pop()
            instants.append((event.time, event.after))
    return by_mode


def _match_events(first: Trajectories, second: Trajectories) -> list[EventDifference]:
    """Pair the changes of each mode that both have, in their order."""
    modes = set(first.model.discrete_position) & set(second.model.discrete_position)
    ours, theirs = (_instants(run.events, float(run.time[0]), modes) for run in (first, second))
    differences: list[EventDifference] = []
    for mode in {**ours, **theirs}:
        left, right = list(ours.get(mode, ())), list(theirs.get(mode, ()))
        while left or right:
            if left and right and left[0][1] == right[0][1]:
                (t, after), (u, _) = left.pop(0), right.pop(0)
                differences.append(EventDifference(mode, after, t, u))
            elif left and (not right or left[0][0] <= right[0][0]):
                t, after = left.pop(0)
                differences.append(EventDifference(mode, after, t, None))
            else:
                u, after = right.pop(0)
                differences.append(EventDifference(mode, after, None, u))
    return sorted(differences, key=lambda event: min(t for t in (event.first, event.second) if t is not None))


@dataclass(frozen=True)
class _Grid:
    """Rows for the comparison of two solutions.

    Attributes:
        rows: of the first.
        times: of these rows.
        partners: rows of the second at the same times; unused if it is interpolated.
        interpolated: whether the second has no results at these times.
    """

    rows: _Rows
    times: Vector
    partners: _Rows
    interpolated: bool

    @classmethod
    def of(cls, first: Trajectories, second: Trajectories, events: Sequence[EventDifference]) -> _Grid:
        """Take the common times, or those of the first if there are few."""
        time, other = first.time, second.time
        once = np.flatnonzero(_single(time) & (time >= other[0]) & (time <= other[-1]))
        near = np.searchsorted(other, time[once] - _SAME_TIME)
        common = (other[near] <= time[once] + _SAME_TIME) & _single(other)[near]
        interpolated = bool(2 * np.count_nonzero(common) < min(len(once), np.count_nonzero(_single(other))))
        if not interpolated:
            once, near = once[common], near[common]
        clear = ~_between(time[once], events)
        return cls(once[clear], time[once][clear], near[clear], interpolated)


def _single(time: Vector) -> _Marks:
    """Return which times are single; a time of an event occurs twice."""
    apart = np.diff(time) > _SAME_TIME
    return np.append(apart, True) & np.insert(apart, 0, True)


def _between(times: Vector, events: Sequence[EventDifference]) -> _Marks:
    """Return which times are between the two times of a mode change."""
    inside = np.zeros(len(times), dtype=bool)
    for event in events:
        if event.first is not None and event.second is not None:
            low, high = sorted((event.first, event.second))
            inside |= (times >= low - _SAME_TIME) & (times <= high + _SAME_TIME)
    return inside


def _each(run: Trajectories, names: Sequence[str]) -> Iterator[tuple[str, Vector]]:
    """Yield trajectories, many of which are read together."""
    size = max(1, _AT_ONCE // len(run.time))
    for k in range(0, len(names), size):
        yield from run.together(*names[k : k + size]).items()


def _difference(second: Trajectories, mine: Vector, other: Vector, grid: _Grid) -> Vector:
    other = np.interp(grid.times, second.time, other) if grid.interpolated else other[grid.partners]
    return other - mine[grid.rows]


def _largest(second: Trajectories, mine: Vector, other: Vector, grid: _Grid) -> tuple[float, float]:
    """Return the largest difference, and its time in s."""
    difference = np.abs(_difference(second, mine, other, grid))
    difference = np.where(np.isnan(difference), np.inf, difference)
    k = int(np.argmax(difference))
    return float(difference[k]), float(grid.times[k])


_NOISE = 1e-6


def ranges(solution: Trajectories, names: Iterable[str], least: float = _NOISE) -> dict[str, float]:
    """Return the range of each signal, largest minus smallest value.

    The slip of a stuck clutch is rounding noise without a range. So the range is at least a share of the largest value
    among the signals of its unit.

    Args:
        solution: the run.
        names: signals.
        least: that share.
    """
    spans: dict[str, float] = {}
    largest: dict[str, float] = {}
    for name, values in _each(solution, [*names]):
        spans[name], unit = float(np.ptp(values)), solution.unit_of(name)
        largest[unit] = max(largest.get(unit, 0.0), float(np.abs(values).max()))
    return {name: max(span, least * largest[solution.unit_of(name)]) or 1.0 for name, span in spans.items()}
