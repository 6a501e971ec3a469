"""Compiled models for the run-time, and their instances."""

from __future__ import annotations

import ctypes
import weakref
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from modelica_like.compile.cached import Cached
from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.compile.sliding import as_asked
from modelica_like.errors import ModelicaLikeError, NotEnoughMemory, UnknownName, did_you_mean
from modelica_like.fmi.interface import FmuVariable, interface
from modelica_like.fmi.model_file import model_file
from modelica_like.fmi.start_tables import start_tables
from modelica_like.fmi.tables import make_tables
from modelica_like.garbage import without_garbage_search
from modelica_like.native.code import compiled_code
from modelica_like.native.codes import Code
from modelica_like.native.failures import Failure, error_of
from modelica_like.native.library import MESSAGE_LENGTH, OK, POINT, library
from modelica_like.options import Options
from modelica_like.solve.initialize import Point, StartKind, StartPlan
from modelica_like.solve.recorder import Event


class NativeModel:
    """A model in the run-time; instances in all threads share it.

    Args:
        model: the compiled model.
        start: kind of start, if instances compute it themselves; by default that of the netlist.
        fixed_step: of its instances in s, 0 for adaptive steps.
        plan: which start values determine what; by default as the parameters and declared modes of the model ask for.
        compiled: whether its equations run as compiled code.

    Attributes:
        notice: why they do not in spite of that, or "".

    Raises:
        MissingStart, ContradictingStart: the start values do not determine all states.
        ExportError: there is no library, and none can be compiled.
        LanguageError: a function has no counterpart in C.
    """

    @without_garbage_search()
    def __init__(
        self, model: CompiledDae, start: StartKind | None = None, fixed_step: float = 0.0,
        plan: StartPlan | None = None, *, compiled: bool = False,
    ) -> None:  # fmt: skip
        twin = model.twin(settings={**model.settings, **({"start": start} if start else {})})
        face = interface(twin)
        tables = start_tables(twin, plan) if plan else face.start
        made = make_tables(twin, tables)
        data = model_file(made, face.variables, "{native}", Options.rtol, fixed_step)
        self.library = library()
        message = ctypes.create_string_buffer(MESSAGE_LENGTH)
        self.address = self.library.open(data, len(data), message)
        if not self.address:
            raise ModelicaLikeError(message.value.decode())
        weakref.finalize(self, self.library.close, self.address)
        self._code, self.notice = compiled_code(made) if compiled else (None, "")
        if self._code is not None:
            self.library.compiled(self.address, ctypes.addressof(ctypes.c_char.in_dll(self._code, "codes")))
        self.start: StartKind = twin.settings.get("start", "given")
        self.plan = tables.plan
        self.variables = {variable.name: variable for variable in face.variables}
        self.name, self.sizes = model.name, (len(model.states), len(model.implicit), model.discrete_size)

    @staticmethod
    def of(
        model: CompiledDae, start: StartKind | None = None, fixed_step: float = 0.0,
        plan: StartPlan | None = None, *, compiled: bool = False,
    ) -> NativeModel:  # fmt: skip
        """Return the cached one of the same model, for any parameter values."""
        model, kind = as_asked(model), start or model.settings.get("start", "given")
        rests = model.settings.get("on_chattering") == "rest"
        key = Cached.NATIVE, kind, fixed_step, rests, plan and plan.choice, compiled
        if not (fixed_step or plan or compiled):
            _made(model).setdefault(kind, None)
        return model.once(key, lambda: NativeModel(model, kind, fixed_step, plan, compiled=compiled))

    @staticmethod
    def any_start(model: CompiledDae) -> StartKind:
        """Return a kind of start of which there is a cached one, or else one that needs no start values."""
        for kind in _made(as_asked(model)):
            return kind
        return "steady"

    def references(self, names: Iterable[str]) -> np.ndarray[Any, np.dtype[np.uint32]]:
        """Return the value references of variables.

        Raises:
            UnknownName: there is no such variable.
        """
        variables: list[FmuVariable] = []
        for name in names:
            if name not in self.variables:
                raise UnknownName(f"{self.name} has no variable '{name}'{did_you_mean(name, self.variables) or '.'}")
            variables.append(self.variables[name])
        return np.array([variable.reference for variable in variables], np.uint32)


def _made(model: CompiledDae) -> dict[StartKind, None]:
    """Kinds of start of which there is a model in the run-time."""
    return model.once(Cached.NATIVE_STARTS, dict)


class Instance:
    """An instance of a model: memory, state, and functions that raise errors of the run-time.

    Args:
        model: the compiled model; its parameters and inputs are those of the instance.
        start, fixed_step, plan, compiled: as of `NativeModel`.
    """

    def __init__(
        self, model: CompiledDae, start: StartKind | None = None, fixed_step: float = 0.0,
        plan: StartPlan | None = None, *, compiled: bool = False,
    ) -> None:  # fmt: skip
        self.model, self.native = model, NativeModel.of(model, start, fixed_step, plan, compiled=compiled)
        self.library = self.native.library
        self.address = self.library.new(self.native.address)
        if not self.address:
            raise NotEnoughMemory(f"There is not enough memory for an instance of {model.name}.")
        # The model must outlive it.
        weakref.finalize(self, _free, self.library, self.address, self.native)

    def check(self, code: int, events: Sequence[Event] = (), options: Options | None = None) -> None:
        """Raise the error of a failed call.

        Args:
            code: what the call has returned.
            events: of the run, if they are known.
            options: of the run.
        """
        if code != OK:
            raise error_of(self._failure(events, options or Options()))

    def _failure(self, events: Sequence[Event], options: Options) -> Failure:
        places, model = POINT(), as_asked(self.model)
        failure, nx, nd = self.library.failure(self.address, places).contents, len(model.states), model.discrete_size
        sizes = nx + len(model.implicit), nd, nd, len(model.p), len(model.u)
        x, d, before, p, u = (np.array(place[:size], float) for place, size in zip(places, sizes, strict=True))
        reference = failure.place if failure.place >= 0 else None
        return Failure(
            model.twin(p=p, u=u), self.native.start, Code(failure.code), int(failure.place),
            next((name for name, variable in self.native.variables.items() if variable.reference == reference), ""),
            tuple(failure.numbers), Point(self.time, x[:nx], x[nx:], d), before,
            self.library.message(self.address).decode(), events, options,
        )  # fmt: skip

    def reset(self, t0: float, end: float, rtol: float, atol: float) -> None:
        """Start again at a time in s, with the model's parameters and inputs; `end` may be infinite."""
        self.check(self.library.reset(self.address, t0, end, rtol, atol))
        self.library.set_all(self.address, _at(self.model.p), _at(self.model.u))

    @property
    def time(self) -> float:
        """Where it stands, in s."""
        return self.library.time(self.address)

    def point(self) -> tuple[Vector, Vector]:
        """Return views of states and implicit unknowns, and of d, which change with the instance."""
        places, unknowns = POINT(), len(self.model.states) + len(self.model.implicit)
        self.library.failure(self.address, places)
        x, d = (
            np.ctypeslib.as_array(place, (size,)) if size else np.zeros(0)
            for place, size in ((places[0], unknowns), (places[1], self.model.discrete_size))
        )
        return x, d

    def present(self) -> Point:
        """Return where it stands."""
        x, d = self.point()
        nx = len(self.model.states)
        return Point(self.time, x[:nx].copy(), x[nx:].copy(), d.copy())

    @property
    def failed(self) -> Code:
        """What has failed last."""
        return Code(self.library.failure(self.address, POINT()).contents.code)

    def limit(self, longest: float) -> None:
        """Limit steps from now on, in s."""
        self.library.limit(self.address, longest)

    def begin_at(self, point: Point) -> None:
        """Start at a consistent point, before its events."""
        self.check(self.at(self.library.begin_at, point))

    def begin_differentiable(self, by: np.ndarray[Any, np.dtype[np.uint32]]) -> None:
        """Start as the model says, before the events there, and keep the run for its derivatives by references."""
        self.check(self.library.gradient_start(self.library.instance(self.address), by.ctypes.data, by.size))
        self.check(self.library.begin(self.address))

    def at(self, function: Callable[..., int], point: Point, *arguments: Any) -> int:
        """Call a function of the run-time that goes to a point, and return its code."""
        arrays = [np.ascontiguousarray(part, dtype=float) for part in (point.x, point.z, point.d)]
        return function(self.address, *(_at(array) for array in arrays), *arguments)

    def counts(self) -> tuple[int, int, int, int]:
        """Steps, rejected steps, evaluations of the equations, and mode changes since the reset."""
        counts = np.zeros(4)
        self.library.counts(self.address, _at(counts))
        steps, rejected, evaluations, events = (int(count) for count in counts)
        return steps, rejected, evaluations, events


def _free(loaded: Any, address: int, _: NativeModel) -> None:
    loaded.free(address)


def _at(array: Vector) -> int:
    return array.ctypes.data
