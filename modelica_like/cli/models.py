"""Commands on netlists: check and simulate."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from modelica_like.cli.declare import Option, WrongUse
from modelica_like.cli.shared import Assignments, Debug, Netlist, assigned, load_netlist, note, out, told

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from matplotlib.figure import Figure

    from modelica_like.solve.trajectories import Trajectories

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
    show: Annotated[list[str] | None, Option(metavar="PATTERN", help="Curves: '*.w', '2*pi*motor.w'.")] = None,
    compare: Annotated[
        list[str] | None, Option(metavar="WHAT", help="In the picture, too: a file, or runs, e.g. 'gear.ratio=2,3'.")
    ] = None,
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
        from modelica_like.analyse.sweeps.ranges import read_range
        from modelica_like.cli.outcome import Outcome
        from modelica_like.report.plausible import notes
        from modelica_like.report.progress import Bar
        from modelica_like.report.run import run_report
        from modelica_like.simulation import build
        from modelica_like.simulation import simulate as run
        from modelica_like.solve.display import Display
        from modelica_like.solve.signals import read_signals

        if compare and plot is None:
            raise WrongUse("it is drawn into the picture of --plot, which is missing.", "--compare")
        variants = [read_range(text) for text in compare or () if "=" in text]
        files = [Path(text) for text in compare or () if "=" not in text]
        for file in files:
            file.stat()
        model = build(assembly, free=[path for path, _ in variants])
        read_signals(model, show or ())
        shown = assigned(display, "--display")
        Display(model, shown)
        with Bar(until or model.settings.get("until")) as bar:
            made = Outcome(
                lambda: run(model, until, start=start, points=points, progress=bar, solver=solver), debug=debug
            )
        energy = energy and made.stopped is None and made.attempt("The energy balance", made.solution.energy)
        made.tell(lambda one: run_report(one, energy=energy, debug=debug, display=shown, show=show or ()), csv)
        made.attempt("The notes", lambda: note(*notes(assembly, made.solution, energy=energy)))
        again = partial(run, model, until, start=start, points=points)
        curves = (plot, lambda one: _drawn(one, variants, files, again, show or (), shown))
        pictures = curves, (sankey, lambda one: one.energy().sankey(model.name))
        made.write(csv, units=units or bool(display), display=shown, pictures=pictures, show=show or ())


def _drawn(
    run: Trajectories, variants: Sequence[tuple[str, Sequence[Any]]], files: Sequence[Path],
    again: Callable[..., Trajectories], show: Sequence[str], display: Mapping[str, str],
) -> Figure:  # fmt: skip
    """Draw a run alone, or with runs for other parameter values and files beside it."""
    if not (variants or files):
        from modelica_like.solve.plot import plot

        return plot(run, show, display=display)
    from modelica_like.report.overlay import overlay

    pairs = ((path, value) for path, values in variants for value in values)
    family = {f"{path} = {value}": again(parameters={path: value}) for path, value in pairs}
    beside = {file.name: file for file in files}
    return overlay({"as given": run} | family | beside, *show, title=run.model.name, display=display)
