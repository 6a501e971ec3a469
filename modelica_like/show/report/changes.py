"""Events as reports tell them: instead of relations behind discrete variables, what these variables become."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from modelica_like.errors import Source
from modelica_like.language.transition import NAME_IN_NOTICE
from modelica_like.runs.trajectories import Trajectories
from modelica_like.solve.recorder import Event


@dataclass(frozen=True)
class Change:
    """A change at an event.

    Attributes:
        time: in s.
        path: of the mode or discrete variable; of an event that changes none, of the component.
        before: name or value before; empty where only the component is known.
        after: the same after it.
        because: why, in words; may be empty.
        source: what in the component makes it.
    """

    time: float
    path: str
    before: str
    after: str
    because: str
    source: Source

    @property
    def owner(self) -> str:
        """Path of the component."""
        return self.path.rpartition(".")[0] if self.after else self.path


def changes(run: Trajectories) -> list[Change]:
    """Return what happens at the events of a run, in their order."""
    hidden = {discrete.path for discrete in run.model.flat_discretes if discrete.hidden}
    result: list[Change] = []
    for _, group in groupby(zip(run.events, reasons(run), strict=True), key=lambda pair: pair[0].time):
        pairs = list(group)
        result += [_plain(event, why) for event, why in pairs if event.mode not in hidden]
        first = pairs[0][0].round  # later rounds follow from it
        behind = [_plain(event, why) for event, why in pairs if event.mode in hidden and event.round == first]
        result += _visible(run, behind, timed=all(_timed(run, event) for event, _ in pairs)) if behind else []
    return result


def reasons(run: Trajectories) -> list[str]:
    """Return in words why each of the events happened, parameters with their values; nothing where nobody knows."""
    texts: dict[tuple[str, int], str] = {}

    def valued(path: str) -> str:
        unit = str(run.model.units[path])
        return f"{path.rpartition('.')[2]} = {run[path][0]:g}{'' if unit == '1' else f' {unit}'}"

    for event in run.events:
        key, (component, dot, _) = (event.mode, event.transition), event.mode.rpartition(".")
        if key not in texts:
            by_itself = "an impact" if event.source.file else ""  # FMUs do not tell why
            because = by_itself if event.transition < 0 else run.model.events.transitions[event.transition].because
            texts[key] = NAME_IN_NOTICE.sub(lambda name, owner=component + dot: valued(owner + name[1]), because)
    return [texts[event.mode, event.transition] for event in run.events]


def _plain(event: Event, why: str) -> Change:
    return Change(event.time, event.mode, event.before, event.after, why, event.source)


def _timed(run: Trajectories, event: Event) -> bool:
    return event.transition >= 0 and run.model.events.transitions[event.transition].timed


def _visible(run: Trajectories, behind: Sequence[Change], *, timed: bool) -> list[Change]:
    """What users see of events of relations and clocks: discrete variables that change, else the reasons themselves."""
    at = behind[0].time
    first, last = np.searchsorted(run.time, at), max(np.searchsorted(run.time, at, "right") - 1, 0)
    result: list[Change] = []
    numbers: list[Change] = []
    for discrete in (d for d in run.model.flat_discretes if not d.hidden and not d.names):
        before, after = (float(run[discrete.path][side]) for side in (first, last))
        if before != after:
            owner = discrete.path.rpartition(".")[0]
            causes = [change for change in behind if change.owner == owner] or behind
            why = ", ".join(dict.fromkeys(change.because for change in causes if change.because))
            visible = Change(
                at, discrete.path, _value(discrete.kind, before), _value(discrete.kind, after), why, causes[0].source
            )
            (numbers if discrete.kind == "number" else result).append(visible)
    if timed or result:  # numbers change at every tick
        return result
    owners = (Change(at, change.owner or run.model.name, "", "", change.because, change.source) for change in behind)
    return numbers or list(dict.fromkeys(owners))  # several relations of one line say the same


def _value(kind: str, value: float) -> str:
    return ("true" if value else "false") if kind == "boolean" else f"{value:.6g}"
