"""Commands on netlists: check and simulate."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from modelica_like.cli.reader import Option
from modelica_like.cli.shared import (
    Assignments,
    Csv,
    Curves,
    Debug,
    Json,
    Netlist,
    Plot,
    Points,
    Tolerance,
    Units,
    Until,
    assigned,
    load_netlist,
    told,
)
from modelica_like.errors import NetlistError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from matplotlib.figure import Figure

    from modelica_like.runs.trajectories import Trajectories

Start = Annotated[
    Literal["given", "rest", "steady"] | None,
    Option(help="Missing start values: none (given), zero (rest); or steady, for which given ones are guesses."),
]
Solver = Annotated[
    Literal["idas", "native"] | None,
    Option(help="IDAS only, or the compiled run-time of FMUs; by default that run-time if IDAS fails."),
]

Compiled = Annotated[
    bool, Option("--compiled", help="Machine code of the equations, where the compiled run-time does the run.")
]
OnChattering = Annotated[
    Literal["stop", "slide", "rest"] | None,
    Option(help="Where events never end: an error (stop), sliding between two modes, rest after ever faster impacts."),
]


Compare = Annotated[
    list[str] | None, Option(metavar="WHAT", help="In the picture, too: a file, or runs, e.g. 'gear.ratio=2,3'.")
]
Shown = Annotated[list[str] | None, Option(metavar="WHAT=UNIT", help="Unit of results, e.g. speed=rpm or '*.phi=deg'.")]
Inputs = Annotated[
    Path | None, Option(metavar="FILE", help="Open inputs over time: CSV with columns time and e.g. 'motor.tau'.")
]


def check(
    netlist: Netlist, assignments: Assignments = None, *,
    start_values: Annotated[bool, Option("--start-values", help="Print the start values and their origin.")] = False,
    json: Json = False, debug: Debug = False,
) -> None:  # fmt: skip
    """Check a netlist: equations, unknowns, states, index, blocks, energy terms.

    Units, wiring, structure, start values and what happens at the start are checked without a run. What looks like a
    slip is told on stderr; the exit code stays 0. All mistakes that do not follow from each other are told at once.
    """
    with told(debug, json=json) as page:
        assembly = load_netlist(netlist, assignments, thorough=True)
        from modelica_like.netlist.further import thoroughly
        from modelica_like.show.report.plausible import drive_notes
        from modelica_like.show.report.start import start_notes, start_report
        from modelica_like.show.report.structure import structure_report
        from modelica_like.simulation import build

        with thoroughly(assembly):
            structure, model = structure_report(assembly), build(assembly)
        missing = start_notes(model)  # before the report, which says that the drive can be simulated
        page.print(structure)
        page.note(assembly, *drive_notes(assembly), *(missing if not start_values else ()))
        if start_values:
            page.print("", start_report(assembly, model))


def simulate(
    netlist: Netlist, assignments: Assignments = None, *,
    until: Until = None, start: Start = None, solver: Solver = None, compiled: Compiled = False,
    rtol: Tolerance = None, points: Points = None,
    on_chattering: OnChattering = None, csv: Csv = None, units: Units = False, plot: Plot = None, show: Curves = None,
    compare: Compare = None, display: Shown = None, inputs: Inputs = None,
    sankey: Annotated[Path | None, Option(metavar="FILE", help="Draw the energies as a flow diagram.")] = None,
    energy: Annotated[bool, Option(help="Print the energy balance.")] = True,
    json: Json = False, debug: Debug = False,
) -> None:  # fmt: skip
    """Simulate a netlist: events, energy balance, results as table and picture.

    The report names every mode change with its reason, the energies of every part, and steps and evaluations. A run
    that fails or is stopped by Ctrl-C keeps its results up to that time.
    """
    with told(debug, json=json, tables=[csv], pictures=[plot, sankey]) as page:
        # Errors in the file are reported before the solver is loaded.
        assembly = load_netlist(netlist, assignments)
        from modelica_like.cli.outcome import Outcome
        from modelica_like.runs.display import Display
        from modelica_like.runs.driven import driven
        from modelica_like.runs.signals import read_signals
        from modelica_like.show.report.plausible import notes
        from modelica_like.show.report.progress import Bar
        from modelica_like.show.report.run import run_report
        from modelica_like.simulation import build
        from modelica_like.simulation import simulate as run

        variants, files = _beside(compare or (), plot)
        if inputs is not None:
            assembly = driven(assembly, inputs)
        model = build(assembly, free=[path for path, _ in variants])
        read_signals(model, show or ())
        shown = assigned(display, "--display")
        Display(model, shown)
        how: dict[str, Any] = {"start": start, "rtol": rtol, "points": points, "on_chattering": on_chattering}
        how["compiled"] = compiled or None
        with Bar(until or model.settings.get("until")) as bar:
            outcome = Outcome(lambda: run(model, until, progress=bar, solver=solver, **how), debug=debug)
        energy = energy and outcome.stopped is None and outcome.attempt("The energy balance", outcome.solution.energy)
        outcome.tell(
            lambda result: run_report(result, energy=energy, debug=debug, display=shown, show=show or ()), page
        )
        outcome.attempt("The notes", lambda: page.note(assembly, *notes(assembly, outcome.solution, energy=energy)))
        again = partial(run, model, until, **how)
        curves = (plot, lambda result: _drawn(result, variants, files, again, show or (), shown))
        pictures = curves, (sankey, lambda result: result.energy().sankey(model.name))
        outcome.write(csv, units=units or bool(display), display=shown, pictures=pictures, show=show or ())


def _beside(texts: Sequence[str], plot: Path | None) -> tuple[list[tuple[str, Sequence[Any]]], list[Path]]:
    """Return the values and the files to compare with."""
    from modelica_like.analyse.sweeps.ranges import read_range

    if texts and plot is None:
        raise NetlistError("Invalid value for --compare: it is drawn into the picture of --plot, which is missing.")
    files = [Path(text) for text in texts if "=" not in text]
    for file in files:
        file.stat()
    return [read_range(text) for text in texts if "=" in text], files


def _drawn(
    run: Trajectories, variants: Sequence[tuple[str, Sequence[Any]]], files: Sequence[Path],
    again: Callable[..., Trajectories], show: Sequence[str], display: Mapping[str, str],
) -> Figure:  # fmt: skip
    """Draw a run alone, or with runs for other parameter values and files beside it."""
    if not (variants or files):
        from modelica_like.show.plot import plot

        return plot(run, show, display=display)
    from modelica_like.show.report.overlay import overlay

    pairs = ((path, value) for path, values in variants for value in values)
    family = {f"{path} = {value}": again(parameters={path: value}) for path, value in pairs}
    beside = {file.name: file for file in files}
    return overlay({"as given": run} | family | beside, *show, title=run.model.name, display=display)
