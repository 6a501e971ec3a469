"""What inputs are mutated with: strange values, words, and changes of trees and texts."""

from __future__ import annotations

import datetime
import math
import random
from collections.abc import Iterator
from copy import deepcopy
from typing import Any

STRANGE: tuple[Any, ...] = (
    0, -1, 1, 3, 10**20, 10**400, 1e308, -1e308, 5e-324, -0.0, math.nan, math.inf, -math.inf, True, False, "", " ", "0",
    "1", "-1", "1e400", "nan", "inf", "1 N.m", "1 rad/s", "2 %", "0 degC", "-300 degC", "1 ms", "1 kg.m2", "J", "2*J",
    "J/0", "1/0", "0*(1/0)", "log(0)", "sqrt(-1)", "2**9999", "(-1)**0.5", "x = 1", "a.b", "a..b", "[1]", "a[0]",
    "a" * 3000,
    "1 N.m" + " " * 9999 + "x", "(" * 200 + "1" + ")" * 200,
    "\x00", "\ud7ff", "é", "10 kg.m²", "∞", "''", '"', "{}", "%s", "[bold]",
    "../../x.toml", "./two_mass.toml", ".", "no_such:Class", "json:JSONDecoder", "math:pi", "Inertia", "Fixed",
    "Clutch", "Sine", "flange_a", "flange", "y", "steady", "rest", "given", "locked", [], [[]], [0], [[0]], [[0, "1"]],
    [[0, [1]]], [[0, 1], [0, 2]], [[0, 1], [1, 2]], [["0 rad/s", 0.1]], [[math.nan, 1]], ["a", "b"], ["a.b"], {},
    {"a": 1}, {"is": "Inertia"}, {"is": "Inertia", "J": 1}, {"is": []}, datetime.date(1979, 5, 27),
    datetime.time(7, 32),
)  # fmt: skip
KEYS = (
    "is", "count", "J", "w", "phi", "c", "d", "mu_pos", "table", "until", "start", "rtol", "points", "parts", "series",
    "connect", "guess", "expose", "free", "parameters", "name", "description", "a.b", "", " ", "a[1]", "a[2].J", "é",
)  # fmt: skip
PIECES = (
    "1", "2.5", "1e3", "J", "c", "pi", "sqrt", "min", "max", "(", ")", "+", "-", "*", "/", "**", ",", " ", ".", "N.m",
    "rpm", "rad/s", "kg.m2", "kgm2", "%", "°", "degC", "^", "^2", "2", "-1", "e", "1e", "'", '"', "[", "]", "{", "}",
    "lambda", "if", "else", "for", "import", "__class__", "=", "==", ":", ";", "\n", "\t", "\\", "#", "0x1", "1_0",
    "é", "µm", "Ω", "١", "²", "∞", "1j", "not", "and",
)  # fmt: skip


def toml(value: Any) -> str:
    """Write a value as TOML, on one line."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return '"' + "".join(c if c.isprintable() and c not in '"\\' else f"\\u{ord(c):04x}" for c in value) + '"'
    if isinstance(value, dict):
        return "{" + ", ".join(f"{toml(str(key))} = {toml(one)}" for key, one in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    return value.isoformat() if isinstance(value, datetime.date | datetime.time) else repr(value)


def document(tree: dict[str, Any]) -> str:
    """Write a whole tree, with a header for each table."""
    tables = {name: value for name, value in tree.items() if isinstance(value, dict)}
    lines = [f"{toml(name)} = {toml(value)}" for name, value in tree.items() if name not in tables]
    for name, table in tables.items():
        lines += [f"[{toml(name)}]", *(f"{toml(str(key))} = {toml(value)}" for key, value in table.items())]
    return "\n".join(lines) + "\n"


def nodes(tree: Any) -> Iterator[tuple[Any, Any]]:
    """Yield all places of a tree: the container and the key."""
    keys = list(tree) if isinstance(tree, dict) else range(len(tree)) if isinstance(tree, list) else ()
    for key in keys:
        yield tree, key
        yield from nodes(tree[key])


def mutated_tree(chance: random.Random, tree: dict[str, Any]) -> None:
    """Change one thing in a tree."""
    places = list(nodes(tree))
    if not places:
        return
    container, key = chance.choice(places)
    other, other_key = chance.choice(places)
    match chance.randrange(7):
        case 0:
            del container[key]
        case 1 if isinstance(container, dict):
            container[chance.choice(KEYS)] = container.pop(key)
        case 2 if isinstance(container, dict):
            container[chance.choice(KEYS)] = deepcopy(chance.choice(STRANGE))
        case 3:
            container[key] = chance.choice([[container[key]], {"is": container[key]}, str(container[key])])
        case 4 if not isinstance(other[other_key], dict | list):
            container[key] = other[other_key]
        case _:
            container[key] = deepcopy(chance.choice(STRANGE))


def mutated_text(chance: random.Random, text: str) -> str:
    """Change some characters or lines of a text."""
    lines = text.split("\n")
    at = chance.randrange(len(lines))
    place = chance.randrange(len(text) + 1)
    match chance.randrange(5):
        case 0:
            return text[:place] + chance.choice(PIECES) + text[place:]
        case 1:
            return text[:place] + text[place + chance.randrange(1, 9) :]
        case 2:
            return "\n".join([*lines[:at], lines[chance.randrange(len(lines))], *lines[at:]])
        case 3:
            return "\n".join([*lines[:at], *lines[at + 1 :]])
        case _:
            return text[:place]


def pieces(chance: random.Random) -> str:
    """Join some words of formulas and units."""
    return "".join(chance.choices(PIECES, k=chance.randrange(1, 12)))
