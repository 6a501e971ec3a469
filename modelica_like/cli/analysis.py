"""Commands on small motions: modes."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from modelica_like.cli.declare import Option
from modelica_like.cli.shared import Assignments, Debug, Netlist, load_netlist, out, told


def modes(
    netlist: Netlist, assignments: Assignments = None, *,
    at: Annotated[
        str, Option(metavar="WHEN", help="Time, e.g. 0.5s, or start: given, rest, steady.")
    ] = "given",
    shapes: Annotated[Path | None, Option(metavar="FILE", help="Draw the shapes of the modes.")] = None,
    show: Annotated[list[str] | None, Option(metavar="NAME", help="Variables along the shapes.")] = None,
    bode: Annotated[Path | None, Option(metavar="FILE", help="Draw the frequency response.")] = None,
    inputs: Annotated[list[str] | None, Option("--input", metavar="NAME", help="Input or parameter.")] = None,
    outputs: Annotated[list[str] | None, Option("--output", metavar="NAME", help="Variable.")] = None,
    debug: Debug = False,
) -> None:  # fmt: skip
    """Linearise a netlist at a point: eigenvalues, damping, where the energy of each mode is."""
    with told(debug, pictures=[shapes, bode]):
        assembly = load_netlist(netlist, assignments)
        from modelica_like.analyse.linear.linearize import linearize, when
        from modelica_like.report.analysis import modes_report
        from modelica_like.solve.plot import save_plot

        linear = linearize(assembly, when(at), inputs=inputs, outputs=outputs)
        found = linear.modes()
        out().print(modes_report(found))
        if shapes:
            speeds = [one.path for one in linear.model.flat_variables if _is_speed(one.path, str(one.unit))]
            save_plot(found.plot(show or speeds), shapes)
        if bode:
            save_plot(linear.bode(), bode)


def _is_speed(path: str, unit: str) -> bool:
    return unit == "rad/s" and path.endswith(".w")
