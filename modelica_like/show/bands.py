"""What pictures over time tell of events: modes as bands, instants as numbers with their text."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from modelica_like.runs.trajectories import Trajectories
from modelica_like.solve.recorder import Event

_MOST_EVENTS, _MOST_BANDS, _MOST_HELD = 30, 8, 16
_MOST_NAMES = 12
_SHORT = 1e-5
"""Part of the run that is too short to be drawn."""


@dataclass(frozen=True)
class Bands:
    """Time spans of the values of one mode.

    Attributes:
        mode: path.
        spans: beginning, end, name.
        names: all names of the mode in the order of their declaration, those that hold a motion.
    """

    mode: str
    spans: tuple[tuple[float, float, str], ...]
    names: tuple[str, ...] = ()
    held: frozenset[str] = frozenset()


Mark = tuple[float, str]
"""Time and text of an instant."""


def bands_of(run: Trajectories, wanted: Sequence[str] = ()) -> tuple[list[Bands], list[str]]:
    """Return modes as bands, and what to tell about the others.

    Args:
        run: the run.
        wanted: paths of modes; by default all that change, or of many only those that hold a motion.
    """
    held: dict[str, set[str]] = {}
    for hold in run.model.held.motions:
        mode = run.model.flat_discretes[hold.mode]
        held.setdefault(mode.path, set()).add(mode.names[hold.number])
    paths = list(wanted) or list(dict.fromkeys(event.mode for event in _declared(run)))
    if not wanted and len(paths) > _MOST_BANDS and any(path in held for path in paths):
        paths = [path for path in paths if path in held]
    most = len(paths) if wanted else _MOST_HELD
    left = [f"No bands: {listed(paths[most:])}."] if paths[most:] else []
    names = {discrete.path: tuple(discrete.names) for discrete in run.model.flat_discretes}
    least = _SHORT * float(run.time[-1] - run.time[0])
    spans = {path: tuple(span for span in mode_spans(run, path) if span[1] - span[0] > least) for path in paths[:most]}
    return [Bands(p, some, names.get(p, ()), frozenset(held.get(p, ()))) for p, some in spans.items()], left


def _declared(run: Trajectories) -> list[Event]:
    """Return the changes of modes that a user has declared."""
    hidden = {discrete.path for discrete in run.model.flat_discretes if discrete.hidden}
    return [event for event in run.events if event.mode not in hidden]


def mode_spans(run: Trajectories, mode: str) -> tuple[tuple[float, float, str], ...]:
    """Return when a mode has which value: beginning, end, name."""
    changes = [event for event in run.events if event.mode == mode]
    begin, end = float(run.time[0]), float(run.time[-1])
    times = [begin, *(event.time for event in changes), end]
    if changes:
        names = [*(event.before for event in changes), changes[-1].after]
    else:
        number = int(run[mode][0])
        names = [
            next(
                (d.names[number] for d in run.model.flat_discretes if d.path == mode and d.names),
                "",
            )
        ]
    return tuple(span for span in zip(times, times[1:], names, strict=False) if span[1] > span[0])


def marks_of(run: Trajectories, banded: Sequence[str]) -> tuple[list[Mark], list[str]]:
    """Return the instants with their mode changes as text, and what to tell about those that are left out.

    Args:
        run: the run.
        banded: modes that are drawn as bands; with many events they come first, and of them those that change seldom.
    """
    by_mode: dict[str, list[Event]] = {}
    for event in _declared(run):
        by_mode.setdefault(event.mode, []).append(event)
    seen, left = set[str](), dict[str, int]()
    kept: list[Event] = []
    for mode, events in sorted(by_mode.items(), key=lambda item: (item[0] not in banded, len(item[1]))):
        times = seen | {told(event.time) for event in events}
        if len(times) <= _MOST_EVENTS:
            seen = times
            kept += events
        else:
            left[mode] = len(events)
    instants: dict[str, tuple[float, dict[str, str]]] = {}
    for event in sorted(kept, key=lambda event: event.time):
        changes = instants.setdefault(told(event.time), (event.time, {}))[1]
        changes[event.mode.removesuffix(".mode")] = event.after
    marks = [(time, ", ".join(f"{mode}: {name}" for mode, name in what.items())) for time, what in instants.values()]
    counts = listed([f"{mode} {count}\u00d7" for mode, count in left.items()])
    return marks, [f"Not numbered: {counts}."] if left else []


def listed(names: Sequence[str]) -> str:
    """Return names as a text; of many only the first, and the number of the others."""
    shown = [*names[:_MOST_NAMES], *([f"{len(names) - _MOST_NAMES} others"] if len(names) > _MOST_NAMES else [])]
    return ", ".join(shown)


def told(time: float) -> str:
    """Return a time as it is written; instants that read the same are one."""
    return f"{time:.5g}"
