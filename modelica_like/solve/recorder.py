"""The record of a run: smooth segments and the events between them."""

from __future__ import annotations

from dataclasses import dataclass, field

from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.errors import Source
from modelica_like.solve.dense import Keeper
from modelica_like.solve.initialize import Impact, Point

TERMINATED = "has terminated it"
"""The reason where an FMU ends a run: it cannot say more."""
IMPACT = -1
"""Stands in the place of a transition where an impact has changed a mode."""


@dataclass(frozen=True)
class Event:
    """A mode change.

    Attributes:
        time: in s.
        mode: path of the mode, e.g. `clutch.mode`.
        before: name of the mode before.
        after: name of the mode after.
        source: the transition's place in its component.
        transition: position in the model's transitions, or `IMPACT`.
        segment: position of the segment that follows.
        round: number of the round at its instant; a round uses the changes of the one before.
    """

    time: float
    mode: str
    before: str
    after: str
    source: Source
    transition: int = IMPACT
    segment: int = 0
    round: int = 0

    def __str__(self) -> str:
        return f"{self.time:.9g} s  {self.mode}: {self.before} → {self.after}"


@dataclass(frozen=True)
class Ended:
    """A regular end of a run, by a component.

    Attributes:
        time: in s.
        component: its path; of a model without parts its name; the name of an FMU.
        reason: goes on after the name of the component.
    """

    time: float
    component: str
    reason: str

    def __str__(self) -> str:
        return f"The run ended at {self.time:.9g} s: {self.component} {self.reason.rstrip('.')}."


@dataclass(frozen=True)
class Segment:
    """A smooth piece of the solution with fixed modes; both ends included.

    Attributes:
        times: shape (n,), in s.
        x: states, shape (nx, n).
        z: implicit unknowns, shape (nz, n).
        d: modes and discrete values.
    """

    times: Vector
    x: Vector
    z: Vector
    d: Vector

    @property
    def start(self) -> Point:
        """First point."""
        return self.point(0)

    def point(self, k: int) -> Point:
        """Return one point."""
        return Point(float(self.times[k]), self.x[:, k].copy(), self.z[:, k].copy(), self.d)


@dataclass
class Recorder:
    """Collects segments, events and losses in impacts, and dense output.

    `notices` are messages for the report; `ended` is whether a component has ended the run.
    """

    segments: list[Segment] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)
    impacts: list[Impact] = field(default_factory=list)
    notices: list[str] = field(default_factory=list)
    ended: bool = False
    keeper: Keeper = field(default_factory=Keeper)

    def note(
        self, model: CompiledDae, time: float, number: int, change: tuple[int, int], transition: int, round: int
    ) -> None:
        """Record the change of a mode from one number to another, by a transition or by an `IMPACT`."""
        mode = model.flat_discretes[number]
        before, after = (mode.names[k] for k in change)
        # Break-away in an impact has no transition; the first one of the mode gives its place.
        place = transition
        if place < 0:
            place = next(k for k, candidate in enumerate(model.events.transitions) if candidate.mode == number)
        self.ended |= transition >= 0 and model.events.transitions[transition].ends
        source, segment = model.events.transitions[place].source, len(self.segments)
        self.events.append(Event(time, mode.path, before, after, source, transition, segment, round))
