"""Commands that check results and designs: validate, compare, size and demo."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from modelica_like.cli.reader import Argument, Option
from modelica_like.cli.shared import (
    SOLVE_FAILED,
    Assignments,
    Debug,
    Json,
    Plot,
    Points,
    Timeout,
    Tolerance,
    Until,
    told,
    values,
)
from modelica_like.errors import NetlistError

_HOMES = (Path(__file__).parents[1], Path(__file__).parents[2])
DEMO = next((home / "examples/demo.py" for home in _HOMES if (home / "examples").is_dir()), Path("examples/demo.py"))
"""In the folder of its netlists: in the package, or in a copy of the source."""


def size(
    file: Annotated[
        str, Argument(metavar="FILE", help="Sizing file, or a design check to describe; none: list all.")
    ] = "",
    *, json: Json = False, debug: Debug = False,
) -> None:  # fmt: skip
    """Run the design checks of a sizing file; exit code 1 if a limit is exceeded."""
    with told(debug, json=json) as page:
        from modelica_like.analyse.sizing.run import size as run
        from modelica_like.show.report.sizing import checks_report, sizing_report

        if not file or not Path(file).suffix:
            page.print(checks_report(file))
            return
        sizing = run(file)
        page.print(sizing_report(sizing))
        if sizing.exceeded:
            raise SystemExit(SOLVE_FAILED)


def demo(
    pictures: Annotated[Path, Option(metavar="FOLDER", help="Where to write the pictures.")] = Path("build/demo"),
    *, json: Json = False, debug: Debug = False,
) -> None:  # fmt: skip
    """Run the start-ups of the examples and compare them with the published values."""
    with told(debug, json=json) as page:
        from runpy import run_path

        if not DEMO.is_file():
            raise NetlistError("The demo needs the folder of examples.", advice="Run it from a copy of the source.")
        run_path(str(DEMO))["run_demo"](page, pictures)


def validate(
    fmu: Annotated[Path, Argument(metavar="FMU", help="FMU of FMI 2.0 or 3.0.")],
    *, timeout: Timeout = "60s", json: Json = False, debug: Debug = False,
) -> None:  # fmt: skip
    """Check an FMU against the standard, and run it with several importers; exit code 1 if a check fails.

    Schemas of the standard, FMPy's own checks, then runs: FMPy as Model Exchange (CVode, explicit Euler) and as
    Co-Simulation, ecos and libcosim as Co-Simulation (extra `importers`). Each run has its own process, and all must
    end with the same values.
    """
    with told(debug, json=json) as page:
        from modelica_like.fmi.validate import validate_fmu
        from modelica_like.show.report.validation import validation_table
        from modelica_like.simulation import seconds

        validation = validate_fmu(fmu, timeout=seconds(timeout, "timeout"))
        page.print(validation_table(validation))
        if not validation.passed:
            raise SystemExit(SOLVE_FAILED)


def compare(
    a: Annotated[Path, Argument(metavar="A", help="Netlist, FMU, system of FMUs, or CSV file.")],
    b: Annotated[Path, Argument(metavar="B", help="What to compare with.")],
    signals: Annotated[
        list[str] | None, Option("--signal", metavar="PATTERN", help="Signals to compare, e.g. '*.w'; default: all.")
    ] = None,
    assignments: Assignments = None, *,
    until: Until = None, rtol: Tolerance = None, points: Points = None, plot: Plot = None,
    json: Json = False, debug: Debug = False,
) -> None:  # fmt: skip
    """Compare two trajectories of one system: the largest deviation of each signal, the times of the events.

    Signals are compared by name, at common times; with few common times, the second side is interpolated, and the
    report says so. Signals with other units are left out and named. Mode changes are paired by mode and new mode;
    between the two times of a pair, nothing is compared. A signal's range is its largest minus its smallest value in A,
    at least a millionth of the largest value of its unit. `--set` sets a value in both, where they are netlists or
    FMUs. The picture has the signals that deviate most, or those chosen.
    """
    with told(debug, json=json, pictures=[plot]) as page:
        from modelica_like.show.report.compare import compare as run
        from modelica_like.simulation import seconds

        end = None if until is None else seconds(until)
        comparison = run(
            a, b, signals=signals or (), until=end, points=points or 500, tolerance=rtol, values=values(assignments),
            option="--set",
        )  # fmt: skip
        page.print(comparison)
        if plot:
            from modelica_like.show.plot import save_plot

            save_plot(comparison.plot(*(signals or ())), plot)
