"""What a run adds to a schematic: modes by colours, power by the width of lines."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import cast

import numpy as np

from modelica_like.errors import ValueOutOfRange
from modelica_like.language.component import Component
from modelica_like.language.declared import Connector
from modelica_like.language.inside import inside
from modelica_like.language.units import parse_unit
from modelica_like.runs.energy import EnergyBalance, EnergyRow
from modelica_like.runs.trajectories import Trajectories
from modelica_like.show.draw.diagram import Node, Notes, Port
from modelica_like.show.draw.labels import VALUE, Box, Text, meet, text_width
from modelica_like.show.draw.sheet import MARK, Line, Placed, Point, Sheet, texts

Piece = tuple[Point, Point, float]
HELD, OPEN, SLIDES = "held", "open", "slides"
_WATT = parse_unit("W")
_THICKEST = 12.0
"""Width of the line with the largest power, in 1/96 inch."""
_SAID = 1e-3
"""Part of the largest power below which a line says nothing."""
_CARRIES = 1e-9
"""Part of its largest reaction above which a part is not open."""
_PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"))
_COLUMN = 100.0
"""Width of a column of the sheet in which texts are compared, in 1/96 inch."""
_LEAST = 0.005
"""Share of the supply below which an energy is not told."""


@dataclass
class Running:
    """A run as a schematic shows it.

    Attributes:
        modes: of each node with a mode, times at which its look changes, and the looks and names from then on.
        powers: pieces of each line, with the power that passes in W.
        said: texts at each line that has room for them.
        end: of the run in s.
        span: of a run in s whose energies are shown, not its powers.
        supply: energy that came into the drive meanwhile, in J.
        moving: show all modes one after the other instead of those of one time.
    """

    modes: dict[Node, list[tuple[float, str, str]]] = field(default_factory=dict)
    powers: dict[Line, list[Piece]] = field(default_factory=dict)
    end: float = 0.0
    said: dict[Line, list[Text]] = field(default_factory=dict)
    span: float = 0.0
    supply: float = 0.0
    moving: bool = False

    @cached_property
    def largest(self) -> float:
        """The largest power in W, once all are known."""
        return max((abs(power) for pieces in self.powers.values() for _, _, power in pieces), default=0.0)

    def width(self, line: Line, power: float) -> float:
        """Return how thick a piece of a line is drawn."""
        least = line.stroke.width
        return least + (_THICKEST - least) * abs(power) / self.largest if power else least

    def texts(self, line: Line) -> Iterator[list[Text]]:
        """Yield what may be written at a level stretch of a line, the longest first: its power, or energy and share."""
        stretches = dict[tuple[float, str], tuple[float, float, float]]()
        for (x1, y1), (x2, y2), power in self.powers.get(line, ()):
            if y1 == y2 and abs(power) > _SAID * self.largest:
                key = y1, spelled(abs(power) * self.span, "J") if self.span else spelled(abs(power))
                low, high, _ = stretches.get(key, (x1, x2, 0.0))
                stretches[key] = min(low, x1, x2), max(high, x1, x2), abs(power)
        for (y, text), (low, high, power) in sorted(stretches.items(), key=lambda item: item[1][0] - item[1][1]):
            x = (low + high) / 2
            if high - low >= text_width(text, VALUE) and not self.span:
                yield [Text(text, (x, y + 16.0), VALUE)]
            elif high - low >= text_width(text, VALUE):
                share = f"{power * self.span / self.supply:.0%}"
                yield [Text(text, (x, y - 9.0), VALUE), Text(share, (x, y + 18.0), VALUE)]


def spelled(value: float, unit: str = "W") -> str:
    """Return a power, or an energy, with a suitable unit."""
    size, prefix = next((p for p in _PREFIXES if abs(value) >= p[0]), _PREFIXES[-1])
    return f"{value / size:.3g} {prefix}{unit}"


def energy_notes(balance: EnergyBalance) -> Notes:
    """Return what is written below each part: energies in J and as shares of the supply."""
    rows_of: dict[str, list[EnergyRow]] = defaultdict(list)
    for row in balance:
        names = row.component.split(".")
        for depth in range(len(names)):
            rows_of[".".join(names[: depth + 1])].append(row)
    supply = balance.supply

    def told(part: Component) -> list[str]:
        rows = rows_of.get(path_of(part), [])
        sums = {"in": 0.0, "out": 0.0, "stored": sum(row.stored for row in rows), "lost": sum(row.lost for row in rows)}
        source = sum(row.source for row in rows)
        sums["in" if source > 0.0 else "out"] = abs(source)
        return [
            f"{what} {spelled(value, 'J')}, {value / supply:.1%}"
            for what, value in sums.items()
            if abs(value) > _LEAST * supply
        ]

    return told


def running(
    drawn: Sheet, run: Trajectories, *, at: float | None = None, flow: bool = False, moving: bool = False,
    balance: EnergyBalance | None = None,
) -> Running:  # fmt: skip
    """Collect what a run adds to a sheet.

    Args:
        drawn: the schematic of what was run.
        run: the run.
        at: time in s whose modes and powers are shown; by default modes at the end and mean powers.
        flow: show powers.
        moving: show the modes of the whole run.
        balance: of the run; its energies are told instead of powers and modes.

    Raises:
        ValueOutOfRange: the run has no such time.
    """
    first, last = float(run.time[0]), float(run.time[-1])
    if at is not None and not first <= at <= last:
        raise ValueOutOfRange(f"There is nothing at {at:g} s: the run goes from {first:g} s to {last:g} s.")
    result = Running(end=last, moving=moving)
    if balance is not None and balance.supply:
        result.span, result.supply = last - first, balance.supply
    for item in (item for _, item in drawn.everything()):
        if isinstance(item, Placed) and item.node.component is not None and balance is None:
            looks = list(_looks(item.node.component, run))
            if looks and not moving:
                now = last if at is None else at
                looks = [[look for look in looks if look[0] <= now][-1]]
            if looks:
                result.modes[item.node] = looks
        elif isinstance(item, Line) and flow and not item.stroke.dashed and (pieces := _pieces(item, run, at)):
            result.powers[item] = pieces
    _write(drawn, result)
    return result


class _Taken:
    """Places on a sheet that are taken, by its columns: a text is compared with what is near."""

    def __init__(self) -> None:
        self._columns: dict[int, list[tuple[Line | None, Box]]] = defaultdict(list)

    def add(self, box: Box, by: Line | None = None) -> None:
        """Take a place."""
        for column in self._across(box):
            self._columns[column].append((by, box))

    def meets(self, box: Box, line: Line) -> bool:
        """Whether a box overlaps anything but what this line has taken."""
        near = (item for column in self._across(box) for item in self._columns.get(column, ()))
        return any(by is not line and meet(box, other) for by, other in near)

    @staticmethod
    def _across(box: Box) -> range:
        return range(int(box[0] // _COLUMN), int(box[2] // _COLUMN) + 1)


def _write(drawn: Sheet, result: Running) -> None:
    """Choose texts at lines that meet no other text, no ground and no other line."""
    taken = _Taken()
    lines = list[tuple[Point, Line]]()
    for at, item in drawn.everything():
        if isinstance(item, Placed):
            by = at[0] + item.at[0], at[1] + item.at[1]
            for box in [*(text.box for text in texts(item)), *_marks(item)]:
                taken.add(_moved(box, by))
        elif isinstance(item, Line):
            lines.append((at, item))
            for a, b in (pair for path in item.paths for pair in pairwise(path)):
                taken.add(_moved((*min(a, b), *max(a, b)), at), item if a[1] == b[1] else None)
    for at, line in lines:
        for said in result.texts(line):
            boxes = [_moved(text.box, at) for text in said]
            if not any(taken.meets(box, line) for box in boxes):
                result.said[line] = said
                for box in boxes:
                    taken.add(box)
                break


def _marks(part: Placed) -> Iterator[Box]:
    """Where grounds are drawn."""
    for port in part.node.ports.values():
        if port.mark:
            x, y = {"W": -part.half[0] - MARK, "E": part.half[0] + MARK}.get(port.side, port.along), port.along
            yield x - MARK, y - MARK / 2, x + MARK, y + MARK


def _moved(box: Box, by: Point) -> Box:
    return box[0] + by[0], box[1] + by[1], box[2] + by[0], box[3] + by[1]


def _looks(part: Component, run: Trajectories) -> Iterator[tuple[float, str, str]]:
    """When the look of a part changes, to what look, and the mode's name."""
    name = next((m for m, mode in part.modes.items() if mode.holds), None)
    if name is None:
        return
    path, mode = path_of(part), part.modes[name]
    values = run[f"{path}.{name}"].astype(int)
    # A hold knows its reaction only by the node of the flat system, and some have none.
    held = next((hold for hold in run.model.held.motions if hold.component == path and hold.reaction >= 0), None)
    carried = np.abs(run[run.model.flat_variables[held.reaction].path]) if held else np.ones(len(values))
    changes = [0, *(np.flatnonzero(np.diff(values)) + 1), len(values)]
    for k, end in pairwise(changes):
        now = mode.names[values[k]]
        carries = np.max(carried[k:end]) > _CARRIES * np.max(carried)
        yield float(run.time[k]), HELD if now in mode.holds else SLIDES if carries else OPEN, now.replace("_", " ")


def path_of(part: Component) -> str:
    """Return the path of a part in the whole drive."""
    names = list[str]()
    while inside(part).owner is not None:
        names.append(inside(part).name)
        part = cast("Component", inside(part).owner)
    return ".".join(reversed(names))


def _pieces(line: Line, run: Trajectories, at: float | None) -> list[Piece]:
    """Pieces of a line between its corners and branches, and what passes each: the powers of all parts beyond it."""
    powers = {_rounded(tip): power_into(port, run, at) for port, tip in line.tips.items()}
    lacking = [tip for tip, power in powers.items() if power is None]
    if len(lacking) > 1 or len(powers) < 2:
        return []
    into = {tip: power for tip, power in powers.items() if power is not None}
    into |= dict.fromkeys(lacking, -sum(into.values()))
    paths = [[_rounded(corner) for corner in path] for path in line.paths]
    corners = sorted({corner for path in paths for corner in path})
    edges = dict[frozenset[Point], None]()
    for path in paths:
        for a, b in pairwise(path):
            there = [corner for corner in corners if _between(corner, a, b)]
            edges |= dict.fromkeys(frozenset(pair) for pair in pairwise(there) if pair[0] != pair[1])
    return [(min(edge), max(edge), _beyond(edge, edges, into)) for edge in edges]


def _rounded(point: Point) -> Point:
    return round(point[0], 2), round(point[1], 2)


def _between(point: Point, a: Point, b: Point) -> bool:
    return all(min(a[k], b[k]) <= point[k] <= max(a[k], b[k]) for k in (0, 1))


def _beyond(cut: frozenset[Point], edges: Iterable[frozenset[Point]], into: Mapping[Point, float]) -> float:
    """Power through a piece: into all that hangs on one of its ends, once it is taken out."""
    start, _ = cut
    reached, pending = {start}, [start]
    while pending:
        here = pending.pop()
        for other in (v for edge in edges if here in edge and edge != cut for v in edge if v not in reached):
            reached.add(other)
            pending.append(other)
    return sum(power for tip, power in into.items() if tip in reached)


def power_into(port: Port, run: Trajectories, at: float | None = None) -> float | None:
    """Return the power in W into a part through a port at a time, or its mean; None where the run does not tell it."""
    part = port.node.component
    connector = part and used_connector(part, port.name)
    if part is None or connector is None:
        return None
    path = f"{path_of(part)}.{port.name}"
    columns: Mapping[str, np.ndarray] = {
        name: run[f"{path}.{name}"] for name in connector.fields if f"{path}.{name}" in run
    }
    flows = [name for name in columns if getattr(connector.fields[name], "is_flow", False)]
    others = [name for name in columns if name not in flows]
    if len(flows) != 1 or len(others) != 1:
        return None
    flow, other = columns[flows[0]], columns[others[0]]
    unit = connector.fields[flows[0]].unit
    if unit == _WATT:
        return _at(run.time, flow, at)
    if (unit * connector.fields[others[0]].unit).dimension == _WATT.dimension:
        return _at(run.time, flow * other, at)
    # Flow times the rate of the potential.
    spans, rises = np.diff(run.time), np.diff(other)
    if at is None:
        return float(np.sum(0.5 * (flow[1:] + flow[:-1]) * rises) / max(np.sum(spans), np.finfo(float).tiny))
    moves = spans > 0.0
    middles, rates = 0.5 * (run.time[1:] + run.time[:-1])[moves], rises[moves] / spans[moves]
    return float(np.interp(at, middles, rates) * np.interp(at, run.time, flow)) if moves.any() else 0.0


def used_connector(part: Component, name: str) -> Connector | None:
    """Return a connector of a part, if something is connected to it."""
    connector = part.connectors.get(name)
    return connector if connector is not None and connector.used else None


def _at(time: np.ndarray, values: np.ndarray, at: float | None) -> float:
    if at is not None:
        return float(np.interp(at, time, values))
    span = time[-1] - time[0]
    return float(np.trapezoid(values, time) / span) if span else 0.0
