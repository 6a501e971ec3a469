"""Writes llms.txt: the pages of the site, each with its title and its first sentence, for programs that read it."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

_LINK = re.compile(r"!?\[([^\]]*)\]\([^)]*\)")
_FRONT = re.compile(r"\A---\n.*?\n---\n", re.DOTALL)
_SENTENCE = re.compile(r".+?(?<!\b[A-Z])[.?](?=$| [^a-z])")
_LONGEST = 200
"""Characters of a sentence."""


def llms(pages: Path, config: Path) -> str:
    """Return the index.

    Args:
        pages: folder with the pages as Markdown.
        config: of the site, with its name, its description and its navigation.
    """
    project = tomllib.loads(config.read_text(encoding="utf-8"))["project"]
    lines = [f"# {project['site_name']}", "", f"> {project['site_description']}"]
    for section in project["nav"]:
        ((name, entry),) = section.items()
        lines += ["", f"## {name}", "", *(_line(pages / path, path) for path in _paths(entry))]
    return "\n".join(lines) + "\n"


def _paths(entry: Any) -> Iterator[str]:
    if isinstance(entry, str):
        yield entry
        return
    for inner in entry.values() if isinstance(entry, dict) else entry:
        yield from _paths(inner)


def _line(page: Path, path: str) -> str:
    title, sentence = about(page.read_text(encoding="utf-8"))
    home = path.replace("README.md", "index.md").removesuffix(".md")
    return f"- [{title}]({home}.html): {sentence}"


def about(text: str) -> tuple[str, str]:
    """Return the title of a page, and its first sentence as plain text."""
    text = re.sub(r"<!--.*?-->", "", _FRONT.sub("", text), flags=re.DOTALL)
    title = re.search(r"^# (.+)$", text, re.M)
    if title is None:
        raise ValueError(f"A page has no title: {text[:60]!r}")
    for block in re.split(r"\n\s*\n", re.sub(r"^```.*?^```$", "", text[title.end() :], flags=re.M | re.DOTALL)):
        plain = " ".join(_LINK.sub(r"\1", block).split())
        if plain and plain[0] not in "#|<!$-{" and not block.startswith(("    ", "![")):
            match = _SENTENCE.match(plain)
            sentence = match[0] if match else plain.rstrip(":,.") + "."
            return _LINK.sub(r"\1", title[1]), sentence if len(
                sentence
            ) <= _LONGEST else f"{sentence[:_LONGEST].rpartition(' ')[0]} …"
    raise ValueError(f"A page has no text: {title[1]}")
