"""Points at which a drive is analysed."""

from __future__ import annotations

from typing import get_args

from modelica_like.compile.compiled import CompiledDae
from modelica_like.initialize import Point, StartKind, initialize
from modelica_like.simulation import Model, build, simulate
from modelica_like.solve.solution import Solution
from modelica_like.units import parse_unit, to_si

Drive = Model | Solution
"""What can be analysed: a component, a netlist file, a compiled model, or a solution of one."""

At = float | str | None
"""A time in s, or a start: `given`, `rest` or `steady`."""


def point_of(drive: Drive, at: At = None) -> tuple[CompiledDae, Point]:
    """Return the model and the point of its motion that `at` means.

    Args:
        drive: what is analysed.
        at: a time in s, or a kind of start; by default the end of a solution, otherwise the given start.

    Raises:
        ValueOutOfRange: the time is not within the run.
        ModelicaLikeError: the drive cannot be built, started or simulated.
    """
    if isinstance(drive, Solution):
        if isinstance(at, str):
            return drive.model, initialize(drive.model, float(drive.time[0]), _kind(at))
        return drive.model, drive.point(float(drive.time[-1]) if at is None else float(at))
    model = build(drive)
    if at is None or isinstance(at, str) or at == 0.0:
        return model, initialize(model, 0.0, _kind(at) if isinstance(at, str) else "given")
    run = simulate(model, float(at))
    return model, run.point(float(at))


def when(text: str) -> At:
    """Read a time with a unit, or a kind of start, as a command line gives it.

    Raises:
        UnitError: it is neither.
    """
    return text if text in get_args(StartKind) else to_si(text, parse_unit("s"), "at")


def _kind(name: str) -> StartKind:
    # initialize() tells which names there are.
    return next((kind for kind in get_args(StartKind) if kind == name), name)  # type: ignore[return-value]
