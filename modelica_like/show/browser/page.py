"""A drive as one page for a browser: the compiled run-time, the model, sliders and curves, without a server."""

from __future__ import annotations

import base64
import ctypes
import gzip
import hashlib
import json
import re
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

from modelica_like.arguments import checked
from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import ExportError, UnknownName
from modelica_like.flatten.model import FlatParameter
from modelica_like.fmi.build import BROWSER
from modelica_like.fmi.export import Report, compiled_open, silent, tool
from modelica_like.fmi.interface import FmuVariable, interface
from modelica_like.fmi.model_file import model_file
from modelica_like.fmi.package import target_file
from modelica_like.fmi.runtime import runtime_library
from modelica_like.fmi.tables import make_tables
from modelica_like.garbage import without_garbage_search
from modelica_like.language.formula import Formula
from modelica_like.language.units import ANY, ONE, Unit, coherent, parse_unit
from modelica_like.native.library import MESSAGE_LENGTH, Run
from modelica_like.options import Options
from modelica_like.runs.display import Display
from modelica_like.runs.signals import Signal, si_value
from modelica_like.show.plot import for_page
from modelica_like.show.plot import quantity as quantity_of
from modelica_like.simulation import Model, seconds, simulate
from modelica_like.writing import write_bytes

_SPREAD = 5.0
"""Sliders without bounds span from the value divided by this to the value times this."""
HELPERS = Path(__file__).parent / "helpers.js"
"""Common code of the scripts of pages."""
CURVES = Path(__file__).parent / "curves.js"
"""Curves over time, of all pages in which a drive runs."""
_POINTER_SIZE = 4
_HIGH = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")


@dataclass(frozen=True)
class Page:
    """A written page.

    Attributes:
        path: the page.
        sliders: number of adjustable parameters and inputs, without the end time.
        curves: number of curves shown at first.
        size: of the file in bytes.
        seconds: wall time.
    """

    path: Path
    sliders: int
    curves: int
    size: int
    seconds: float

    def __str__(self) -> str:
        counts = f"{self.sliders} sliders, {self.curves} curves"
        return f"{self.path}: {counts}, {self.size / 1000:.0f} kB, {self.seconds:.1f} s"


@without_garbage_search()
@checked
def export_html(
    drive: Model, path: str | Path, until: float | str | None = None, *, show: Sequence[str] = (),
    report: Report = silent,
) -> Page:  # fmt: skip
    """Write a drive as a page that simulates it in a browser: one file that loads nothing else.

    It has a slider for every tunable parameter and for every input without a value, and curves over time by unit, with
    modes and events. Sliders go from min to max if both are declared, otherwise from a fifth of the value to five
    times the value. IDAS runs the drive once first, to choose the curves.

    Args:
        drive: a component, a netlist file, or a compiled model.
        path: the page to write, with the ending .html.
        until: end time, a number in s or a quantity; by default that of the netlist.
        show: names, patterns or formulas of the first curves; by default speeds, torques and forces of the parts, or
            what a circuit has.
        report: called with the present activity.

    Raises:
        ExportError: it cannot be exported, or the run-time cannot be compiled.
        MissingExtra: the run-time must be compiled, and zig is not installed.
        UnknownName: nothing matches a pattern.
        ModelicaLikeError: the model has an error or no end time, or cannot be simulated.
    """
    begin = time.perf_counter()
    target = target_file(path, ".html", "A page")
    report("compiling the model")
    model, description, _ = compiled_open(drive, (), "flow", ())
    model.demand_begin_at_zero(ExportError, "A page")
    report("simulating")
    end = seconds(until if until is not None else model.settings.get("until"))
    solution = simulate(model, end)
    content = page_content(model, for_page(solution, show)[0], end, solution.options)
    report("writing the page")
    variables = interface(model)
    data = model_file(make_tables(model, variables.start), variables.variables, "{page}", solution.options.rtol)
    content |= {
        "model": _text(data), "runtime": _text(runtime_library(BROWSER.name, report).read_bytes()),
        "layout": _layout(), "message_length": MESSAGE_LENGTH,
    }  # fmt: skip
    write_bytes(target, page(model.name, description, content).encode())
    shown = sum(variable["shown"] for variable in content["variables"])
    size, elapsed = target.stat().st_size, time.perf_counter() - begin
    return Page(target, len(content["sliders"]) - 1, shown, size, elapsed)


def page(name: str, description: str, content: Mapping[str, Any]) -> str:
    """Return a page with sliders and curves.

    Args:
        name: of the drive.
        description: of the drive.
        content: what `page_content` has returned, and what wasm.js reads.
    """
    folder = Path(__file__).parent
    # No text may contain the end of the script.
    data = json.dumps(content, ensure_ascii=False, separators=(",", ":")).replace("<", "\\u003c")
    script = joined_scripts(HELPERS, CURVES, folder / "wasm.js", folder / "page.js")
    parts = {
        "name": escape(name), "description": escape(description), "page": data, "script": script,
        "hash": script_hash(script),
    }  # fmt: skip
    text = (folder / "page.html").read_text(encoding="utf-8")
    return re.sub(r"\{\{(\w+)\}\}", lambda match: parts[match[1]], text)


def joined_scripts(*files: Path) -> str:
    """Return the script of a page."""
    return "\n".join(file.read_text(encoding="utf-8").rstrip() for file in files)


def script_hash(script: str) -> str:
    """Return how a content policy names a script: only this one runs, whatever else gets into the page."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}'"


def page_content(model: CompiledDae, signals: Sequence[Signal], until: float, options: Options) -> dict[str, Any]:
    """Return what the script of a page reads: sliders, variables, modes and units.

    Args:
        model: the compiled model.
        signals: curves that are drawn at first.
        until: end time in s.
        options: of the runs.

    Raises:
        UnknownName: a formula has an energy in it.
    """
    variables = interface(model)
    end = {
        "name": "end time", "group": "", "reference": None, "description": "", "unit": "s", "factor": 1.0,
        "offset": 0.0, "value": until, "written": "s", "low": until / _SPREAD, "high": until * _SPREAD, "log": True,
    }  # fmt: skip
    units, display = _Units(), Display(model)
    return {
        "tool": tool(), "until": until,
        "rtol": options.rtol, "atol": options.atol, "points": options.points, "most_events": options.max_events,
        "sliders": [end, *_sliders(model, variables.by_name, display)],
        "variables": list(_variables(model, variables.by_name, signals, units, display)),
        "modes": [
            {
                "name": discrete.path, "reference": variables.by_name[discrete.path].reference,
                "names": discrete.names or None, "unit": units.number(ONE), "driving": 1,
            }
            for discrete in model.flat_discretes
            if not discrete.hidden
        ],
        "units": units.rows,
    }  # fmt: skip


def _text(data: bytes) -> str:
    return base64.b64encode(gzip.compress(data, mtime=0)).decode()


def _layout() -> dict[str, int]:
    """Offsets of the fields of `NativeRun` with pointers of four bytes."""
    places: dict[str, int] = {}
    place = 0
    for field in Run._fields_:
        size = _POINTER_SIZE if field[1] is ctypes.c_void_p else ctypes.sizeof(field[1])
        places[field[0]] = place + -place % size
        place = places[field[0]] + size
    return places | {"size": place}


class _Units:
    """Shown units, each once."""

    def __init__(self) -> None:
        self.rows: list[dict[str, Any]] = []
        self._numbers: dict[Unit, int] = {}

    def number(self, unit: Unit) -> int:
        """Return the position of a unit."""
        if unit not in self._numbers:
            self._numbers[unit] = len(self.rows)
            quantity = quantity_of(str(coherent(unit)))
            row = {"text": _spelled(unit), "factor": unit.factor, "offset": unit.offset, "quantity": quantity}
            self.rows.append(row)
        return self._numbers[unit]


def _spelled(unit: Unit) -> str:
    """Write a unit in print form: `kg·m²`."""
    if unit in (ONE, ANY):
        return ""
    text = "°" if str(unit) == "deg" else str(unit).replace(".", "·")
    return re.sub(r"(?<=[A-Za-z])\d+", lambda match: match[0].translate(_HIGH), text)


def _variables(
    model: CompiledDae,
    fmu_variables: dict[str, FmuVariable],
    signals: Sequence[Signal],
    units: _Units,
    display: Display,
) -> Iterator[dict[str, Any]]:
    """Variables, each with its value reference; formulas as trees over several references."""
    names, variables = (
        {signal_.name for signal_ in signals},
        {variable.path for variable in model.flat_variables} & fmu_variables.keys(),
    )
    for signal in model.flat_variables:
        if signal.path in fmu_variables and (signal.path in names or signal.kind in ("local", "output")):
            yield {
                "name": signal.path, "reference": fmu_variables[signal.path].reference,
                "description": signal.description, "unit": units.number(parse_unit(display.of(signal.path))),
                "shown": signal.path in names, "driving": signal.driving,
            }  # fmt: skip
    for signal in signals:
        if signal.name not in variables:
            references: list[int] = []
            yield {
                "name": signal.name, "tree": _tree(signal.formula, fmu_variables, references), "references": references,
                "unit": units.number(parse_unit(signal.shown_in(display))), "shown": True, "driving": 1,
            }  # fmt: skip


def _tree(formula: Formula, variables: Mapping[str, FmuVariable], references: list[int]) -> Any:
    """A number; `[place]` for the value of a reference, -1 for time; or `[operation, operands…]`."""
    kind, operands = formula.operation, formula.operands
    if kind in ("number", "quantity"):
        return operands[0] if kind == "number" else si_value(operands[0])
    if kind != "name":
        return [kind, *(_tree(operand, variables, references) for operand in operands)]
    if operands[0] != "time" and operands[0] not in variables:
        raise UnknownName(f"A page with sliders cannot show '{operands[0]}': it has variables, parameters and modes.")
    if operands[0] != "time":
        references.append(variables[operands[0]].reference)
    return [len(references) - 1 if operands[0] != "time" else -1]


def _sliders(model: CompiledDae, variables: dict[str, FmuVariable], display: Display) -> Iterator[dict[str, Any]]:
    """Adjustable values in the shown unit, with factor and offset to SI units."""
    inputs = (model.flat_variables[k] for k in model.inputs)
    for quantity in (*model.flat_parameters, *inputs):
        if isinstance(quantity, FlatParameter) and not quantity.tunable:
            continue
        about, shown_unit = variables[quantity.path], display.of_quantity(str(quantity.unit))
        unit = (
            quantity.written
            if isinstance(quantity, FlatParameter) and quantity.written and shown_unit == str(quantity.unit)
            else None
        )
        unit = unit or parse_unit(shown_unit)
        shown = (
            None if si is None else (si - unit.offset) / unit.factor for si in (about.start, quantity.min, quantity.max)
        )
        value, least, most = shown
        low, high, log = _span(value or 0.0, least, most)
        yield {
            "name": quantity.path, "group": quantity.path.rpartition(".")[0], "reference": about.reference,
            "description": quantity.description, "unit": _spelled(unit), "factor": unit.factor, "offset": unit.offset,
            "value": value or 0.0, "low": low, "high": high, "log": log, "written": str(unit),
        }  # fmt: skip


def _span(value: float, low: float | None, high: float | None) -> tuple[float, float, bool]:
    """Return the range of a slider, and whether its scale is logarithmic."""
    if low is not None and high is not None:
        return low, high, False
    first, last = sorted((value / _SPREAD, value * _SPREAD)) if value else (-1.0, 1.0)
    if low is not None:
        first = max(first, low)
    if high is not None:
        last = min(last, high)
    return first, last, first * last > 0.0
