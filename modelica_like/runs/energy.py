"""Energy balance: power in = change of stored energy + losses, for every component."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from modelica_like import upper
from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.errors import UnknownName, did_you_mean
from modelica_like.options import Options
from modelica_like.runs.polynomials import NODES
from modelica_like.runs.powers import POWERS, Powers, Results, results
from modelica_like.runs.windows import cut_segments
from modelica_like.solve.dense import Dense
from modelica_like.solve.initialize import INSTANT, Impact, Point, call, solve_implicit
from modelica_like.solve.recorder import Event, Segment
from modelica_like.upper import Shown

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_ROUNDING = 1e-9
"""Part of a component's largest power that counts as rounding in a difference of powers."""
_NOTHING = 1e-12
"""Part of the model's largest power that counts as rounding."""
_LAST_DIGITS = 1e-14
"""By what part numbers are changed to see what is rounding, ..."""
_CHANGES = 6
"""... and how often: that rounding has the same sign and size each time would be a rare accident."""
_SAME_TIME = 1e-12
_ADDED_UP = 10.0
"""Smallest reported drift, in relative tolerances of the run."""


@dataclass(frozen=True)
class EnergyRow:
    """Energies of one component over a run, in J.

    Attributes:
        component: path; empty for the model itself.
        inflow: through its connectors.
        source: supplied from outside the model.
        stored: change of its stored energy.
        lost: dissipated.
        at_events: part of `stored` that changed by resets at events.
        residual: integral of power in + source power - loss - rate of the stored energy; zero if the component's
            equations keep the balance, whatever the precision of the integration.
        drift: change of the stored energy minus the integral of its rate: the integration error.
        impact: part of `lost` that was lost in impacts.
        imbalance: largest |power in + source power - loss - rate of the stored energy| at any result, both sides of
            events included, as a fraction of the component's largest power; zero if it is rounding.
        imbalance_time: its time, in s.
        gain: largest power of a negative loss, in W; zero if it is rounding.
        gain_time: its time, in s.
    """

    component: str
    inflow: float
    source: float
    stored: float
    lost: float
    at_events: float
    residual: float
    drift: float
    impact: float = 0.0
    imbalance: float = 0.0
    imbalance_time: float = 0.0
    gain: float = 0.0
    gain_time: float = 0.0


@dataclass(frozen=True)
class EnergyBalance(Shown):
    """Energy balance of a run, component by component.

    Attributes:
        rows: one per component.
        throughput: largest of the energies exchanged, supplied, dissipated and stored.
        at_events: largest change of all stored energies together at an event, in J, without an impact or a
            reset.
        tolerance: relative tolerance of the run; 0 if it has none.
    """

    rows: tuple[EnergyRow, ...]
    throughput: float
    at_events: float = 0.0
    tolerance: float = 0.0

    def __getitem__(self, component: str) -> EnergyRow:
        """Return the energies of a component.

        Raises:
            UnknownName: there is no such component.
        """
        rows = {row.component: row for row in self.rows}
        if component not in rows:
            near = did_you_mean(component, rows) or "."
            raise UnknownName(f"The energy balance has no component '{component}'{near}")
        return rows[component]

    def __iter__(self) -> Iterator[EnergyRow]:
        return iter(self.rows)

    @property
    def source(self) -> float:
        """Energy supplied from outside, J."""
        return sum(row.source for row in self.rows)

    @property
    def stored(self) -> float:
        """Change of the stored energy, J."""
        return sum(row.stored for row in self.rows)

    @property
    def lost(self) -> float:
        """Dissipated energy, J."""
        return sum(row.lost for row in self.rows)

    @property
    def delivered(self) -> float:
        """Energy that loads took away, J."""
        return -sum(row.source for row in self.rows if row.source < 0)

    @property
    def supply(self) -> float:
        """Energy from sources and stores, component by component, J."""
        return sum(max(row.source, 0.0) + max(-row.stored, 0.0) for row in self.rows)

    @property
    def efficiency(self) -> float:
        """Energy that loads took away over energy from sources and stores; nan without any."""
        given = sum(max(row.source, 0.0) for row in self.rows) + max(-self.stored, 0.0)
        return self.delivered / given if given else float("nan")

    def sankey(self, title: str = "") -> Figure:
        """Draw an energy flow diagram."""
        return upper.sankey(self, title)

    @property
    def closure(self) -> float:
        """How well the balance closes, relative to the throughput: the worse of `power_closure` and `drift`."""
        return max(self.power_closure, self.drift)

    @property
    def power_closure(self) -> float:
        """Largest residual of a component, and of all connections together, relative to the throughput.

        It judges the equations of components, whatever the precision of the integration.
        """
        open_ends = [*(row.residual for row in self.rows), sum(row.inflow for row in self.rows)]
        return _largest(open_ends) / (self.throughput or 1.0) if np.isfinite(self.throughput) else np.inf

    @property
    def imbalance(self) -> float:
        """Largest imbalance of a component at any result, as a fraction of its largest power."""
        return max((row.imbalance for row in self.rows), default=0.0)

    @property
    def notices(self) -> tuple[str, ...]:
        """Messages about errors: powers that do not balance, negative losses, energies that drift."""
        notes: list[str] = []
        for row in self.rows:
            name = row.component or "The model itself"
            if not np.isfinite([row.inflow, row.source, row.stored, row.lost]).all():
                notes.append(f"{name} has energies that are not finite numbers: there is no balance.")
            if row.imbalance:
                notes.append(
                    f"{name} does not balance at {row.imbalance_time:.9g} s: power in, source, loss and rate of the "
                    f"stored energy differ by {row.imbalance:.2g} of its largest power."
                )
            if row.gain:
                notes.append(f"{name} has a negative loss, {-row.gain:.6g} W at {row.gain_time:.9g} s.")
        if self.at_events > _ROUNDING * self.throughput:
            notes.append(f"At an event {self.at_events:.6g} J appear or vanish without an impact or a reset.")
        if self.tolerance and _ADDED_UP * self.tolerance < self.drift < np.inf:
            worst = max(self.rows, key=lambda row: abs(row.drift))
            notes.append(
                f"The stored energy of {worst.component or 'the model itself'} drifts by {worst.drift:.2g} J, "
                f"{self.drift / self.tolerance:.2g} times the run's relative tolerance: errors of the integrator's "
                f"steps add up. Smaller tolerances (rtol, atol) lower them."
            )
        return tuple(notes)

    @property
    def drift(self) -> float:
        """Largest integration error of a stored energy, relative to the throughput."""
        drifts = _largest(row.drift for row in self.rows)
        return drifts / (self.throughput or 1.0) if np.isfinite(self.throughput) else np.inf

    def __str__(self) -> str:
        width = max([len("component"), *(len(row.component) for row in self.rows)])
        head = f"{'component':{width}}  {'in / J':>12}  {'source / J':>12}  {'stored / J':>12}  {'lost / J':>12}"
        lines = [
            f"{row.component:{width}}  {row.inflow:12.6g}  {row.source:12.6g}  {row.stored:12.6g}  {row.lost:12.6g}"
            for row in self.rows
            if any((row.inflow, row.source, row.stored, row.lost))
        ]
        total = f"{'total':{width}}  {'':12}  {self.source:12.6g}  {self.stored:12.6g}  {self.lost:12.6g}"
        closes = f"closes to {self.closure:.1e} of {self.throughput:.6g} J (powers to {self.power_closure:.1e})"
        return "\n".join([head, *lines, total, *self.impacts, closes, *self.notices])

    @property
    def impacts(self) -> tuple[str, ...]:
        """Messages about losses in impacts."""
        return tuple(
            f"{row.component or 'The model itself'} lost {row.impact:.6g} J in impacts."
            for row in self.rows
            if row.impact
        )


@np.errstate(over="ignore", invalid="ignore")  # what is not finite gets a notice
def energy_balance(
    model: CompiledDae,
    segments: tuple[Segment, ...],
    options: Options | None = None,
    events: Sequence[Event] = (),
    impacts: Sequence[Impact] = (),
    dense: Dense | None = None,
) -> EnergyBalance:
    """Integrate the energy terms of every component along a run.

    It is a quadrature over the results of the run; where they are too coarse, over more points of its dense output, or,
    without that, of IDAS, which integrates again. If this fails, the coarser value is kept: there is always a balance.

    Args:
        model: the compiled model.
        segments: smooth pieces of the run.
        options: of the run; the integrals are as precise as its relative tolerance.
        events: mode changes; their resets may change stored energies.
        impacts: losses of components at events.
        dense: dense output of the run, if that was kept.
    """
    count = len(model.components)
    audit, totals = _Audit(count), np.zeros((POWERS, count))
    options = options or Options()
    powers = Powers(model, options, sum(len(segment.times) for segment in segments), dense)
    if dense is not None:
        segments = cut_segments(model, segments, dense, NODES)
    for some in results(model, segments):
        totals += powers.integrals(some)
        audit.see(some)
    lost, source, inflow, rate = totals
    starts, ends = (np.concatenate(parts, axis=1) for parts in (audit.starts, audit.ends))
    struck, given, at_start = _impacts(model, impacts, float(audit.times[0][0]), starts[:, 0])
    impact, work = struck.sum(axis=0), given.sum(axis=0)
    jumps = np.column_stack([at_start, starts[:, 1:] - ends[:, :-1]])
    change, at_once = ends[:, -1] - starts[:, 0] + at_start, np.sum(jumps, axis=1)
    columns = (
        inflow, source + work, change, lost + impact, at_once, inflow + source - lost - rate, change - at_once - rate,
        impact, *audit.found(model),
    )  # fmt: skip
    rows = tuple(map(EnergyRow, model.components, *(column.tolist() for column in columns)))
    exchanged = (inflow, source + work, lost + impact)
    throughput = max([powers.stored, powers.cancelled, *(float(np.sum(np.abs(part))) for part in exchanged)])
    # Which `when` came true is not written down: where one sets states, any relation may have been its own.
    sets_states = any(row.reset.kind != "discrete" for row in model.events.update_rows)
    relations = {k for k, discrete in enumerate(model.flat_discretes) if sets_states and discrete.hidden}
    resets = {n for n, one in enumerate(model.events.transitions) if one.resets or one.mode in relations}
    reset = [event.time for event in events if event.transition in resets]
    unexplained = [(hit.time, hit.energy - float(np.sum(work))) for hit, work in zip(impacts, given, strict=True)]
    at_events = _unexplained(np.concatenate(audit.times), np.sum(jumps, axis=0), reset, unexplained)
    return EnergyBalance(rows, throughput, at_events, options.rtol)


def _largest(values: Iterable[float]) -> float:
    """Return the largest amount, infinite if one is not a number."""
    return float(np.max(np.nan_to_num(np.abs([*values]), nan=np.inf), initial=0.0))


class _Audit:
    """The largest imbalance of each component and its largest negative loss, with their times.

    It also has the stored energies at both ends of smooth pieces, and their start times.
    """

    def __init__(self, count: int) -> None:
        self.times: list[Vector] = []
        self.starts: list[Vector] = []
        self.ends: list[Vector] = []
        self._largest = np.zeros(count)
        self._worst = np.zeros((2, count))
        self._when = np.zeros((2, count))
        self._points: dict[int, Point] = {}

    def see(self, some: Results) -> None:
        """Audit some results of the run."""
        stored, lost, source, inflow, rate, _ = some.terms
        places = np.arange(len(some.times))
        starts = places == some.first
        self.times.append(some.times[starts])
        self.starts.append(stored[:, starts])
        self.ends.append(stored[:, places == some.last])
        self._largest = np.maximum(self._largest, np.abs(some.terms[1:]).max(axis=2).max(axis=0))
        for k, values in enumerate((np.abs(inflow + source - lost - rate), -lost)):
            worst = np.max(values, axis=1)
            later = worst > self._worst[k]
            self._when[k, later] = some.times[np.argmax(values[later], axis=1)]
            self._worst[k, later] = worst[later]
            if k == 0:
                at = np.argmax(values, axis=1)
                self._points |= {int(n): some.point(int(at[n])) for n in np.flatnonzero(later & self._counts()[0])}

    def _counts(self) -> Any:
        """Return which imbalances and negative losses are no rounding of the component's own powers."""
        floor = _NOTHING * np.max(self._largest, initial=0.0)
        return self._worst > np.maximum(_ROUNDING * self._largest, floor)

    def found(self, model: CompiledDae) -> tuple[Vector, Vector, Vector, Vector]:
        """Return imbalances, as fractions of the largest powers, and negative losses, without rounding."""
        real = self._counts()
        for component in map(int, np.flatnonzero(real[0])):
            real[0, component] = not _is_rounding(model, self._points[component], component)
        (imbalance, gain), (when, then) = np.where(real, self._worst, 0.0), np.where(real, self._when, 0.0)
        return imbalance / np.maximum(self._largest, 1e-300), when, gain, then


def _is_rounding(model: CompiledDae, point: Point, component: int) -> bool:
    """Tell whether an imbalance is rounding, which grows where torques are small differences of large ones.

    It is where it changes as much as it is large when the last digits of all numbers change; what a wrong law leaves
    hardly changes.
    """
    digits, sums = np.random.default_rng(0), list[float]()

    def moved(numbers: Vector) -> Vector:
        return numbers * (1.0 + _LAST_DIGITS * digits.uniform(-1.0, 1.0, len(numbers)))

    for _ in range(_CHANGES):
        twin, near = model.twin(p=moved(model.p)), Point(point.t, moved(point.x), point.z.copy(), point.d)
        solve_implicit(twin, near)
        _, lost, source, inflow, rate, _ = call(twin, twin.energy, near).reshape(-1, len(model.components))[
            :, component
        ]
        sums.append(float(inflow + source - lost - rate))
    return bool(np.ptp(sums) > 0.5 * np.max(np.abs(sums)))


def _impacts(
    model: CompiledDae, impacts: Sequence[Impact], start: float, stored: Vector
) -> tuple[Vector, Vector, Vector]:
    """Return what components lose, and what sources give, in each impact; and what is stored in those at the start.

    A prescribed motion does not stop: its source pushes with an impulse, which is work.

    Args:
        model: the compiled model.
        impacts: their losses.
        start: of the run in s.
        stored: energies of the components behind the start, in J.
    """
    struck, given = np.zeros((2, len(impacts), len(stored)))
    at_start: Vector | None = None
    for lost, work, impact in zip(struck, given, impacts, strict=True):
        lost[model.components.index(impact.component)] = impact.energy
        if impact.trials:
            before, after = (call(model, model.energy, point).reshape(-1, len(stored)) for point in impact.trials)
            work[:] = INSTANT * (after[2] - before[2])
            if at_start is None and impact.time == start:
                at_start = stored - before[0]
    return struck, given, np.zeros(len(stored)) if at_start is None else at_start


def _unexplained(
    times: Vector, jumps: Vector, reset: Sequence[float], unexplained: Sequence[tuple[float, float]]
) -> float:
    """Return the largest unexplained change of all stored energies together at an instant, in J."""
    left: dict[float, float] = {}
    for time, jump in zip(times.tolist(), jumps.tolist(), strict=True):
        left[time] = left.get(time, 0.0) + jump
    instants = list(left)

    def at(time: float) -> float | None:
        near = _SAME_TIME * max(1.0, abs(time))
        k = bisect_left(instants, time - near)
        return instants[k] if k < len(instants) and instants[k] <= time + near else None

    for time, lost in unexplained:
        if (instant := at(time)) is not None:
            left[instant] += lost
    for time in reset:
        if (instant := at(time)) is not None:
            left[instant] = 0.0
    return max(map(abs, left.values()), default=0.0)
