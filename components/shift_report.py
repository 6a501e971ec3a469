"""Torque and friction work of the shifts of an automatic gearbox, from a run."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, Protocol

import numpy as np

from modelica_like.language.quantities import Energy, Time, Torque
from modelica_like.language.results import Result, line

_ELEMENTS = ("clutch_a", "clutch_b", "brake_c", "brake_d", "clutch_e")
_ROUNDING = 1e-9
_NAMES = {-1.0: "R", 0.0: "N"}


class Run(Protocol):
    """Trajectories by path, as a `Solution` has them."""

    def __getitem__(self, key: str, /) -> Any:
        """Return a trajectory."""
        ...


class ElementShift(Result):
    """What a clutch or brake does in a shift."""

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
    """Work out what every clutch and brake does in every shift.

    A shift lasts until the next one begins. Its friction work is the integral of the loss power over the results of the
    run; a dozen results while an element slips make it exact to four digits.

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
        # The results have both sides of the instant at which the next shift begins.
        window = slice(first, last)
        name = _NAMES.get(float(gear[first]), f"{gear[first]:g}")
        for element in elements:
            rows += _element(run, f"{box}.{element}", window, (name, float(time[first]), element))
    return ShiftReport(sum(row.work for row in rows), tuple(rows))


def _element(run: Run, path: str, window: slice, head: tuple[str, float, str]) -> list[ElementShift]:
    power = run[f"{path}.loss_power"]
    # What sticks has a slip of rounding errors.
    power = np.where(power > _ROUNDING * np.max(power), power, 0.0)[window]
    if not np.any(power):
        return []
    time, torque, slips = run["time"][window], run[f"{path}.tau"][window], power > 0
    between = (slips[1:] | slips[:-1]) & (np.diff(time) > 0)
    slipping = float(np.sum(np.diff(time)[between]))
    # The torque at which slip begins or ends counts, too.
    ends = np.append(between, False) | np.append(False, between)
    return [ElementShift(*head, slipping, float(np.max(np.abs(torque[ends]))), _integral(time, power))]


def _integral(time: Any, power: Any) -> float:
    """Integrate cubics piece by piece; between the pieces there are the two sides of an event."""
    total = 0.0
    for piece in np.split(np.arange(len(time)), np.flatnonzero(np.diff(time) == 0) + 1):
        t, p = time[piece], power[piece]
        step = np.diff(t)
        total += float(np.sum(0.5 * step * (p[1:] + p[:-1])))
        if len(t) > 2:
            slope = np.gradient(p, t, edge_order=2)
            total += float(np.sum(step**2 * (slope[:-1] - slope[1:]))) / 12
    return total
