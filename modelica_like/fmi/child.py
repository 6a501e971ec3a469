"""Runs one FMU with FMPy in a separate process: python child.py FOLDER."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Collection
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal, cast

import fmpy
import numpy as np
from fmpy.simulation import Recorder

from modelica_like.fmi.inside import DISCRETE, REAL, Job, Refused, about, savings

Side = Literal["left", "right"]
KINDS = {"me": "ModelExchange", "cs": "CoSimulation"}
POINTS = 500
"""Default number of equal intervals, as in simulations."""
_TIME_RESOLUTION = 1e-12
_OF_STEP = 4
"""Results of a step of FMI 3.0; the last one is its time."""


class EventLocator:
    """Finds the mode changes inside communication steps, by stepping again from a saved state."""

    def __init__(self, recorder: Recorder, fmi: str) -> None:
        self._fmu: Any = recorder.fmu
        self._recorder = recorder
        self._save, self._load, self._free = savings(self._fmu, fmi)
        self._columns = [k for k, column in enumerate(recorder.cols) if column[1] not in (np.float64, np.float32)]
        self._state: Any = None
        self._from = 0.0

    def __call__(self, time: float) -> None:
        """Note that a communication step has ended."""
        rows = self._recorder.rows
        if self._state is not None and self._modes(rows[-1]) != self._modes(rows[-2]):
            rows.pop()
            self._step_through(time)
        self.begin(time)

    def begin(self, time: float) -> None:
        """Save the state at the beginning of a communication step."""
        self.free()
        self._state, self._from = self._save(), time

    def free(self) -> None:
        """Free the saved state."""
        if self._state is not None:
            self._free(self._state)
            self._state = None

    def _modes(self, row: tuple[Any, ...]) -> list[Any]:
        return [row[k] for k in self._columns]

    def _probe(self, step: float) -> tuple[Any, ...]:
        """Step from the saved state."""
        self._load(self._state)
        if step > 0.0:
            self._fmu.doStep(currentCommunicationPoint=self._from, communicationStepSize=step)
        self._recorder.sample(self._from + step, force=True)
        return self._recorder.rows.pop()

    def _step_through(self, end: float) -> None:
        """Repeat the step to its end, with both sides of every mode change."""
        while self._from < end:
            before = self._modes(self._probe(0.0))
            if self._modes(row := self._probe(end - self._from)) == before:
                self._recorder.rows.append(row)
                return
            low, high = 0.0, end - self._from
            while high - low > max(_TIME_RESOLUTION, 4 * np.spacing(self._from)):
                middle = (low + high) / 2
                if self._modes(self._probe(middle)) == before:
                    low = middle
                else:
                    high = middle
            time = self._from + high
            self._recorder.rows.append((time, *self._probe(low)[1:]))
            row = self._probe(high)
            self._recorder.rows.append(row)
            self.begin(time)


class Ending:
    """Sees whether an FMU ends the run, behind the functions by which it says so; it has a last row then.

    Attributes:
        seen: whether it does.
        recorder: of the run, once a step is done.
        time: of the end in s, where a step of FMI 3.0 tells it: FMPy may take the end of that step.
    """

    def __init__(self, fmu: Any, kind: str) -> None:
        self.seen, self.recorder, self._kind = False, cast("Recorder | None", None), kind
        self.time: float | None = None
        for name in ("doStep", "getBooleanStatus", "newDiscreteStates", "updateDiscreteStates"):
            if hasattr(fmu, name):
                setattr(fmu, name, self._watched(getattr(fmu, name)))

    def _watched(self, call: Callable[..., Any]) -> Callable[..., Any]:
        def watched(*given: Any, **named: Any) -> Any:
            done = call(*given, **named)
            if done[1] if isinstance(done, tuple) else done:
                self.seen = True
                if isinstance(done, tuple) and len(done) == _OF_STEP:
                    self.time = done[-1]
                if self._kind == "me" and self.recorder is not None:  # FMPy leaves out what the event has done
                    self.recorder.sample(self.recorder.rows[-1][0], force=True)
            return done

        return watched


def take_arrays(parameters: dict[str, Any], arrays: dict[str, tuple[int, ...]]) -> None:
    """Write arrays number behind number, row by row, as FMPy wants them.

    Args:
        parameters: what was asked for, under names that the FMU has.
        arrays: shapes of its arrays; all else are scalars.
    """
    for name, value in parameters.items():
        given, wanted = np.shape(value), arrays.get(name, ())
        if given not in (wanted, (math.prod(wanted),) if wanted else ()):
            raise Refused(kind="shape", name=name, wanted=_size(wanted), given=_size(given))
        if given:
            parameters[name] = np.ravel(value).tolist()


def _size(shape: tuple[int, ...]) -> str:
    return f"an array of {' x '.join(map(str, shape))}" if shape else "a number"


def check_names(job: dict[str, Any], causality: dict[str, str], arrays: Collection[str] = ()) -> None:
    """Refuse parameters, inputs and outputs that the FMU does not have.

    Args:
        job: the request.
        causality: of every scalar variable.
        arrays: what else may be a parameter.
    """
    for name in [*(set(job["parameters"]) - set(arrays)), *(job["outputs"] or ()), *job["inputs"]]:
        if name not in causality:
            raise Refused(kind="unknown", name=name, known=list(causality))
    for name in job["inputs"]:
        if causality[name] != "input":
            inputs = [n for n, c in causality.items() if c == "input"]
            raise Refused(kind="no input", name=name, causality=causality[name], known=inputs)


def interpolate(series: Any, times: Any, side: Side) -> Any:
    """Interpolate a series of (time, value) linearly; at jumps take its `left` or `right` value."""
    instants, values = np.transpose(series)
    if len(instants) == 1:
        return np.full(np.shape(times), values[0])
    after = np.clip(np.searchsorted(instants, times, side), 1, len(instants) - 1)
    span = instants[after] - instants[after - 1]
    part = np.clip((times - instants[after - 1]) / np.where(span > 0, span, 1), 0, 1)
    return values[after - 1] + part * (values[after] - values[after - 1])


def input_table(inputs: dict[str, Any]) -> Any:
    """Return inputs in FMPy's form: a row for every time, two where an input jumps."""
    if not inputs:
        return None
    times = np.unique(np.concatenate([s[:, 0] for s in inputs.values()]))
    jumps = np.unique(np.concatenate([s[1:, 0][np.diff(s[:, 0]) == 0] for s in inputs.values()]))
    rows: list[tuple[float, ...]] = []
    sides: tuple[tuple[Side, Any], ...] = (("left", times), ("right", jumps))
    for side, instants in sides:
        rows += zip(instants, *(interpolate(s, instants, side) for s in inputs.values()), strict=True)
    rows.sort(key=lambda row: row[0])
    return np.array(rows, dtype=[("time", float), *((n, float) for n in inputs)])


class Ramps:
    """Gives an FMU time-varying inputs.

    A slave gets their slopes if it supports them, otherwise their means over short steps; FMPy would hold them for a
    step. In Model Exchange they are set at every time; FMPy's solver would keep those of its last evaluation of
    indicators.
    """

    def __init__(self, fmu: Any, description: Any, inputs: dict[str, Any], kind: str, start: float) -> None:
        variables = [v for v in description.modelVariables if v.name in inputs and v.type in ("Real", "Float64")]
        moving = [v for v in variables if v.variability in (None, "continuous") and np.ptp(inputs[v.name][:, 1])]
        self._fmu, self._series = fmu, [inputs[v.name] for v in moving]
        self._references = [v.valueReference for v in moving]
        self._kinks = np.unique(np.concatenate([[], *(s[:, 0] for s in self._series)]))
        self._write = fmu.setFloat64 if description.fmiVersion.startswith("3") else fmu.setReal
        if kind == "cs":
            side = description.coSimulation
            self._sloped = description.fmiVersion == "2.0" and side.canInterpolateInputs
            self._divides = side.canHandleVariableCommunicationStepSize
            self._do_step, fmu.doStep = fmu.doStep, self.step
        elif description.fmiVersion != "1.0":
            self._now = self._begin = start
            self._end = math.inf
            self._set_time, fmu.setTime = fmu.setTime, self.set_time
            self._resume, fmu.enterContinuousTimeMode = fmu.enterContinuousTimeMode, self.resume

    def set_time(self, time: float) -> None:
        """Set the time and its inputs; the inputs before a jump hold until its event."""
        self._set_time(time)
        self._now = time
        place = min(max(time, self._begin), self._end)
        self._set(self._values(place, "left" if place > self._begin else "right"))

    def resume(self) -> None:
        """Continue after an event."""
        self._resume()
        self._begin = self._now
        jumps = (t for s in self._series for t in s[1:, 0][np.diff(s[:, 0]) == 0] if t > self._begin)
        self._end = min(jumps, default=math.inf)

    def step(self, currentCommunicationPoint: float, communicationStepSize: float, **rest: Any) -> Any:
        """Divide a step into pieces: in each, inputs are linear and, without slopes, change little."""
        done: Any = None
        end = currentCommunicationPoint + communicationStepSize
        grid = self._grid(currentCommunicationPoint, end)
        for low, high in pairwise(grid):
            first, last = self._values(low, "right"), self._values(high, "left")
            self._set(first if self._sloped else (first + last) / 2)
            if self._sloped:
                slopes = (last - first) / (high - low)
                self._fmu.setRealInputDerivatives(self._references, [1] * len(slopes), list(slopes))
            done = self._do_step(currentCommunicationPoint=low, communicationStepSize=high - low, **rest)
            if isinstance(done, tuple) and any(done[:3]):
                done = (*done[:2], done[2] or high < end, end := done[3] if done[2] else high)
                break
        if not self._sloped:
            self._set(self._values(end, "left"))
        return done

    def _grid(self, begin: float, end: float) -> list[float]:
        if not self._divides:
            return [begin, end]
        corners = [begin, *self._kinks[(self._kinks > begin) & (self._kinks < end)], end]
        grid = [begin]
        for low, high in pairwise(corners):
            change = self._values(high, "left") - self._values(low, "right")
            parts = [abs(c) / np.ptp(s[:, 1]) * POINTS for c, s in zip(change, self._series, strict=True)]
            count = 1 if self._sloped else math.ceil(max(parts))
            grid += [*np.linspace(low, high, max(count, 1) + 1)[1:]]
        return grid

    def _values(self, time: float, side: Side) -> Any:
        return np.array([float(interpolate(series, time, side)) for series in self._series])

    def _set(self, values: Any) -> None:
        self._write(self._references, list(values))


def output_step(job: dict[str, Any], stop: float, suggested: Any) -> float | None:
    """Return the communication step; None means that suggested by the FMU."""
    if job["step"] is not None and not job["points"]:
        return job["step"]
    if suggested is not None and not job["points"]:
        return None
    return (stop - job["start"]) / (job["points"] or POINTS)


def can_locate(description: Any, kind: str) -> bool:
    """Return whether mode changes inside a communication step can be found by stepping again."""
    if kind != "cs" or description.fmiVersion == "1.0":
        return False
    cs = description.coSimulation
    able = cs.canGetAndSetFMUstate and cs.canHandleVariableCommunicationStepSize
    return bool(able) and not getattr(cs, "hasEventMode", False)


def watcher(job: Job, description: Any, kind: str, ending: Ending) -> Callable[[float, Recorder], bool]:
    """Return the callback after every step: report the time, locate mode changes."""
    locators: list[EventLocator] = []

    def after_step(time: float, recorder: Recorder) -> bool:
        job.reach(time)
        ending.recorder = recorder
        if can_locate(description, kind):
            if not locators:
                locators.append(EventLocator(recorder, description.fmiVersion))
            locators[0](time)
        return True

    return after_step


def run(job: Job) -> None:
    """Run the job of a folder."""
    request, fmu = job.asked, str(job.folder / "0")
    description: Any = fmpy.read_model_description(fmu, validate=False)
    has = {"cs": description.coSimulation is not None, "me": description.modelExchange is not None}
    kind = request["kind"] or ("cs" if has["cs"] else "me")
    if not any(has.values()):
        raise Refused(kind="scheduled")
    if not has[kind]:
        raise Refused(kind="no kind", wanted=KINDS[kind])
    numbers = [v for v in description.modelVariables if v.type in (*REAL, *DISCRETE)]
    scalars = {v.name: v for v in numbers if v.name != "time" and not v.shape}
    arrays = {v.name: tuple(v.shape) for v in numbers if v.shape}
    check_names(request, {name: v.causality or "local" for name, v in scalars.items()}, arrays)
    take_arrays(request["parameters"], arrays)
    outputs = request["outputs"] or [name for name, v in scalars.items() if v.causality != "parameter"]
    instance = _instance(job, description, kind)
    ending = Ending(instance, kind)
    table = np.asarray(simulate(job, description, kind, outputs, instance, ending))
    if ending.time is not None:
        table["time"][-1] = ending.time
    np.save(job.folder / "result.npy", table)
    parameters = {name: v.start for name, v in scalars.items() if v.causality == "parameter"}
    constants = {name: start for name, start in parameters.items() if start not in (None, "true", "false")}
    variables = [*map(about, scalars.values())]
    job.leave({"name": description.modelName, "variables": variables, "constants": constants, "ended": ending.seen})
    instance.freeInstance()  # after all else: it may crash there


def _instance(job: Job, description: Any, kind: str) -> Any:
    event_mode, make = _has_event_mode(description), cast("Any", fmpy.instantiate_fmu)
    return make(
        str(job.folder / "0"), description, KINDS[kind], logger=job.hear, early_return_allowed=event_mode,
        event_mode_used=event_mode, require_functions=False,
    )  # fmt: skip


def _has_event_mode(description: Any) -> bool:
    return bool(getattr(description.coSimulation, "hasEventMode", False))


def simulate(
    job: Job, description: Any, kind: str, outputs: list[str], instance: Any, ending: Ending
) -> Any:  # fmt: skip
    """Run the FMU by FMPy; return its table."""
    request, fmu = job.asked, str(job.folder / "0")
    experiment = description.defaultExperiment
    stop = request["stop"] if request["stop"] is not None else getattr(experiment, "stopTime", None)
    stop = float(stop) if stop is not None else request["start"] + 1.0
    step = output_step(request, stop, getattr(experiment, "stepSize", None))
    inputs = {n: np.array(v if isinstance(v, list) else [[0.0, v]]) for n, v in request["inputs"].items()}
    event_mode = _has_event_mode(description)
    if any(np.ptp(series[:, 1]) for series in inputs.values()):
        Ramps(instance, description, inputs, kind, request["start"])
    go: Any = fmpy.simulate_fmu
    return go(
        fmu, validate=False, model_description=description, fmi_type=KINDS[kind], start_time=request["start"],
        stop_time=stop, solver=request["solver"], relative_tolerance=request["tolerance"],
        step_size=step if request["solver"] == "Euler" else None, output_interval=step,
        start_values=request["parameters"], input=input_table(inputs), output=outputs,
        use_event_mode=event_mode, early_return_allowed=event_mode, fmu_instance=instance,
        step_finished=watcher(job, description, kind, ending),
    )  # fmt: skip


if __name__ == "__main__":
    run(Job(Path(sys.argv[1])))
