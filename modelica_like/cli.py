"""The command line: `modelica-like check drive.toml` and the others."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer
from rich.console import Console
from rich.markup import escape

from modelica_like.errors import InitializationError, ModelicaLikeError, SolveError

BAD_INPUT = 2
SOLVE_FAILED = 1

# What only a defect of this package raises; everything foreseen is a ModelicaLikeError.
_DEFECTS = (ArithmeticError, AssertionError, AttributeError, LookupError, RuntimeError, TypeError, ValueError)

app = typer.Typer(
    help="Drive-trains written once, acausally: check, simulate and describe netlists.",
    no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False,
)  # fmt: skip

Netlist = Annotated[Path, typer.Argument(metavar="NETLIST", help="TOML file", show_default=False)]
Debug = Annotated[bool, typer.Option("--debug", help="Show where in the code an error was raised.")]
Assignments = Annotated[
    list[str] | None, typer.Option("--set", metavar="PATH=VALUE", help='Set a value, e.g. --set clutch.mu="0.3".')
]


class Start(StrEnum):
    """What stands for start values that are not given."""

    GIVEN = "given"
    REST = "rest"
    STEADY = "steady"


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
    except (typer.Exit, typer.Abort, typer.BadParameter):
        raise
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
    what, *rest = message.split("\n")
    console = Console(stderr=True, highlight=False, soft_wrap=True)
    console.print(f"[bold red]{escape(what)}[/]")
    for line in rest:
        console.print(escape(line), style="dim" if line.startswith("  ") else None)
    raise typer.Exit(code)


def out() -> Console:
    """Return the console for results; a pipe gets plain text that is wide enough for tables."""
    return Console(highlight=False, width=None if sys.stdout.isatty() else 160)


@app.command()
def check(netlist: Netlist, assignments: Assignments = None, *, debug: Debug = False) -> None:
    """Check a netlist: equations, unknowns, states, index, blocks, energy terms."""
    with told(debug):
        assembly = _load(netlist, assignments)
        from modelica_like.report.structure import structure_report

        out().print(structure_report(assembly))


@app.command()
def simulate(
    netlist: Netlist, assignments: Assignments = None, *,
    until: Annotated[str | None, typer.Option(metavar="TIME", help="End time, e.g. 2s; else the netlist's.")] = None,
    start: Annotated[Start | None, typer.Option(help="Start values: as given, from rest, or the steady state.")] = None,
    csv: Annotated[Path | None, typer.Option(metavar="FILE", help="Write all trajectories as a table.")] = None,
    points: Annotated[int | None, typer.Option(metavar="N", help="Number of equal intervals of the results.")] = None,
    units: Annotated[bool, typer.Option("--units", help="Units in a second header line of the table.")] = False,
    plot: Annotated[Path | None, typer.Option(metavar="FILE", help="Draw the results: .png, .svg or .pdf.")] = None,
    show: Annotated[list[str] | None, typer.Option(metavar="PATTERN", help="What to draw, e.g. '*.w'.")] = None,
    energy: Annotated[bool, typer.Option(help="Tell the energy balance; it takes another, more precise run.")] = True,
    debug: Debug = False,
) -> None:  # fmt: skip
    """Simulate a netlist: events, energy balance, results as table and picture."""
    with told(debug):
        # What is wrong in the file is told before the solver is loaded.
        assembly = _load(netlist, assignments)
        from modelica_like.report.progress import Bar
        from modelica_like.report.run import run_report
        from modelica_like.simulation import build
        from modelica_like.simulation import simulate as run

        model = build(assembly)
        with Bar(until or model.settings.get("until")) as bar:
            solution = run(model, until, start=start.value if start else None, points=points, progress=bar)
        out().print(run_report(solution, energy=energy))
        if csv:
            from modelica_like.report.files import write_csv

            write_csv(solution, csv, units=units)
        if plot:
            from modelica_like.solve.plot import plot as draw
            from modelica_like.solve.plot import save_plot

            save_plot(draw(solution, show or ()), plot)


@app.command()
def describe(
    kind: Annotated[str, typer.Argument(metavar="TYPE", help="type as a netlist names it", show_default=False)],
    *, debug: Debug = False,
) -> None:  # fmt: skip
    """Describe a component type: parameters, units, connectors, equations."""
    with told(debug):
        from modelica_like.netlist import find_type
        from modelica_like.report.types import describe as page

        out().print(page(find_type(kind)))


@app.command()
def schema(*, debug: Debug = False) -> None:
    """Print the JSON schema of netlists with all component types, for editors."""
    with told(debug):
        import json

        from modelica_like.netlist import schema as generate

        typer.echo(json.dumps(generate(), indent=2, ensure_ascii=False))


@app.command()
def library(*, debug: Debug = False) -> None:
    """List all component types of the installed libraries."""
    with told(debug):
        from modelica_like.netlist import library_types
        from modelica_like.report.types import library_table

        out().print(library_table(library_types()))


@app.command()
def size(
    file: Annotated[
        str, typer.Argument(metavar="FILE", help="sizing file, or a design check to describe; none: list all checks")
    ] = "",
    *, debug: Debug = False,
) -> None:  # fmt: skip
    """Run the design checks of a sizing file; exit code 1 if a limit is exceeded."""
    with told(debug):
        from modelica_like.sizing.report import checks_report, sizing_report
        from modelica_like.sizing.run import size as run

        if not file or not Path(file).suffix:
            out().print(checks_report(file))
            return
        sizing = run(file)
        out().print(sizing_report(sizing))
        if sizing.exceeded:
            raise typer.Exit(SOLVE_FAILED)


@app.command()
def demo(
    pictures: Annotated[Path, typer.Option(metavar="FOLDER", help="Where to write the pictures.")] = Path("build/demo"),
    *, debug: Debug = False,
) -> None:  # fmt: skip
    """Run the start-ups of the examples against their published values."""
    with told(debug):
        from modelica_like.demo import run_demo

        run_demo(out(), pictures)


def _load(netlist: Path, assignments: list[str] | None) -> Any:
    from modelica_like.netlist import load

    assembly = load(netlist)
    for assignment in assignments or ():
        path, equals, value = assignment.partition("=")
        if not equals:
            raise typer.BadParameter(f"'{assignment}' is not PATH=VALUE.", param_hint="--set")
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


def main() -> None:
    """Run the command line; classes of modules in the working directory can be used in netlists."""
    sys.path.insert(0, "")
    app()
