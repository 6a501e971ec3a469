"""A handle for control loops and learning: set, step, read and restore, at the speed of C."""

from __future__ import annotations

import ctypes
import math
import weakref
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from modelica_like.arguments import checked
from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.errors import ValueOutOfRange
from modelica_like.native.buffers import Buffers
from modelica_like.native.model import Instance
from modelica_like.options import Options
from modelica_like.simulation import positive_step
from modelica_like.solve.initialize import StartKind

_ROUNDING = 1e-9
"""Relative distance by which a time may be before the present one: sums of steps differ in their last digits."""


class Native:
    """One instance of a model in memory.

    ```python
    drive = build("drive.toml").native(inputs=["drive.u"], outputs=["load.w"])
    while drive.time < 1.0:
        drive.inputs[0] = controller(drive.outputs[0])
        drive.step(drive.time + 1e-3)
    ```

    Values are in SI units. Only one thread at a time may use a handle; handles of one model run in parallel.

    Args:
        model: the compiled model.
        inputs: inputs and tunable parameters that steps set.
        outputs: variables, modes (as numbers) and other quantities of the model's FMU, read by steps.
        start: `given`, `rest` or `steady`; by default that of the netlist.
        rtol: relative tolerance.
        atol: absolute tolerance, in nominal values; by default a hundredth of `rtol`.
        by: parameters, inputs that are held, and start values; `gradient` differentiates with respect to them.
        fixed_step: step size in s, or a time such as "1 ms", for bounded work per step; steps and output intervals
            are whole numbers of it. By default the step size is adaptive.
        compiled: whether the equations become machine code, with the same results: at first use the C compiler takes
            about a second. Without a compiler `notice` says so, and they run as tapes.

    Raises:
        ValueOutOfRange: the fixed step is not a positive time.

    Attributes:
        inputs: set by the next step, shape (inputs,); write into it.
        outputs: read by the last step, shape (outputs,); the next step overwrites it.
        notice: why equations are not compiled that should be, or "".
    """

    @checked
    def __init__(
        self, model: CompiledDae, inputs: Sequence[str] = (), outputs: Sequence[str] = (), *, by: Sequence[str] = (),
        start: StartKind | None = None, rtol: float = Options.rtol, atol: float | None = None,
        fixed_step: float | str | None = None, compiled: bool = False,
    ) -> None:  # fmt: skip
        self._instance = Instance(model, start, positive_step(fixed_step), compiled=compiled)
        self._library, self._address = self._instance.library, self._instance.address
        self._tolerances = rtol, rtol / 100 if atol is None else atol
        names = self._instance.native
        self.notice = names.notice
        self._references = names.references(inputs), names.references(outputs)
        self._by = names.references(by)
        self.inputs, self.outputs = np.zeros(len(inputs)), np.zeros(len(outputs))
        self._step = tuple(
            part
            for references, values in zip(self._references, (self.inputs, self.outputs), strict=True)
            for part in (len(values), references.ctypes.data, values.ctypes.data)
        )
        self.reset()

    def reset(
        self, values: Mapping[str, float] | None = None, *, t0: float | None = None, until: float = math.inf
    ) -> None:
        """Start again.

        Args:
            values: other values of parameters, inputs and start values by path.
            t0: start time in s; by default that of the netlist, or zero.
            until: end of the run, if known.

        Raises:
            UnknownName, ValueOutOfRange: a value cannot be set, or a time is no number.
            InitializationError, SolveError: there is no start with these values.
        """
        given, t0 = values or {}, self._instance.model.begin if t0 is None else t0
        for name, time in (("t0", t0), ("until", until)):
            _number(name, time)
        self._instance.reset(t0, until, *self._tolerances)
        if given:
            self.set(given)
        if self._by.size:
            self._instance.begin_differentiable(self._by)
        else:
            self._instance.check(self._library.begin(self._address))
        if self.inputs.size:
            self._instance.check(self._library.get(self._address, *self._step[:3]))
        self._instance.check(self._library.get(self._address, *self._step[3:]))

    def set(self, values: Mapping[str, float]) -> None:
        """Set inputs and tunable parameters by path, from now on."""
        references, numbers = self._instance.native.references(values), np.array([*values.values()], float)
        self._instance.check(
            self._library.set(self._address, len(numbers), references.ctypes.data, numbers.ctypes.data)
        )

    def get(self, *names: str) -> Vector:
        """Return variables at the present point, shape (names,)."""
        return self._read(self._instance.native.references(names), np.zeros(len(names)))

    def step(self, time: float) -> Vector:
        """Set `inputs`, step to a time in s through all events, and return `outputs`, shape (outputs,).

        Where a component has ended the run before, it stays at that time: see `time`.

        Raises:
            SolveError: the run cannot continue; use `restore` or `reset`.
            ValueOutOfRange: an input cannot be set, the time is before the present one or not finite, or it is not a
                whole number of fixed steps away.
        """
        self._check_later(time)
        code = self._library.step(self._address, time, *self._step)
        if code:
            self._instance.check(code)
        return self.outputs

    def gradient(self) -> Vector:
        """Return the derivatives of `outputs` with respect to `by`, through all events since the start.

        It costs about three runs, for any number of parameters and one output. By what leads off a kink at which the
        run stays (an output limited to what it just is) there is none: `sensitivities` tells those of both sides.

        Returns:
            Shape (outputs, by); nan by what has none, where others have. Alone it is refused with the reason.

        Raises:
            NoGradient: by nothing there are any: at an event a small change leads to other modes, a rate jumps without
                an event, a copy was restored, or the run has too many steps to keep.
        """
        self._read(self._references[1], self.outputs)  # after events that come first
        slopes = np.zeros((len(self.outputs), self._by.size))
        whole, of = self._library.instance(self._address), self._references[1]
        self._instance.check(self._library.gradient(whole, of.ctypes.data, of.size, slopes.ctypes.data))
        return slopes

    @property
    def time(self) -> float:
        """Present time in s."""
        return self._library.time(self._address)

    @property
    def states(self) -> Vector:
        """States at the present point, shape (states,), in the order of `model.states` and in SI units.

        Others can be set, also during a run; modes change if their events say so. What modes hold then, such as the
        slip of a clutch that sticks, or whose slip was set to the other sign, is stopped as in an impact: momentum is
        kept.

        Raises:
            ValueOutOfRange: a state is not finite, or their number is another one.
            SolveError: the run cannot continue from there; use `restore` or `reset`.
        """
        return self._at_states(None)

    @states.setter
    def states(self, values: Any) -> None:
        given = np.ascontiguousarray(values, dtype=float)
        if given.shape != (self._instance.native.sizes[0],):
            raise ValueOutOfRange(f"There are {self._instance.native.sizes[0]} states, not {given.size}.")
        self._at_states(given)
        self._read(self._references[1], self.outputs)

    def _at_states(self, given: Vector | None) -> Vector:
        states = np.zeros(self._instance.native.sizes[0])
        place = None if given is None else given.ctypes.data
        self._instance.check(self._library.states(self._address, place, states.ctypes.data))
        return states

    def copy(self) -> Copy:
        """Return a copy of the state, to restore any number of times."""
        return Copy(self._instance)

    def restore(self, copy: Copy) -> None:
        """Restore a copy of this handle or of another one of the same model; `outputs` follow."""
        copy.into(self._instance)
        self._read(self._references[1], self.outputs)

    def run(self, until: float, points: int = 500) -> tuple[Vector, Vector]:
        """Run to a time, with results at equal intervals and on both sides of every event.

        Returns:
            Times, shape (n,), and outputs, shape (n, outputs).

        Raises:
            SolveError: the run cannot continue; use `restore` or `reset`.
            ValueOutOfRange: the time is before the present one or not finite, or the number of intervals is no positive
                whole number.
        """
        self._check_later(until)
        if not isinstance(points, (int, np.integer)) or points < 1:
            raise ValueOutOfRange(f"points must be a positive whole number, not {points!r}.")
        widths = {"times": 1, "outputs": len(self.outputs)}
        written = Buffers(self._instance, until, points, widths, self._references[1])
        self._instance.check(written.go(lambda _: True))
        return written["times"][:, 0], written["outputs"]

    def _check_later(self, time: float) -> None:
        """Refuse what is no time from now on: C would step for ever, or stay where it is."""
        if not math.isfinite(_number("time", time)):
            raise ValueOutOfRange(f"The time must be finite, not {time} s.")
        present = self._library.time(self._address)
        if time < present - _ROUNDING * max(1.0, abs(present)):
            raise ValueOutOfRange(
                f"The time {time:.9g} s is before the present one, {present:.9g} s.",
                advice="Go back with `restore`, or begin again with `reset`.",
            )

    def _read(self, references: Any, values: Vector) -> Vector:
        self._instance.check(self._library.get(self._address, len(values), references.ctypes.data, values.ctypes.data))
        return values


def _number(name: str, time: float) -> float:
    """Return a time, unless it is none: in the middle of a control loop there are no units."""
    try:
        if not math.isnan(time):
            return time
    except TypeError:
        pass
    raise ValueOutOfRange(f"{name} must be a number of seconds, not {time!r}.")


class Copy:
    """A copy of an instance's state."""

    def __init__(self, instance: Instance) -> None:
        self._instance, self._memory = instance, ctypes.c_void_p()
        instance.check(instance.library.copy(instance.address, ctypes.byref(self._memory)))
        weakref.finalize(self, _drop, instance, self._memory)

    def into(self, instance: Instance) -> None:
        """Write it into an instance of the same model."""
        if instance.native is not self._instance.native:
            raise ValueOutOfRange("The copy is that of another model.")
        instance.check(instance.library.restore(instance.address, self._memory))


def _drop(instance: Instance, memory: Any) -> None:
    instance.library.drop(instance.address, ctypes.byref(memory))
