"""Component types: of installed libraries, and of Python modules by name."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from functools import lru_cache
from importlib.metadata import entry_points
from types import MappingProxyType, ModuleType

from modelica_like.errors import NetlistError, UnknownName, did_you_mean
from modelica_like.language import Component

GROUP = "modelica_like.libraries"
"""Entry-point group by which libraries make themselves known; each entry is a module with `__all__`."""


@lru_cache(maxsize=1)
def library_types() -> Mapping[str, type[Component]]:
    """Return the component types of all installed libraries by name, sorted; partial classes are left out.

    Raises:
        NetlistError: a library cannot be imported, or two libraries have a type of one name.
    """
    types: dict[str, type[Component]] = {}
    for entry in sorted(entry_points(group=GROUP), key=lambda entry: entry.name):
        for name, kind in _types_of(imported(entry.value, f"The library '{entry.name}'")).items():
            if types.setdefault(name, kind) is not kind:
                raise NetlistError(
                    f"Two libraries have a component '{name}': {types[name].__module__} and {kind.__module__}.",
                    advice=f'Write which one: "{kind.__module__}:{name}".',
                )
    return MappingProxyType(dict(sorted(types.items())))


def _types_of(module: ModuleType) -> dict[str, type[Component]]:
    members = {name: getattr(module, name) for name in getattr(module, "__all__", ())}
    return {
        name: member
        for name, member in members.items()
        if isinstance(member, type) and issubclass(member, Component) and not member._partial
    }


def imported(module: str, what: str) -> ModuleType:
    """Import a module.

    Args:
        module: its full name.
        what: how to call it in a message.

    Raises:
        NetlistError: it cannot be imported.
    """
    try:
        return importlib.import_module(module)
    except (ImportError, SyntaxError) as error:
        raise NetlistError(f"{what} cannot be imported: {error}.") from error


def find_type(name: str) -> type[Component]:
    """Return the component type that a netlist means by `is`.

    Args:
        name: a type of an installed library (`Clutch`), or a class of a module (`my_parts:Coupling`).

    Raises:
        UnknownName: there is no such type.
        NetlistError: the module cannot be imported, or the class is no component.
    """
    if ":" in name:
        return _class_of_module(name)
    types = library_types()
    if name not in types:
        hint = did_you_mean(name, types) or "."
        advice = "`modelica-like library` lists all types." if types else "No component library is installed."
        raise UnknownName(f"There is no component type '{name}'{hint}", advice=advice)
    return types[name]


def _class_of_module(name: str) -> type[Component]:
    module_name, _, class_name = name.partition(":")
    if not all(part.isidentifier() for part in module_name.split(".")):
        raise NetlistError(f"'{name}' is no class of a module.", advice='Write "package.module:Class".')
    module = imported(module_name, f"The module '{module_name}'")
    kind = getattr(module, class_name, None)
    if kind is None:
        known = [key for key, value in vars(module).items() if isinstance(value, type) and issubclass(value, Component)]
        raise UnknownName(
            f"Module {module_name} has no component '{class_name}'{did_you_mean(class_name, known) or '.'}"
        )
    if not (isinstance(kind, type) and issubclass(kind, Component)):
        raise NetlistError(f"'{name}' is not a component class.")
    return kind


def type_name(kind: type[Component]) -> str:
    """Return the name by which a netlist finds a type: the inverse of `find_type`.

    Raises:
        NetlistError: the class is local to a function, so no file can name it.
    """
    if library_types().get(kind.__name__) is kind:
        return kind.__name__
    if "." in kind.__qualname__:
        raise NetlistError(f"{kind.__qualname__} is not at the top of its module, so a netlist cannot name it.")
    return f"{kind.__module__}:{kind.__name__}"
