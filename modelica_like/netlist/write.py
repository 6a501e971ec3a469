"""From a tree of components to a netlist: the inverse of reading."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from modelica_like import upper
from modelica_like.errors import NetlistError
from modelica_like.language import Assembly, Component
from modelica_like.language.fields import Field, Parameter, Value
from modelica_like.language.formula import Formula
from modelica_like.language.inside import declarations, inside
from modelica_like.language.scopes import scope_for, scopes_of
from modelica_like.language.tables import frozen_rows
from modelica_like.netlist import spell
from modelica_like.netlist.convert import as_assembly
from modelica_like.netlist.read import load, new_component
from modelica_like.netlist.registry import type_name
from modelica_like.writing import write_text


def save(component: Component, path: str | Path) -> None:
    """Write a component as a netlist file; see `dumps`.

    What was read from a file keeps its comments, order and layout: only what has changed is written anew.
    """
    kept = upper.rewritten(component, path) if isinstance(component, Assembly) and inside(component).text else None
    write_text(path, kept or dumps(component, folder=Path(path).parent))


def dumps(component: Component, *, folder: str | Path = ".") -> str:
    """Write a component as the text of a netlist; reading it gives the same tree.

    Args:
        component: an assembly, or a component that has only parts and connections.
        folder: of the text; netlists used as parts are named relative to it.

    Raises:
        NetlistError: the component has something a netlist cannot contain, such as equations of its own.
    """
    return spell.document(sections(component, folder))


def sections(component: Component, folder: str | Path) -> dict[str, dict[str, Any]]:
    """Return what `dumps` writes as plain data, by section; what stands at the top has the name ""."""
    assembly = component if isinstance(component, Assembly) else as_assembly(component)
    return _Writer(Path(folder)).sections(assembly)


class _Writer:
    """Collects the sections; start values of all levels go to `[start]` and `[guess]`."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.start: dict[str, Any] = {}
        self.guess: dict[str, Any] = {}

    def sections(self, assembly: Assembly) -> dict[str, dict[str, Any]]:
        parts = {name: self.part(name, part) for name, part in inside(assembly).parts.items()}
        sections: dict[str, dict[str, Any]] = {
            "parameters": {
                name: plain(_given(assembly, name).given)
                for name, field in assembly.fields.items()
                if isinstance(field, Parameter)
            },
            "parts": parts,
            "series": {name: list(ends) for name, ends in assembly.chains.items()},
            "connect": {name: list(ends) for name, ends in assembly.wires.items()},
            "expose": dict(assembly.exposed),
            "start": self.start,
            "guess": self.guess,
            "simulate": inside(assembly).simulate,
            "display": inside(assembly).display,
            "optimize": _as_written(inside(assembly).optimize),
            "tolerances": _as_written(inside(assembly).tolerances),
            "modelica": dict(inside(assembly).libraries),
        }
        top: dict[str, Any] = {"name": inside(assembly).name}
        if inside(assembly).description:
            top["description"] = inside(assembly).description
        if inside(assembly).sizing:
            top["sizing"] = Path(os.path.relpath(inside(assembly).sizing, self.folder.resolve())).as_posix()
        if assembly.free_ends:
            top["free"] = list(assembly.free_ends)
        return {"": top, **sections}

    def part(self, path: str, part: Component | list[Component]) -> Any:
        if not isinstance(part, list):
            return self.entry(path, part)
        entries = [self.entry(f"{path}[{k}]", element) for k, element in enumerate(part, 1)]
        same = all(entry == entries[0] for entry in entries)
        return {"is": entries[0].pop("is"), "count": len(entries), **entries[0]} if same else entries

    def entry(self, path: str, part: Component) -> dict[str, Any]:
        """Return the table of one part: its type, and the differences from a new one of that type."""
        if isinstance(part, Assembly):
            origin = inside(part).origin
            if not origin:
                raise NetlistError(
                    f"{part.label} is an assembly without a file, so a netlist cannot name it.",
                    advice="Save it to a separate file, load that file, and use it as the part.",
                )
            relative = Path(os.path.relpath(origin, self.folder.resolve())).as_posix()
            return {
                "is": (relative if relative.startswith(".") else f"./{relative}"),
                **self.changes(path, part, load(inside(part).origin)),
            }
        structural = {
            key: plain(inside(part).given_tables.get(key, getattr(part, key))) for key in declarations(part).structural
        }
        reference = new_component(type(part), dict(structural))
        different = {
            key: value for key, value in structural.items() if frozen_rows(value) != declarations(part).structural[key]
        }
        return {"is": type_name(type(part)), **different, **self.changes(path, part, reference)}

    def changes(self, path: str, part: Component, reference: Component) -> dict[str, Any]:
        """Return the values that differ from those of `reference`; start values go to their sections."""
        table = {
            name: _given_text(path, part, value)
            for name, value in inside(part).values.items()
            if value != inside(reference).values.get(name)
        }
        for name, value in inside(part).starts.items():
            if value != inside(reference).starts.get(name):
                section = self.start if value.fixed else self.guess
                section[f"{path}.{name}"] = _given_text(path, part, value)
        for name in part.modes:
            if part.start_mode(name) != reference.start_mode(name):
                self.start[f"{path}.{name}"] = part.start_mode(name)
        parts = reference.parts
        for name, inner in part.parts.items():
            if type(inner) is not type(parts[name]):
                table[name] = self.entry(f"{path}.{name}", inner)
            elif change := self.changes(f"{path}.{name}", inner, parts[name]):
                table[name] = change
        return table


def _given(component: Component, name: str) -> Value:
    value = component.value(name)
    if value is None:
        raise NetlistError(f"{component.label}.{name} has no value.")
    return value


def _given_text(path: str, part: Component, value: Value) -> Any:
    """Return a value of a part; names of a formula are written as the netlist knows them, which is above the part."""
    steps, scopes = path.split("."), scopes_of(part, value, given=True)
    if value.formula is None or value.levels >= len(steps):
        return plain(value.given)

    def seen(name: str) -> str:
        levels = value.levels if scope_for(scopes, name) is scopes[0] else 1
        return ".".join([*steps[: len(steps) - levels], name])

    return str(value.formula.renamed(seen))


def plain(value: Any) -> Any:
    """Return a value for TOML; numbers and texts stay as written.

    Raises:
        NetlistError: TOML has no such value.
    """
    if isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, Formula):
        return str(value)
    if isinstance(value, Field):
        return value.name
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if hasattr(value, "magnitude"):
        units = ".".join(f"{name}^({power})" if power != 1 else name for name, power in value.unit_items())
        return f"{float(value.magnitude)!r} {units}"
    if hasattr(value, "tolist"):
        return value.tolist()
    raise NetlistError(f"{value!r} cannot be written to a netlist.")


def _as_written(value: Any) -> Any:
    """Return the values of [optimize] and [tolerances] as TOML has them."""
    if isinstance(value, dict):
        return {key: _as_written(entry) for key, entry in value.items()}
    if isinstance(value, tuple) and len(value) == 1 and isinstance(value[0], str):
        return value[0]  # one text may stand alone
    return [_as_written(entry) for entry in value] if isinstance(value, list | tuple) else value
