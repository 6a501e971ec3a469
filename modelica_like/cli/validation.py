"""Commands that check results and designs: validate, compare, size and demo."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from modelica_like.cli.declare import Argument, Option
from modelica_like.cli.shared import SOLVE_FAILED, Debug, out, told
from modelica_like.errors import NetlistError

_HOMES = (Path(__file__).parents[1], Path(__file__).parents[2])
DEMO = next((home / "examples/demo.py" for home in _HOMES if (home / "examples").is_dir()), Path("examples/demo.py"))
"""In the folder of its netlists: in the package, or in a copy of the source."""


def size(
    file: Annotated[
        str, Argument(metavar="FILE", help="sizing file, or a design check to describe; none: list all checks")
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
            raise SystemExit(SOLVE_FAILED)


def demo(
    pictures: Annotated[Path, Option(metavar="FOLDER", help="Where to write the pictures.")] = Path("build/demo"),
    *, debug: Debug = False,
) -> None:  # fmt: skip
    """Run the start-ups of the examples and compare them with the published values."""
    with told(debug):
        from runpy import run_path

        if not DEMO.is_file():
            raise NetlistError("The demo needs the folder of examples.", advice="Run it from a copy of the source.")
        run_path(str(DEMO))["run_demo"](out(), pictures)


def validate(
    fmu: Annotated[Path, Argument(metavar="FMU", help="FMU of FMI 2.0 or 3.0", show_default=False)],
    timeout: Annotated[float, Option(metavar="SECONDS", help="Time limit of each run.")] = 60.0,
    *, debug: Debug = False,
) -> None:  # fmt: skip
    """Check an FMU against the standard, and run it with several importers; exit code 1 if a check fails."""
    with told(debug):
        from modelica_like.fmi.validate import validate_fmu
        from modelica_like.report.validation import validation_table

        validation = validate_fmu(fmu, timeout=timeout)
        out().print(validation_table(validation))
        if not validation.passed:
            raise SystemExit(SOLVE_FAILED)


def compare(
    a: Annotated[Path, Argument(metavar="A", help="netlist, FMU, system or CSV file", show_default=False)],
    b: Annotated[Path, Argument(metavar="B", help="what to compare with", show_default=False)],
    signals: Annotated[
        list[str] | None, Option(metavar="PATTERN", help="Signals to compare, e.g. '*.w'; default: all.")
    ] = None,
    until: Annotated[float | None, Option(metavar="SECONDS", help="End time of simulations.")] = None,
    points: Annotated[int, Option(metavar="N", help="Number of equal intervals of simulations.")] = 500,
    tolerance: Annotated[float | None, Option(metavar="RTOL", help="Relative tolerance of simulations.")] = None,
    plot: Annotated[Path | None, Option(metavar="FILE", help="Draw the largest deviations.")] = None,
    *, debug: Debug = False,
) -> None:  # fmt: skip
    """Compare two trajectories of one system: the largest deviation of each signal, the times of the events."""
    with told(debug, pictures=[plot]):
        from modelica_like.report.compare import compare as run

        comparison = run(a, b, signals=signals or (), until=until, points=points, tolerance=tolerance)
        out().print(comparison)
        if plot:
            from modelica_like.solve.plot import save_plot

            save_plot(comparison.plot(*(signals or ())), plot)
