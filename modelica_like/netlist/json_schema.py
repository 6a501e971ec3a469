"""JSON schema of netlists, for editors: generated from the declarations of all component types."""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Mapping
from functools import lru_cache
from typing import Any, get_args

from modelica_like.language import Component, Input, Parameter, Variable
from modelica_like.language.fields import Discrete, Field
from modelica_like.language.inside import declarations
from modelica_like.language.places import texts_of_fields
from modelica_like.language.tables import REQUIRED, Column, Rows
from modelica_like.language.units import ANY, parse_unit
from modelica_like.netlist.json_units import Quantities, unnamed_quantities
from modelica_like.netlist.read import FMU_PART
from modelica_like.netlist.registry import library_types
from modelica_like.netlist.sections import OnChattering, StartKind

_QUANTITY = {"type": ["number", "string"]}
_TIME = {"anyOf": [{"type": "number", "exclusiveMinimum": 0}, {"$ref": "#/definitions/quantity_in_s"}]}
_MOMENT = {"anyOf": [{"type": "number"}, {"$ref": "#/definitions/quantity_in_s"}]}
_JSON_TYPES: dict[type, str] = {bool: "boolean", int: "integer", float: "number", str: "string"}
DRAFT = "http://json-schema.org/draft-07/schema#"
"""The draft that the language servers for TOML know."""
_VALUE = {"type": ["number", "string", "object"]}
_RUN = "how the drive is run"
_ANY_PART = {"$ref": "#/definitions/part"}
_TEXT = {"type": "string"}
_COUNT = {"type": "integer", "minimum": 1}
_ENDS = {"type": "array", "items": _TEXT, "minItems": 2}


def schema() -> dict[str, Any]:
    """Return the JSON schema (draft 7) of a netlist with all installed component types.

    Raises:
        NetlistError: a library cannot be imported.
    """
    types = library_types()
    quantities = Quantities(_units(types.values()))
    quantities.text(parse_unit("s"))
    components = {name: _component(kind, quantities) for name, kind in types.items()}
    return {
        "$schema": DRAFT,
        "title": "modelica-like netlist",
        "type": "object",
        "additionalProperties": False,
        "required": ["parts"],
        "properties": sections(),
        "definitions": {"part": chosen(components, _others()), **components, **quantities.definitions()},
    }


@lru_cache(maxsize=512)
def properties_of(kind: type[Component]) -> dict[str, Any]:
    """Return the schemas of what a part of one type can be given, by name."""
    return _component(kind, unnamed_quantities())["properties"]


def chosen(types: Iterable[str], others: Iterable[dict[str, Any]] = ()) -> dict[str, Any]:
    """Return the schema of a table whose `is` chooses a definition, in the form that language servers complete."""
    return {"anyOf": [*({"$ref": f"#/definitions/{name}"} for name in types), *others]}


def _units(types: Iterable[type[Component]]) -> set[str]:
    fields = {field.unit_text for kind in types for field in declarations(kind).fields.values()}
    columns = {
        str(column.unit_in(declarations(kind).fields)) for kind in types for table in declarations(kind).tables.values()
        for column in table.columns if not column.text
    }  # fmt: skip
    return fields | columns


def sections() -> dict[str, Any]:
    """Return the schemas of the sections of a netlist, by name."""
    parts = {"anyOf": [_ANY_PART, {"type": "array", "items": _ANY_PART, "minItems": 1}]}
    free = {"type": "array", "items": _TEXT, "description": "connectors left free on purpose"}
    chain = "chains of parts: the outlet of each is joined to the inlet of the next"
    values = "parameters of the drive: numbers, quantities or formulas of earlier ones"
    scatter = "how parameters scatter: ranges, distributions, files of measured values"
    texts = {"type": "array", "items": _TEXT, "description": "folders or files, from the netlist's folder"}
    units = "units in which results are shown, by quantity, path or pattern"
    return {
        "name": {**_TEXT, "description": "name of the model; default: that of the file"},
        "description": {**_TEXT, "description": "one phrase"},
        "parameters": _map(_QUANTITY, values, {"n": "1500 rpm", "w": "n / 10"}),
        "parts": _map(parts, "components by name; `is` names the type", {"hub": {"is": "Inertia", "J": "0.02 kg.m2"}}),
        "series": _map(_ENDS, chain, {"drive": ["motor", "clutch", "hub"]}),
        "connect": _map(_ENDS, "connectors that are joined, or an output with inputs", {"f": ["ramp.y", "clutch.f"]}),
        "start": _map(_VALUE, "fixed start values, and start modes, by path", {"hub.w": "10 rad/s"}),
        "guess": _map(_VALUE, "start values that the initialization may change, by path", {"clutch.tau": "10 N.m"}),
        "free": {**free, "examples": [["gear.support"]]},
        "expose": _map(_TEXT, "outer connectors and signals", {"input": "hub.flange_a"}),
        "simulate": _simulate(),
        "sizing": {**_TEXT, "description": "sizing file, whose checks stand in reports"},
        "display": _map(_TEXT, units, {"speed": "rpm", "*.phi": "deg"}),
        "optimize": _optimize(),
        "tolerances": _map({"anyOf": [_TEXT, {"type": ["object", "array"]}]}, scatter, {"clutch.capacity": "±10 %"}),
        "modelica": {
            "type": "object",
            "description": "libraries of Modelica text",
            "additionalProperties": False,
            "properties": {"libraries": {**texts, "examples": [["library/Drives"]]}},
        },
    }


def _optimize() -> dict[str, Any]:
    texts = {"anyOf": [_TEXT, {"type": "array", "items": _TEXT, "minItems": 1}]}
    tables = {"type": "array", "items": {"type": "object"}, "minItems": 1}
    limits = {**texts, "description": "limits of outputs", "examples": [["clutch.lock_time <= 0.4 s"]]}
    files = "values to try by path, or a CSV table of kinds of a part"
    properties = {
        "minimize": {
            **texts,
            "description": "output that is to be small; of two, a front",
            "examples": ["peak(a.tau)"],
        },
        "maximize": {**texts, "description": "output that is to be large"},
        "free": {"type": "object", "description": "bounds by path", "examples": [{"clutch.capacity": [20, 120]}]},
        "choose": {"type": "object", "description": files, "examples": [{"motor": "motors.csv"}]},
        "subject_to": limits,
        "for": {**tables, "description": "load cases: other values of parameters, and a name"},
        "starts": {**_COUNT, "description": "starts of the search"},
        "points": {**_COUNT, "description": "designs of a front"},
    }
    return {"type": "object", "description": "the best design", "additionalProperties": False, "properties": properties}


def _simulate() -> dict[str, Any]:
    rtol = {"type": "number", "minimum": 1e-14, "maximum": 0.1, "description": "relative tolerance", "examples": [1e-7]}
    start = "start values that are missing: none (given), zero (rest), or those of the steady state"
    properties = {
        "from": {"description": "time at which runs begin [s]", **_MOMENT, "default": 0},
        "until": {"description": "end time [s]", **_TIME, "examples": ["0.5 s"]},
        "start": {"enum": list(get_args(StartKind)), "description": start},
        "rtol": rtol,
        "points": {**_COUNT, "maximum": 1_000_000, "description": "number of output intervals", "default": 500},
        "on_chattering": {
            "enum": list(get_args(OnChattering)),
            "default": "stop",
            "description": "where events never end: an error, sliding between two modes, rest in contact",
        },
    }
    return {"type": "object", "description": _RUN, "additionalProperties": False, "properties": properties}


def _map(entries: dict[str, Any], description: str, example: dict[str, Any]) -> dict[str, Any]:
    return {"type": "object", "description": description, "additionalProperties": entries, "examples": [example]}


def _others() -> list[dict[str, Any]]:
    """Return the schemas of parts that are no component of a library."""
    patterns = {
        r"^[\w.]+:\w+$": "class of a Python module",
        r"\.toml$": "another netlist",
        r"\.mo(:[\w.]+)?$": "class of a Modelica text",
        f"^{FMU_PART}$": "FMU, coupled by its inputs and outputs; run by `modelica-like cosim`",
    }
    return [
        {
            "type": "object", "description": text, "required": ["is"], "additionalProperties": True,
            "properties": {"is": {"type": "string", "pattern": pattern}},
        }
        for pattern, text in patterns.items()
    ]  # fmt: skip


def _component(kind: type[Component], quantities: Quantities) -> dict[str, Any]:
    described = Parameter | Input | Variable | Discrete
    count = {**_COUNT, "description": "number of parts in an array"}
    properties: dict[str, Any] = {"is": {"const": kind.__name__}, "count": count}
    properties |= {
        name: _field(field, quantities)
        for name, field in declarations(kind).fields.items()
        if isinstance(field, described)
    }
    properties |= {
        name: {"enum": list(mode.names), "description": f"{mode.description}, at the start"}
        for name, mode in declarations(kind).modes.items()
    }
    texts = texts_of_fields(kind)
    properties |= {
        name: {"description": texts.get(name, ""), **_structural(kind, name)}
        for name in declarations(kind).structural if name not in declarations(kind).tables
    }  # fmt: skip
    properties |= {
        name: _table(table, declarations(kind).fields, quantities) for name, table in declarations(kind).tables.items()
    }
    properties |= {
        name: {"type": "object", "description": "values of a part", "additionalProperties": True}
        for name in declarations(kind).parts
    }
    return {
        "type": "object",
        "required": ["is"],
        "description": inspect.cleandoc(kind.__doc__ or "").partition("\n")[0],
        "properties": properties,
        "patternProperties": {r"[.\[]": True},
        "additionalProperties": False,
    }


def _field(field: Field, quantities: Quantities) -> dict[str, Any]:
    number: dict[str, Any] = {"type": "number"}
    if field.unit.factor == 1.0 and field.unit.offset == 0.0:
        number |= {key: bound for key, bound in (("minimum", field.min), ("maximum", field.max)) if bound is not None}
    unit = "" if field.unit_text == "1" else f" [{field.unit_text}]"
    described: dict[str, Any] = {
        "description": field.description + unit,
        "anyOf": [number, quantities.text(field.unit)],
    }
    if unit and field.unit != ANY:
        described["examples"] = [f"1 {field.unit_text}"]
    if isinstance(field.default, int | float | str):
        described["default"] = field.default
    return described


def _table(table: Rows, fields: Mapping[str, Field], quantities: Quantities) -> dict[str, Any]:
    cells = [{"description": column.described(fields), **_cell(column, fields, quantities)} for column in table.columns]
    size = {"minItems": len(cells), "additionalItems": cells[-1] if table.more else False}
    row = cells[0] if table.flat else {"type": "array", "items": cells, **size}
    array: dict[str, Any] = {"type": "array", "description": table.description, "minItems": 1, "items": row}
    return array if table.default is REQUIRED else array | {"default": table.default}


def _cell(column: Column, fields: Mapping[str, Field], quantities: Quantities) -> dict[str, Any]:
    if column.text:
        return {"type": "string"}
    unit = column.unit_in(fields)
    return {"type": "number"} if unit == ANY else {"anyOf": [{"type": "number"}, quantities.text(unit)]}


def _structural(kind: type[Component], name: str) -> dict[str, Any]:
    default = declarations(kind).structural[name]
    entry: dict[str, Any] = (
        {"type": json_type, "default": default} if (json_type := _JSON_TYPES.get(type(default))) else {}
    )
    return entry | ({"enum": choices} if (choices := kind.choices(name)) else {})
