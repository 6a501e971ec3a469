"""Netlists: TOML files with the same tree of components as Python classes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from modelica_like.language import Component
from modelica_like.netlist.read import load as load
from modelica_like.netlist.read import loads as loads
from modelica_like.netlist.registry import find_type as find_type
from modelica_like.netlist.registry import library_types as library_types
from modelica_like.netlist.registry import type_name as type_name
from modelica_like.trust import trusting as trusting

__all__ = ["dumps", "find_type", "library_types", "load", "loads", "save", "schema", "trusting", "type_name"]


def dumps(component: Component, *, folder: str | Path = ".") -> str:
    """Write a component as the text of a netlist; see `write.dumps`."""
    from modelica_like.netlist import write

    return write.dumps(component, folder=folder)


def save(component: Component, path: str | Path) -> None:
    """Write a component as a netlist file; see `write.dumps`."""
    from modelica_like.netlist import write

    write.save(component, path)


def schema() -> dict[str, Any]:
    """Return the JSON schema of netlists with all installed component types."""
    from modelica_like.netlist.json_schema import schema as generate

    return generate()
