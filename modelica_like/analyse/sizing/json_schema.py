"""JSON schema of sizing files, for editors: generated from the arguments and results of all design checks."""

from __future__ import annotations

import dataclasses
import inspect
from functools import lru_cache
from typing import Any

from modelica_like.analyse.sizing.checks import (
    Argument,
    Check,
    arguments_of,
    design_checks,
    meanings,
    unit_of_kind,
    without_none,
)
from modelica_like.language.results import hints
from modelica_like.netlist.json_schema import DRAFT, chosen
from modelica_like.netlist.json_units import Quantities, unnamed_quantities

_RUN = {"type": "object", "description": "a number from a run", "required": ["from"], "additionalProperties": True}
_TEXT = {"type": "string"}


def schema() -> dict[str, Any]:
    """Return the JSON schema (draft 7) of a sizing file with all installed design checks."""
    checks = design_checks()
    arguments = [argument for check in checks.values() for argument in arguments_of(check).values()]
    units = {str(unit) for argument in arguments if (unit := unit_of_kind(without_none(argument.kind)))}
    quantities = Quantities(units)
    schemas = {name: _check(check, quantities) for name, check in checks.items()}
    return {
        "$schema": DRAFT,
        "title": "modelica-like sizing file",
        "type": "object",
        "additionalProperties": False,
        "required": ["checks"],
        "properties": {
            "name": {**_TEXT, "description": "name of the design; default: that of the file"},
            "description": {**_TEXT, "description": "one phrase"},
            "parameters": {"type": "object", "description": "numbers, quantities, formulas of earlier ones, or runs"},
            "checks": {
                "type": "object", "description": "design checks by name; `is` names the check",
                "additionalProperties": {"$ref": "#/definitions/check"},
            },
            "compare": {
                "type": "object", "description": "names of checks of one kind to print side by side, by heading",
                "additionalProperties": {"type": "array", "items": _TEXT},
            },
        },
        "definitions": {"check": chosen(schemas), **schemas, **quantities.definitions()},
    }  # fmt: skip


@lru_cache(maxsize=512)
def properties_of(check: Check) -> dict[str, Any]:
    """Return the schemas of what one check can be given, by name."""
    return _check(check, unnamed_quantities())["properties"]


def _check(check: Check, quantities: Quantities) -> dict[str, Any]:
    text = inspect.cleandoc(check.__doc__ or "")
    described = dict(meanings(text))
    properties = {name: _argument(a, described.get(name, ""), quantities) for name, a in arguments_of(check).items()}
    result = hints(check)["return"]
    lines = [field.name for field in dataclasses.fields(result)] if dataclasses.is_dataclass(result) else []
    common = {
        "is": {"const": check.__name__},
        "note": {**_TEXT, "description": "a remark that is printed"},
        "limits": {"type": "object", "description": f"min and max of {', '.join(lines)}", "additionalProperties": True},
        "published": {"type": "object", "description": "values of a document", "additionalProperties": True},
    }
    return {
        "type": "object", "required": ["is"], "description": text.partition("\n")[0],
        "properties": {**common, **properties}, "additionalProperties": False,
    }  # fmt: skip


def _argument(argument: Argument, meaning: str, quantities: Quantities) -> dict[str, Any]:
    kind = without_none(argument.kind)
    unit = unit_of_kind(kind)
    result: dict[str, Any] = {"description": meaning + (f" [{unit}]" if unit and unit.atoms else "")}
    if unit is not None:
        value = {"anyOf": [{"type": "number"}, quantities.text(unit), _RUN]}
        result |= {"anyOf": [*value["anyOf"], {"type": "array", "items": value}]}
    if isinstance(argument.default, bool | int | float | str):
        result["default"] = argument.default
    return result
