"""Names, connectors, units, defaults and limits of all components are what netlists rely on; each change is a decision.

`python tests/library/test_declarations.py` writes the list anew.
"""

from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from pkgutil import walk_packages

import components
from modelica_like import Component
from modelica_like.language.declared import Connector
from modelica_like.language.tables import Rows
from modelica_like.netlist import library_types

LIST = Path(__file__).with_name("declarations.txt")
COLUMNS = ("unit", "scale", "rising", "text", "min", "max")
SHOWN = ("unit_text", "default", "min", "max", "above", "nominal", "guess", "state", "tunable")


def declarations() -> Iterator[str]:
    """One line for each declaration of each component, inherited ones included."""
    for name, kind in sorted(library_types().items()):
        yield name
        yield from (f"  {key}: {_connector(one)}" for key, one in kind._class_connectors.items())
        for field in kind._class_fields.values():
            about = (f"{what} {getattr(field, what)}" for what in SHOWN if getattr(field, what, None) is not None)
            yield f"  {field.name}: {type(field).__name__}, {', '.join(about)}"
        yield from (f"  {field} = {_told(default)}" for field, default in kind._structural.items())
        yield from (f"  {field}: {_table(table)}" for field, table in kind._tables.items())
        yield from (f"  {mode}: {' '.join(one.names)}" for mode, one in kind._class_modes.items())


def _told(default: object) -> str:
    return "required" if type(default) is object else repr(default)


def _connector(one: Connector) -> str:
    return " ".join([type(one).__name__, *(what for what in ("may_be_free", "optional") if getattr(one, what))])


def _table(table: Rows) -> str:
    columns = (", ".join(f"{what} {getattr(one, what)}" for what in COLUMNS) for one in table.columns)
    return f"{'flat' if table.flat else 'rows'}{' with more' if table.more else ''}; {'; '.join(columns)}"


def test_declarations_are_what_netlists_rely_on() -> None:
    known, found = LIST.read_text(encoding="utf-8").splitlines(), list(declarations())
    changed = [f"- {line}" for line in known if line not in set(found)]
    changed += [f"+ {line}" for line in found if line not in set(known)]
    assert changed == []
    assert known == found


def test_what_netlists_cannot_name_is_only_a_base() -> None:
    """A base class that could be made by mistake would be a part that lacks equations."""
    modules = (import_module(one.name) for one in walk_packages(components.__path__, "components."))
    kinds = {kind for module in modules for kind in vars(module).values() if isinstance(kind, type)}
    ours = {kind for kind in kinds if issubclass(kind, Component) and kind.__module__.startswith("components.")}
    whole = {kind.__name__ for kind in ours if not kind._partial}
    assert whole - {*library_types()} == {"Chained"}  # of which a transfer function consists


if __name__ == "__main__":
    LIST.write_text("\n".join(declarations()) + "\n", encoding="utf-8")
