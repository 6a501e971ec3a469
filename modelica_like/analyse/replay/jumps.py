"""Events of a replay as linear maps: the shift of the event, and the changes it causes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from modelica_like.analyse.replay.holds import impact, projection, share_slopes
from modelica_like.analyse.replay.when import Coincidence, Trigger, When, at_rest, either_first, event_time
from modelica_like.compile.buffers import Vector
from modelica_like.compile.cached import Cached, Key
from modelica_like.compile.compiled import CompiledDae
from modelica_like.compile.groups import Reset
from modelica_like.language.holding import UNLIMITED
from modelica_like.native.holds import is_hard, share, strike
from modelica_like.solve.initialize import Point, call, holding, solve_implicit
from modelica_like.solve.initialize.holds import capacities
from modelica_like.solve.initialize.slopes import Sizes, slopes
from modelica_like.solve.recorder import Event

_SMOOTH = 1e-9
_JOLT = 1e-9
"""Change of a held motion, relative to itself or to 1, that is a new value: held motions change by rounding only."""


@dataclass(frozen=True)
class Jump:
    """A change of modes, shifted to the recorded time.

    Attributes:
        before: point before.
        after: point after, at the same time.
        events: the mode changes.
        when: the cause of its time.
        x: derivatives of the states after by (x, theta) before, shape (nx, nx + ntheta).
        d: derivatives of the discrete values after, shape (nd, nx + ntheta).
        gain: drop of the integrands at the event: quadratures grow by it times the shift of the event, shape (nq,).
        matters: whether anything depends on its time.
        chances: motions of zero that modes hold from then on.
    """

    before: Point
    after: Point
    events: tuple[Event, ...]
    when: When
    x: Vector
    d: Vector
    gain: Vector
    matters: bool
    chances: tuple[Coincidence, ...] = ()

    @property
    def trigger(self) -> Trigger | None:
        """When it happens."""
        return self.when.trigger

    @property
    def quadratures(self) -> Vector:
        """Change of the quadratures because the event is not exactly at its recorded time."""
        return self.gain * (0.0 if self.trigger is None else self.trigger.shift)

    def time(self) -> Trigger:
        """Return when it happens.

        Raises:
            NoGradient: its time has no derivative.
        """
        if self.trigger is None:
            assert self.when.reason is not None
            raise self.when.reason
        return self.trigger

    @property
    def by_time(self) -> Vector:
        """Derivative of its time by (x, theta) before it; zero without a trigger."""
        return np.zeros(self.x.shape[1]) if self.trigger is None else self.trigger.by

    def forward(self, whole: Vector) -> tuple[Vector, Vector]:
        """Carry derivatives of (x, theta) behind it; shapes (nx + ntheta, columns) and (quadratures, columns)."""
        fixed = whole[len(self.x) : len(whole) - len(self.d)]
        return np.vstack([self.x @ whole, fixed, self.d @ whole]), np.outer(self.gain, self.by_time @ whole)

    def adjoint(self, whole: Vector, Q: Vector) -> Vector:
        """Carry derivatives by (x, theta) to before it; Q are those by the quadratures."""
        nx, fixed = len(self.x), len(whole) - len(self.d)
        back = self.x.T @ whole[:nx] + self.d.T @ whole[fixed:] + np.outer(self.by_time, self.gain @ Q)
        back[nx:fixed] += whole[nx:fixed]
        return back


def make_jump(
    model: CompiledDae, before: Point, events: tuple[Event, ...], begin: Point, integrands: Any, *, first: bool
) -> Jump:
    """Differentiate an event.

    Args:
        model: the compiled model.
        before: the point before the event, at its recorded time.
        events: the mode changes there, in the order in which they happened.
        begin: beginning of the segment before; the change of a guard since then decides whether it grazes zero.
        integrands: gives the integrands of the quadratures at a point.
        first: the event is at the start of the run, and stays there.

    Raises:
        NoGradient: the states after the event have no derivative.
    """
    work = Work.at(model, before)
    rate_before = slopes(model, before, "ode").value
    when = When() if first else event_time(model, before, events, begin)
    trigger = when.trigger
    if trigger is not None:
        work.x += np.outer(rate_before, trigger.by)
        work.point.x = before.x + rate_before * trigger.shift
        work.time = trigger.by
    work.share()
    for number in range(1 + max((event.round for event in events), default=0)):
        now = [event for event in events if event.round == number]
        if now:
            work.fire(now)
        work.update()
    while work.update():
        pass  # it ended in the run
    chances = work.chances()
    rate_after = slopes(model, work.point, "ode").value
    gain = integrands(before) - integrands(work.point)
    # The time of the event matters only if states, rates or integrands jump.
    states, rates = np.abs(before.x - work.point.x), np.abs(rate_before - rate_after)
    matters = np.any(np.abs(gain) > _SMOOTH)
    matters |= np.any(rates > _SMOOTH * (model.equations.nominals + np.abs(rate_before) + np.abs(rate_after)))
    matters |= np.any(states > _SMOOTH * (model.equations.nominals + np.abs(before.x)))
    if when.reason is not None and matters:
        raise when.reason
    if when.apart and not gain.size and either_first(model, before, events, work.point):
        matters = False
    if trigger is not None:
        work.x -= np.outer(rate_after, trigger.by)
        work.point.x = work.point.x - rate_after * trigger.shift
        solve_implicit(model, work.point)
    return Jump(before, work.point, events, when, work.x, work.d, gain, bool(matters), chances)


@dataclass
class Work:
    """States and discrete values in the course of an event, with their derivatives by (x, theta) before it."""

    model: CompiledDae
    point: Point
    x: Vector
    d: Vector
    time: Vector | None = None
    struck: tuple[Vector, Vector] | None = None
    entered: set[int] = field(default_factory=set)
    resting: set[int] = field(default_factory=set)
    """Motions that modes hold because they are zero: nothing has stopped them."""
    passing: dict[int, Coincidence] = field(default_factory=dict)
    """Motions that a later round has stopped, as they were before: they were zero, too."""

    @classmethod
    def at(cls, model: CompiledDae, point: Point) -> Work:
        """Start with the point itself."""
        size = Sizes.of(model)
        columns = size.x + size.theta
        return cls(model, point.copy(), np.eye(size.x, columns), np.eye(size.d, columns, size.x + size.fixed))

    def _total(
        self, name: str | Key, rows: Sequence[int] | None = None, function: Any = None, *constants: Vector,
        at: Point | None = None,
    ) -> tuple[Vector, Vector]:  # fmt: skip
        """Value of a function (see `slopes`) and its derivatives by (x, theta) before the event."""
        part = slopes(self.model, at or self.point, name, rows, function, *constants)
        nx, fixed = len(self.x), len(self.model.fixed_position)
        total = part.x @ self.x + part.theta[:, fixed:] @ self.d
        total[:, nx : nx + fixed] += part.theta[:, :fixed]
        if self.time is not None:
            total += np.outer(part.t, self.time)
        return part.value, total

    def fire(self, events: list[Event]) -> None:
        """Carry out the transitions of a round together, and the impact that follows; see events.c."""
        model, before = self.model, self.point.d
        transitions = [model.events.transitions[event.transition] for event in events if event.transition >= 0]
        x, d, dx, dd = self.point.x.copy(), self.point.d.copy(), self.x.copy(), self.d.copy()
        projected: list[tuple[Reset, float, Vector]] = []
        motions = self._motions()
        for transition in transitions:
            d[transition.mode] = transition.target
            for reset in transition.resets:
                value, slope = self._reset(reset.value)
                if reset.kind == "state":
                    self.struck = None
                    x[reset.index], dx[reset.index] = value / reset.factor, slope / reset.factor
                elif reset.kind == "discrete":
                    d[reset.index], dd[reset.index] = value, slope
                else:
                    projected.append((reset, value, slope))
        self.point = replace(self.point, x=x, d=d)
        self.x, self.d = dx, dd
        self.share()
        self._project(projected)
        knocked = [event for event in events if event.transition < 0]
        for hold in self._jolted(before, motions, limited=True):
            mode = model.held.motions[hold].mode
            names = model.flat_discretes[mode].names
            self.point.d[mode] = next(
                (names.index(one.after) for one in knocked if model.discrete_position[one.mode] == mode),
                self.point.d[mode],
            )
        self._stop_motions(before, later=events[0].round > 0, jolted=self._jolted(before, motions, limited=False))
        for event in knocked:
            mode = model.discrete_position[event.mode]
            self.point.d[mode] = model.flat_discretes[mode].names.index(event.after)
        if knocked:
            self.share()
            modes = {model.discrete_position[event.mode] for event in knocked}
            self.resting.update(k for k in holding(model, self.point) if model.held.motions[k].mode in modes)

    def update(self) -> bool:
        """Evaluate the discrete equations once; return whether something changes. See events.c."""
        rows = self.model.events.update_rows
        if not rows:
            return False
        values, total = self._total("updates")
        motions = self._motions()
        x, d, projected = self.point.x.copy(), self.point.d.copy(), list[tuple[Reset, float, Vector]]()
        for k, row in enumerate(rows):
            reset = row.reset
            if reset.kind == "discrete":
                d[reset.index], self.d[reset.index] = values[k], total[k]
            elif values[k] != np.inf and reset.kind == "state":
                x[reset.index], self.x[reset.index] = values[k] / reset.factor, total[k] / reset.factor
            elif values[k] != np.inf:
                projected.append((reset, values[k], total[k]))
        if not (projected or (x != self.point.x).any() or (d != self.point.d).any()):
            return False
        self.point = replace(self.point, x=x, d=d)
        self.share()
        self._project(projected)
        self._stop_motions(d, later=False, jolted=self._jolted(d, motions, limited=False))
        return True

    def _motions(self) -> Vector:
        """Motions that modes may hold."""
        if not self.model.held.motions:
            return np.zeros(0)
        nodes = [hold.motion for hold in self.model.held.motions]
        return np.array(call(self.model, self.model.equations.variables, self.point))[nodes]

    def _jolted(self, before: Vector, motions: Vector, *, limited: bool) -> list[int]:
        """What is held, as before, and has got a new speed; see events.c."""
        model, held = self.model, holding(self.model, self.point) if len(motions) else []
        kept = [k for k in held if before[model.held.motions[k].mode] == model.held.motions[k].number]
        now = self._motions() if kept else motions
        moved = [k for k in kept if min(abs(now[k] - motions[k]), abs(now[k])) > _JOLT * max(abs(now[k]), 1.0)]
        capacity = capacities(model, self.point).max(axis=1) if moved else ()
        return [k for k in moved if (capacity[k] < UNLIMITED) == limited]

    def share(self) -> None:
        """Let elements share what they hold together, and solve the implicit equations."""
        share(self.model, self.point)
        solve_implicit(self.model, self.point)
        self.differentiate_shares()

    def differentiate_shares(self) -> None:
        """Derivatives of the shares at the present point."""
        for circuit in self.model.held.circuits:
            self.d[circuit.entries] = 0.0
            self.d[circuit.shares.entries] = share_slopes(self.model, self.point, circuit, self.x.shape[1], self._total)

    def _stop_motions(self, before: Vector, *, later: bool, jolted: list[int]) -> None:
        """Stop what modes have begun to hold since `before`, also where it stands still already, and what is `jolted`.

        In a `later` round nothing has come to a stop: what begins to be held was zero.
        """
        model, point = self.model, self.point
        held = holding(model, point)
        entering = [
            k for k in held if k in jolted or before[model.held.motions[k].mode] != model.held.motions[k].number
        ]
        if not entering:
            return
        hard = is_hard(model, point, entering)
        if hard:
            # All impacts at this instant are solved together, from the speeds before the first.
            entering = self._begin_again(entering)
            point = self.point
        struck = strike(model, point, entering)
        trial = point.copy()
        for k in struck.knocked:
            trial.d[model.held.motions[k].mode] = model.held.motions[k].loose
        share(model, trial)
        solve_implicit(model, trial)
        stopped = [k for k in entering if k not in struck.knocked]
        if later and not hard:
            self.passing |= {k: self._at_rest(k) for k in stopped}
        if stopped:
            self.x = self.x + self._total((Cached.IMPACT, *stopped), None, lambda: impact(model, stopped), at=trial)[1]
        self.point = struck.point

    def chances(self) -> tuple[Coincidence, ...]:
        """Tell what is zero just at these parameters: motions that rest, and those that stop and go on at once."""
        held = holding(self.model, self.point)
        return (
            *map(self._at_rest, sorted(self.resting)),
            *(value for k, value in self.passing.items() if k not in held),
        )

    def _at_rest(self, hold: int) -> Coincidence:
        by = self._total("variables", [self.model.held.motions[hold].motion])[1][0]
        return at_rest(self.model, self.point, hold, by)

    def _begin_again(self, entering: list[int]) -> list[int]:
        """Go back to the states before the first impact, hold all motions that were hit, and return these."""
        self.entered.update(entering)
        if self.struck is None:
            self.struck = self.point.x, self.x
        x, self.x = self.struck
        d = self.point.d.copy()
        for k in self.entered:
            d[self.model.held.motions[k].mode] = self.model.held.motions[k].number
        self.point = replace(self.point, x=x.copy(), d=d)
        self.share()
        return sorted(self.entered)

    def _reset(self, number: int) -> tuple[float, Vector]:
        value, slope = self._total("resets", [number])
        return float(value[0]), slope[0]

    def _project(self, resets: list[tuple[Reset, float, Vector]]) -> None:
        """Change the states as little as possible until variables have their new values; see events.c."""
        model = self.model
        if not resets:
            return
        new: dict[int, tuple[float, Vector]] = {}
        for reset, value, slope in sorted(resets, key=lambda one: one[0].factor == 0):
            scale = reset.factor or 1.0
            new.setdefault(model.events.reset_nodes[reset.target], (value / scale, slope / scale))
        solve_implicit(model, self.point)
        named = {model.events.reset_nodes[reset.target] for reset, *_ in resets if reset.factor}
        rows = slopes(model, self.point, "variables", [*new]).x
        for k in range(len(new) - 1, -1, -1):  # what is to keep its value need not where it follows
            if [*new][k] not in named and np.linalg.matrix_rank(rows[: k + 1]) == np.linalg.matrix_rank(rows[:k]):
                del new[[*new][k]]
        nodes = [*new]
        present, slope = self._total("variables", nodes)
        back = np.linalg.pinv(slopes(model, self.point, "variables", nodes).x)
        missing = np.array([value for value, _ in new.values()]) - present
        change, turn = self._total((Cached.PROJECTION, *nodes), None, lambda: projection(model, nodes), missing)
        self.point = replace(self.point, x=self.point.x + change)
        self.x = self.x + turn + back @ (np.array([slope for _, slope in new.values()]) - slope)
        solve_implicit(model, self.point)
