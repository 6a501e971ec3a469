"""Command on pictures of netlists: draw."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from modelica_like.cli.declare import Option
from modelica_like.cli.shared import Assignments, Debug, Netlist, load_netlist, say, told


def draw(
    netlist: Netlist, assignments: Assignments = None, *,
    output: Annotated[Path | None, Option("--output", "-o", metavar="FILE", help="A .svg, .png or .pdf file.")] = None,
    depth: Annotated[int, Option(metavar="N", help="How many levels of assemblies are open.")] = 1,
    debug: Debug = False,
) -> None:  # fmt: skip
    """Draw the schematic of a netlist: power from left to right."""
    with told(debug):
        from modelica_like.draw import check_format, save_schematic

        path = output or Path(f"{netlist.stem}.svg")
        check_format(path)
        save_schematic(load_netlist(netlist, assignments), path, depth=depth)
        say(str(path))
