"""Assemblies from component classes that only join parts."""

from __future__ import annotations

from typing import Any

from modelica_like.errors import NetlistError
from modelica_like.language import Assembly, Component, Connector
from modelica_like.language.equation import Connection, FreeEnd, as_statement
from modelica_like.language.fields import Parameter
from modelica_like.language.inside import inside
from modelica_like.language.places import located


def as_assembly(component: Component) -> Assembly:
    """Return an assembly with the parts, connections and parameters of a component.

    Args:
        component: an instance of a class whose `equations()` yield only `connect`, `series` and `free`.

    Raises:
        NetlistError: the class has variables, modes or equations of its own.
    """
    root = component.copy()
    names = [name for name, field in root.fields.items() if not isinstance(field, Parameter)]
    if names or root.modes:
        raise _not_only_wires(component, ", ".join([*names, *root.modes]))
    parameters = {name: value_text(root, name) for name in root.fields}
    parts: dict[str, Any] = dict(inside(root).parts)
    wires: list[list[str]] = []
    free: list[str] = []
    exposed: dict[str, str] = {}
    for item, source in located(root.equations()):
        statement = as_statement(item, source, root.label)
        if isinstance(statement, FreeEnd):
            free.append(statement.connector.path)
        elif isinstance(statement, Connection):
            wires.append(_expose(statement, root, exposed))
        else:
            raise _not_only_wires(component, f"the equation {source}")
    named = {f"wire_{k}": ends for k, ends in enumerate((ends for ends in wires if len(ends) > 1), 1)}
    assembly = Assembly(
        inside(component).name or type(component).__name__, parts=parts, connect=named, free=free, parameters=parameters
    )
    for name, end in exposed.items():
        assembly.expose(name, end)
    return assembly


def _expose(connection: Connection, root: Component, exposed: dict[str, str]) -> list[str]:
    """Return the ends of a connection; an outer connector represents the first inner end joined to it."""
    inner = [_path(end) for end in connection.ends if _owner(end) is not root]
    ends = list(inner)
    for end in connection.ends:
        name = _path(end)
        if _owner(end) is root and (name in exposed or not inner or not isinstance(end, Connector)):
            ends.append(name)
        elif _owner(end) is root:
            exposed[name] = inner[0]
    return ends


def _owner(end: Any) -> Any:
    return inside(end).owner if isinstance(end, Connector) else end.owner


def _path(end: Any) -> str:
    return end.path if isinstance(end, Connector) else ".".join(filter(None, (end.owner.path, end.name)))


def value_text(component: Component, name: str) -> Any:
    """Return the value of a parameter for a netlist.

    Raises:
        NetlistError: there is none.
    """
    value = component.value(name)
    if value is None:
        raise NetlistError(f"{component.label}.{name} has no value, so a netlist cannot declare it.")
    unit = component.fields[name].unit_text
    is_number = isinstance(value.given, int | float) and unit not in ("1", "*")
    return f"{value.given!r} {unit}" if is_number else value.given


def _not_only_wires(component: Component, what: str) -> NetlistError:
    return NetlistError(
        f"{type(component).__name__} has {what} of its own; a netlist contains only parts and connections.",
        advice="Use it as a part of a netlist instead.",
    )
