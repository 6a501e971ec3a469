"""Buffers that the run-time writes a run into."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from modelica_like.compile.compiled import Vector
from modelica_like.errors import ValueOutOfRange
from modelica_like.native.library import MORE, PAUSED, Run
from modelica_like.native.model import Instance
from modelica_like.options import memory
from modelica_like.solve.dense import MOST_KEPT

_COUNTED = {
    "points": ("times", "states", "outputs"), "segments": ("modes", "firsts"), "events": ("events",),
    "impacts": ("impacts",), "taken": ("steps_taken",),
}  # fmt: skip
_LEAST = 32
_AT_ONCE = 2
"""Rows that are written together."""
_BREATH = 5000
"""Number of steps between two checks for an interrupt."""


class Buffers:
    """A run of an instance, and its results.

    Args:
        instance: a started one.
        end: end time in s.
        points: number of equal intervals of the results.
        widths: arrays to write (of `NativeRun` in native.c), with the number of columns.
        outputs: value references of the outputs.
        room: for events and impacts at first. An instant for which there is none is passed again, and derivatives of
            the run are lost.

    Attributes:
        emptied: takes the steps for which there is no more room.
    """

    emptied: Callable[[Vector], None]

    def __init__(
        self, instance: Instance, end: float, points: int, widths: Mapping[str, int], outputs: Any = (),
        *, room: int = _LEAST,
    ) -> None:  # fmt: skip
        self.instance, self.end, self.points = instance, end, points
        self.references = np.array(outputs, np.uint32)
        self.run = Run(steps=_BREATH, n_outputs=len(self.references), references=self.references.ctypes.data)
        self._widths, self._arrays = widths, dict[str, Vector]()
        # What is not wanted needs no room, and takes none of the time of a short run.
        written = {counted: [name for name in names if name in widths] for counted, names in _COUNTED.items()}
        self._written = {counted: names for counted, names in written.items() if names or counted == "points"}
        for counted, names in self._written.items():
            first = {"points": points + 2 * _LEAST, "events": room, "impacts": room}.get(counted, _LEAST)
            self._make_room(counted, names, first)

    def go(self, reached: Callable[[float], bool]) -> int:
        """Run to the end, and return the last code.

        Args:
            reached: called at intervals with the time reached; returns whether to continue.
        """
        while True:
            arguments = self.instance.address, self.end, self.points, ctypes.byref(self.run)
            code = self.instance.library.run(*arguments)
            if not reached(self.run.last) or code not in (MORE, PAUSED):
                return code
            rooms = {counted: getattr(self.run, f"room_{counted}") for counted in self._written}
            full = [counted for counted in rooms if getattr(self.run, f"n_{counted}") + _AT_ONCE > rooms[counted]]
            # An instant may have more events than there is room for, and leaves none of them.
            for counted in (full or rooms) if code == MORE else ():
                names, room = self._written[counted], 2 * rooms[counted]
                if names == ["steps_taken"] and room * self._widths[names[0]] > MOST_KEPT:
                    self.emptied(self["steps_taken"])
                    self.run.n_taken = 0
                else:
                    self._make_room(counted, names, room)

    def __getitem__(self, name: str) -> Vector:
        """Written rows, shape (rows, columns)."""
        counted = next(counted for counted, names in _COUNTED.items() if name in names)
        return self._arrays[name][: getattr(self.run, f"n_{counted}")]

    def _make_room(self, counted: str, names: Iterable[str], room: int) -> None:
        needed = 8.0 * room * sum([self._widths[name] for name in names])
        if needed > (there := memory()):
            raise ValueOutOfRange(
                f"By {self.run.last:.6g} s there are {self.run.n_points:,} results, two of them at every event; more "
                f"of them need room of {needed / 1e9:.3g} GB, and this machine has {there / 1e9:.3g} GB.",
                advice="Run a shorter time, or a part of the drive.",
            )
        setattr(self.run, f"room_{counted}", room)
        for name in names:
            new = np.empty((room, self._widths[name]))
            if name in self._arrays:
                new[: len(self[name])] = self[name]
            self._arrays[name] = new
            setattr(self.run, name, new.ctypes.data)
