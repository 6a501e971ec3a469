"""Component types: of installed libraries, and of Python modules by name."""

from __future__ import annotations

import importlib
import sys
import traceback
from collections.abc import Mapping, Sequence
from functools import lru_cache
from importlib.machinery import PathFinder
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import MappingProxyType, ModuleType

from modelica_like.errors import NetlistError, UnknownName, did_you_mean
from modelica_like.language import Component

GROUP = "modelica_like.libraries"
"""Entry-point group of libraries; each entry is a module with `__all__`."""
_HOME = str(Path(__file__).parents[2])
"""Folder of this package, with the library that comes with it."""
_FAILURES = (ImportError, SyntaxError, NameError, AttributeError, TypeError, ValueError, LookupError, ArithmeticError)
"""Exceptions from the import of a module."""


@lru_cache(maxsize=1)
def library_types() -> Mapping[str, type[Component]]:
    """Return the component types of all installed libraries by name, sorted; partial classes are left out.

    Raises:
        NetlistError: a library cannot be imported, or two libraries have a type with the same name.
    """
    found = {name: kind for name in _libraries() if (kind := _library_type(name)) is not None}
    return MappingProxyType(dict(sorted(found.items())))


@lru_cache(maxsize=1)
def _libraries() -> Mapping[str, Mapping[str, ModuleType]]:
    """Return the libraries of each public name, without importing them."""
    libraries: dict[str, dict[str, ModuleType]] = {}
    for entry in sorted(entry_points(group=GROUP), key=lambda entry: entry.name):
        module = library_module(entry)
        for name in getattr(module, "__all__", ()):
            libraries.setdefault(name, {})[entry.name] = module
    for name, modules in libraries.items():
        if len(modules) > 1:
            _type_in(name, modules)
    return libraries


def library_module(entry: EntryPoint) -> ModuleType:
    """Import an installed library, even if a user's folder has a module of the same name.

    Raises:
        NetlistError: it cannot be imported, or a user's module has the same name.
    """
    distribution = getattr(entry, "dist", None)
    homes = [*([str(distribution.locate_file(""))] if distribution else []), _HOME]
    module = imported(entry.value, f"The library '{entry.name}'", homes)
    spec = PathFinder.find_spec(entry.value, homes)
    if spec is not None and spec.origin not in (None, _place(module)):
        raise NetlistError(
            f"The library '{entry.name}' is hidden by '{_place(module)}', which has taken its name '{entry.value}'.",
            advice="Rename that module.",
        )
    return module


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
            advice=f'Write the full name: "{kinds[1].__module__}:{name}".',
        )
    return kinds[0] if kinds else None


def imported(module: str, what: str, folders: Sequence[str] = ()) -> ModuleType:
    """Import a module.

    Args:
        module: its full name.
        what: name for messages.
        folders: to search first.

    Raises:
        NetlistError: it cannot be imported.
    """
    importlib.invalidate_caches()
    before = list(sys.path)
    sys.path[:0] = folders
    try:
        return importlib.import_module(module)
    except _FAILURES as error:
        raise _not_imported(what, error) from error
    finally:
        sys.path[:] = before


def _not_imported(what: str, error: Exception) -> NetlistError:
    if isinstance(error, ImportError | SyntaxError):
        return NetlistError(f"{what} cannot be imported: {error}.")
    frame = traceback.extract_tb(error.__traceback__)[-1]
    place = f"{Path(frame.filename).name}:{frame.lineno}"
    return NetlistError(f"{what} cannot be imported: {type(error).__name__}: {error} ({place}).")


def _place(module: ModuleType) -> str:
    return getattr(module, "__file__", None) or next(iter(getattr(module, "__path__", ())), "the program")


def find_type(name: str, folder: Path | None = None) -> type[Component]:
    """Return the component type of an `is` in a netlist.

    Args:
        name: a type of an installed library (`Clutch`), or a class of a module (`my_parts:Coupling`).
        folder: of the netlist; modules are searched there, in the current directory, and among installed packages.

    Raises:
        UnknownName: there is no such type.
        NetlistError: the module cannot be imported, or the class is not a component.
    """
    if ":" in name:
        return _class_of_module(name, folder or Path())
    kind = _library_type(name)
    if kind is None:
        types = library_types()
        hint = did_you_mean(name, types) or "."
        advice = "`modelica-like library` lists all types." if types else "No component library is installed."
        module, _, last = name.rpartition(".")
        advice += f" A class of a module is written '{module}:{last}'." if module else ""
        raise UnknownName(f"There is no component type '{name}'{hint}", advice=advice)
    return kind


def _class_of_module(name: str, folder: Path) -> type[Component]:
    module_name, _, class_name = name.partition(":")
    if not all(part.isidentifier() for part in module_name.split(".")):
        raise NetlistError(f"'{name}' is not a class of a module.", advice='Write "package.module:Class".')
    module = _own_module(module_name, [str(one.resolve()) for one in (folder, Path())])
    kind = getattr(module, class_name, None)
    if kind is None:
        known = [key for key, value in vars(module).items() if isinstance(value, type) and issubclass(value, Component)]
        raise UnknownName(
            f"Module {module_name} has no component '{class_name}'{did_you_mean(class_name, known) or '.'}"
        )
    if not (isinstance(kind, type) and issubclass(kind, Component)):
        raise NetlistError(f"'{name}' is not a component class.")
    return kind


def _own_module(name: str, folders: list[str]) -> ModuleType:
    """Import a module that may be in the netlist's folder; a module loaded from elsewhere is refused."""
    _libraries()  # loaded first, they cannot be hidden
    importlib.invalidate_caches()
    top = name.partition(".")[0]
    home = next((one for one in folders if PathFinder.find_spec(top, [one]) is not None), None)
    known = sys.modules.get(top)
    ours = {"modelica_like", *(entry.value.partition(".")[0] for entry in entry_points(group=GROUP))}
    if home is None or top in ours:
        return imported(name, f"The module '{name}'")
    if known is not None and Path(_place(known)).resolve().parent not in (Path(home), Path(home) / top):
        raise NetlistError(
            f"The module '{top}' of '{home}' cannot be used: '{_place(known)}' is loaded under this name.",
            advice="Rename one of the two.",
        )
    module = imported(name, f"The module '{name}'", [home])
    if home not in sys.path:
        sys.path.append(home)  # other processes get the path and also find it
    return module


def type_name(kind: type[Component]) -> str:
    """Return the name by which a netlist finds a type: the inverse of `find_type`.

    Raises:
        NetlistError: the class is local to a function, so no file can name it.
    """
    if _library_type(kind.__name__) is kind:
        return kind.__name__
    if "." in kind.__qualname__:
        raise NetlistError(f"{kind.__qualname__} is not at the top level of its module, so a netlist cannot name it.")
    return f"{kind.__module__}:{kind.__name__}"
