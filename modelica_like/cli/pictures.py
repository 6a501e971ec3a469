"""Commands that show netlists and runs: draw, report, explore, edit."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from modelica_like.cli.reader import Argument, Option
from modelica_like.cli.shared import Assignments, Curves, Debug, Netlist, Until, load_netlist, say, told
from modelica_like.errors import NetlistError

if TYPE_CHECKING:
    from modelica_like.page import Session


def draw(
    netlist: Netlist, assignments: Assignments = None, *,
    output: Annotated[Path | None, Option("--output", "-o", metavar="FILE", help="By default DRIVE.svg.")] = None,
    depth: Annotated[int, Option(metavar="N", help="Levels of assemblies to open.")] = 1,
    at: Annotated[str | None, Option(metavar="TIME", help="Run the drive; show modes and powers at a time.")] = None,
    flow: Annotated[bool, Option("--flow", help="Run the drive; show mean powers as line widths.")] = False,
    animate: Annotated[bool, Option("--animate", help="Run the drive; show its modes one by one.")] = False,
    until: Until = None, debug: Debug = False,
) -> None:  # fmt: skip
    """Draw the schematic of a netlist: power from left to right."""
    with told(debug):
        from modelica_like.show.draw import check_format, save_schematic
        from modelica_like.simulation import seconds, simulate

        path = output or Path(f"{netlist.stem}.svg")
        check_format(path, moving=animate)
        drive = load_netlist(netlist, assignments)
        run = simulate(drive, until or (at if not (flow or animate) else None)) if at or flow or animate else None
        moment = seconds(at, "at") if at else None
        save_schematic(drive, path, depth=depth, run=run, at=moment, flow=flow or bool(at), moving=animate)
        say(str(path))


def report(
    source: Annotated[Path, Argument(metavar="NETLIST", help="Netlist, FMU, system or CSV file.")],
    assignments: Assignments = None, *,
    output: Annotated[Path | None, Option("--output", "-o", metavar="FILE", help="By default DRIVE.html.")] = None,
    until: Until = None, show: Curves = None, debug: Debug = False,
) -> None:  # fmt: skip
    """Simulate a netlist and write a page about it: schematic, events, curves, energies, numbers."""
    path = output or Path(f"{source.stem}.html")
    with told(debug, files=[path]):
        from modelica_like.fmi.cosimulation.files import describes_system
        from modelica_like.netlist.read import is_modelica
        from modelica_like.runs.signals import read_signals
        from modelica_like.show.report.page import save_report
        from modelica_like.show.report.progress import Bar
        from modelica_like.show.report.sources import trajectories
        from modelica_like.simulation import build, seconds, simulate

        if not is_modelica(source) and (source.suffix.lower() != ".toml" or describes_system(source)):
            if assignments:
                raise NetlistError(f"--set changes netlists; '{source.name}' is none.")
            save_report(None, trajectories(source, seconds(until) if until else None), path, show=show or ())
            say(str(path))
            return
        drive = load_netlist(source, assignments)
        model = build(drive)
        read_signals(model, show or ())
        with Bar(until or model.settings.get("until")) as bar:
            run = simulate(model, until, progress=bar)
        save_report(drive, run, path, show=show or ())
        say(str(path))


def explore(
    netlist: Netlist, assignments: Assignments = None, *,
    until: Until = None, show: Curves = None,
    output: Annotated[Path, Option("--output", "-o", metavar="FOLDER", help="Where the page saves files.")] = Path(),
    browser: Annotated[bool, Option(help="Open the browser.")] = True,
    debug: Debug = False,
) -> None:  # fmt: skip
    """Open a page with sliders and curves that runs the drive on this machine: that of `edit`, with the text folded."""
    with told(debug):
        drive = load_netlist(netlist, assignments)
        from modelica_like.page import Session

        _serve(Session(drive, until, show=show or (), folder=output), browser=browser, folded=True)


def edit(
    netlist: Annotated[Path | None, Argument(metavar="NETLIST", help="Netlist; by default an empty sheet.")] = None, *,
    until: Until = None, show: Curves = None,
    output: Annotated[
        Path | None, Option("--output", "-o", metavar="FOLDER", help="For exports; by default that of the netlist.")
    ] = None,
    autosave: Annotated[bool, Option("--autosave", help="Write the file after each valid change.")] = False,
    browser: Annotated[bool, Option(help="Open the browser.")] = True,
    debug: Debug = False,
) -> None:  # fmt: skip
    """Open a page in which a drive is built, changed and run: picture, values, text and curves of one file."""
    with told(debug):
        from modelica_like.page import Session, new_file
        from modelica_like.trust import everything_trusted

        path = netlist or new_file(Path())
        session = Session(
            path, until, show=show or (), folder=output or path.parent, trusted=everything_trusted(), autosave=autosave
        )
        _serve(session, browser=browser)


def _serve(session: Session, *, browser: bool, folded: bool = False) -> None:
    from modelica_like.page import PageServer

    with PageServer(session, folded=folded) as server:
        say(f"{server.address}\nCtrl-C ends it.")
        server.show(browser=browser)
