"""Requests of the page: runs with other values, their sensitivities, and files."""

from __future__ import annotations

import copy
import math
import threading
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from modelica_like.analyse.sensitivity.derivatives import sensitivities
from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.errors import ModelicaLikeError
from modelica_like.fmi.export import export_fmu
from modelica_like.language import Assembly
from modelica_like.native.buffers import Buffers
from modelica_like.native.library import OK
from modelica_like.native.model import Instance
from modelica_like.netlist import save
from modelica_like.options import Options
from modelica_like.show.report.page import save_report
from modelica_like.simulation import build, simulate

_MOST_BARS = 12
_LOOK = 0.05
"""Seconds between two looks whether a run that waits for another is still wanted."""
FILES = {"netlist": ".toml", "FMU": ".fmu", "report": ".html"}
"""What can be saved, with the endings."""


class Runs:
    """Runs of one drive with other values.

    Args:
        drive: the drive.
        model: the same, compiled.
        options: tolerances and number of results.
    """

    def __init__(self, drive: Assembly, model: CompiledDae, options: Options) -> None:
        self._drive, self._model, self._options = drive, model, options
        self._instance = Instance(model)
        self.references = {name: variable.reference for name, variable in self._instance.native.variables.items()}
        self._names = {reference: name for name, reference in self.references.items()}
        self._settable = {self.references[parameter.path] for parameter in model.flat_parameters if parameter.tunable}
        self._settable |= {self.references[model.flat_variables[k].path] for k in model.inputs}
        self._running, self._analysing = threading.Lock(), threading.Lock()

    def values(self, request: Mapping[str, Any]) -> list[tuple[int, float]]:
        """Return the value references of parameters and inputs in a request, with what they are, in SI units.

        Raises:
            KeyError, TypeError, ValueError: the request is wrong.
        """
        return [(_known(reference, self._settable), number(value)) for reference, value in request["values"]]

    def outputs(self, request: Mapping[str, Any]) -> list[int]:
        """Return the value references of the outputs in a request.

        Raises:
            KeyError, TypeError, ValueError: the request is wrong.
        """
        return [_known(reference, self._names) for reference in request["references"]]

    def run(
        self, values: Sequence[tuple[int, float]], references: Sequence[int], until: float, wanted: Callable[[], bool]
    ) -> tuple[dict[str, Any], list[Vector]] | None:
        """Run the drive, one run at a time.

        Args:
            values: value references of parameters and inputs, with what they are, in SI units.
            references: value references of the requested outputs.
            until: end time in s.
            wanted: tells whether the run is still wanted.

        Returns:
            Counts and a message if the run did not finish; times, outputs and events as rows. None: it is not wanted.
        """
        while not self._running.acquire(timeout=_LOOK):
            if not wanted():
                return None
        try:
            return self._run(values, references, until, wanted)
        finally:
            self._running.release()

    def _run(
        self, values: Sequence[tuple[int, float]], references: Sequence[int], until: float, wanted: Callable[[], bool]
    ) -> tuple[dict[str, Any], list[Vector]] | None:
        instance, widths = self._instance, {"times": 1, "outputs": len(references), "events": 7}
        if not wanted():
            return None
        try:
            self._begin(values, until)
        except ModelicaLikeError as error:
            return self._about(self._said(error, values)), [np.zeros(0)] * 3
        written = Buffers(instance, until, self._options.points, widths, references)
        code = written.go(lambda _: wanted() and written.run.n_events <= self._options.max_events)
        message = instance.library.message(instance.address).decode() if code != OK else ""
        return self._about(message), [written[name] for name in ("times", "outputs", "events")]

    def _begin(self, values: Sequence[tuple[int, float]], until: float) -> None:
        instance = self._instance
        references, numbers = (
            np.array([value[k] for value in values], kind) for k, kind in ((0, np.uint32), (1, float))
        )
        instance.reset(0.0, until, self._options.rtol, self._options.atol)
        place = references.ctypes.data, numbers.ctypes.data
        instance.check(instance.library.set(instance.address, len(values), *place))
        instance.check(instance.library.begin(instance.address))

    def _about(self, message: str) -> dict[str, Any]:
        return {"message": message, "steps": self._instance.counts()[0]}

    def _said(self, error: ModelicaLikeError, values: Sequence[tuple[int, float]]) -> str:
        """The message of a netlist with these values is better than that of the run-time."""
        try:
            build(self.changed(values))
        except ModelicaLikeError as told:
            error = told
        return f"{error.what} {error.advice}".strip()

    def changed(self, values: Sequence[tuple[int, float]]) -> Assembly:
        """Return the drive with other values of parameters.

        Raises:
            ModelicaLikeError: a value is out of range.
        """
        drive = copy.deepcopy(self._drive)
        for reference, value in values:
            drive.set(self._names[reference], value)
        return drive

    def ranking(self, values: Sequence[tuple[int, float]], until: float, output: str) -> dict[str, Any]:
        """Return by how much the final value of an output changes with one percent of each parameter.

        Returns:
            Rows of names and changes, in percent, or in the unit of an output that ends at zero; a caption.

        Raises:
            NoGradient, ModelicaLikeError: there are no derivatives.
        """
        given = {self._names[reference]: value for reference, value in values}
        with self._analysing:
            sensitivity = sensitivities(self._model, [output], until=until, parameters=given)
        (end,) = sensitivity.outputs
        rows = [
            (quantity.name, relative if end.value else 0.01 * quantity.value * derivative)
            for quantity, derivative, relative in sensitivity.ranking(output)
        ]
        rows = [row for row in rows if row[1]][:_MOST_BARS]
        caption = (
            f"change in {'percent' if end.value else end.unit_text or 'its value'} for one percent of the parameter"
        )
        ends = f"{output} ends at {end.value:.5g} {end.unit_text}".rstrip()
        return {"caption": caption if rows else f"{ends}, and no parameter changes that.", "rows": rows}

    def save(self, what: str, values: Sequence[tuple[int, float]], until: float, folder: Path) -> Path:
        """Write the changed drive into a folder, without overwriting files.

        Args:
            what: one of `FILES`.
            values: of parameters.
            until: end time of the report in s.
            folder: for the file.

        Raises:
            ModelicaLikeError: the values are wrong, or it cannot be run or exported.
            OSError: it cannot be written.
        """
        drive, ending = self.changed(values), FILES[what]
        names = (f"{self._model.name}_explored{number or ''}{ending}" for number in range(10_000))
        path = next(folder / name for name in names if not (folder / name).exists())
        if what == "netlist":
            save(drive, path)
        elif what == "FMU":
            export_fmu(drive, path)
        else:
            save_report(drive, simulate(drive, until), path)
        return path


def number(value: Any) -> float:
    """Return a finite number.

    Raises:
        TypeError, ValueError: it is none.
    """
    if not math.isfinite(value):
        raise ValueError(f"{value} is not finite")
    return float(value)


def _known(reference: Any, allowed: Collection[int]) -> int:
    if not isinstance(reference, int) or reference not in allowed:
        raise ValueError(f"there is no reference {reference}")
    return reference
