"""Commands on designs: size and demo."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from modelica_like.cli.declare import Argument, Option
from modelica_like.cli.shared import SOLVE_FAILED, Debug, out, told
from modelica_like.errors import NetlistError

_HOMES = (Path(__file__).parents[1], Path(__file__).parents[2])
DEMO = next((home / "examples/demo.py" for home in _HOMES if (home / "examples").is_dir()), Path("examples/demo.py"))
"""Lies beside its netlists: in the package, or in a copy of the source next to it."""


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
        from runpy import run_path

        if not DEMO.is_file():
            raise NetlistError("The demo needs the folder of examples.", advice="Run it from a copy of the source.")
        run_path(str(DEMO))["run_demo"](out(), pictures)
