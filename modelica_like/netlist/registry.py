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
    found = {name: kind for name in _libraries() if (kind := _library_type(name)) is not None}
    return MappingProxyType(dict(sorted(found.items())))


@lru_cache(maxsize=1)
def _libraries() -> Mapping[str, Mapping[str, ModuleType]]:
    """Return the libraries of each public name; a library need not import what nobody asks for."""
    libraries: dict[str, dict[str, ModuleType]] = {}
    for entry in sorted(entry_points(group=GROUP), key=lambda entry: entry.name):
        module = imported(entry.value, f"The library '{entry.name}'")
        for name in getattr(module, "__all__", ()):
            libraries.setdefault(name, {})[entry.name] = module
    for name, modules in libraries.items():
        if len(modules) > 1:
            _type_in(name, modules)
    return libraries


def _library_type(name: str) -> type[Component] | None:
    """Return the component type of a name in the libraries, None if it has none.

    Raises:
        NetlistError: two libraries have different ones.
    """
    return _type_in(name, _libraries().get(name, {}))


def _type_in(name: str, modules: Mapping[str, ModuleType]) -> type[Component] | None:
    kinds: list[type[Component]] = []
    for library, module in modules.items():
        try:
            kind = getattr(module, name)
        except (ImportError, SyntaxError) as error:
            raise _not_imported(f"The library '{library}'", error) from error
        if isinstance(kind, type) and issubclass(kind, Component) and not kind._partial and kind not in kinds:
            kinds.append(kind)
    if len(kinds) > 1:
        raise NetlistError(
            f"Two libraries have a component '{name}': {kinds[0].__module__} and {kinds[1].__module__}.",
            advice=f'Write which one: "{kinds[1].__module__}:{name}".',
        )
    return kinds[0] if kinds else None


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
        raise _not_imported(what, error) from error


def _not_imported(what: str, error: Exception) -> NetlistError:
    return NetlistError(f"{what} cannot be imported: {error}.")


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
    kind = _library_type(name)
    if kind is None:
        types = library_types()
        hint = did_you_mean(name, types) or "."
        advice = "`modelica-like library` lists all types." if types else "No component library is installed."
        raise UnknownName(f"There is no component type '{name}'{hint}", advice=advice)
    return kind


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
    if _library_type(kind.__name__) is kind:
        return kind.__name__
    if "." in kind.__qualname__:
        raise NetlistError(f"{kind.__qualname__} is not at the top of its module, so a netlist cannot name it.")
    return f"{kind.__module__}:{kind.__name__}"
