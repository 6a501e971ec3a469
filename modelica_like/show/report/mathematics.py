"""A flat model as mathematics: the equations of each component type that occurs, with their source."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from modelica_like.errors import Source as Place
from modelica_like.flatten.model import FlatModel
from modelica_like.language import Component
from modelica_like.show.report.component_pages.markdown import cell, table
from modelica_like.show.report.component_pages.page import written
from modelica_like.show.report.component_pages.source import Said, Source, Term

_CONDITION = re.compile(r"\\text\{(if|unless) \} \\text\{(.+) is (connected|given)\}")


def mathematics(flat: FlatModel) -> str:
    """Return the equations of a flat model in Markdown with LaTeX, for notebooks.

    Instances of one type stand together, with the lines that their equations come from.

    Args:
        flat: the model.
    """
    parts, places = dict[type[Component], dict[str, Component]](), dict[type[Component], dict[str, None]]()
    for instance in flat.instances:
        if instance.template.sources:
            part = flat.components[instance.path]
            parts.setdefault(type(part), {})[instance.path or flat.name] = part
            places.setdefault(type(part), {}).update(dict.fromkeys(map(_place, instance.template.sources)))
    lines = [f"## {flat.name}", f"{flat}."]
    for kind, parts_of in parts.items():
        lines += [
            f"### {kind.__name__}: {', '.join(f'`{path}`' for path in parts_of)}",
            _class(kind, [*parts_of.values()]),
        ]
        lines.append(f"Source: {', '.join(places[kind])}.")
    ends = dict.fromkeys((e.origin.path, e.origin.source) for e in flat.linear if e.origin.kind == "connection")
    joined = table("", ("joined", "source"), [(cell(path), _place(source)) for path, source in ends])
    if joined:
        lines += ["### Connections", "Potentials are equal, and flows add up to zero.", joined]
    return "\n\n".join(filter(None, lines))


def _class(kind: type[Component], parts: Sequence[Component]) -> str:
    """The equations of a class that hold for one of the parts, and what they call."""
    source = Source(kind)
    try:
        equations = written(said for said in source.says("equations") if _holds(said, parts))
        definitions = written(source.definitions())
    except OSError:  # typed at a prompt
        return ""
    return equations + (f"\n\nwhere\n\n{definitions}" if definitions else "")


def _holds(said: Said, parts: Sequence[Component]) -> bool:
    """Whether an equation applies to one of the parts, as far as its condition tells it."""
    match = _CONDITION.fullmatch(said.where) if isinstance(said, Term) else None
    if match is None:
        return True
    word, name, what = match[1], match[2].replace(" ", "_"), match[3]
    facts = [part.connectors[name].used if what == "connected" else part.given(name) for part in parts]
    return (word == "if") in facts


def _place(source: Place) -> str:
    return f"{Path(source.file).name}:{source.line}" if source.file else ""
