"""Pages of all component types of the installed libraries, with an index."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from importlib import import_module
from inspect import cleandoc
from pathlib import Path
from typing import Any, cast

from modelica_like.errors import NetlistError
from modelica_like.language import Component
from modelica_like.netlist.document import parse, read_text
from modelica_like.netlist.registry import find_type, library_types
from modelica_like.show.report.component_pages.markdown import module_title, place, table
from modelica_like.show.report.component_pages.page import Example, page
from modelica_like.show.report.types import summary
from modelica_like.writing import write_text

INDEX = "README.md"


def component_pages(folder: Path, examples: Path | None = None, types: Sequence[str] | None = None) -> dict[Path, str]:
    """Return pages about component types by file.

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
    index = {} if types else {folder / INDEX: _index(kinds)}
    return index | {file: page(kind, file, occurrences.get(name, ())) for file, (name, kind) in pages.items()}


def write_component_pages(folder: Path, examples: Path | None = None, types: Sequence[str] | None = None) -> list[Path]:
    """Write pages about component types, see `component_pages`; other files in the folder are not touched.

    Raises:
        OSError: a file cannot be written.
    """
    pages = component_pages(folder, examples, types)
    for file, content in pages.items():
        write_text(file, content)
    return list(pages)


def examples_by_type(folder: Path) -> dict[str, list[Example]]:
    """Return the netlists of a folder in which each type occurs, the shortest first.

    Files without parts, such as design checks, are skipped.
    """
    if not folder.is_dir():
        raise NetlistError(f"There is no folder '{folder}' with examples.", advice="Name a folder of netlists.")
    found: dict[str, dict[Path, Example]] = {}
    contents = {file: read_text(file) for file in folder.rglob("*.toml")}
    for file in sorted(contents, key=lambda file: (len(contents[file]), file)):
        if "[parts" in contents[file]:
            netlist = parse(contents[file], str(file))
            for part in _parts(netlist.parts):
                example = Example(file, netlist.description or netlist.name)
                found.setdefault(part["is"], {}).setdefault(file, example)
    return {name: list(examples.values()) for name, examples in found.items()}


def _parts(table: Any) -> Iterator[Mapping[str, Any]]:
    """Yield all tables that are parts, at any depth."""
    if isinstance(table, dict):
        inner = cast("dict[str, Any]", table)
        if isinstance(inner.get("is"), str):
            yield inner
        for value in inner.values():
            yield from _parts(value)
    elif isinstance(table, list):
        for value in cast("list[Any]", table):
            yield from _parts(value)


def _index(types: Mapping[str, type[Component]]) -> str:
    modules: dict[str, list[str]] = {}
    for name, kind in types.items():
        modules.setdefault(kind.__module__, []).append(name)
    sections = [
        "# Components",
        f"{len(types)} component types, by machine element. These pages are generated from the declarations.",
        " · ".join(
            f"[{module_title(module)}](#{module_title(module).replace(' ', '-')})" for module in sorted(modules)
        ),
    ]
    for module, members in sorted(modules.items()):
        text = cleandoc(import_module(module).__doc__ or "").partition("\n\n")[0]
        sections += [f"## {module_title(module)}", text, _rows(types, members)]
    return "\n\n".join(sections) + "\n"


def _rows(types: Mapping[str, type[Component]], members: Sequence[str]) -> str:
    rows = ((f"[{name}]({place(types[name]).as_posix()})", summary(types[name])) for name in members)
    return table("", ("type", "what it is"), rows)
