"""The index of component types: one tile for each, with symbol and sentence, by what they connect."""

from __future__ import annotations

from collections.abc import Mapping

from modelica_like.language import Component
from modelica_like.show.report.component_pages.markdown import cell, place
from modelica_like.show.report.component_pages.page import symbol_file
from modelica_like.show.report.types import summary

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
    connectors = kind._class_connectors.values()
    always = [connector for connector in connectors if not connector.optional] or connectors
    names = sorted({one.stroke.name if one.stroke else type(one).__name__ for one in always})
    return " and ".join(names) or _SIGNALS


def _tile(kind: type[Component]) -> str:
    page = place(kind)
    picture = symbol_file(page).as_posix()
    return f"- ![]({picture}) [{kind.__name__}]({page.as_posix()}) {cell(summary(kind))}"
