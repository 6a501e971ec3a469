"""The model file of the compiled run-time: tables and tapes in the layout of the memory.

A header (magic, format, number of sections, CRC-32 of the rest, size), one entry per section (number, size of a record,
offset, count), then the sections, each aligned to 8 bytes. All is little-endian; texts are offsets in the section
`text`. `model.c` reads the same sections in the same order, and checks every offset and index.
"""

from __future__ import annotations

import math
import re
import struct
import zlib
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from modelica_like.compile.compiled import HOMOTOPY, TERMINAL, CompiledDae, Reset
from modelica_like.errors import ExportError
from modelica_like.flatten.model import Origin
from modelica_like.fmi.interface import FmuVariable, Interface
from modelica_like.fmi.sources import Version, runtime_sources
from modelica_like.fmi.start_tables import StartTables
from modelica_like.fmi.tables import Tables, make_tables
from modelica_like.fmi.tape import OPERATIONS, Tape

ABSOLUTE_TO_RELATIVE = 1e-2
"""Absolute tolerance, in nominal values, over the relative one."""

DEFAULT_TOLERANCE = 1e-7
MODEL = "resources/model.bin"
"""Path of the file in an FMU."""
FORMAT = 11
_MAGIC = b"MLMODEL\0"
_HEADER = struct.Struct("<8siiII")
_ENTRY = struct.Struct("<4i")
_ALIGNED = 8

_INTEGER, _DOUBLE, _TEXT = "<i4", "<f8", "u1"


def _record(integers: str, doubles: str = "") -> list[tuple[str, str]]:
    """A record of integers and then doubles; names as in model.h."""
    return [*((name, _INTEGER) for name in integers.split()), *((name, _DOUBLE) for name in doubles.split())]


_RESET = _record("place value transition at_start", "factor")
_START_OF = _record("position start", "factor")
_START_ROW = _record("start node row")
_QR = ("colind", "row", "v_colind", "v_row", "r_colind", "r_row", "row_place", "column_order")
_LU = ("ends", "rows", "row_place", "column_order")
_TAPES = (
    "rates", "jacobian", "alg", "alg_jacobian", "variables", "guards", "edges", "guards_soon", "moments", "resets",
    "updates", "start_conditions", "start_values", "discrete_starts", "hold_terms", "determinants", "start_system",
    "start_jacobian", "derived", "delays",
)  # fmt: skip
SECTIONS: dict[str, Any] = {
    "settings": _record(
        "n_d n_y steady rates_depend_on_time implicit_linear terminal ideal n_edges n_slope_edges n_kinks rests "
        "homotopy",
        "absolute_to_relative default_tolerance fixed_step",
    ),
    "text": _TEXT,
    "token": _TEXT,
    **dict.fromkeys(("constants", "parameters", "parameter_min", "parameter_max"), _DOUBLE),
    **dict.fromkeys(("inputs", "guesses", "nominals"), _DOUBLE),
    **dict.fromkeys(("state_names", "implicit_names", "singular_names"), _INTEGER),
    "variables": [("reference", "<u4"), *_record("type kind index start tunable name count")],
    "rising": _record("below above below_name above_name"),
    "transitions": [
        *_record("mode target"), ("timed", "<i2"), ("ends", "<i2"),
        *_record("index name notice"), ("sources", "<u8"),
    ],
    "guard_transition": _INTEGER,
    "resets": _RESET,
    "reset_nodes": _INTEGER,
    "updates": _RESET,
    "modes": _record("first_name n_names hidden"),
    "mode_names": _INTEGER,
    "holds": _record("mode number loose motion state reaction approach moved name unused", "factor nominal"),
    "circuits": _record("first_member n_members first"),
    "members": _INTEGER,
    "ideals": _record("row mode zero other name unused", "nominal"),
    "units": _INTEGER,
    "delays": _record("name first"),
    "start_modes": _record("mode target"),
    **dict.fromkeys(("start_direct", "start_default", "start_guess"), _START_OF),
    **dict.fromkeys(("start_rows", "start_dependent"), _START_ROW),
    **dict.fromkeys(("start_zero", "start_columns", "steady", "jacobian_to_step", "step_diagonal"), _INTEGER),
    **{f"{matrix}.{field}": _INTEGER for matrix in ("step", "start") for field in _QR},
    **{f"lu.{field}": _INTEGER for field in _LU},
    **{
        f"tapes.{tape}.{field}": kind
        for tape in _TAPES
        for field, kind in (
            ("runs", _record("operation count")), ("operands", _record("left right")), ("outputs", _INTEGER),
        )
    },
}  # fmt: skip
"""Sections in the order of the file, with the type of their records."""

_KINDS = ("time", "state", "der", "variable", "parameter", "derived", "input", "discrete", "guard")
_TYPES = {"Float64": 0, "Enumeration": 1, "Int64": 1}
_ARRAY = 2
_CODES = {name: code for code, name in enumerate(OPERATIONS)}


def model_file(
    tables: Tables, variables: Sequence[FmuVariable], token: str, tolerance: float, fixed_step: float = 0.0
) -> bytes:
    """Write the file of a model.

    Args:
        tables: of the model.
        variables: its FMI variables.
        token: GUID (2.0) or instantiation token (3.0) of the description.
        tolerance: relative tolerance of Co-Simulation if the importer gives none.
        fixed_step: step size of Co-Simulation in s, 0 for adaptive steps.

    Raises:
        ExportError: a value is delayed, and steps are fixed.
    """
    text = _Text()
    if fixed_step:
        tables.model.refuse_delays(ExportError, f"{tables.model.name} cannot take fixed steps")
    contents = _contents(tables, variables, tolerance, fixed_step, text)
    contents |= {"token": np.frombuffer(token.encode() + b"\0", _TEXT), "text": np.frombuffer(text.joined(), _TEXT)}
    entries, body = b"", bytearray()
    first = _HEADER.size + _ENTRY.size * len(SECTIONS)
    for number, (name, kind) in enumerate(SECTIONS.items()):
        records = np.array(list(contents[name]), dtype=kind)
        entries += _ENTRY.pack(number, records.itemsize, first + len(body), len(records))
        body += records.tobytes()
        body += bytes(-len(body) % _ALIGNED)
    return _headed(entries + bytes(body))


def _headed(rest: bytes) -> bytes:
    return _HEADER.pack(_MAGIC, FORMAT, len(SECTIONS), zlib.crc32(rest), _HEADER.size + len(rest)) + rest


def with_token(data: bytes, old: str, new: str) -> bytes:
    """Return the file of a model with another token of the same length."""
    return _headed(data[_HEADER.size :].replace(old.encode() + b"\0", new.encode() + b"\0"))


def as_c(data: bytes, *, compiled: bool = False) -> str:
    """Write the file of a model as C text, in aligned words of 8 bytes; `compiled`: its equations are code, too."""
    codes = "extern const Codes codes;\nconst Codes *const model_codes = &codes;\n"
    words = np.frombuffer(data, "<u8")
    lines = (", ".join(f"{word:#x}u" for word in words[k : k + 6].tolist()) for k in range(0, len(words), 6))
    return (
        "/* The model, as model.c reads it. */\n"
        '#include "model.h"\n\nconst uint64_t model_data[] = {\n    '
        + ",\n    ".join(lines)
        + "};\nconst size_t model_data_size = sizeof model_data;\n"
        + (codes if compiled else "const Codes *const model_codes = NULL;\n")
    )


def generate(
    model: CompiledDae, face: Interface, version: Version = "2.0", *, token: str, fixed_step: float = 0.0
) -> dict[str, str]:
    """Return all C sources of an FMU by file name, with the model compiled in; arguments are those of `model_file`."""
    data = model_file(make_tables(model, face.start), face.variables, token, DEFAULT_TOLERANCE, fixed_step)
    return runtime_sources((version,)) | {"model_data.c": as_c(data)}


class _Text:
    """Texts one after the other; each is identified by its offset."""

    def __init__(self) -> None:
        self.places = {"": 0}
        self.size = 1

    def __call__(self, value: str) -> int:
        if value not in self.places:
            self.places[value] = self.size
            self.size += len(value.encode()) + 1
        return self.places[value]

    def joined(self) -> bytes:
        return b"".join(value.encode() + b"\0" for value in self.places)


def _contents(
    tables: Tables, variables: Sequence[FmuVariable], tolerance: float, fixed_step: float, text: _Text
) -> dict[str, Any]:
    model, start, sizes = tables.model, tables.start, tables.slots.sizes
    contents: dict[str, Any] = {
        "settings": [_settings(tables, tolerance, fixed_step)],
        "constants": tables.slots.constants,
        "parameters": model.p,
        "parameter_min": [-math.inf if parameter.min is None else parameter.min for parameter in model.flat_parameters],
        "parameter_max": [math.inf if parameter.max is None else parameter.max for parameter in model.flat_parameters],
        "inputs": model.u,
        "guesses": [*model.starts.guesses, *model.starts.z_guesses],
        "nominals": model.equations.nominals,
        "state_names": [text(name) for name in model.states],
        "implicit_names": [text(name) for name in model.implicit],
        "singular_names": [
            text(", ".join(names[:6]) or _nameless(origins)) for names, origins in model.equations.singular
        ],
        "variables": [_variable(variable, text) for variable in sorted(variables, key=lambda v: v.reference)],
        "rising": [(*pair, *(text(model.flat_parameters[k].path) for k in pair)) for pair in model.rising],
        "delays": [
            (text(model.flat_discretes[first].path.removesuffix("[0]")), first)
            for first, *_ in model.events.delay_parts
        ],
        "jacobian_to_step": tables.to_step,
        "step_diagonal": tables.diagonal,
    }
    contents |= (
        _events(model, text) | _holds(model, text) | _starts(start, len(model.states), len(model.implicit), sizes["y"])
    )
    for name, pattern in (("step", tables.step), ("start", tables.start_pattern)):
        contents |= {f"{name}.{field}": pattern[field] for field in _QR}
    contents |= {f"lu.{field}": tables.lu[field] for field in _LU}
    for tape in tables.tapes.values():
        contents |= _tape(tape)
    return contents


def _nameless(origins: Sequence[Origin]) -> str:
    """Return what is singular in a block without unknowns: frictions that hold together, or other equations."""
    paths = [origin.path for origin in origins]
    open_still = f"{' and '.join(paths)}, where it is open which slides first"
    return open_still if len(paths) > 1 else f"{paths[0]} with other parameters"


def _settings(tables: Tables, tolerance: float, fixed_step: float) -> tuple[float, ...]:
    model, sizes = tables.model, tables.slots.sizes
    return (
        sizes["d"],
        sizes["y"],
        int(tables.start.steady is not None),
        int(tables.rates_depend_on_time),
        int(tables.implicit_linear),
        model.discrete_position.get(TERMINAL, -1),
        model.held.ideal.rows.first if model.held.ideal else 0,
        model.edges.count,
        model.edges.slopes,
        model.edges.kinks,
        int(model.settings.get("on_chattering") == "rest"),
        model.discrete_position.get(HOMOTOPY, -1),
        ABSOLUTE_TO_RELATIVE,
        tolerance,
        fixed_step,
    )


def _events(model: CompiledDae, text: _Text) -> dict[str, Any]:
    transitions: list[tuple[int, ...]] = []
    resets: list[tuple[float, ...]] = []
    for k, transition in enumerate(model.events.transitions):
        path = model.flat_discretes[transition.mode].path
        texts = (text(path), text(_notice(path, transition.notice)))
        sources = sum(1 << source for source in transition.sources)
        ends = 2 if transition.ends else int(transition.fails)
        transitions.append(
            (transition.mode, transition.target, int(transition.timed), ends, transition.index, *texts, sources)
        )
        resets += [(_place(model, r), r.value, k, -1, r.factor) for r in transition.resets]
    guards = {t.index: k for k, t in enumerate(model.events.transitions) if not t.timed}
    names = [text(name) for discrete in model.flat_discretes for name in discrete.names]
    return {
        "transitions": transitions,
        "guard_transition": [guards[k] for k in range(len(guards))],
        "resets": resets,
        "reset_nodes": model.events.reset_nodes,
        "updates": [
            (_place(model, r), k, 0, r.index if e.at_start else -1, r.factor)
            for k, (e, r) in enumerate((row, row.reset) for row in model.events.update_rows)
        ],
        "modes": [
            (*place, int(discrete.hidden))
            for place, discrete in zip(
                _counted(len(d.names) for d in model.flat_discretes), model.flat_discretes, strict=True
            )
        ],
        "mode_names": names,
        "start_modes": [(mode, target) for mode, target, _ in model.starts.modes],
    }


def _place(model: CompiledDae, reset: Reset) -> int:
    """Place of what is reset among states, entries of d, and nodes that are reset."""
    n_x = len(model.states)
    return {"state": reset.index, "discrete": n_x + reset.index, "value": n_x + model.discrete_size + reset.target}[
        reset.kind
    ]


def _counted(counts: Iterable[int]) -> list[tuple[int, int]]:
    """Pairs of first entry and count."""
    result: list[tuple[int, int]] = []
    for count in counts:
        result.append((sum(result[-1]) if result else 0, count))
    return result


def _holds(model: CompiledDae, text: _Text) -> dict[str, Any]:
    holds: list[tuple[float, ...]] = []
    moved = _moved_from_outside(model)
    for hold in model.held.motions:
        state, factor = hold.state or (-1, 1.0)
        name = text(model.flat_discretes[hold.mode].path)
        about = (hold.reaction, hold.approach, int(hold.motion in moved), name, 0)
        nominal = abs(model.flat_variables[hold.motion].nominal)
        holds.append((hold.mode, hold.number, hold.loose, hold.motion, state, *about, factor, nominal))
    first = _counted(len(circuit.members) for circuit in model.held.circuits)
    units = {str(variable.unit): k for k, variable in enumerate(model.flat_variables)}
    return {
        "holds": holds,
        "circuits": [(*place, circuit.first) for place, circuit in zip(first, model.held.circuits, strict=True)],
        "members": [k for circuit in model.held.circuits for k in circuit.members],
        "ideals": [
            (
                element.row,
                element.mode,
                *element.zeros,
                text(element.component),
                0,
                abs(model.flat_variables[element.zeros[0]].nominal),
            )
            for element in (model.held.ideal.elements if model.held.ideal else ())
        ],
        "units": [units[str(variable.unit)] for variable in model.flat_variables] if holds or model.held.ideal else [],
    }


def _moved_from_outside(model: CompiledDae) -> set[int]:
    """Variables that are not determined by states alone, such as those of a source of motion."""
    if not model.held.circuits:
        return set()
    moving = (model.equations.variables.name_in().index(name) for name in ("t", "u", "d"))
    return {row for k in moving for row in model.equations.variables.jac_sparsity(0, k).row()}


def _notice(path: str, notice: str) -> str:
    """Put the component's name before a notice, and names of parameters in place of their values."""
    sentence = re.sub(r"\{(.*?)\}", r"\1", notice)
    return f"{path.rpartition('.')[0]} {sentence}".strip() if notice else ""


def _starts(start: StartTables, n_x: int, n_z: int, n_y: int) -> dict[str, Any]:
    return {
        "start_direct": start.direct,
        "start_default": start.defaults,
        "start_guess": [*start.x_guesses, *((n_x + z, *of) for z, *of in start.z_guesses)],
        "start_rows": start.rows,
        "start_dependent": start.dependent,
        "start_zero": start.plan.zero,
        "start_columns": [k if k < n_x else k - n_y if k >= n_x + n_y else k + n_z for k in start.plan.columns],
        "steady": () if start.steady is None else (*start.steady, *range(n_x, n_x + n_z)),
    }


def _variable(variable: FmuVariable, text: _Text) -> tuple[int, ...]:
    kind, index = variable.slot
    start = -1 if variable.start_entry is None else variable.start_entry
    tunable = int(kind == "parameter" and variable.variability == "tunable")
    of_type, count = _TYPES[variable.type], len(variable.elements)
    if count:
        of_type, start = _ARRAY, variable.elements[0]
    return (variable.reference, of_type, _KINDS.index(kind), index, start, tunable, text(variable.name), count or 1)


def _tape(tape: Tape) -> dict[str, Any]:
    return {
        f"tapes.{tape.name}.runs": [(_CODES[name], count) for name, count in tape.runs],
        f"tapes.{tape.name}.operands": [(left, right) for _, left, right in tape.operations],
        f"tapes.{tape.name}.outputs": tape.outputs,
    }
