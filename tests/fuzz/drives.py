"""Drives of all component types at random, with valid ends, and crossings of two netlists."""

from __future__ import annotations

import random
import tomllib
from collections.abc import Callable
from copy import deepcopy
from functools import cache
from pathlib import Path
from typing import Any

from inputs import document

from modelica_like import build, simulate
from modelica_like.errors import ModelicaLikeError
from modelica_like.language import Input, Output, Parameter
from modelica_like.language.inside import declarations
from modelica_like.language.tables import REQUIRED
from modelica_like.netlist import library_types, loads

Case = tuple[str, Callable[[], object]]
EXAMPLES = Path(__file__).parents[2] / "examples"
LARGEST = 4000
"""Characters of the netlists that are mutated."""
WITH_ENDS = 0.9
"""Share of connectors that are joined with others of their kind."""


@cache
def examples() -> list[tuple[Path, dict[str, Any], str]]:
    """Return the netlists of examples/ that are not long."""
    found = [(path, path.read_text(encoding="utf-8")) for path in sorted(EXAMPLES.rglob("*.toml"))]
    return [(path, tomllib.loads(text), text) for path, text in found if "[parts" in text and len(text) < LARGEST]


@cache
def valid_parts() -> dict[str, list[dict[str, Any]]]:
    """Return tables of parts that load alone, by type: those of the examples, and what a type needs at least."""
    tables = [table for _, tree, _ in examples() for table in tree["parts"].values() if isinstance(table, dict)]
    tables += [{"is": name, **_needed(kind)} for name, kind in library_types().items()]
    parts: dict[str, list[dict[str, Any]]] = {}
    for table in tables:
        if table["is"] in library_types() and "count" not in table and _loads({"k": table}) is not None:
            parts.setdefault(table["is"], []).append(table)
    return parts


def _needed(kind: Any) -> dict[str, Any]:
    fields = {name: field for name, field in declarations(kind).fields.items() if isinstance(field, Parameter)}
    numbers = {name: max(field.min or 0, 1.0) for name, field in fields.items() if field.default is None}
    texts = {name: kind.choices(name)[0] for name, value in declarations(kind).structural.items()
             if value is REQUIRED and kind.choices(name)}  # fmt: skip
    return numbers | texts


def _loads(parts: dict[str, Any], **sections: Any) -> Any:
    try:
        return loads(document({"parts": parts, **sections}), "drive.toml")
    except ModelicaLikeError:
        return None


def drive(chance: random.Random) -> Case:
    """Join some parts of any types at ends of the same kind, and run a few."""
    names = chance.choices(list(valid_parts()), k=chance.randrange(1, 7))
    parts = {f"p{k}": dict(chance.choice(valid_parts()[name])) for k, name in enumerate(names)}
    assembly, connect = _loads(parts), {}
    ends: dict[str, list[str]] = {}
    inputs, outputs = list[str](), list[str]()
    for name, part in assembly.parts.items():
        for end, connector in part.connectors.items():
            if chance.random() < WITH_ENDS:
                ends.setdefault(type(connector).__name__, []).append(f"{name}.{end}")
        inputs += [f"{name}.{key}" for key, field in part.fields.items() if isinstance(field, Input)]
        outputs += [f"{name}.{key}" for key, field in part.fields.items() if isinstance(field, Output)]
    for kind, those in ends.items():
        chance.shuffle(those)
        while len(those) > 1:
            size = min(len(those), chance.choice((2, 2, 2, 3)))
            connect[f"{kind}{len(those)}"] = [those.pop() for _ in range(size)]
    for k, end in enumerate(inputs):
        if outputs and chance.random() < 0.8:
            connect[f"s{k}"] = [chance.choice(outputs), end]
    until = chance.choice((1e-6, 1e-3, 0.05))
    start = chance.choice(("rest", "rest", "given", "steady"))
    text = document({"parts": parts, "connect": connect, "simulate": {"until": until, "start": start}})
    runs = chance.random() < 0.5

    def run() -> None:
        model = build(loads(text, "drive.toml"))
        if runs:
            simulate(model, points=5)

    return text, run


def crossing(chance: random.Random) -> Case:
    """Load a netlist with parts and sections of two."""
    (path, one, _), (_, other, _) = chance.choices(examples(), k=2)
    tree = deepcopy(one)
    for section, content in other.items():
        if not isinstance(content, dict):
            continue
        own = tree.setdefault(section, {})
        for key, value in content.items():
            if chance.random() < 0.5 and isinstance(own, dict):
                own[key if chance.random() < 0.5 else f"{key}_"] = deepcopy(value)
    names = [name for name in tree["parts"] if chance.random() < 0.1]
    for name in names:
        del tree["parts"][name]
    text = document(tree)
    return text, lambda: build(loads(text, str(path)))
