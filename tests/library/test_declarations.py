"""Names, connectors, units, defaults and limits of all components are what netlists rely on; each change is a decision.

`python tests/library/test_declarations.py` writes the list anew.
"""

from collections.abc import Iterable, Iterator
from importlib import import_module
from pathlib import Path
from pkgutil import walk_packages

import pytest

import components
from modelica_like import Component
from modelica_like.language.declared import Connector
from modelica_like.language.inside import declarations
from modelica_like.language.tables import Rows
from modelica_like.netlist import library_types

LIST = Path(__file__).with_name("declarations.txt")
COLUMNS = ("unit", "scale", "rising", "text", "min", "max")
SHOWN = ("unit_text", "default", "min", "max", "above", "nominal", "guess", "state", "tunable")


def declared_ones() -> Iterator[str]:
    """One line for each declaration of each component, inherited ones included."""
    for name, kind in sorted(library_types().items()):
        yield name
        yield from (f"  {key}: {_connector(one)}" for key, one in declarations(kind).connectors.items())
        for field in declarations(kind).fields.values():
            about = (f"{what} {getattr(field, what)}" for what in SHOWN if getattr(field, what, None) is not None)
            yield f"  {field.name}: {type(field).__name__}, {', '.join(about)}"
        yield from (f"  {field} = {_told(default)}" for field, default in declarations(kind).structural.items())
        yield from (f"  {field}: {_table(table)}" for field, table in declarations(kind).tables.items())
        yield from (f"  {mode}: {' '.join(one.names)}" for mode, one in declarations(kind).modes.items())


def _names(lines: Iterable[str]) -> dict[str, dict[str, list[str]]]:
    """The names of each type, with the modes in their order where one is a mode."""
    names: dict[str, dict[str, list[str]]] = {}
    for line in lines:
        if not line.startswith(" "):
            names[line] = {}
        else:
            name, _, about = line.strip().replace(" = ", ": ", 1).partition(": ")
            modes = declarations(library_types()[[*names][-1]]).modes
            names[[*names][-1]][name] = about.split() if name in modes else []
    return names


def broken(known: Iterable[str], found: Iterable[str]) -> list[str]:
    """Names that have gone without a word in `renamed`, and modes with another number: neither may ever be."""
    new = _names(found)
    faults = []
    for kind, names in _names(known).items():
        gone = names.keys() - new.get(kind, {}).keys() - library_types()[kind].renamed.keys() if kind in new else {kind}
        faults += [f"{kind}.{name} is gone: what replaces it is written in `renamed`" for name in sorted(gone)]
        for name in names.keys() - gone:
            if new[kind].get(name, [])[: len(names[name])] != names[name]:
                faults.append(f"{kind}.{name}: modes have other numbers; new ones go behind {names[name]}")
    return faults


def _told(default: object) -> str:
    return "required" if type(default) is object else repr(default)


def _connector(one: Connector) -> str:
    return " ".join([type(one).__name__, *(what for what in ("may_be_free", "optional") if getattr(one, what))])


def _table(table: Rows) -> str:
    columns = (", ".join(f"{what} {getattr(one, what)}" for what in COLUMNS) for one in table.columns)
    return f"{'flat' if table.flat else 'rows'}{' with more' if table.more else ''}; {'; '.join(columns)}"


def test_declarations_are_what_netlists_rely_on() -> None:
    known, found = LIST.read_text(encoding="utf-8").splitlines(), list(declared_ones())
    changed = [f"- {line}" for line in known if line not in set(found)]
    changed += [f"+ {line}" for line in found if line not in set(known)]
    assert changed == []
    assert known == found


def test_what_runs_today_is_never_without_a_successor() -> None:
    known = LIST.read_text(encoding="utf-8").splitlines()
    assert broken(known, declared_ones()) == []
    turned = [line.replace("mode: free stuck", "mode: stuck free") for line in known]
    assert "Clutch.mode: modes have other numbers; new ones go behind" in "\n".join(broken(turned, known))
    assert "Brake.capacity is gone: what replaces it is written in `renamed`" in broken(
        known, [line for line in known if "  capacity:" not in line]
    )


def renames() -> Iterator[str]:
    """One row of the page for each former name."""
    for name, kind in library_types().items():
        yield from (f"| `{name}` | `{former}` | {instead} |" for former, instead in kind.renamed.items())


def test_the_page_of_changes_has_every_former_name() -> None:
    page = (Path(__file__).parents[2] / "docs" / "changes_of_names.md").read_text(encoding="utf-8")
    table = page.partition("## Names")[2].partition("## Modules")[0].strip().splitlines()
    assert table[2:] == [*renames()]


@pytest.mark.parametrize("t_ref", [293.15, 368.15])
def test_the_former_coefficient_of_windings_is_converted_exactly(t_ref: float) -> None:
    """R(T) = R_ref (1 + alpha (T - T_ref)) was the law; the sentence of `renamed` gives the same resistance."""
    alpha, t = 0.0038, 393.15
    alpha20 = alpha / (1 - alpha * (t_ref - 293.15))
    at_ref = alpha20 / (1 + alpha20 * (t_ref - 293.15))
    assert 1 + at_ref * (t - t_ref) == pytest.approx(1 + alpha * (t - t_ref), rel=1e-14)
    assert "alpha20 = alpha/(1 - alpha*(T_ref - 293.15 K))" in library_types()["SeriesDCMachine"].renamed["alpha"]


def test_what_netlists_cannot_name_is_only_a_base() -> None:
    """A base class that could be made by mistake would be a part that lacks equations."""
    modules = (import_module(one.name) for one in walk_packages(components.__path__, "components."))
    kinds = {kind for module in modules for kind in vars(module).values() if isinstance(kind, type)}
    ours = {kind for kind in kinds if issubclass(kind, Component) and kind.__module__.startswith("components.")}
    whole = {kind.__name__ for kind in ours if not declarations(kind).partial}
    assert whole - {*library_types()} == {"Chained"}  # of which a transfer function consists


if __name__ == "__main__":
    if faults := broken(LIST.read_text(encoding="utf-8").splitlines(), declared_ones()):
        raise SystemExit("\n".join(faults))
    LIST.write_text("\n".join(declared_ones()) + "\n", encoding="utf-8")
