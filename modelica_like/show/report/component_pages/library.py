"""Pages of all component types of the installed libraries, with an index."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, cast

from modelica_like.errors import NetlistError
from modelica_like.language import Component
from modelica_like.language.inside import declarations
from modelica_like.netlist import spell
from modelica_like.netlist.document import parse, read_text
from modelica_like.netlist.registry import find_type, library_types
from modelica_like.show.draw.symbol import symbol
from modelica_like.show.report.component_pages.markdown import cell, place
from modelica_like.show.report.component_pages.page import Example, page, simplicity, symbol_file
from modelica_like.show.report.types import summary
from modelica_like.writing import write_text

INDEX = "README.md"


def component_pages(folder: Path, examples: Path | None = None, types: Sequence[str] | None = None) -> dict[Path, str]:
    """Return pages about component types by file, with their symbols.

    Args:
        folder: of the pages.
        examples: folder of netlists to link.
        types: names as in netlists; by default all types of the installed libraries, with an index.

    Raises:
        UnknownName: there is no such type.
        NetlistError: a library or an example cannot be read.
    """
    kinds = {name: find_type(name) for name in types} if types else library_types()
    occurrences = examples_by_type(examples) if examples else {}
    pages = {folder / place(kind): (name, kind) for name, kind in kinds.items()}
    texts = {} if types else {folder / INDEX: index(kinds)}
    texts |= {file: page(kind, file, occurrences.get(name, ())) for file, (name, kind) in pages.items()}
    return texts | {symbol_file(file): symbol(kind) for file, (_, kind) in pages.items()}


def write_component_pages(folder: Path, examples: Path | None = None, types: Sequence[str] | None = None) -> list[Path]:
    """Write pages about component types, see `component_pages`; other files in the folder are not touched.

    Returns:
        The files of the pages, without those of their symbols.

    Raises:
        OSError: a file cannot be written.
    """
    pages = component_pages(folder, examples, types)
    for file, content in pages.items():
        write_text(file, content)
    return [file for file in pages if file.suffix == ".md"]


def examples_by_type(folder: Path) -> dict[str, list[Example]]:
    """Return the netlists of a folder in which each type occurs, the shortest first.

    Files without parts, such as design checks, are skipped.
    """
    if not folder.is_dir():
        raise NetlistError(f"There is no folder '{folder}' with examples.", advice="Name a folder of netlists.")
    by_type: dict[str, list[Example]] = {}
    contents = {file: read_text(file) for file in folder.rglob("*.toml")}
    for file in sorted(contents, key=lambda file: (len(contents[file]), file)):
        if "[parts" in contents[file]:
            netlist = parse(contents[file], str(file))
            for name, part in _parts("", netlist.parts):
                example = Example(file, netlist.description or netlist.name, f"{name} = {spell.value(part)}")
                by_type.setdefault(part["is"], []).append(example)
    return {name: _once(examples) for name, examples in by_type.items()}


def _once(examples: Sequence[Example]) -> list[Example]:
    """Return one example per file, with its simplest line."""
    files: dict[Path, list[Example]] = {}
    for example in examples:
        files.setdefault(example.path, []).append(example)
    return [min(of, key=lambda s: simplicity(s.line)) for of in files.values()]


def _parts(name: str, table: Any) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield all tables that are parts, at any depth, with their names."""
    if isinstance(table, dict):
        inner = cast("dict[str, Any]", table)
        if isinstance(inner.get("is"), str):
            yield name, inner
        for key, value in inner.items():
            yield from _parts(key, value)
    elif isinstance(table, list):
        for value in cast("list[Any]", table):
            yield from _parts(name, value)


_SIGNALS = "signals"


def index(types: Mapping[str, type[Component]]) -> str:
    """Return a page in Markdown with all types, those of one module side by side.

    Args:
        types: by name.
    """
    domains: dict[str, list[str]] = {}
    for name, kind in sorted(types.items(), key=lambda item: (item[1].__module__.rpartition(".")[2], item[0])):
        domains.setdefault(domain(kind), []).append(name)
    largest = sorted(domains.items(), key=lambda item: (item[0] == _SIGNALS, " and " in item[0], -len(item[1])))
    links = " · ".join(f"[{title}](#{title.replace(' ', '-')})" for title, _ in largest)
    sections = [
        "# Components",
        f"{len(types)} component types, by what they connect: {links}. The pages are made from the declarations; "
        "`modelica-like library WORD` searches them, `modelica-like describe TYPE` shows one.",
    ]
    for title, members in largest:
        tiles = "\n".join(_tile(types[name]) for name in members)
        sections += [f"## {title.capitalize()}", f'<div class="types" markdown="1">\n\n{tiles}\n\n</div>']
    return "\n\n".join(sections) + "\n"


def domain(kind: type[Component]) -> str:
    """Return what a type connects: shaft, circuit and shaft, …; signals if it has no connectors.

    Connectors that may be missing count only if there are no others.
    """
    connectors = declarations(kind).connectors.values()
    always = [connector for connector in connectors if not connector.optional] or connectors
    names = sorted({a.stroke.name if a.stroke else type(a).__name__ for a in always})
    return " and ".join(names) or _SIGNALS


def _tile(kind: type[Component]) -> str:
    page = place(kind)
    picture = symbol_file(page).as_posix()
    return f"- ![]({picture}) [{kind.__name__}]({page.as_posix()}) {cell(summary(kind))}"
