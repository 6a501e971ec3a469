"""Compiled models for the run-time, and their instances."""

from __future__ import annotations

import ctypes
import re
import weakref
from collections.abc import Iterable
from typing import Any

import numpy as np

from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.compile.sliding import as_asked
from modelica_like.errors import (
    Chattering,
    ContradictingStart,
    InitializationError,
    LimitPassed,
    ModelicaLikeError,
    NoGradient,
    NoValidModes,
    SingularAtStart,
    StepFailed,
    UnknownName,
    ValueOutOfRange,
    did_you_mean,
)
from modelica_like.fmi.interface import FmuVariable, interface
from modelica_like.fmi.model_file import model_file
from modelica_like.fmi.tables import make_tables
from modelica_like.native.library import MESSAGE_LENGTH, OK, library
from modelica_like.options import Options
from modelica_like.solve.initialize import Point, StartKind

_ERRORS: tuple[tuple[str, type[ModelicaLikeError]], ...] = (
    ("The integrator gave up|The step from", StepFailed),
    (r"Modes still switch|Discrete variables do not|Events follow each other|At \S+ s the condition of", Chattering),
    (r"At t = \S+ s no combination", NoValidModes),
    (r"At t = \S+ s .* contradicts the rest of the circuit", NoValidModes),
    ("The Jacobian is singular|The derivative of .* is not finite", SingularAtStart),
    (r"t = \S+ s: ", LimitPassed),
    ("Two start values|A start value of", ContradictingStart),
    ("There are no derivatives", NoGradient),
    ("The equations for|No start|No steady|The modes at the start", InitializationError),
)
"""Error class of a message of the run-time; all others are wrong values."""


def failure(message: str) -> ModelicaLikeError:
    """Return a message of the run-time as the corresponding Python error, with message and advice."""
    kind = next((kind for pattern, kind in _ERRORS if re.match(pattern, message)), ValueOutOfRange)
    what, _, advice = message.partition(". ")
    return kind(f"{what.removesuffix('.')}.", advice=advice)


class NativeModel:
    """A model in the run-time; instances in all threads share it.

    Args:
        model: the compiled model.
        start: kind of start, if instances compute it themselves; by default that of the netlist.
        fixed_step: of its instances in s, 0 for adaptive steps.

    Raises:
        MissingStart, ContradictingStart: the start values do not determine all states.
        ExportError: there is no library, and none can be compiled.
        LanguageError: a function has no counterpart in C.
    """

    def __init__(self, model: CompiledDae, start: StartKind | None = None, fixed_step: float = 0.0) -> None:
        twin = model.twin(settings={**model.settings, **({"start": start} if start else {})})
        face = interface(twin)
        data = model_file(make_tables(twin, face.start), face.variables, "{native}", Options.rtol, fixed_step)
        self.library = library()
        message = ctypes.create_string_buffer(MESSAGE_LENGTH)
        self.address = self.library.open(data, len(data), message)
        if not self.address:
            raise ModelicaLikeError(message.value.decode())
        weakref.finalize(self, self.library.close, self.address)
        self.variables = {one.name: one for one in face.variables}
        self.name, self.sizes = model.name, (len(model.states), len(model.implicit), model.discrete_size)

    @staticmethod
    def of(model: CompiledDae, start: StartKind | None = None, fixed_step: float = 0.0) -> NativeModel:
        """Return the cached one of the same model, for any parameter values."""
        model, kind = as_asked(model), start or model.settings.get("start", "given")
        key = "native", kind, fixed_step, model.settings.get("on_chattering") == "rest"
        return model.once(key, lambda: NativeModel(model, kind, fixed_step))

    def references(self, names: Iterable[str]) -> np.ndarray[Any, np.dtype[np.uint32]]:
        """Return the value references of variables.

        Raises:
            UnknownName: there is no such variable.
        """
        found: list[FmuVariable] = []
        for name in names:
            if name not in self.variables:
                raise UnknownName(f"{self.name} has no variable '{name}'{did_you_mean(name, self.variables) or '.'}")
            found.append(self.variables[name])
        return np.array([one.reference for one in found], np.uint32)


class Instance:
    """An instance of a model: memory, state, and functions that raise errors of the run-time.

    Args:
        model: the compiled model; its parameters and inputs are those of the instance.
        start, fixed_step: as of `NativeModel`.
    """

    def __init__(self, model: CompiledDae, start: StartKind | None = None, fixed_step: float = 0.0) -> None:
        self.model, self.native = model, NativeModel.of(model, start, fixed_step)
        self.library = self.native.library
        self.address = self.library.new(self.native.address)
        if not self.address:
            raise MemoryError(f"There is not enough memory for an instance of {model.name}.")
        # The model must outlive it.
        weakref.finalize(self, _free, self.library, self.address, self.native)

    def check(self, code: int) -> None:
        """Raise the error of a failed call."""
        if code != OK:
            raise failure(self.library.message(self.address).decode())

    def reset(self, t0: float, end: float, rtol: float, atol: float) -> None:
        """Start again at a time in s, with the model's parameters and inputs; `end` may be infinite."""
        self.check(self.library.reset(self.address, t0, end, rtol, atol))
        self.library.set_all(self.address, _at(self.model.p), _at(self.model.u))

    def limit(self, longest: float) -> None:
        """Limit steps from now on, in s."""
        self.library.limit(self.address, longest)

    def begin_at(self, point: Point) -> None:
        """Start at a consistent point, before its events."""
        arrays = [np.ascontiguousarray(part, dtype=float) for part in (point.x, point.z, point.d)]
        self.check(self.library.begin_at(self.address, *(_at(one) for one in arrays)))

    def counts(self) -> tuple[int, int, int, int]:
        """Steps, rejected steps, evaluations of the equations, and mode changes since the reset."""
        found = np.zeros(4)
        self.library.counts(self.address, _at(found))
        steps, rejected, evaluations, events = (int(one) for one in found)
        return steps, rejected, evaluations, events


def _free(loaded: Any, address: int, _: NativeModel) -> None:
    loaded.free(address)


def _at(array: Vector) -> int:
    return array.ctypes.data
