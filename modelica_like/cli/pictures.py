"""Commands that show netlists and runs: draw, report."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from modelica_like.cli.declare import Option
from modelica_like.cli.shared import Assignments, Debug, Netlist, load_netlist, say, told


def draw(
    netlist: Netlist, assignments: Assignments = None, *,
    output: Annotated[Path | None, Option("--output", "-o", metavar="FILE", help="A .svg, .png or .pdf file.")] = None,
    depth: Annotated[int, Option(metavar="N", help="Levels of assemblies to open.")] = 1,
    debug: Debug = False,
) -> None:  # fmt: skip
    """Draw the schematic of a netlist: power from left to right."""
    with told(debug):
        from modelica_like.draw import check_format, save_schematic

        path = output or Path(f"{netlist.stem}.svg")
        check_format(path)
        save_schematic(load_netlist(netlist, assignments), path, depth=depth)
        say(str(path))


def report(
    netlist: Netlist, assignments: Assignments = None, *,
    output: Annotated[Path | None, Option("--output", "-o", metavar="FILE", help="The page, .html.")] = None,
    until: Annotated[str | None, Option(metavar="TIME", help="End time, e.g. 2s; default: the netlist's.")] = None,
    show: Annotated[list[str] | None, Option(metavar="PATTERN", help="Variables to draw, e.g. '*.w'.")] = None,
    debug: Debug = False,
) -> None:  # fmt: skip
    """Simulate a netlist and write a page about it: schematic, events, curves, energies, numbers."""
    path = output or Path(f"{netlist.stem}.html")
    with told(debug, files=[path]):
        drive = load_netlist(netlist, assignments)
        from modelica_like.report.page import save_report
        from modelica_like.report.progress import Bar
        from modelica_like.simulation import build, simulate
        from modelica_like.solve.plot import matching

        model = build(drive)
        matching(model, show or ())
        with Bar(until or model.settings.get("until")) as bar:
            run = simulate(model, until, progress=bar)
        save_report(drive, run, path, show=show or ())
        say(str(path))
