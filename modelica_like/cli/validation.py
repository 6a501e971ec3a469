"""Commands on trajectories and FMUs of whatever origin: validate and compare."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from modelica_like.cli.declare import Argument, Option
from modelica_like.cli.shared import SOLVE_FAILED, Debug, out, told


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
    b: Annotated[Path, Argument(metavar="B", help="what to compare it with", show_default=False)],
    signals: Annotated[
        list[str] | None, Option(metavar="PATTERN", help="What to compare, e.g. '*.w'; else all.")
    ] = None,
    until: Annotated[float | None, Option(metavar="SECONDS", help="End time of what is run.")] = None,
    points: Annotated[int, Option(metavar="N", help="Number of equal intervals of what is run.")] = 500,
    tolerance: Annotated[float | None, Option(metavar="RTOL", help="Relative tolerance of what is run.")] = None,
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
