"""Many runs of one model in C that return only numbers, for sweeps."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.errors import NotEnoughMemory
from modelica_like.native.library import BatchArguments
from modelica_like.native.model import NativeModel
from modelica_like.options import Options
from modelica_like.solve.initialize import StartKind

Kind = Literal["end", "at", "max", "integral", "first", "reach", "change", "impact"]
_KINDS: tuple[Kind, ...] = ("end", "at", "max", "integral", "first", "reach", "change", "impact")
_RECORD = np.dtype(
    [*((name, np.int32) for name in ("kind", "place", "before", "after", "number", "unused")), ("moment", float)]
)


@dataclass(frozen=True)
class Reading:
    """A number to read off a run.

    Attributes:
        kind: value at the end or at a moment, largest value, integral, first time above zero, first time not below it,
            time of a mode change, energy in J lost in impacts.
        place: position of the variable, of the mode, or of the held motion.
        change: numbers of the modes before and after (-1: any), and which of several such changes.
        moment: in s.
    """

    kind: Kind
    place: int
    change: tuple[int, int, int] = (-1, -1, 1)
    moment: float = 0.0


class Batch:
    """Runs of a model that differ in parameters and inputs; several threads may use it at once.

    Args:
        model: the compiled model.
        readings: numbers to read off every run.
        options: tolerances and largest number of events.
        span: start and end time in s.
        start: kind of start; by default that of the netlist.

    Attributes:
        notice: why equations are not compiled that should be, or "".

    Raises:
        MissingStart, ContradictingStart: the start values do not determine all states.
        ExportError: there is no library, and none can be compiled.
        LanguageError: a function has no counterpart in C.
    """

    def __init__(
        self, model: CompiledDae, readings: Sequence[Reading], options: Options, span: tuple[float, float],
        start: StartKind | None = None,
    ) -> None:  # fmt: skip
        settings = {**model.settings, "on_chattering": options.on_chattering}
        self._native = NativeModel.of(model.twin(settings=settings), start, compiled=options.compiled)
        self.notice = self._native.notice
        self._options, self._span = options, span
        rows = [(_KINDS.index(reading.kind), reading.place, *reading.change, 0, reading.moment) for reading in readings]
        self._readings = np.array(rows, _RECORD)

    def run(self, parameters: Vector, inputs: Vector, stop: ctypes.c_int | None = None) -> tuple[Vector, Any]:
        """Do runs one after the other, without blocking other threads.

        Args:
            parameters: in the order of `model.p`, unchecked, shape (runs, parameters).
            inputs: in the order of `model.u`, shape (runs, inputs).
            stop: becomes nonzero when the results are no longer needed.

        Returns:
            Numbers, shape (runs, readings), nan for changes that do not happen, and which runs failed, shape (runs,).
        """
        runs, options = len(parameters), self._options
        values, failed = np.empty((runs, len(self._readings))), np.ones(runs, np.uint8)
        numbers = [np.ascontiguousarray(values, float) for values in (parameters, inputs)]
        places = (array.ctypes.data for array in (self._readings, *numbers, values, failed))
        counts = options.max_events, runs, len(self._readings)
        stops = ctypes.pointer(ctypes.c_int(0) if stop is None else stop)
        arguments = BatchArguments(*self._span, options.rtol, options.atol, *counts, *places, stops)
        if self._native.library.batch(self._native.address, ctypes.byref(arguments)) < 0:
            raise NotEnoughMemory(f"There is not enough memory for runs of {self._native.name}.")
        return values, failed.astype(bool)
