"""The model as C text: `model.h` with sizes, `model.c` with tables and tapes."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from typing import Any

from modelica_like.compile.compiled import CompiledDae
from modelica_like.fmi.interface import FmuVariable
from modelica_like.fmi.sparse import QrPattern
from modelica_like.fmi.start_tables import StartTables
from modelica_like.fmi.tables import Tables
from modelica_like.fmi.tape import Tape

ABSOLUTE_TO_RELATIVE = 1e-2
"""Absolute tolerance, in nominal values, over the relative one."""

_KINDS = {
    "time": "KIND_TIME", "state": "KIND_STATE", "der": "KIND_DERIVATIVE", "variable": "KIND_VARIABLE",
    "parameter": "KIND_PARAMETER", "derived": "KIND_DERIVED", "input": "KIND_INPUT", "discrete": "KIND_DISCRETE",
    "guard": "KIND_GUARD",
}  # fmt: skip
_TYPES = {"Float64": "TYPE_FLOAT64", "Enumeration": "TYPE_ENUMERATION", "Int64": "TYPE_ENUMERATION"}
_RESETS = {"state": "RESET_STATE", "discrete": "RESET_DISCRETE", "value": "RESET_VALUE"}


def number(value: float) -> str:
    """Write a number exactly, as C reads it back."""
    if math.isnan(value):
        return "NAN"
    if math.isinf(value):
        return "INFINITY" if value > 0 else "-INFINITY"
    return repr(float(value))


def text(value: str) -> str:
    """Write a string literal; what is not plain ASCII as octal escapes of its UTF-8 bytes."""
    plain = (chr(b) if 32 <= b < 127 and b not in b'"\\?' else f"\\{b:03o}" for b in value.encode())
    return f'"{"".join(plain)}"'


def _array(kind: str, name: str, values: Iterable[str], static: bool = False) -> str:
    """Write an array; C has none without elements."""
    items = list(values) or ["0" if "char" in kind or "double" in kind or kind == "int" else "{0}"]
    lines = [""]
    for item in items:
        if len(lines[-1]) + len(item) > 120:
            lines.append("")
        lines[-1] += f"{item}, "
    body = "\n    ".join(line.rstrip() for line in lines)
    return f"{'static ' if static else ''}const {kind} {name}[] = {{\n    {body}\n}};\n"


def _integers(name: str, values: Iterable[int], static: bool = False) -> str:
    return _array("int", name, map(str, values), static)


def _doubles(name: str, values: Iterable[float], static: bool = False) -> str:
    return _array("double", name, map(number, values), static)


def _names(name: str, values: Iterable[str]) -> str:
    return _array("char *const", name, map(text, values))


def header(tables: Tables, variables: Sequence[FmuVariable], tolerance: float) -> str:
    """Write model.h: the sizes."""
    model, start, sizes = tables.model, tables.start, tables.slots.sizes
    counts: dict[str, Any] = {f"N_{name.upper()}": sizes[name] for name in ("x", "z", "p", "u", "d", "y")}
    counts |= {
        "N_CONSTANTS": len(tables.slots.constants),
        "N_OPERATIONS": max(len(tape.operations) for tape in tables.tapes.values()),
        "N_VARIABLES": len(variables),
        "N_NODES": len(model.flat_variables),
        "N_DERIVED": len(model.flat_derived),
        "N_GUARDS": model.guards.numel_out(0),
        "N_MOMENTS": model.moments.numel_out(0),
        "N_TRANSITIONS": len(model.transitions),
        "N_RESETS": model.resets.numel_out(0),
        "N_HOLDS": len(model.holds),
        "N_CIRCUITS": len(model.circuits),
        "MOST_MEMBERS": max((len(one.members) for one in model.circuits), default=0),
        "N_DETERMINANTS": model.determinants.numel_out(0),
        "N_JACOBIAN": len(tables.to_step),
        "N_STARTS": len(model.starts),
        "N_START_MODES": len(model.start_modes),
        "N_START_DIRECT": len(start.direct),
        "N_START_DEFAULT": len(start.defaults),
        "N_START_X_GUESS": len(start.x_guesses),
        "N_START_Z_GUESS": len(start.z_guesses),
        "N_START_DEPENDENT": len(start.dependent),
        "N_START_ZERO": len(start.zero),
        "N_START_UNKNOWNS": len(start.columns),
        "N_START_VALUES": start.system.numel_out(2),
        "N_START_JACOBIAN": len(tables.tapes["start_jacobian"].outputs),
        "START_STEADY": int(start.steady is not None),
        "N_STEADY": len(start.steady or ()),
        "RATES_DEPEND_ON_TIME": int(tables.rates_depend_on_time),
        "ABSOLUTE_TO_RELATIVE": number(ABSOLUTE_TO_RELATIVE),
        "DEFAULT_TOLERANCE": number(tolerance),
    }
    lines = [f"#define {name} {value}" for name, value in counts.items()]
    return (
        f"/* Sizes of the model {_comment(model.name)}. */\n#ifndef MODEL_H\n#define MODEL_H\n\n"
        + "\n".join(lines)
        + "\n\n#endif\n"
    )


def _comment(name: str) -> str:
    return name.replace("*/", "* /").encode("ascii", "replace").decode()


def source(tables: Tables, variables: Sequence[FmuVariable], token: str) -> str:
    """Write model.c: values, tables and tapes."""
    model = tables.model
    limits = [
        ((-math.inf if p.min is None else p.min), (math.inf if p.max is None else p.max)) for p in model.flat_parameters
    ]
    parts = [
        f"/* Tables and tapes of the model {_comment(model.name)}. */\n",
        '#include <math.h>\n#include <stddef.h>\n#include "core.h"\n',
        f"const char *const model_token = {text(token)};\n",
        _doubles("model_constants", tables.slots.constants),
        _doubles("model_parameters", model.p),
        _doubles("model_parameter_min", (low for low, _ in limits)),
        _doubles("model_parameter_max", (high for _, high in limits)),
        _doubles("model_inputs", model.u),
        _doubles("model_guesses", model.guesses),
        _doubles("model_z_guesses", model.z_guesses),
        _doubles("model_nominals", model.nominals),
        _names("model_state_names", model.states),
        _names("model_implicit_names", model.implicit),
        _names("model_singular_names", (", ".join(names[:6]) for names, _ in model.singular)),
        *_events(model),
        *_holds(model),
        *_starts(tables.start, model),
        _array("Variable", "model_variables", (_variable(one) for one in sorted(variables, key=lambda v: v.reference))),
        _integers("jacobian_to_step", tables.to_step),
        _integers("step_diagonal", tables.diagonal),
        *_pattern("step", tables.step),
        *_pattern("start", tables.start_pattern),
    ]
    for tape in tables.tapes.values():
        parts += _tape(tape)
    return "\n".join(parts)


def _events(model: CompiledDae) -> list[str]:
    transitions: list[str] = []
    resets: list[str] = []
    for one in model.transitions:
        path = model.flat_discretes[one.mode].path
        mask = sum(1 << source for source in one.sources)
        changes = f"{len(resets)}, {len(one.resets)}"
        numbers = f"{one.mode}, UINT64_C({mask}), {one.target}, {int(one.timed)}, {one.index}, {changes}"
        transitions.append(f"{{{numbers}, {text(path)}, {text(_notice(path, one.notice))}}}")
        resets += [f"{{{_RESETS[r.kind]}, {r.index}, {number(r.factor)}, {r.value}, {r.target}}}" for r in one.resets]
    guards = {one.index: k for k, one in enumerate(model.transitions) if not one.timed}
    modes = model.flat_discretes
    names = [
        _array("char *const", f"mode_{k}", map(text, one.names), static=True)
        for k, one in enumerate(modes)
        if one.names
    ]
    lists = (f"mode_{k}" if one.names else "NULL" for k, one in enumerate(modes))
    return [
        _array("Transition", "model_transitions", transitions),
        _integers("model_guard_transition", (guards[k] for k in range(len(guards)))),
        _array("Reset", "model_resets", resets),
        _integers("model_reset_nodes", model.reset_nodes),
        *names,
        _array("char *const *const", "model_mode_names", lists),
        _integers("model_mode_counts", (len(one.names) for one in modes)),
        _array("StartMode", "model_start_modes", (f"{{{mode}, {target}}}" for mode, target, _ in model.start_modes)),
    ]  # fmt: skip


def _holds(model: CompiledDae) -> list[str]:
    holds: list[str] = []
    moved = _moved_from_outside(model)
    for one in model.holds:
        state, factor = one.state or (-1, 1.0)
        numbers = f"{one.mode}, {one.number}, {one.loose}, {one.motion}, {state}, {number(factor)}"
        path = model.flat_discretes[one.mode].path
        about = f"{int(one.motion in moved)}, {number(abs(model.flat_variables[one.motion].nominal))}, {text(path)}"
        holds.append(f"{{{numbers}, {one.reaction}, {one.approach}, {about}}}")
    members = [k for circuit in model.circuits for k in circuit.members]
    first = [sum(len(one.members) for one in model.circuits[:k]) for k in range(len(model.circuits))]
    circuits = (f"{{{k}, {len(one.members)}, {one.first}}}" for k, one in zip(first, model.circuits, strict=True))
    units = {str(one.unit): k for k, one in enumerate(model.flat_variables)}
    return [
        _array("Held", "model_holds", holds),
        _array("Circuit", "model_circuits", circuits),
        _integers("model_members", members),
        _integers("model_units", (units[str(one.unit)] for one in model.flat_variables) if holds else ()),
    ]


def _moved_from_outside(model: CompiledDae) -> set[int]:
    """Variables that something but states moves, such as a source of motion."""
    if not model.circuits:
        return set()
    moving = (model.variables.name_in().index(name) for name in ("t", "u", "d"))
    return {row for k in moving for row in model.variables.jac_sparsity(0, k).row()}


def _notice(path: str, notice: str) -> str:
    """Put the component's name before what is told, and parameters' names where their values would be."""
    told = re.sub(r"\{(.*?)\}", r"\1", notice)
    return f"{path.rpartition('.')[0]} {told}".strip() if notice else ""


def _starts(start: StartTables, model: CompiledDae) -> list[str]:
    of = {"direct": start.direct, "default": start.defaults, "x_guess": start.x_guesses, "z_guess": start.z_guesses}
    rows = {"rows": start.rows, "dependent": start.dependent}
    return [
        *(
            _array("StartOf", f"model_start_{name}", (f"{{{p}, {k}, {number(f)}}}" for p, k, f in some))
            for name, some in of.items()
        ),
        *(
            _array("StartRow", f"model_start_{name}", (f"{{{k}, {node}, {row}}}" for k, node, row in some))
            for name, some in rows.items()
        ),
        _integers("model_start_zero", start.zero),
        _integers("model_start_columns", start.columns),
        _integers("model_steady_states", start.steady or ()),
    ]


def _variable(one: FmuVariable) -> str:
    kind, index = one.slot
    start = -1 if one.start_entry is None else one.start_entry
    tunable = int(kind == "parameter" and one.variability == "tunable")
    return f"{{{one.reference}, {_TYPES[one.type]}, {_KINDS[kind]}, {index}, {start}, {tunable}, {text(one.name)}}}"


def _pattern(name: str, one: QrPattern) -> list[str]:
    fields = ("colind", "row", "v_colind", "v_row", "r_colind", "r_row", "row_place", "column_order")
    arrays = [_integers(f"{name}_{field}", getattr(one, field), static=True) for field in fields]
    sizes = f"{one.size}, {len(one.row)}, {len(one.v_row)}, {len(one.r_row)}"
    return [
        *arrays,
        f"const QrPattern pattern_{name} = {{{sizes}, {', '.join(f'{name}_{field}' for field in fields)}}};\n",
    ]


def _tape(tape: Tape) -> list[str]:
    name = tape.name
    sizes = f"{len(tape.operations)}, {len(tape.runs)}, {len(tape.outputs)}"
    fields = ", ".join(f"{name}_{field}" for field in ("runs", "operands", "outputs"))
    return [
        _array("Run", f"{name}_runs", (f"{{OPERATION_{one}, {count}}}" for one, count in tape.runs), static=True),
        _array("Operands", f"{name}_operands", (f"{{{a}, {b}}}" for _, a, b in tape.operations), static=True),
        _integers(f"{name}_outputs", tape.outputs, static=True),
        f"const Tape tape_{name} = {{{sizes}, {fields}}};\n",
    ]
