"""What all commands share: their common options, and how results and errors are told."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

from modelica_like.cli.declare import Argument, Option, WrongUse
from modelica_like.errors import InitializationError, ModelicaLikeError, SolveError

if TYPE_CHECKING:
    from rich.console import Console

BAD_INPUT = 2
SOLVE_FAILED = 1

# What only a defect of this package raises; everything foreseen is a ModelicaLikeError.
_DEFECTS = (ArithmeticError, AssertionError, AttributeError, LookupError, RuntimeError, TypeError, ValueError)

Netlist = Annotated[Path, Argument(metavar="NETLIST", help="TOML file", show_default=False)]
Debug = Annotated[bool, Option("--debug", help="Show where in the code an error was raised.")]
Assignments = Annotated[
    list[str] | None, Option("--set", metavar="PATH=VALUE", help='Set a value, e.g. --set clutch.mu="0.3".')
]


@contextmanager
def told(debug: bool) -> Iterator[None]:
    """Turn errors into one block of sentences on stderr, and into the exit code."""
    try:
        yield
    except ModelicaLikeError as error:
        if debug:
            raise
        _fail(str(error), exit_code(error))
    except OSError as error:
        if debug:
            raise
        _fail(f"{error.filename or 'A file'}: {error.strerror or error}.", BAD_INPUT)
    except _DEFECTS as error:
        if debug:
            raise
        what = f"{type(error).__name__}: {error}"
        _fail(f"This should not happen: {what}\nRun again with --debug, and report what it shows.", SOLVE_FAILED)


def exit_code(error: ModelicaLikeError) -> int:
    """Return 1 where the model is right but cannot be solved, 2 where it is wrong."""
    unsolved = isinstance(error, SolveError) or type(error) is InitializationError
    return SOLVE_FAILED if unsolved else BAD_INPUT


def _fail(message: str, code: int) -> NoReturn:
    from rich.console import Console
    from rich.markup import escape

    what, *rest = message.split("\n")
    console = Console(stderr=True, highlight=False, soft_wrap=True, emoji=False)
    console.print(f"[bold red]{escape(what)}[/]")
    for line in rest:
        console.print(escape(line), style="dim" if line.startswith("  ") else None)
    raise SystemExit(code)


def out() -> Console:
    """Return the console for results; a pipe gets plain text that is wide enough for tables."""
    from rich.console import Console

    return Console(highlight=False, emoji=False, width=None if sys.stdout.isatty() else 160)


def load_netlist(netlist: Path, assignments: list[str] | None) -> Any:
    """Load a netlist and give it the values of `--set`."""
    from modelica_like.netlist import load

    assembly = load(netlist)
    for assignment in assignments or ():
        path, equals, value = assignment.partition("=")
        if not equals:
            raise WrongUse(f"'{assignment}' is not PATH=VALUE.", "--set")
        assembly.set(path.strip(), _value(value.strip()))
    return assembly


def _value(text: str) -> Any:
    """Read a value of the command line: true, false, a number, or a text with a unit."""
    known: dict[str, Any] = {"true": True, "false": False}
    if text in known:
        return known[text]
    readers: tuple[Callable[[str], Any], ...] = (int, float)
    for reader in readers:
        try:
            return reader(text)
        except ValueError:
            continue
    return text
