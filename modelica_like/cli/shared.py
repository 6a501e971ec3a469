"""Shared by all commands: common options, output of results and errors."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from modelica_like.cli.reader import Argument, Option
from modelica_like.errors import DEFECTS, InitializationError, ModelicaLikeError, NetlistError, SolveError, Source
from modelica_like.writing import check_writable

if TYPE_CHECKING:
    from rich.console import Console

    from modelica_like.language import Component

BAD_INPUT = 2
SOLVE_FAILED = 1

INTERRUPTED = 130

TOLD = (KeyboardInterrupt, ModelicaLikeError, OSError, *DEFECTS)
"""What ends a command with a text."""

Netlist = Annotated[Path, Argument(metavar="NETLIST", help="Netlist, a TOML file.")]
Debug = Annotated[bool, Option("--debug", help="Show where in the code errors are raised and events declared.")]
Assignments = Annotated[
    list[str] | None, Option("--set", metavar="PATH=VALUE", help="Set a value, e.g. 'clutch.mu=0.3'.")
]
Until = Annotated[str | None, Option(metavar="TIME", help="End time, e.g. 2s; by default that of the file.")]
Points = Annotated[int | None, Option(metavar="N", help="Number of equal intervals of the results.")]
Tolerance = Annotated[float | None, Option("--rtol", metavar="NUMBER", help="Relative tolerance, e.g. 1e-8.")]
TABLE = "Write a table: .csv, .parquet, .nc, or - for the screen."
Csv = Annotated[Path | None, Option(metavar="FILE", help=TABLE)]
Units = Annotated[bool, Option("--units", help="Write the units of [display], named in a second header line.")]
Plot = Annotated[Path | None, Option(metavar="FILE", help="Draw a picture: .png, .svg or .pdf.")]
Curves = Annotated[
    list[str] | None, Option("--show", metavar="PATTERN", help="Curves, also formulas: '*.w', '2*pi*motor.w'.")
]
Timeout = Annotated[str, Option(metavar="TIME", help="Time limit of a run.")]
Json = Annotated[bool, Option("--json", help="Print the tables as JSON, with all digits and rows.")]


class Page:
    """What a command prints: at once, or as JSON when it is complete; on stderr if stdout gets a table.

    Attributes:
        problems: errors and notes as data for JSON.
    """

    def __init__(self, *, json: bool, stderr: bool = False) -> None:
        self.problems: list[dict[str, Any]] = []
        self._stderr = stderr
        self._parts: list[Any] | None = [] if json else None

    def print(self, *parts: Any) -> None:
        """Print reports, or keep them."""
        if self._parts is None:
            for part in parts:
                out(stderr=self._stderr).print(part)
        else:
            self._parts += parts

    def warn(self, message: str, colour: str = "yellow") -> None:
        """Print a block of text on stderr, unless JSON stands there."""
        if self._parts is None or not self._stderr:
            warn(message, colour)

    def note(self, drive: Component, *sentences: str) -> None:
        """Tell what looks like a slip in a drive, on stderr and among the problems."""
        from modelica_like.show.report.problems import note_problem

        self.problems += (note_problem(drive, sentence) for sentence in sentences)
        if sentences:
            self.warn(slips(*sentences))

    def close(self) -> None:
        """Print what is kept as JSON."""
        if self._parts or (self._parts is not None and self.problems):
            from json import dumps

            from modelica_like.show.report.tables import as_data

            data = {"problems": self.problems, **as_data(*self._parts)}
            text = dumps(data, indent=1, ensure_ascii=False, allow_nan=False)
            # What is half a character in UTF-16, as a name of a file can have it, is no text.
            text = text.encode(errors="replace").decode()
            (sys.stderr if self._stderr else sys.stdout).write(f"{text}\n")


@contextmanager
def told(
    debug: bool, *, json: bool = False, tables: Iterable[Path | None] = (), pictures: Iterable[Path | None] = (),
    files: Iterable[Path | None] = (),
) -> Iterator[Page]:  # fmt: skip
    """Turn errors into one block of text on stderr and an exit code.

    Args:
        debug: raise them instead.
        json: whether the page is JSON.
        tables: to be written; checked before the run.
        pictures: to be written.
        files: of any kind, to be written.
    """
    tables = [table for table in tables if table is not None]
    page = Page(json=json, stderr=Path("-") in tables)
    try:
        try:
            _check(tables, filter(None, pictures), filter(None, files))
            yield page
        except TOLD as error:
            page.problems += _problems(error)
            raise
        finally:
            page.close()
    except BrokenPipeError:
        raise  # main() ends the program
    except TOLD as error:
        if debug:
            raise
        message, code = _explained(error)
        page.warn(message, "red")
        raise SystemExit(code) from None


def _problems(error: BaseException) -> Iterable[dict[str, Any]]:
    """Return errors as data for JSON."""
    if isinstance(error, ModelicaLikeError):
        return (problem.as_json() for problem in error.problems())
    name = getattr(error, "filename", None)
    place = Source("" if name is None else str(name))
    return [{**ModelicaLikeError(_explained(error)[0], where=place).as_json(), "kind": type(error).__name__}]


def _explained(error: BaseException) -> tuple[str, int]:
    """Return the text of an error and the exit code."""
    notes: list[str] = getattr(error, "__notes__", [])
    if isinstance(error, KeyboardInterrupt):
        return " ".join(["Interrupted.", *(notes or ["Unfinished results are not written."])]), INTERRUPTED
    if isinstance(error, ModelicaLikeError):
        return "\n".join([str(error), *notes]), exit_code(error)
    if isinstance(error, OSError):
        return f"{error.filename or 'A temporary file'}: {error.strerror or error}.", BAD_INPUT
    what = f"Internal error: {type(error).__name__}: {error}"
    return f"{what}\nRun again with --debug, and report the output.", SOLVE_FAILED


def _check(tables: Iterable[Path], pictures: Iterable[Path], files: Iterable[Path]) -> None:
    for file in files:
        check_writable(file)
    for file in tables:
        from modelica_like.show.report.files import check_table

        check_table(file)
    for file in pictures:
        from modelica_like.show.plot import check_picture

        check_picture(file)


def exit_code(error: ModelicaLikeError) -> int:
    """Return 1 if the model is valid but cannot be solved, 2 if the input is wrong."""
    unsolved = isinstance(error, SolveError) or type(error) is InitializationError
    return SOLVE_FAILED if unsolved else BAD_INPUT


def warn(message: str, colour: str = "yellow") -> None:
    """Print a block of text on stderr."""
    from rich.console import Console
    from rich.markup import escape

    what, *rest = message.split("\n")
    console = Console(stderr=True, highlight=False, soft_wrap=True, emoji=False)
    console.print(f"[bold {colour}]{escape(what)}[/]")
    for line in rest:
        console.print(escape(line), style="dim" if line.startswith("  ") else None)


def out(*, stderr: bool = False) -> Console:
    """Return the console for results; a pipe gets plain text that is wide enough for tables."""
    from rich.console import Console

    stream = sys.stderr if stderr else sys.stdout
    return Console(highlight=False, emoji=False, stderr=stderr, width=None if stream.isatty() else 160)


def say(text: str) -> None:
    """Print a text without markup, on lines of any length."""
    from rich.markup import escape

    out().print(escape(text), soft_wrap=True)


def slips(*sentences: str) -> str:
    """Return the block of text about what looks like a slip."""
    return "\n".join(["Please look at this:", *(f"- {sentence}" for sentence in sentences)])


def assigned(assignments: list[str] | None, option: str) -> dict[str, str]:
    """Split assignments at the equals sign."""
    pairs = [assignment.partition("=") for assignment in assignments or ()]
    for before, equals, _ in pairs:
        if not equals:
            form = "PATH=VALUE" if option == "--set" else "WHAT=UNIT"
            raise NetlistError(f"Invalid value for {option}: '{before}' is not {form}.")
    return {before.strip(): after.strip() for before, _, after in pairs}


def load_netlist(netlist: Path, assignments: list[str] | None, *, thorough: bool = False) -> Any:
    """Load a netlist and give it the values of `--set`; see `load` and `load_thoroughly`."""
    from modelica_like.netlist.read import assign, load, load_thoroughly

    assembly = (load_thoroughly if thorough else load)(netlist)
    assign(assembly, values(assignments), "--set")
    return assembly


def values(assignments: list[str] | None) -> dict[str, Any]:
    """Return the values of `--set` by path."""
    return {path: _value(text) for path, text in assigned(assignments, "--set").items()}


def _value(text: str) -> Any:
    """Read a value of the command line: true, false, a number, a table as in a netlist, or a text with a unit."""
    words: dict[str, Any] = {"true": True, "false": False}
    if text in words:
        return words[text]
    if text.startswith("["):
        import tomllib

        with suppress(tomllib.TOMLDecodeError, RecursionError):
            return tomllib.loads(f"table = {text}")["table"]
    readers: tuple[Callable[[str], Any], ...] = (int, float)
    for reader in readers:
        try:
            return reader(text)
        except ValueError:
            continue
    return text
