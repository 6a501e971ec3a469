"""Torque and friction work of the shifts of an automatic gearbox, from a run."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, Protocol

import numpy as np

from components.clutches.friction import DryFriction
from modelica_like.language.quantities import Energy, Time, Torque
from modelica_like.language.results import Result, line

_ELEMENTS = ("clutch_a", "clutch_b", "brake_c", "brake_d", "clutch_e")
_ROUNDING = 1e-9
_NAMES = {-1.0: "R", 0.0: "N"}
_SLIDING = [k for k, name in enumerate(DryFriction.mode.names) if name not in ("free", "stuck")]


class Run(Protocol):
    """Trajectories by path, values at a time, and energies over a time span, like a `Solution`."""

    def __getitem__(self, key: str, /) -> Any:
        """Return a trajectory."""
        ...

    def at(self, t: float, /) -> Any:
        """Return all values at a time."""
        ...

    def energy(self, begin: float, end: float, /) -> Any:
        """Return the energy balance between two times."""
        ...


class ElementShift(Result):
    """A clutch or brake in a shift."""

    gear: str = line("gear that is engaged")
    begin: Time = line("begin of the shift")
    element: str = line("clutch or brake")
    slipping: Time = line("time during which it slips under load")
    torque: Torque = line("largest torque while it slips")
    work: Energy = line("friction work")


class ShiftReport(Result):
    """Torque and friction work of shifts."""

    work: Energy = line("friction work of all shifts")
    shifts: tuple[ElementShift, ...] = line("elements that slip, shift by shift")


def shift_report(
    run: Run, selector: str = "selector", box: str = "box", elements: tuple[str, ...] = _ELEMENTS
) -> ShiftReport:
    """Compute slip, torque and friction work of every clutch and brake in every shift.

    A shift lasts until the next one begins. An element slips from event to event, according to its mode. The friction
    work is as precise as the run.

    Args:
        run: a run of a gearbox with a `ShiftSchedule`.
        selector: path of the schedule.
        box: path of the gearbox.
        elements: names of its clutches and brakes.
    """
    time, gear, count = run["time"], run[f"{selector}.gear"], run[f"{selector}.row"]
    begins = [int(np.argmax(count == k)) for k in np.unique(count) if k > 0]
    rows: list[ElementShift] = []
    for first, last in pairwise([*begins, len(time)]):
        # The results have both sides of the beginning of the next shift.
        begin, end = float(time[first]), float(time[last - 1])
        if end <= begin:
            continue
        balance = run.energy(begin, end)
        name = _NAMES.get(float(gear[first]), f"{gear[first]:g}")
        for element in elements:
            path = f"{box}.{element}"
            slipping, torque = _slip(run, path, slice(first, last))
            if slipping:
                rows.append(ElementShift(name, begin, element, slipping, torque, balance[path].lost))
    return ShiftReport(sum(row.work for row in rows), tuple(rows))


def _slip(run: Run, path: str, window: slice) -> tuple[float, float]:
    """Return the slip time of an element under load and its largest torque meanwhile; 0 if it does not slip."""
    time, torque = run["time"][window], np.abs(run[f"{path}.tau"])
    # A barely touching element has a torque of rounding errors.
    loaded = torque[window] > _ROUNDING * np.max(torque)
    slips = np.isin(run[f"{path}.mode"][window], _SLIDING) & loaded
    if not slips.any():
        return 0.0, 0.0
    inside = np.where(slips, torque[window], 0.0)
    k = int(np.argmax(inside))
    largest = float(inside[k])
    # The maximum may be between two results: at the vertex of the parabola through three of them.
    if 0 < k < len(inside) - 1 and slips[k - 1] and slips[k + 1] and time[k - 1] < time[k] < time[k + 1]:
        bend, slope, _ = np.polyfit(time[k - 1 : k + 2] - time[k], inside[k - 1 : k + 2], 2)
        if bend < 0:
            largest = max(largest, abs(run.at(float(time[k] - 0.5 * slope / bend))[f"{path}.tau"]))
    return float(np.sum(np.diff(time)[slips[1:] | slips[:-1]])), largest
