"""Mode shapes below a schematic: how far each shaft and slide moves, at its place along the drawing."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from modelica_like.language.icon import Stroke
from modelica_like.show.draw.diagram import Port
from modelica_like.show.draw.labels import VALUE, text_width
from modelica_like.show.draw.running import path_of, used_connector
from modelica_like.show.draw.sheet import Line, Placed, Point, Sheet

if TYPE_CHECKING:
    from modelica_like.analyse.linear.model import Mode, Modes

_MOTIONS = ("rad", "m")
"""Units of what moves."""
_STILL = 1e-9


@dataclass(frozen=True, slots=True)
class Stretch:
    """A straight piece of a shape: places along the sheet and deviations, from -1 to 1.

    Attributes:
        rigid: a shaft or slide, whose deviation is the same all along; else what lies between two of them.
        said: the deviation as a text, where there is room for it.
    """

    begin: Point
    end: Point
    stroke: Stroke
    rigid: bool
    said: str = ""


@dataclass(frozen=True, slots=True)
class Shape:
    """One mode: its heading, and its pieces from below to above."""

    title: str
    stretches: tuple[Stretch, ...]


def shapes(drawn: Sheet, modes: Modes, most: int) -> list[Shape]:
    """Return the shapes of the first oscillations in which something on the sheet moves.

    Angles and positions each have their own scale: the largest deviation is one. All are seen at the instant of the
    largest one.

    Args:
        drawn: the schematic.
        modes: of the same drive.
        most: largest number of shapes.
    """
    names = dict.fromkeys(
        name for _, item in drawn.everything() if isinstance(item, Placed)
        for port in item.node.ports.values() if (name := _motion(port, modes))
    )  # fmt: skip
    result = list[Shape]()
    for k, mode in enumerate(modes):
        if mode.oscillates and len(result) < most and (moves := _moves(modes, k, [*names])):
            title = f"mode {k + 1}: {mode.frequency:.4g} Hz, damping {mode.damping:.3g}{_where(mode)}"
            result.append(Shape(title, tuple(_stretches(drawn, modes, moves))))
    return result


def _where(mode: Mode) -> str:
    return f", energy in {', '.join(list(mode.stored)[:2])}" if mode.stored else ""


def _motion(port: Port, modes: Modes) -> str | None:
    """Return the name of the angle or position of a port."""
    part = port.node.component
    connector = part and used_connector(part, port.name)
    if part is None or connector is None:
        return None
    for name, field in connector.fields.items():
        path = f"{path_of(part)}.{port.name}.{name}"
        if str(field.unit) in _MOTIONS and path in modes.linear.model.position:
            return path
    return None


def _moves(modes: Modes, mode: int, names: Sequence[str]) -> dict[str, float]:
    """Return the deviation of each motion, relative to the largest of its kind; nothing if nothing moves."""
    values, model = np.asarray(modes.shape(mode, names)), modes.linear.model
    units = np.array([str(model.units[name]) == _MOTIONS[0] for name in names], bool)
    if not np.any(np.abs(values) > _STILL * np.max(np.abs(modes[mode].shape))):
        return {}
    first = units if np.any(np.abs(values[units])) else ~units
    reference = values[first][np.argmax(np.abs(values[first]))]
    values = np.real(values * np.abs(reference) / reference)
    for kind in (units, ~units):
        values[kind] /= np.max(np.abs(values[kind]), initial=0.0) or 1.0
    return dict(zip(names, map(float, values), strict=True))


def _stretches(drawn: Sheet, modes: Modes, moves: dict[str, float]) -> Iterator[Stretch]:
    tips: dict[Port, float] = {}
    rigid = list[Stretch]()
    for (x, _), item in drawn.everything():
        if not isinstance(item, Line):
            continue
        there = {port: x + tip[0] for port, tip in item.tips.items()}
        tips |= there
        mode = next((name for port in there if (name := _motion(port, modes)) in moves), None)
        if mode and len(there) > 1:
            low, high, value = min(there.values()), max(there.values()), moves[mode]
            text = f"{round(value, 2) + 0.0:g}".replace("-", "−")
            said = text if text_width(text, VALUE) < high - low else ""
            rigid.append(Stretch((low, value), (high, value), item.stroke, rigid=True, said=said))
    for (x, _), item in drawn.everything():
        if isinstance(item, Placed) and item.sheet is None:
            ports = [(port, name) for port in item.node.ports.values() if (name := _motion(port, modes)) in moves]
            side = {
                v: [(tips.get(port, x + item.at[0] + way * item.half[0]), moves[name], port.stroke)
                      for port, name in ports if name and (port.way == v)]
                for v, way in (("W", -1.0), ("E", 1.0))
            }  # fmt: skip
            for (x1, first, stroke), (x2, second, _) in product(side["W"], side["E"]):
                yield Stretch((x1, first), (x2, second), stroke, rigid=False)
    yield from rigid
