"""Mutates netlists, formulas, units, options, sizing files, systems, SSPs and FMUs: does all end in a sentence?

Run with `python tests/fuzz/fuzzer.py COUNT [FIRST [KIND]]`; input number k is the same everywhere, and
`python tests/fuzz/fuzzer.py 1 K` repeats it with its traceback.
"""

from __future__ import annotations

import contextlib
import io
import os
import random
import shutil
import signal
import sys
import tempfile
import tomllib
import traceback
import warnings
from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from drives import crossing, drive, examples
from files import archive, fmu, folder, sizing, ssp, system, table
from inputs import STRANGE, document, mutated_text, mutated_tree, pieces
from matplotlib.font_manager import get_font_names
from modelica import modelica

from components import Inertia
from modelica_like import build, simulate
from modelica_like.analyse.sweeps.ranges import read_assignment, read_range
from modelica_like.cli import TASKS, command
from modelica_like.cli import run as call
from modelica_like.cli.reader import parameters
from modelica_like.errors import ModelicaLikeError
from modelica_like.fmi.runtime import cache_folder
from modelica_like.language.inside import declarations
from modelica_like.language.units import parse_unit, read_quantity, to_si
from modelica_like.netlist import library_types, loads
from modelica_like.netlist.write import dumps

EXAMPLES = Path(__file__).parents[2] / "examples"
SECONDS = 5
"""Time of the processor for one input."""
PROGRESS = 5000


@dataclass(frozen=True)
class Crash:
    """An input that ended in something else than a sentence."""

    number: int
    kind: str
    given: str
    error: BaseException


class Hang(BaseException):
    """An input takes too long; no `except Exception` catches it."""


class Touched(BaseException):
    """An input ran a command, or wrote a file where it had not to."""


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
    known = [
        *declarations(kind).fields,
        *declarations(kind).structural,
        *declarations(kind).modes,
        *declarations(kind).parts,
    ]
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
                call([*words, "--debug"])
        except SystemExit:
            pass

    return " ".join(words), run


def words(chance: random.Random) -> tuple[str, Callable[[], object]]:
    """Give any command any of its options, right and wrong words, and files of any kind."""
    name = chance.choice([one for names in TASKS.values() for one in names if one not in NOT_HERE])
    options = [
        word for one in parameters(command(name)) for word in one.words()
        if not word.startswith("--no-") or word == "--no-such"
    ]  # fmt: skip
    files = [*GIVEN, "no.toml", "."]
    values = [*files, "J1.w", "*", "1", "1e-5", "J1.J=1", "J1.J=1:2:2", "", "-", "x.png", "x.csv", pieces(chance)]
    given = [chance.choice(files) for _ in range(chance.choice((0, 1, 1, 1, 2)))]
    for _ in range(chance.randrange(4)):
        value = chance.choice(values)
        option = chance.choice([*options, "--until", "--no-such"]) if options else "--no-such"
        given += chance.choice(([f"{option}={value}"], [option], [option, value], [value]))
    line = [name, *(one.replace("\0", "") for one in given)]
    return " ".join(line), lambda: _called(line)


def _called(line: list[str]) -> None:
    here = os.getcwd()
    os.chdir(folder() / "here")
    for name in GIVEN:  # a command may write to any of them
        shutil.copy(folder() / name, name)
    try:
        with contextlib.redirect_stderr(io.StringIO()), contextlib.redirect_stdout(io.StringIO()):
            call([*line, "--debug"])
    except SystemExit:
        pass
    finally:
        os.chdir(here)


GIVEN = ("drive.toml", "motor.fmu", "system.ssp")
NOT_HERE = {"explore", "edit", "lsp", "mcp", "demo", "runtimes", "trust", "export", "docs"}
"""Commands that serve, compile, or take long."""
KINDS = {
    netlist: 30, part: 20, formula: 7, unit: 7, option: 2, sizing: 12, system: 7, ssp: 8, fmu: 7,
    drive: 12, crossing: 8, words: 3, table: 8, archive: 8, modelica: 20,
}  # fmt: skip


def attempt(number: int, kind: str = "") -> Crash | None:
    """Try one input, of any kind or of one."""
    chance = random.Random(number)
    (make,) = chance.choices(list(KINDS), [n if kind in ("", one.__name__) else 0 for one, n in KINDS.items()])
    given, run = make(chance)
    if hasattr(signal, "SIGPROF"):
        signal.signal(signal.SIGPROF, _hangs)
        signal.setitimer(signal.ITIMER_PROF, SECONDS)
    try:
        run()
    except ModelicaLikeError:
        return None
    except OSError as error:
        # The command line names the file and the reason, if the file is one that was asked for; `--output ""` is ".".
        named = str(error.filename or "")
        asked = named == "." or named.startswith((str(folder()), str(EXAMPLES)))
        return None if asked else Crash(number, make.__name__, given, error)
    except (Exception, Hang, Touched) as error:  # noqa: BLE001 - whatever it is
        return Crash(number, make.__name__, given, error)
    finally:
        if hasattr(signal, "SIGPROF"):
            signal.setitimer(signal.ITIMER_PROF, 0)
    return None


def _hangs(*_: object) -> None:
    raise Hang(f"more than {SECONDS} s")


def watch() -> None:
    """From now on, commands that are run and files that are written elsewhere end the input they belong to."""
    # Of new sources the run-time is compiled once, into the cache, whatever input comes first.
    sys.dont_write_bytecode = True  # of modules that an input is the first to import
    allowed = (str(folder()), tempfile.gettempdir(), os.devnull, str(cache_folder()))

    def look(event: str, arguments: tuple[Any, ...]) -> None:
        if event == "open" and isinstance(arguments[1], str) and set(arguments[1]) & set("wax+"):
            # A number is a file that is open already: a pipe to the process that runs an FMU.
            if not isinstance(arguments[0], int) and not os.path.abspath(arguments[0]).startswith(allowed):
                raise Touched(f"{arguments[0]} is written")
        elif event in ("os.system", "os.exec", "os.posix_spawn", "socket.connect", "webbrowser.open"):
            raise Touched(f"{event} {arguments}")

    sys.addaudithook(look)


def main() -> None:
    """Try as many inputs as asked for."""
    count, first = int(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 0
    only = sys.argv[3] if len(sys.argv) > 3 else ""
    seen: dict[str, int] = {}
    for number in range(first, first + count):
        crash = attempt(number, only)
        if (number + 1 - first) % PROGRESS == 0:
            sys.stdout.write(f"{number + 1 - first} inputs\n")
            sys.stdout.flush()
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
    get_font_names()  # A list of fonts is written where matplotlib is used for the first time on a machine.
    warnings.simplefilter("error")  # Nobody reads the lines that a warning writes among the results.
    watch()
    main()
