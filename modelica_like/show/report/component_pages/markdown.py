"""Markdown: tables, cells and links."""

from __future__ import annotations

import inspect
import os
from collections.abc import Iterable, Sequence
from pathlib import Path

from modelica_like.language import Component
from modelica_like.netlist.registry import library_types
from modelica_like.parsing import source_lines
from modelica_like.show.report.declared import filled


def source_link(kind: type, file: Path) -> str:
    """Return a link to the first line of a class, relative to a page."""
    source = Path(inspect.getsourcefile(kind) or "")
    line = source_lines(kind)[1]
    return f"[{source.name}:{line}]({relative(source, file.resolve())}#L{line})"


def module_title(module: str) -> str:
    """Return the title of a module."""
    return module.rpartition(".")[2].replace("_", " ")


def markdown(words: str) -> str:
    """Return a text with Markdown commands escaped."""
    return words.replace("<", "&lt;").replace("*", r"\*")


def cell(words: str) -> str:
    """Return a text for a cell of a table."""
    return markdown(words).replace("|", r"\|").replace("\n", " ")


def table(title: str, head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table under a heading, without empty columns; an empty text if there are no rows."""
    _, kept, filled_rows = filled(title, head, rows)
    lines = [kept, ["---"] * len(kept), *filled_rows] if filled_rows else []
    return (f"## {title}\n\n" if title and lines else "") + "\n".join(f"| {' | '.join(line)} |" for line in lines)


def page_link(kind: type[Component]) -> str:
    """Return a link from one page to another."""
    in_library = library_types().get(kind.__name__) is kind
    return f"[{kind.__name__}](../{place(kind).as_posix()})" if in_library else kind.__name__


def place(kind: type[Component]) -> Path:
    """Return the file of a page, from the folder of all pages: `friction/Clutch.md`."""
    return Path(kind.__module__.rpartition(".")[2]) / f"{kind.__name__}.md"


def relative(target: Path, page: Path) -> str:
    """Return the path of a file as a link of a page."""
    return Path(os.path.relpath(target, page.parent)).as_posix()
