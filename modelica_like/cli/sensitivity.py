"""Command on exact derivatives: sensitivity."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from modelica_like.cli.declare import Option
from modelica_like.cli.models import Start
from modelica_like.cli.shared import Assignments, Debug, Netlist, load_netlist, out, told


def sensitivity(
    netlist: Netlist,
    of: Annotated[list[str], Option(metavar="OUTPUT", help="What to differentiate, e.g. 'max(shaft.tau)'.")],
    to: Annotated[list[str] | None, Option(metavar="PARAMETER", help="By what; else by all.")] = None,
    assignments: Assignments = None, *,
    until: Annotated[str | None, Option(metavar="TIME", help="End time, e.g. 2s; else the netlist's.")] = None,
    start: Annotated[Start | None, Option(help="Start values: as given, from rest, or the steady state.")] = None,
    tornado: Annotated[Path | None, Option(metavar="FILE", help="Draw a tornado plot of the first.")] = None,
    debug: Debug = False,
) -> None:  # fmt: skip
    """Differentiate a run exactly, through its events: ranking tables, tornado plot."""
    with told(debug, pictures=[tornado]):
        assembly = load_netlist(netlist, assignments)
        from modelica_like.analyse.sensitivity.derivatives import sensitivities
        from modelica_like.report.analysis import sensitivity_report
        from modelica_like.solve.plot import save_plot

        result = sensitivities(assembly, of, to or (), until=until, start=start)
        out().print(sensitivity_report(result))
        if tornado:
            save_plot(result.tornado(of[0]), tornado)
