"""Answers as short JSON: six digits, the first rows of tables, problems without empty keys."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from difflib import unified_diff
from pathlib import Path
from typing import Any

from modelica_like.show.report.tables import as_data

_ROWS, _PROBLEMS, _CHANGED = 8, 10, 40
"""Rows of a table, problems and changed lines in an answer; the numbers of the others are told."""
_LONGEST = 12_000
"""Characters of a text."""
_KEPT = ("kind", "line", "path", "what", "why", "advice")


def written(answer: Any) -> str:
    """Return an answer as JSON text."""
    # What is half a character in UTF-16, as a name of a file can have it, is no text.
    return json.dumps(_short(answer), ensure_ascii=False, allow_nan=False).encode(errors="replace").decode()


def _short(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _short(inner) for key, inner in value.items()}
    if isinstance(value, str):
        return value if len(value) <= _LONGEST else f"{value[:_LONGEST]}… ({len(value)} characters in all)"
    if isinstance(value, bool | int | None):
        return value
    if isinstance(value, Sequence):
        return [_short(inner) for inner in value]
    number = float(value)
    return float(f"{number:.6g}") if math.isfinite(number) else None


def report(*shown: Any) -> dict[str, Any]:
    """Return reports as data: the first rows of their tables, with the number of the others, and sentences."""
    data = as_data(*shown)
    tables = {name: first(rows, _ROWS) for name, rows in data["tables"].items()}
    return {**tables, **({"text": data["text"]} if data["text"] else {})}


def first(rows: Sequence[Any], most: int) -> list[Any]:
    """Return the first elements, with a sentence about the others."""
    return [*rows[:most], *([f"and {len(rows) - most} others"] if len(rows) > most else [])]


def problems(root: Path, listed: Iterable[Mapping[str, Any]]) -> list[Any]:
    """Return problems without what is empty; places outside of the folder are not told."""
    short: list[dict[str, Any]] = []
    for problem in listed:
        file, suggestion = Path(problem["file"] or ""), problem["suggestion"]
        place = {"file": file.relative_to(root).as_posix()} if file.is_relative_to(root) else {}
        keys = {key: problem[key] for key in _KEPT if problem[key] and (place or key != "line")}
        change = {key: suggestion[key] for key in suggestion if key != "file"} if suggestion else None
        short.append({**place, **keys, **({"suggestion": change} if change else {})})
    return first(short, _PROBLEMS)


def changed(before: str, after: str) -> list[str]:
    """Return the lines that differ, with - and + before them."""
    lines = unified_diff(before.splitlines(), after.splitlines(), lineterm="", n=0)
    return first([line for line in lines if not line.startswith(("---", "+++", "@@"))], _CHANGED)
