"""What can be put on a sheet: types of the libraries, classes and netlists of the folder."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Mapping
from contextlib import suppress
from functools import lru_cache
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

from modelica_like.language import Component
from modelica_like.language.inside import declarations
from modelica_like.lsp.names import Owner, owner_of, units_like
from modelica_like.netlist.registry import GROUP, library_types
from modelica_like.parsing import parse
from modelica_like.show.draw.symbol import symbol
from modelica_like.show.report.component_pages.page import page as component_page
from modelica_like.show.report.types import summary

_MOST = 60
"""Entries of an answer; who wants more types another word."""
_LARGEST = 1_000_000
"""Bytes of a file beside the netlist that is looked into."""
_UNITLESS = ("1", "*")


@lru_cache(maxsize=1)
def _library() -> Mapping[str, tuple[str, str, str]]:
    """Return group, first sentence and searched text of each type of the libraries."""
    known: dict[str, tuple[str, str, str]] = {}
    for name, kind in library_types().items():
        group = kind.__module__.partition(".")[2].replace(".", " · ").replace("_", " ")
        known[name] = group, summary(kind), f"{name} {group} {kind.__doc__}".lower()
    return known


@lru_cache(maxsize=512)
def _symbol(name: str) -> str:
    return symbol(library_types()[name])


def palette(folder: Path, words: str, without: Path) -> dict[str, Any]:
    """Return the types that have all words, best first: those with the words in their name, then in their text.

    Args:
        folder: of the netlist.
        words: in any case of letters; without one there are all groups, and what the folder has.
        without: the netlist itself.

    Returns:
        `groups`, with their numbers of types; `entries` with `kind`, `group`, `about` and `symbol`; `more`, the number
        of those that are left out.
    """
    wanted, groups = words.lower().split(), dict[str, int]()
    rows: list[tuple[int, str, str, str]] = []
    for name, (group, about, text) in _library().items():
        groups[group] = groups.get(group, 0) + 1
        if wanted and all(word in text for word in wanted):
            hits = (name.lower().startswith(wanted[0]), wanted[0] in name.lower(), wanted[0] in about.lower(), True)
            rank = 0 if words.lower() == group.lower() else hits.index(True)
            rows.append((rank, name, group, about))
    own = [(kind, about) for kind, about in _own(folder, without) if all(word in kind.lower() for word in wanted)]
    found = [{"kind": kind, "group": "this folder", "about": about, "symbol": ""} for kind, about in own]
    found += [{"kind": name, "group": group, "about": about, "symbol": _symbol(name)}
              for _, name, group, about in sorted(rows)[:_MOST]]  # fmt: skip
    return {"groups": dict(sorted(groups.items())), "entries": found, "more": max(len(rows) - _MOST, 0)}


def _own(folder: Path, without: Path) -> list[tuple[str, str]]:
    """Return netlists and component classes beside the netlist; no code runs for that."""
    rows: list[tuple[str, str]] = []
    packages = ["modelica_like", *(entry.value.partition(".")[0] for entry in entry_points(group=GROUP))]
    for file in sorted([*folder.glob("*.toml"), *folder.glob("*.py")]):
        if file.resolve() == without.resolve() or not file.is_file() or file.stat().st_size > _LARGEST:
            continue
        text = file.read_text(encoding="utf-8", errors="replace")
        if file.suffix == ".toml" and "[parts" in text and "[expose]" in text:
            rows.append((f"./{file.name}", "netlist of this folder"))
        elif file.suffix == ".py" and any(package in text for package in packages):
            rows += ((f"{file.stem}:{name}", "class of this folder") for name in _classes(text))
    return rows


def _classes(text: str) -> list[str]:
    try:
        statements = parse(text).body
    except (SyntaxError, ValueError, RecursionError):
        return []  # what it is is told where it is used
    return [one.name for one in statements if isinstance(one, ast.ClassDef) and one.bases and one.name[0] != "_"]


def described(owner: Owner) -> dict[str, Any]:
    """Return what a part of a type, or a netlist used as a part, can be given.

    Returns:
        `about`, its text; `values`, rows with `name`, `about`, `unit` and `units` like it, `default`, `least`, `most`,
        `choices`, `sort` (parameter, input, start, mode, structure, table) and, of tables, `columns`; `ends` with
        their descriptions; `parts`, names of the parts inside; `symbol`, of a class of Modelica text that draws one.
    """
    known, schemas = declarations(owner.kind), owner.values
    values: list[dict[str, Any]] = []
    for name, schema in schemas.items():
        if name in ("is", "count") or name in known.parts:
            continue
        field = owner.fields.get(name)
        unit = "" if field is None or field.unit_text in _UNITLESS else field.unit_text
        limits = schema.get("anyOf", [schema])[0]
        values.append({
            "name": name, "about": str(schema.get("description", "")).removesuffix(f" [{unit}]"), "unit": unit,
            "default": schema.get("default"), "least": limits.get("minimum"), "most": limits.get("maximum"),
            "units": units_like(field.unit) if field and unit else [],
            "choices": schema.get("enum") or ([True, False] if schema.get("type") == "boolean" else []),
            "sort": "table" if name in known.tables else "mode" if name in known.modes
            else "structure" if field is None else _SORTS.get(type(field).__name__, "parameter"),
            "columns": _columns(schema) if name in known.tables else [],
        })  # fmt: skip
    inner = [name for name in owner.parts if known.parts or not name.endswith("]")]
    drawn = {"symbol": symbol(owner.part)} if owner.part is not None and owner.part.icon is not None else {}
    return {"about": owner.about, "values": values, "ends": owner.ends(), "parts": inner} | drawn


def class_page(kind: type[Component]) -> dict[str, str]:
    """Return the page of a component class as Markdown up to its equations (`text`), and their source (`source`)."""
    with suppress(OSError, TypeError):  # its file is not there
        text = component_page(kind, Path("page.md"), ())
        tables = text.partition("\n## ")
        return {"text": "".join(tables[1:]).partition("<details")[0],
                "source": inspect.cleandoc("\n" + inspect.getsource(kind.equations))}  # fmt: skip
    return {"text": "", "source": ""}


_SORTS = {"Variable": "start", "Output": "start", "Discrete": "start", "Input": "input"}


def _columns(schema: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return `about` of the columns of a table, and whether their cells are texts (`text`); a flat one has none."""
    cells = schema.get("items", {}).get("items")
    known = cells if isinstance(cells, list) else []
    return [{"about": str(cell.get("description", "")), "text": cell.get("type") == "string"} for cell in known]


@lru_cache(maxsize=512)
def described_type(name: str) -> dict[str, Any]:
    """Return what a part of a type of the libraries can be given, with its symbol; see `described`."""
    kind = library_types()[name]
    return described(owner_of(kind)) | {"symbol": _symbol(name)}
