"""FMUs for a master: FMPy's Co-Simulation slaves of FMI 2.0 and 3.0 with one interface."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import fmpy
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import fmi2Discard, fmi2LastSuccessfulTime, fmi2Terminated
from fmpy.simulation import instantiate_fmu

from modelica_like.fmi.inside import DISCRETE, REAL, Refused, savings

_STORED = {name: name for name in (*REAL, *DISCRETE)} | {"Enumeration": "Integer"}


class Terminated(Exception):
    """An FMU ends the run at a time in s."""

    def __init__(self, unit: str, time: float) -> None:
        super().__init__(unit, time)
        self.detail = {"unit": unit, "time": time}


class Slave:
    """One FMU, whose messages `hear` gets; `notice` is called before each call of the FMU.

    Attributes:
        variables: FMPy's descriptions of the scalar variables by name, without parameters.
        results: names of its continuous outputs and of its states.
        slopes: whether it takes the slopes of its inputs.
        can_save: whether its state can be saved and restored (`save`, `load`, `free`) and its steps may vary.
    """

    def __init__(self, name: str, folder: Path, hear: Callable[..., None], notice: Callable[[], None]) -> None:
        self.name, self.notice = name, notice
        notice()
        self.description: Any = fmpy.read_model_description(str(folder), validate=False)
        about = self.description.coSimulation
        if self.description.fmiVersion == "1.0" or about is None:
            old = self.description.fmiVersion == "1.0"
            raise Refused(kind="too old" if old else "no co-simulation", unit=name)
        second = self.description.fmiVersion == "2.0"
        variables = (v for v in self.description.modelVariables if v.type in _STORED and not v.shape)
        self.all = {v.name: v for v in variables if v.causality != "independent"}
        self.variables = {n: v for n, v in self.all.items() if "arameter" not in (v.causality or "")}
        states = {v.derivative.name for v in self.all.values() if v.derivative is not None}
        self.results = [
            name
            for name, v in self.variables.items()
            if v.type in REAL and v.variability in (None, "continuous") and (v.causality == "output" or name in states)
        ]
        self.slopes = second and bool(about.canInterpolateInputs)
        self.can_save = bool(about.canGetAndSetFMUstate and about.canHandleVariableCommunicationStepSize)
        self._fmu: Any = instantiate_fmu(
            str(folder), self.description, "CoSimulation", logger=hear, event_mode_used=False
        )
        self.save, self.load, self.free = map(self._noticed, savings(self._fmu, self.description.fmiVersion))

    def _noticed(self, function: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any) -> Any:
            self.notice()
            return function(*arguments)

        return call

    def enter_initialization(self, start: float, stop: float, tolerance: float | None) -> None:
        """Enter the initialization mode."""
        self.notice()
        if self.description.fmiVersion == "2.0":
            self._fmu.setupExperiment(tolerance=tolerance, startTime=start, stopTime=stop)
            self._fmu.enterInitializationMode()
        else:
            self._fmu.enterInitializationMode(tolerance=tolerance, startTime=start, stopTime=stop)

    def exit_initialization(self) -> None:
        """Leave the initialization mode."""
        self.notice()
        self._fmu.exitInitializationMode()

    def _stored(self, name: str) -> str:
        kind = _STORED[self.all[name].type]
        # In FMI 3.0 only enumerations have this type; they are read as 64 bits.
        return "Int64" if kind == "Integer" and self.description.fmiVersion != "2.0" else kind

    def set(self, name: str, value: float) -> None:
        """Set a variable."""
        self.notice()
        kind = self._stored(name)
        given: Any = float(value) if kind in REAL else bool(value) if kind == "Boolean" else round(value)
        getattr(self._fmu, f"set{kind}")([self.all[name].valueReference], [given])

    def reader(self, names: Sequence[str]) -> Callable[[], list[float]]:
        """Return a function that reads variables, with one call of the FMU for each type."""
        groups: dict[str, list[int]] = {}
        for place, name in enumerate(names):
            groups.setdefault(self._stored(name), []).append(place)
        calls = [
            (getattr(self._fmu, f"get{kind}"), [self.all[names[k]].valueReference for k in places], places)
            for kind, places in groups.items()
        ]

        def read() -> list[float]:
            self.notice()
            values = [0.0] * len(names)
            for get, references, places in calls:
                for place, value in zip(places, get(references), strict=True):
                    values[place] = float(value)
            return values

        return read

    def give_slopes(self, names: Sequence[str], slopes: Sequence[float]) -> None:
        """Give the slopes of inputs for the next step."""
        self.notice()
        references = [self.all[name].valueReference for name in names]
        self._fmu.setRealInputDerivatives(references, [1] * len(names), list(slopes))

    def step(self, time: float, size: float) -> None:
        """Step to time + size, or raise `Terminated`."""
        self.notice()
        try:
            done = self._fmu.doStep(currentCommunicationPoint=time, communicationStepSize=size,
                                    noSetFMUStatePriorToCurrentPoint=not self.can_save)  # fmt: skip
        except FMICallException as refused:
            if refused.status != fmi2Discard or not self._fmu.getBooleanStatus(fmi2Terminated):
                raise
            raise Terminated(self.name, self._fmu.getRealStatus(fmi2LastSuccessfulTime)) from None
        if isinstance(done, tuple) and done[1]:
            raise Terminated(self.name, done[3])

    def close(self) -> None:
        """Terminate the FMU."""
        self.notice()
        self._fmu.terminate()
        self._fmu.freeInstance()
