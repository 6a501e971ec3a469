"""Mutates the examples, formulas, units and options, and tells what ends in anything but a sentence.

Run with `python tests/fuzz/fuzzer.py COUNT [FIRST]`; input number k is the same everywhere, and
`python tests/fuzz/fuzzer.py 1 K` repeats it with its traceback.
"""

from __future__ import annotations

import contextlib
import datetime
import io
import math
import os
import random
import signal
import sys
import tomllib
import traceback
from collections.abc import Callable, Iterator
from copy import deepcopy
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from components import Inertia
from modelica_like import build, simulate
from modelica_like.analyse.sweeps.ranges import read_assignment, read_range
from modelica_like.cli import _ran
from modelica_like.cli.declare import WrongUse
from modelica_like.errors import ModelicaLikeError
from modelica_like.netlist import library_types, loads
from modelica_like.netlist.write import dumps
from modelica_like.units import parse_unit, read_quantity, to_si

EXAMPLES = Path(__file__).parents[2] / "examples"
SECONDS = 5
LARGEST = 4000
"""Characters of the netlists that are mutated."""
STRANGE: tuple[Any, ...] = (
    0, -1, 1, 3, 10**20, 10**400, 1e308, -1e308, 5e-324, -0.0, math.nan, math.inf, -math.inf, True, False, "", " ", "0",
    "1", "-1", "1e400", "nan", "inf", "1 N.m", "1 rad/s", "2 %", "0 degC", "-300 degC", "1 ms", "1 kg.m2", "J", "2*J",
    "J/0", "1/0", "0*(1/0)", "log(0)", "sqrt(-1)", "2**9999", "(-1)**0.5", "x = 1", "a.b", "a..b", "[1]", "a[0]",
    "a" * 3000, "(" * 200 + "1" + ")" * 200, "\x00", "\ud7ff", "é", "10 kg.m²", "∞", "''", '"', "{}", "%s", "[bold]",
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


@dataclass(frozen=True)
class Crash:
    """An input that ended in something else than a sentence."""

    number: int
    kind: str
    given: str
    error: BaseException


class Hang(BaseException):
    """An input takes too long; no `except Exception` catches it."""


@cache
def examples() -> list[tuple[Path, dict[str, Any], str]]:
    """Return the netlists of examples/ that are not long."""
    found = [(path, path.read_text(encoding="utf-8")) for path in sorted(EXAMPLES.rglob("*.toml"))]
    return [(path, tomllib.loads(text), text) for path, text in found if "[parts" in text and len(text) < LARGEST]


# -- inputs ------------------------------------------------------------------------------------------------------------


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


# -- what is done with them --------------------------------------------------------------------------------------------


def netlist(chance: random.Random) -> tuple[str, Callable[[], object]]:
    """Load a mutated example; some are written again, some compiled, a few run."""
    path, tree, text = chance.choice(examples())
    if chance.random() < 0.7:
        tree = tomllib.loads(text)
        for _ in range(chance.choice((1, 1, 2, 3))):
            mutated_tree(chance, tree)
        text = document(tree)
    else:
        text = mutated_text(chance, text)
    depth = chance.random()

    def run() -> None:
        drive = loads(text, str(path))
        if depth < 0.2:
            dumps(drive, folder=path.parent)
        if depth < 0.1:
            model = build(drive)
            if depth < 0.04:
                simulate(model, 1e-4, points=5)

    return text, run


def part(chance: random.Random) -> tuple[str, Callable[[], object]]:
    """Load a part of any type with strange values; some are compiled, with all that they need."""
    name, kind = chance.choice(list(library_types().items()))
    known = [*kind._class_fields, *kind._structural, *kind._class_modes, *kind._class_parts]
    values = {
        key: deepcopy(chance.choice(STRANGE)) for key in chance.sample(known, min(len(known), chance.randrange(4)))
    }
    text = document({"parts": {"k": {"is": name, **values}}, "simulate": {"until": 1}})

    def run() -> None:
        drive = loads(text, "drive.toml")
        if len(values) < 2:
            build(drive)

    return text, run


def formula(chance: random.Random) -> tuple[str, Callable[[], object]]:
    """Give a parameter a text."""
    text = pieces(chance)
    return text, lambda: Inertia(J=text, w=pieces(chance))


def unit(chance: random.Random) -> tuple[str, Callable[[], object]]:
    """Read a unit, a quantity, a value."""
    text = pieces(chance)
    number = chance.choice(STRANGE)

    def run() -> None:
        for read in (parse_unit, read_quantity, lambda one: to_si(one, parse_unit("N.m"), "x")):
            with contextlib.suppress(ModelicaLikeError):
                read(text)
        to_si(number, parse_unit("rad/s"), "x")

    return f"{text!r}, {number!r}", run


def option(chance: random.Random) -> tuple[str, Callable[[], object]]:
    """Give a command words; most are refused before anything runs."""
    text = str(
        chance.choice((pieces(chance), *chance.choices([s for s in STRANGE if not isinstance(s, dict)], k=3)))
    ).replace("\0", "")
    drive = str(EXAMPLES / "two_mass.toml")
    words = chance.choice((
        ["check", drive, f"--set=J1.J={text}"], ["check", drive, f"--set={text}"], ["check", text],
        ["simulate", drive, f"--until={text}", "--plot=x.foo"],
        ["simulate", drive, "--until=1e-5", f"--points={text}", "--csv=x.foo"],
        ["sweep", drive, f"--over=J1.J={text}", "--of=", "--until=1e-5"],
        ["sweep", drive, "--over=J1.J=1", f"--of={text}", "--until=1e-9"],
        ["describe", text], ["steady", drive, f"--over={text}"], ["modes", drive, f"--at={text}"],
    ))  # fmt: skip

    def run() -> None:
        with contextlib.suppress(ModelicaLikeError):
            read_range(text)
        with contextlib.suppress(ModelicaLikeError):
            read_assignment(text)
        told = io.StringIO()
        try:
            with contextlib.redirect_stderr(told), contextlib.redirect_stdout(io.StringIO()):
                _ran([*words, "--debug"])
        except SystemExit:
            pass

    return " ".join(words), run


KINDS = {netlist: 50, part: 30, formula: 9, unit: 9, option: 2}


def attempt(number: int) -> Crash | None:
    """Try one input."""
    chance = random.Random(number)
    (make,) = chance.choices(list(KINDS), list(KINDS.values()))
    given, run = make(chance)
    if hasattr(signal, "SIGALRM"):
        signal.signal(signal.SIGALRM, _hangs)
        signal.setitimer(signal.ITIMER_REAL, SECONDS)
    try:
        run()
    except (ModelicaLikeError, WrongUse):
        return None
    except (Exception, Hang) as error:  # noqa: BLE001 - whatever it is
        return Crash(number, make.__name__, given, error)
    finally:
        if hasattr(signal, "SIGALRM"):
            signal.setitimer(signal.ITIMER_REAL, 0)
    return None


def _hangs(*_: object) -> None:
    raise Hang(f"more than {SECONDS} s")


def main() -> None:
    """Try as many inputs as asked for."""
    count, first = int(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 0
    seen: dict[str, int] = {}
    for number in range(first, first + count):
        crash = attempt(number)
        if crash is None:
            continue
        frame = traceback.extract_tb(crash.error.__traceback__)[-1]
        kind = f"{type(crash.error).__name__} {Path(frame.filename).name}:{frame.lineno}"
        seen[kind] = seen.get(kind, 0) + 1
        if seen[kind] == 1:
            sys.stdout.write(f"--- {number} {crash.kind}: {kind}: {str(crash.error)[:200]}\n{crash.given[:3000]}\n")
            if count == 1:
                traceback.print_exception(crash.error)
            sys.stdout.flush()
    sys.stdout.write(f"{count} inputs, {sum(seen.values())} crashes at {len(seen)} places {seen}\n")


if __name__ == "__main__":
    os.environ.setdefault("MPLBACKEND", "agg")
    main()
