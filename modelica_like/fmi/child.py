"""Runs one FMU with FMPy, in a process of its own: python child.py FOLDER.

The folder holds `job.json` and the unpacked FMU in `fmu`. What came out is left there: `result.npy` and `meta.json`, or
`error.json`; `progress` holds the time reached. Nothing of the package is imported here: the process starts fast.
"""

from __future__ import annotations

import json
import mmap
import struct
import sys
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Any

import fmpy
import numpy as np
from fmpy.simulation import Recorder

KINDS = {"me": "ModelExchange", "cs": "CoSimulation"}
NUMBERS = ("Real", "Float32", "Float64")
DISCRETE = (
    "Integer",
    "Enumeration",
    "Boolean",
    "Int8",
    "UInt8",
    "Int16",
    "UInt16",
    "Int32",
    "UInt32",
    "Int64",
    "UInt64",
)
POINTS = 500
"""Number of equal intervals where nobody says anything, as in simulations."""
_MESSAGES = 20
_TIME_RESOLUTION = 1e-12


class Refusal(Exception):
    """What the caller asked for cannot be done; `detail` goes to `error.json`."""

    def __init__(self, **detail: Any) -> None:
        super().__init__(str(detail))
        self.detail = detail


class EventLocator:
    """Finds the mode changes inside communication steps, by stepping again from a saved state."""

    def __init__(self, recorder: Recorder, fmi: str) -> None:
        fmu: Any = recorder.fmu
        self._fmu, self._recorder = fmu, recorder
        self._save, self._load, self._free = (
            (fmu.getFMUstate, fmu.setFMUstate, fmu.freeFMUstate)
            if fmi == "2.0"
            else (fmu.getFMUState, fmu.setFMUState, fmu.freeFMUState)
        )
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
        """Give the saved state back."""
        if self._state is not None:
            self._free(self._state)
            self._state = None

    def _modes(self, row: tuple[Any, ...]) -> list[Any]:
        return [row[k] for k in self._columns]

    def _sample(self, time: float) -> tuple[Any, ...]:
        self._recorder.sample(time, force=True)
        return self._recorder.rows.pop()

    def _probe(self, step: float) -> tuple[Any, ...]:
        """Step from the saved state."""
        self._load(self._state)
        if step > 0.0:
            self._fmu.doStep(currentCommunicationPoint=self._from, communicationStepSize=step)
        return self._sample(self._from + step)

    def _step_through(self, end: float) -> None:
        """Go to the end again, with both sides of every mode change on the way."""
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


def variables(description: Any) -> list[dict[str, Any]]:
    """Return what is to be known about every scalar variable."""
    found: list[dict[str, Any]] = []
    for variable in description.modelVariables:
        if variable.shape or variable.name == "time" or variable.type not in (*NUMBERS, *DISCRETE):
            continue
        declared = variable.declaredType
        items = [(int(item.value), item.name) for item in getattr(declared, "items", None) or ()]
        found.append(
            {
                "name": variable.name,
                "unit": variable.unit or getattr(declared, "unit", None) or "1",
                "description": variable.description or "",
                "causality": variable.causality or "local",
                "discrete": variable.type in DISCRETE,
                "start": variable.start,
                "items": items,
            }
        )
    return found


def choose_kind(description: Any, kind: str | None) -> str:
    """Return me or cs."""
    has = {"cs": description.coSimulation is not None, "me": description.modelExchange is not None}
    chosen = kind or ("cs" if has["cs"] else "me")
    if not has[chosen]:
        raise Refusal(kind="no kind", wanted=KINDS[chosen])
    return chosen


def check_names(job: dict[str, Any], found: list[dict[str, Any]]) -> None:
    """Refuse parameters, inputs and outputs that the FMU does not have."""
    causality = {variable["name"]: variable["causality"] for variable in found}
    for name in [*job["parameters"], *(job["outputs"] or ()), *job["inputs"]]:
        if name not in causality:
            raise Refusal(kind="unknown", name=name, known=list(causality))
    for name in job["inputs"]:
        if causality[name] != "input":
            known = [n for n, c in causality.items() if c == "input"]
            raise Refusal(kind="no input", name=name, causality=causality[name], known=known)


def input_table(inputs: dict[str, Any], stop: float) -> Any:
    """Return inputs as FMPy wants them; a number is a constant, otherwise pairs of time and value."""
    if not inputs:
        return None
    series = {n: np.atleast_2d(v if isinstance(v, list) else [[0.0, v], [stop, v]]) for n, v in inputs.items()}
    times = np.unique(np.concatenate([s[:, 0] for s in series.values()]))
    columns = [times, *(np.interp(times, s[:, 0], s[:, 1]) for s in series.values())]
    return np.array(list(zip(*columns, strict=True)), dtype=[("time", float), *((n, float) for n in series)])


def output_step(job: dict[str, Any], stop: float, suggested: Any) -> float | None:
    """Return the communication step; None is what the FMU suggests."""
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


def watcher(folder: Path, description: Any, kind: str) -> Callable[[float, Recorder], bool]:
    """Return what is to be done after every step: tell the time, locate mode changes."""
    file = (folder / "progress").open("r+b")
    memory = mmap.mmap(file.fileno(), 8)
    locators: list[EventLocator] = []

    def after_step(time: float, recorder: Recorder) -> bool:
        memory[:8] = struct.pack("d", time)
        if can_locate(description, kind):
            if not locators:
                locators.append(EventLocator(recorder, description.fmiVersion))
            locators[0](time)
        return True

    return after_step


def run(folder: Path) -> None:
    """Run the job of a folder."""
    job = json.loads((folder / "job.json").read_text())
    description: Any = fmpy.read_model_description(str(folder / "fmu"), validate=False)
    found = variables(description)
    kind = choose_kind(description, job["kind"])
    check_names(job, found)
    experiment = description.defaultExperiment
    stop = job["stop"] if job["stop"] is not None else getattr(experiment, "stopTime", None)
    stop = float(stop) if stop is not None else job["start"] + 1.0
    step = output_step(job, stop, getattr(experiment, "stepSize", None))
    outputs = job["outputs"] or [v["name"] for v in found if v["causality"] != "parameter"]
    event_mode = bool(getattr(description.coSimulation, "hasEventMode", False))
    messages: list[str] = []

    def log(*arguments: Any) -> None:
        text = arguments[-1]
        messages.append(text.decode(errors="replace") if isinstance(text, bytes) else str(text))
        del messages[:-_MESSAGES]

    sys.excepthook = reporter(folder, messages)
    simulate: Any = fmpy.simulate_fmu
    result = simulate(
        str(folder / "fmu"), validate=False, model_description=description, fmi_type=KINDS[kind],
        start_time=job["start"], stop_time=stop, solver=job["solver"], relative_tolerance=job["tolerance"],
        step_size=step if job["solver"] == "Euler" else None, output_interval=step,
        start_values=job["parameters"], input=input_table(job["inputs"], stop), output=outputs,
        use_event_mode=event_mode, early_return_allowed=event_mode, remote_platform=None, logger=log,
        step_finished=watcher(folder, description, kind),
    )  # fmt: skip
    np.save(folder / "result.npy", np.asarray(result))
    meta = {
        "name": description.modelName, "version": description.fmiVersion, "kind": kind, "variables": found,
        "messages": messages,
    }  # fmt: skip
    (folder / "meta.json").write_text(json.dumps(meta))


def reporter(folder: Path, messages: list[str]) -> Callable[..., None]:
    """Return an exception hook that leaves the error in the folder."""

    def report(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
        if isinstance(error, Refusal):
            detail = error.detail
        else:
            detail = {"kind": "failed", "text": str(error) or kind.__name__, "messages": messages}
        (folder / "error.json").write_text(json.dumps(detail))

    return report


if __name__ == "__main__":
    sys.excepthook = reporter(Path(sys.argv[1]), [])
    run(Path(sys.argv[1]))
