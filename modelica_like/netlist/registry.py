"""Component types: of installed libraries, and of Python modules by name."""

from __future__ import annotations

import importlib
import shlex
import sys
import traceback
from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from functools import lru_cache
from importlib.machinery import ModuleSpec, PathFinder
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import MappingProxyType, ModuleType

from modelica_like.errors import NetlistError, UntrustedModule, unknown_name
from modelica_like.language import Component
from modelica_like.language.inside import declarations
from modelica_like.trust import may_run

GROUP = "modelica_like.libraries"
"""Entry-point group of libraries; each entry is a module with `__all__`."""
_HOME = str(Path(__file__).parents[2])
"""Folder of this package, with the library that comes with it."""
_own_folders: set[str] = set()
"""Folders of netlists whose modules run in this process; they are at the end of `sys.path`, too."""


@lru_cache(maxsize=1)
def library_types() -> Mapping[str, type[Component]]:
    """Return the component types of all installed libraries by name, sorted; partial classes are left out.

    Raises:
        NetlistError: a library cannot be imported, or two libraries have a type with the same name.
    """
    types = {name: kind for name in _libraries() if (kind := _library_type(name)) is not None}
    return MappingProxyType(dict(sorted(types.items())))


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
        with _importing(f"The library '{library}'"):
            kind = getattr(module, name)
        if (
            isinstance(kind, type)
            and issubclass(kind, Component)
            and not declarations(kind).partial
            and kind not in kinds
        ):
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
        with _importing(what):
            return importlib.import_module(module)
    finally:
        sys.path[:] = before


@contextmanager
def _importing(what: str) -> Generator[None]:
    """Tell any failure of a module's code in one sentence, also that it ends the program."""
    try:
        yield
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        raise _not_imported(what, error) from error


def _not_imported(what: str, error: BaseException) -> NetlistError:
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
        folder: of the netlist, by default the current directory; its module is searched there and above.

    Raises:
        UnknownName: there is no such type.
        UntrustedModule: the folder is not trusted.
        NetlistError: the module cannot be imported, or the class is not a component.
    """
    if ":" in name:
        return _class_of_module(name, folder or Path())
    kind = _library_type(name)
    if kind is None:
        types = library_types()
        advice = "`modelica-like library` lists all types." if types else "No component library is installed."
        module, _, last = name.rpartition(".")
        advice += f" A class of a module is written '{module}:{last}'." if module else ""
        raise unknown_name(f"There is no component type '{name}'", name, types, advice=advice)
    return kind


def _class_of_module(name: str, folder: Path) -> type[Component]:
    module_name, _, class_name = name.partition(":")
    if not all(part.isidentifier() for part in module_name.split(".")):
        raise NetlistError(f"'{name}' is not a class of a module.", advice='Write "package.module:Class".')
    module = _named_module(module_name, folder.resolve())
    kind = vars(module).get(class_name)
    if kind is None:
        names = [key for key, value in vars(module).items() if isinstance(value, type) and issubclass(value, Component)]
        raise unknown_name(f"Module {module_name} has no component '{class_name}'", class_name, names)
    if not (isinstance(kind, type) and issubclass(kind, Component)):
        raise NetlistError(f"'{name}' is not a component class.")
    return kind


def _named_module(name: str, folder: Path) -> ModuleType:
    """Return a module of an installed library, of a trusted folder, or one that this program has imported itself."""
    _libraries()  # loaded first, they cannot be hidden
    importlib.invalidate_caches()
    top = name.partition(".")[0]
    if top in {entry.value.partition(".")[0] for entry in entry_points(group=GROUP)}:
        return imported(name, f"The module '{name}'")
    for home in (folder, *folder.parents) if top != "modelica_like" else ():
        spec = PathFinder.find_spec(top, [str(home)])
        if spec is not None and (spec.origin is not None or home == folder):
            return _own_module(name, home, spec)
    module = sys.modules.get(name)
    others = name != "__main__" and module is not None and str(Path(_place(module)).parent) in _own_folders
    if module is None or others:
        raise NetlistError(
            f"There is no module '{name}' beside the netlist, or in a folder above.",
            advice="A module from elsewhere must be installed as a library.",
        )
    return module


def _own_module(name: str, folder: Path, spec: ModuleSpec) -> ModuleType:
    """Import a module of a trusted folder; one loaded from elsewhere is refused."""
    top = spec.name
    _check_home(top, folder)
    if name not in sys.modules:
        file = spec.origin or str(folder / top)
        linked = Path(file).resolve()
        if linked.parent not in (folder, folder / top):
            raise NetlistError(
                f"The module '{top}' of '{folder}' is a link to '{linked}'.",
                advice="A module is a file of the netlist's folder: copy it there.",
            )
        if not may_run(folder):
            raise UntrustedModule(
                f"'{name}' is a Python module, '{file}', in a folder that is not trusted.",
                why="A module can do all that you can; a netlist without one only computes.",
                advice="If you know who wrote it, trust the folder: "
                f"`modelica-like trust {shlex.quote(str(folder))}`; or run it this once: `--trust`, in Python "
                "load(…, trust=True).",
            )
        imported(name, f"The module '{name}'", [str(folder)])
        _check_home(top, folder)
        _own_folders.add(str(folder))
        if str(folder) not in sys.path:
            sys.path.append(str(folder))  # other processes get the path and also find it
    return sys.modules[name]


def _check_home(top: str, folder: Path) -> None:
    module = sys.modules.get(top)
    if module is not None and Path(_place(module)).resolve().parent not in (folder, folder / top):
        raise NetlistError(
            f"The module '{top}' of '{folder}' cannot be used: '{_place(module)}' is loaded under this name.",
            advice="Rename one of the two.",
        )


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
