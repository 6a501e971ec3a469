"""Commands on designs: size and demo."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from modelica_like.cli.declare import Argument, Option
from modelica_like.cli.shared import SOLVE_FAILED, Debug, out, told


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
    """Run the start-ups of the examples against their published values."""
    with told(debug):
        from modelica_like.demo import run_demo

        run_demo(out(), pictures)
