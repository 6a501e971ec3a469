"""Commands for co-simulation: split and cosim."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from modelica_like.cli.export import Fmi
from modelica_like.cli.reader import Argument, Option
from modelica_like.cli.shared import (
    Assignments,
    Csv,
    Curves,
    Debug,
    Json,
    Netlist,
    Plot,
    Timeout,
    Units,
    Until,
    load_netlist,
    say,
    told,
)
from modelica_like.errors import NetlistError

Master = Literal["jacobi", "gauss-seidel"]
"""Order in which FMUs step."""
Inputs = Literal["linear", "hold"]
"""Inputs between communication points."""


def split(
    netlist: Netlist, assignments: Assignments = None, *,
    at: Annotated[
        list[str] | None,
        Option("--at", metavar="PLACE", help="A part (the cut is behind it), one of its ends, or a name in [connect]."),
    ] = None,
    output: Annotated[
        Path, Option("--output", "-o", metavar="FOLDER", help="Where to write: a folder, or an SSP (….ssp).")
    ] = Path("build/split"),
    names: Annotated[
        list[str] | None, Option("--name", metavar="NAME", help="Name of an FMU, in the order of the netlist.")
    ] = None,
    fmi: Fmi = "2.0", ssp: Annotated[Literal["1.0", "2.0"], Option(help="Version of SSP.")] = "1.0",
    check: Annotated[bool, Option(help="Compare every FMU with IDAS.")] = True,
    debug: Debug = False,
) -> None:  # fmt: skip
    """Cut a drive at shafts into FMUs, with the system file that `cosim` runs."""
    with told(debug):
        assembly = load_netlist(netlist, assignments)
        from rich.console import Console

        from modelica_like.fmi.cosimulation.split import split as run
        from modelica_like.fmi.cosimulation.split import split_to_ssp

        with Console(stderr=True).status("loading") as status:
            if output.suffix.lower() == ".ssp":
                done = split_to_ssp(
                    assembly, at or (), output, ssp, names=names or (), version=fmi, check=check, report=status.update
                )
            else:
                done = run(
                    assembly, at or (), output, names=names or (), version=fmi, check=check, report=status.update
                )
        say(str(done))


def cosim(
    system: Annotated[Path, Argument(metavar="SYSTEM", help="System or netlist with FMUs (TOML), or SSP.")],
    assignments: Annotated[
        list[str] | None, Option("--set", metavar="FMU.PATH=VALUE", help="Set a value in an FMU, in its units.")
    ] = None, *,
    until: Until = None,
    step: Annotated[str | None, Option(metavar="TIME", help="Communication step, e.g. 0.1ms.")] = None,
    rtol: Annotated[
        float | None, Option(metavar="NUMBER", help="Relative tolerance of the coupling, for a variable step.")
    ] = None,
    master: Annotated[Master | None, Option(help="All FMUs at once, or one after the other.")] = None,
    inputs: Annotated[Inputs | None, Option(help="Interpolate inputs linearly, or hold them.")] = None,
    csv: Csv = None, units: Units = False, plot: Plot = None, show: Curves = None, timeout: Timeout = "600s",
    json: Json = False, debug: Debug = False,
) -> None:  # fmt: skip
    """Run a system of FMUs together: mode changes, energies at the couplings, results as table and picture."""
    with told(debug, json=json, tables=[csv], pictures=[plot]) as page:
        from modelica_like.cli.outcome import Outcome
        from modelica_like.fmi.cosimulation.files import opened
        from modelica_like.fmi.cosimulation.run import cosim as run
        from modelica_like.fmi.cosimulation.solution import described_model
        from modelica_like.runs.signals import read_signals
        from modelica_like.show.plot import plot as draw
        from modelica_like.show.report.progress import Bar
        from modelica_like.show.report.run import cosimulation_report
        from modelica_like.simulation import seconds

        values = _numbers(assignments or ())
        with opened(system) as loaded, Bar(until or loaded.settings.until) as bar:
            if show:
                read_signals(described_model(loaded), show)
            outcome = Outcome(
                lambda: run(
                    loaded, until, step=step, master=master, inputs=inputs, tolerance=rtol,
                    parameters=values, timeout=seconds(timeout, "timeout"), progress=bar,
                ), debug=debug,
            )  # fmt: skip
        outcome.tell(cosimulation_report, page)
        outcome.write(csv, units=units, show=show or (), pictures=[(plot, lambda run: draw(run, show or ()))])


def _numbers(assignments: list[str] | tuple[str, ...]) -> dict[str, float]:
    """Read values for FMUs, which take plain numbers."""
    values: dict[str, float] = {}
    for assignment in assignments:
        path, _, text = assignment.partition("=")
        try:
            values[path.strip()] = float(text)
        except ValueError:
            raise NetlistError(f"Invalid value for --set: '{assignment}' is not FMU.PATH=NUMBER.") from None
    return values
