"""Commands on netlists: check and simulate."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from modelica_like.cli.declare import Option
from modelica_like.cli.shared import Assignments, Debug, Netlist, assigned, load_netlist, note, out, told

Start = Literal["given", "rest", "steady"]
"""Replacement of missing start values."""
Solver = Literal["idas", "native"]
"""Integrator."""


def check(
    netlist: Netlist, assignments: Assignments = None, *,
    start: Annotated[bool, Option("--start", help="Print the start values and their origin.")] = False,
    debug: Debug = False,
) -> None:  # fmt: skip
    """Check a netlist: equations, unknowns, states, index, blocks, energy terms."""
    with told(debug):
        assembly = load_netlist(netlist, assignments)
        from modelica_like.report.plausible import drive_notes
        from modelica_like.report.structure import structure_report

        out().print(structure_report(assembly))
        note(*drive_notes(assembly))
        if start:
            from modelica_like.report.start import start_report
            from modelica_like.simulation import build

            out().print("", start_report(assembly, build(assembly)))


def simulate(
    netlist: Netlist, assignments: Assignments = None, *,
    until: Annotated[str | None, Option(metavar="TIME", help="End time, e.g. 2s; default: the netlist's.")] = None,
    start: Annotated[Start | None, Option(help="Start values: as given, from rest, or the steady state.")] = None,
    csv: Annotated[Path | None, Option(metavar="FILE", help="Write a table: .csv, .parquet, .nc.")] = None,
    points: Annotated[int | None, Option(metavar="N", help="Number of equal intervals of the results.")] = None,
    units: Annotated[bool, Option("--units", help="Units in a second header line of the table.")] = False,
    plot: Annotated[Path | None, Option(metavar="FILE", help="Draw the results: .png, .svg or .pdf.")] = None,
    show: Annotated[list[str] | None, Option(metavar="PATTERN", help="Variables to draw, e.g. '*.w'.")] = None,
    display: Annotated[
        list[str] | None, Option(metavar="WHAT=UNIT", help="Unit of results, e.g. speed=rpm or '*.phi=deg'.")
    ] = None,
    sankey: Annotated[Path | None, Option(metavar="FILE", help="Draw an energy flow diagram.")] = None,
    energy: Annotated[bool, Option(help="Print the energy balance.")] = True,
    solver: Annotated[Solver | None, Option(help="IDAS only, or only the compiled run-time of FMUs.")] = None,
    debug: Debug = False,
) -> None:  # fmt: skip
    """Simulate a netlist: events, energy balance, results as table and picture."""
    with told(debug, tables=[csv], pictures=[plot, sankey]):
        # Errors in the file are reported before the solver is loaded.
        assembly = load_netlist(netlist, assignments)
        from modelica_like.cli.outcome import Outcome
        from modelica_like.report.plausible import notes
        from modelica_like.report.progress import Bar
        from modelica_like.report.run import run_report
        from modelica_like.simulation import build
        from modelica_like.simulation import simulate as run
        from modelica_like.solve.display import Display
        from modelica_like.solve.plot import plot as draw
        from modelica_like.solve.trajectories import matching

        model = build(assembly)
        matching(model, show or ())
        shown = assigned(display, "--display")
        Display(model, shown)
        with Bar(until or model.settings.get("until")) as bar:
            made = Outcome(
                lambda: run(model, until, start=start, points=points, progress=bar, solver=solver), debug=debug
            )
        energy = energy and made.stopped is None and made.attempt("The energy balance", made.solution.energy)
        made.tell(lambda one: run_report(one, energy=energy, debug=debug, display=shown), csv)
        made.attempt("The notes", lambda: note(*notes(assembly, made.solution, energy=energy)))
        curves = (plot, lambda one: draw(one, show or (), display=shown))
        pictures = curves, (sankey, lambda one: one.energy().sankey(model.name))
        made.write(csv, units=units or bool(display), display=shown, pictures=pictures)
