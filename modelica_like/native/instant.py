"""Instants of a run that another integrator does, by the compiled run-time."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence

import numpy as np

from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.native.library import MORE, Run
from modelica_like.native.model import Instance
from modelica_like.options import Options
from modelica_like.solve.initialize import Point
from modelica_like.solve.instants import impact_size
from modelica_like.solve.recorder import Event

_LEAST = 64
Rows = list[list[float]]


class InstantEngine:
    """Lets happen what happens at an instant; it remembers the last ones of its run.

    Args:
        model: the compiled model.
        start: time in s at which the run begins.
        end: time in s.
        options: of the run.
    """

    def __init__(self, model: CompiledDae, start: float, end: float, options: Options) -> None:
        self._instance, self._options = Instance(model), options
        self._instance.reset(start, end, options.rtol, options.atol)
        self._transitions = len(model.transitions)
        self._widths = {"events": 7, "impacts": impact_size(model)}
        self._run, self._rows = Run(), dict[str, Vector]()
        self._make_room(_LEAST)

    def settle(self, now: Point, located: Sequence[int]) -> tuple[int, Rows, Rows]:
        """Fire transitions, and what follows; `now` becomes the point after it, or where it could not go on.

        Args:
            now: the instant.
            located: numbers of the transitions.

        Returns:
            A code for `check`, and rows of `events` and `impacts` of `NativeRun` in native.c.
        """
        wanting, settle = np.zeros(self._transitions, np.uint8), self._instance.library.instant
        wanting[list(located)] = 1
        point = [np.array(part, dtype=float) for part in (now.x, now.z, now.d)]
        places = [one.ctypes.data for one in (wanting, *point)]
        while (code := settle(self._instance.address, now.t, *places, ctypes.byref(self._run))) == MORE:
            self._make_room(2 * len(self._rows["events"]))
        now.x, now.z, now.d = point
        events, impacts = (self._rows[name][: getattr(self._run, f"n_{name}")].tolist() for name in self._widths)
        return code, events, impacts

    def check(self, code: int, events: Sequence[Event]) -> None:
        """Raise the error of an instant that could not be passed; `events` are those of the run so far."""
        self._instance.check(code, events, self._options)

    def _make_room(self, rows: int) -> None:
        for name, width in self._widths.items():
            self._rows[name] = np.zeros((rows, width))
            setattr(self._run, name, self._rows[name].ctypes.data)
            setattr(self._run, f"room_{name}", rows)
