"""Runs of the netlist that a page shows: with other values, their sensitivities, and pictures of an instant."""

from __future__ import annotations

import copy
import math
import threading
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any

import numpy as np

from modelica_like.analyse.calibration.calibrate import calibrate
from modelica_like.analyse.calibration.measurements import Trajectories
from modelica_like.analyse.optimize.optimize import optimize
from modelica_like.analyse.optimize.result import Front
from modelica_like.analyse.sensitivity.derivatives import sensitivities
from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.edit.saving import rewritten
from modelica_like.errors import Interrupted, ModelicaLikeError
from modelica_like.language import Assembly
from modelica_like.language.inside import inside
from modelica_like.language.units import parse_unit, to_si
from modelica_like.native.buffers import Buffers
from modelica_like.native.library import OK
from modelica_like.native.model import Instance
from modelica_like.runs.signals import Signal, read_signals
from modelica_like.runs.solution import Solution
from modelica_like.show.browser.page import page_content
from modelica_like.show.plot import for_page
from modelica_like.show.report.start import other_values, start_values
from modelica_like.simulation import build, plan, simulate

_MOST_BARS = 12
_LOOK = 0.05
"""Seconds between two looks whether a run that waits for another is still wanted."""
_NO_END = 1.0
"""End of a run in s, where the netlist has none."""


class Runs:
    """Runs of one drive with other values.

    Args:
        drive: the drive.
        model: the same, compiled.
        until: end time, a number in s or a quantity; by default that of the netlist, or else one second.

    Raises:
        ModelicaLikeError: the end time is wrong, or there are not all start values.

    Attributes:
        until: end time in s.
    """

    def __init__(self, drive: Assembly, model: CompiledDae, until: float | str | None = None) -> None:
        self._drive, self._model = drive, model
        self.until, self._options = plan(model, until or model.settings.get("until") or _NO_END)
        self._solution: tuple[Any, Solution] | None = None
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
        instance.reset(self._model.begin, until, self._options.rtol, self._options.atol)
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

    def solution(self, values: Sequence[tuple[int, float]] = ()) -> Solution:
        """Return a run with all variables, until the end; the last one is kept.

        Raises:
            ModelicaLikeError: it cannot be run.
        """
        key = tuple(values)
        with self._analysing:
            if self._solution is None or self._solution[0] != key:
                given = {self._names[reference]: value for reference, value in values}
                run = simulate(self._model, self.until, parameters=given, options=self._options, solver="native")
                self._solution = key, run
            return self._solution[1]

    def content(self, shown: Sequence[str]) -> dict[str, Any]:
        """Return what the script of a page reads; see `page_content`.

        Args:
            shown: names or formulas of curves; those that the drive does not have are left out, and without any there
                are the usual ones.

        Raises:
            ModelicaLikeError: it cannot be run, which shows what is usual.
        """
        signals = [signal for name in shown for signal in self._signals(name)]
        if not signals:
            signals = for_page(self.solution())[0]
        return page_content(self._model, signals, self.until, self._options)

    def _signals(self, name: str) -> list[Signal]:
        modes = {discrete.path for discrete in self._model.flat_discretes if discrete.names}
        try:
            return [signal for signal in read_signals(self._model, [name]) if signal.name not in modes]
        except ModelicaLikeError:
            return []  # its part has gone

    def scales(self, units: Sequence[tuple[str, str]]) -> list[tuple[float, float]]:
        """Return the factor and the offset from each unit to the SI unit of a variable, a formula or `time`.

        Raises:
            UnitError, UnknownName: it does not fit, or there is no such variable.
        """
        rows: list[tuple[float, float]] = []
        for name, text in units:
            unit = parse_unit("s" if name == "time" else read_signals(self._model, [name])[0].unit)
            zero, one = (to_si(f"{k} {text}" if text else float(k), unit, name) for k in (0, 1))
            rows.append((one - zero, zero))
        return rows

    def calibrated(
        self, values: Sequence[tuple[int, float]], time: Sequence[float], columns: Mapping[str, Sequence[float]],
        free: Mapping[str, tuple[float, float]], wanted: Callable[[], bool],
    ) -> dict[str, Any] | None:  # fmt: skip
        """Find the parameters with which the drive fits measured curves best.

        Args:
            values: value references of parameters and inputs, with what they are, in SI units.
            time: in s; what was measured before 0 s is left out.
            columns: measured variables in SI units, shape (len(time),); nan is a gap.
            free: lower and upper bound of each parameter in SI units.
            wanted: tells whether the answer is still wanted.

        Returns:
            `values`, names with numbers in SI units, and `text`, which says how well they are known. None: not wanted.

        Raises:
            ModelicaLikeError: they cannot be found.
        """
        times, tables = np.array(time), dict[bytes, dict[str, Vector]]()
        for name, column in columns.items():
            there = np.isfinite(column) & (times >= 0.0)
            if there.any():  # one run for all columns with the same gaps
                tables.setdefault(there.tobytes(), {"time": times[there]})[name] = np.array(column)[there]
        data = [Trajectories(table) for table in tables.values()]
        try:
            with self._analysing:
                fit = calibrate(self.changed(values), data, free, progress=_while(wanted))
        except Interrupted:
            return None
        return {"values": [(name, float(value)) for name, value in zip(fit.names, fit.values, strict=True)],
                "text": str(fit)}  # fmt: skip

    def optimized(
        self, values: Sequence[tuple[int, float]], wanted: Callable[[], bool], progress: Callable[[int, int], None]
    ) -> dict[str, Any] | None:
        """Find the best design that [optimize] of the netlist asks for.

        Args:
            values: value references of parameters and inputs, with what they are, in SI units.
            wanted: tells whether the answer is still wanted.
            progress: called after each design with the number of those tried, and about the most that there can be.

        Returns:
            `about`, the answer as text; `feasible`, whether all limits hold; `text`, the netlist with the best values,
            empty for a front and where no netlist can have them. None: not wanted.

        Raises:
            ModelicaLikeError: there is none.
        """
        try:
            with self._analysing:
                best = optimize(self.changed(values), progress=_while(wanted, progress))
        except Interrupted:
            return None
        if isinstance(best, Front):
            return {"about": str(best), "feasible": True, "text": ""}
        text = rewritten(best.best_drive(), inside(self._drive).origin)
        return {"about": str(best), "feasible": best.feasible, "text": text or ""}

    def starts(self) -> list[dict[str, Any]]:
        """Return start values in SI units, with their origins."""
        asked = self._drive, self._model, self._model.settings.get("start", "given")
        rows = [*start_values(*asked), *other_values(*asked)]
        return [{"path": r.path, "value": float(r.value), "unit": r.unit, "origin": r.origin} for r in rows]


def _while(
    wanted: Callable[[], bool], progress: Callable[[int, int], None] = lambda designs, most: None
) -> Callable[[int, int], None]:
    """Return a progress of searches that ends them when nobody waits for them any more."""

    def told(designs: int, most: int) -> None:
        progress(designs, most)
        if not wanted():
            raise Interrupted

    return told


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
