"""JSON schema of netlists, for editors: generated from the declarations of all component types."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from typing import Any, get_args

from modelica_like.language import Component, Input, Parameter, Variable
from modelica_like.language.fields import Discrete, Field
from modelica_like.language.tables import REQUIRED, Column, Rows
from modelica_like.netlist.document import StartKind
from modelica_like.netlist.registry import library_types
from modelica_like.units import ANY

_QUANTITY = {"type": ["number", "string"]}
_JSON_TYPES: dict[type, str] = {bool: "boolean", int: "integer", float: "number", str: "string"}
_ENDS = {"type": "array", "items": {"type": "string"}, "minItems": 2}


def schema() -> dict[str, Any]:
    """Return the JSON schema (draft 2020-12) of a netlist with all installed component types.

    Raises:
        NetlistError: a library cannot be imported.
    """
    types = library_types()
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "modelica-like netlist",
        "type": "object",
        "additionalProperties": False,
        "required": ["parts"],
        "properties": _sections(),
        "$defs": {"part": _part(list(types)), **{name: _component(kind) for name, kind in types.items()}},
    }


def _sections() -> dict[str, Any]:
    return {
        "name": {"type": "string", "description": "name of the model"},
        "description": {"type": "string", "description": "one phrase"},
        "parameters": _map(_QUANTITY, "parameters of the assembly: numbers, quantities or formulas"),
        "parts": _map(
            {"anyOf": [{"$ref": "#/$defs/part"}, {"type": "array", "items": {"$ref": "#/$defs/part"}, "minItems": 1}]},
            "components by name",
        ),
        "series": _map(_ENDS, "chains of parts: outlet to inlet"),
        "connect": _map(_ENDS, "connectors or signals that are joined"),
        "start": _map({"type": ["number", "string", "object"]}, "fixed start values, and start modes, by path"),
        "guess": _map({"type": ["number", "string", "object"]}, "guessed start values by path"),
        "free": {"type": "array", "items": {"type": "string"}, "description": "connectors left free on purpose"},
        "expose": _map({"type": "string"}, "outer connectors: name and inner connector"),
        "simulate": _simulate(),
        "sizing": {"type": "string", "description": "sizing file, whose checks stand in reports"},
        "display": _map({"type": "string"}, "units in which results are shown, by path, pattern or quantity"),
    }


def _simulate() -> dict[str, Any]:
    return {
        "type": "object",
        "additionalProperties": False,
        "properties": {
            "until": {**_QUANTITY, "description": "end time [s]"},
            "start": {"enum": list(get_args(StartKind)), "description": "how the start values are found"},
            "rtol": {"type": "number", "minimum": 1e-14, "maximum": 0.1, "description": "relative tolerance"},
            "points": {"type": "integer", "minimum": 1, "description": "number of output intervals"},
        },
    }


def _map(entries: dict[str, Any], description: str) -> dict[str, Any]:
    return {"type": "object", "description": description, "additionalProperties": entries}


def _part(names: list[str]) -> dict[str, Any]:
    choices = [
        {"enum": names},
        {"pattern": r"^[\w.]+:\w+$", "description": "class of a Python module"},
        {"pattern": r"\.toml$", "description": "another netlist"},
    ]
    return {
        "type": "object",
        "required": ["is"],
        "properties": {
            "is": {"type": "string", "anyOf": choices},
            "count": {"type": "integer", "minimum": 1, "description": "number of parts in an array"},
        },
        "allOf": [
            {"if": {"properties": {"is": {"const": name}}}, "then": {"$ref": f"#/$defs/{name}"}} for name in names
        ],
    }


def _component(kind: type[Component]) -> dict[str, Any]:
    described = Parameter | Input | Variable | Discrete
    properties: dict[str, Any] = {"is": {"const": kind.__name__}, "count": {"type": "integer"}}
    properties |= {name: _field(field) for name, field in kind._class_fields.items() if isinstance(field, described)}
    properties |= {name: {"enum": list(mode.names)} for name, mode in kind._class_modes.items()}
    properties |= {name: _structural(default) for name, default in kind._structural.items() if name not in kind._tables}
    properties |= {name: _table(table, kind._class_fields) for name, table in kind._tables.items()}
    properties |= {name: {"type": "object"} for name in kind._class_parts}
    return {
        "description": inspect.cleandoc(kind.__doc__ or "").partition("\n")[0],
        "properties": properties,
        "patternProperties": {r"[.\[]": True},
        "additionalProperties": False,
    }


def _field(field: Field) -> dict[str, Any]:
    number: dict[str, Any] = {"type": "number"}
    if field.unit.factor == 1.0 and field.unit.offset == 0.0:
        number |= {key: bound for key, bound in (("minimum", field.min), ("maximum", field.max)) if bound is not None}
    unit = "" if field.unit_text == "1" else f" [{field.unit_text}]"
    described: dict[str, Any] = {"description": field.description + unit, "anyOf": [number, {"type": "string"}]}
    if isinstance(field.default, int | float | str):
        described["default"] = field.default
    return described


def _table(table: Rows, fields: Mapping[str, Field]) -> dict[str, Any]:
    cells = [{"type": _cell_types(one, fields), "description": one.described(fields)} for one in table.columns]
    size = {"minItems": len(cells)} | ({"items": cells[-1]} if table.more else {"items": False})
    row = cells[0] if table.flat else {"type": "array", "prefixItems": cells, **size}
    found: dict[str, Any] = {"type": "array", "description": table.description, "minItems": 1, "items": row}
    return found if table.default is REQUIRED else found | {"default": table.default}


def _cell_types(column: Column, fields: Mapping[str, Field]) -> str | list[str]:
    if column.text:
        return "string"
    return "number" if column.unit_in(fields) == ANY else ["number", "string"]


def _structural(default: object) -> dict[str, Any]:
    kind = _JSON_TYPES.get(type(default))
    return {"type": kind, "default": default} if kind else {}
