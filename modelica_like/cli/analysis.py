"""Commands that analyse drives: small motions, operating points, sweeps, gradients, designs, calibrations, scatter."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from modelica_like.cli.models import Start
from modelica_like.cli.reader import Option
from modelica_like.cli.shared import (
    SOLVE_FAILED,
    TABLE,
    Assignments,
    Debug,
    Json,
    Netlist,
    Plot,
    Until,
    load_netlist,
    told,
)

if TYPE_CHECKING:
    from modelica_like.analyse.optimize.result import Front, Optimum


def modes(
    netlist: Netlist, assignments: Assignments = None, *,
    at: Annotated[
        str | None, Option(metavar="WHEN", help="Time, e.g. 0.5s, or given, rest, steady; else as the netlist starts.")
    ] = None,
    shapes: Annotated[Path | None, Option(metavar="FILE", help="Draw the shapes of the modes.")] = None,
    show: Annotated[list[str] | None, Option(metavar="NAME", help="Variables along the shapes.")] = None,
    draw: Annotated[Path | None, Option(metavar="FILE", help="Schematic with shapes below: .svg, .png, .pdf.")] = None,
    bode: Annotated[Path | None, Option(metavar="FILE", help="Draw the frequency response.")] = None,
    nyquist: Annotated[Path | None, Option(metavar="FILE", help="Draw it in the complex plane.")] = None,
    opened: Annotated[
        str | None, Option("--open", metavar="SIGNAL", help="Open a loop there: its response, its margins.")
    ] = None,
    inputs: Annotated[list[str] | None, Option("--input", metavar="NAME", help="Input or parameter.")] = None,
    outputs: Annotated[list[str] | None, Option("--response", metavar="NAME", help="Variable that answers.")] = None,
    json: Json = False, debug: Debug = False,
) -> None:  # fmt: skip
    """Linearize a netlist at a point: eigenvalues, damping, energy shares of each mode."""
    with told(debug, json=json, pictures=[shapes, bode, nyquist]) as page:
        assembly = load_netlist(netlist, assignments)
        from rich.markup import escape

        from modelica_like.analyse.linear.linearize import linearize, when
        from modelica_like.analyse.linear.loop import open_loop
        from modelica_like.show.draw import check_format, save_schematic
        from modelica_like.show.plot import save_plot
        from modelica_like.show.report.analysis import modes_report

        if draw:
            check_format(draw)
        start = when(at) if at else None
        loop = open_loop(assembly, opened, start) if opened else None
        linear = loop or linearize(assembly, start, inputs=inputs, outputs=outputs)
        mode_shapes = linear.modes()
        page.print(modes_report(mode_shapes))
        if loop:
            page.print("", escape(str(loop.margins())))
        if shapes:
            speeds = [
                variable.path
                for variable in linear.model.flat_variables
                if (str(variable.unit), variable.path.rpartition(".")[2]) in (("rad/s", "w"), ("m/s", "v"))
            ]
            save_plot(mode_shapes.plot(show or speeds), shapes)
        if draw:
            save_schematic(assembly, draw, modes=mode_shapes)
        if bode:
            save_plot(linear.bode(), bode)
        if nyquist:
            save_plot(linear.nyquist(), nyquist)


def steady(
    netlist: Netlist, assignments: Assignments = None, *,
    hold: Annotated[
        list[str] | None, Option(metavar="NAME=VALUE", help="Hold a variable, e.g. 'motor.w=4000 rpm'.")
    ] = None,
    by: Annotated[list[str] | None, Option(metavar="PARAMETER", help="Parameter to find, one per --hold.")] = None,
    over: Annotated[
        str | None, Option(metavar="NAME=VALUES", help="A curve, e.g. 'load=0:0.25:26' or 'load=0,0.1,0.2'.")
    ] = None,
    after: Annotated[str | None, Option(metavar="TIME", help="Start from the end of a run, e.g. 2s.")] = None,
    show: Annotated[list[str] | None, Option(metavar="NAME", help="Variables of the table and the plot.")] = None,
    plot: Plot = None, json: Json = False, debug: Debug = False,
) -> None:  # fmt: skip
    """Find operating points of a netlist: powers, losses and efficiency, or a characteristic curve."""
    with told(debug, json=json, pictures=[plot]) as page:
        assembly = load_netlist(netlist, assignments)
        from modelica_like.analyse.operating.curves import characteristic
        from modelica_like.analyse.operating.steady import steady as find
        from modelica_like.analyse.sweeps.ranges import by_name, read_assignment, read_range
        from modelica_like.show.plot import save_plot
        from modelica_like.show.report.analysis import curves_report, point_report
        from modelica_like.simulation import simulate

        near = simulate(assembly, after) if after else None
        if over is None:
            held = by_name((read_assignment(text) for text in hold or ()), "--hold")
            page.print(point_report(find(assembly, held, by or (), near=near), show or ()))
            return
        curves = characteristic(assembly, dict([read_range(over)]), by=(by or [""])[0], near=near)
        page.print(curves_report(curves, show or ()))
        if plot:
            save_plot(curves.plot(*(show or ("efficiency",))), plot)


def sweep(
    netlist: Netlist,
    over: Annotated[list[str], Option(metavar="NAME=VALUES", help="E.g. 'gear.ratio=2:4:21' or 'mu=0.1,0.3'.")],
    of: Annotated[list[str], Option(metavar="OUTPUT", help="Output of each run, e.g. 'max(shaft.tau)'.")],
    assignments: Assignments = None, *,
    until: Until = None,
    checkpoint: Annotated[Path | None, Option(metavar="FOLDER", help="Store finished runs here.")] = None,
    processes: Annotated[int | None, Option(metavar="N", help="Parallel runs; default: one per core.")] = None,
    scheduler: Annotated[str | None, Option(metavar="ADDRESS", help="Dask scheduler, e.g. tcp://host:8786.")] = None,
    solver: Annotated[Literal["native", "idas"], Option(help="The compiled run-time of FMUs, or IDAS.")] = "native",
    compiled: Annotated[
        bool, Option("--compiled", help="Equations as machine code; long sweeps have that by themselves.")
    ] = False,
    output: Annotated[Path | None, Option("--output", "-o", metavar="FILE", help=TABLE)] = None,
    plot: Annotated[Path | None, Option(metavar="FILE", help="Draw lines, a map, or parallel coordinates.")] = None,
    json: Json = False, debug: Debug = False,
) -> None:  # fmt: skip
    """Simulate a netlist over a grid of parameter values."""
    finished = checkpoint / "zarr.json" if checkpoint else None
    with told(debug, json=json, tables=[output], pictures=[plot], files=[finished]) as page:
        assembly = load_netlist(netlist, assignments)
        from modelica_like.analyse.sweeps.ranges import by_name, read_range
        from modelica_like.analyse.sweeps.sweep import sweep as run
        from modelica_like.show.report.analysis import sweep_report
        from modelica_like.show.report.files import write_dataset
        from modelica_like.show.report.progress import Bar

        with Bar(title="runs") as bar:
            dataset = run(
                assembly, by_name(map(read_range, over), "--over"), of, until=until, checkpoint=checkpoint,
                processes=processes, scheduler=scheduler, progress=bar, solver=solver, compiled=compiled or None,
            )  # fmt: skip
        page.print(sweep_report(dataset))
        if output:
            write_dataset(dataset, output)
        if plot:
            from modelica_like.analyse.sweeps.pictures import plot_sweep
            from modelica_like.show.plot import save_plot

            save_plot(plot_sweep(dataset), plot)


def sensitivity(
    netlist: Netlist,
    of: Annotated[list[str], Option(metavar="OUTPUT", help="Output to differentiate, e.g. 'max(shaft.tau)'.")],
    to: Annotated[list[str] | None, Option(metavar="PARAMETER", help="Parameter or input; default: all.")] = None,
    assignments: Assignments = None, *,
    until: Until = None, start: Start = None,
    tornado: Annotated[Path | None, Option(metavar="FILE", help="Draw a tornado plot of the first output.")] = None,
    json: Json = False, debug: Debug = False,
) -> None:  # fmt: skip
    """Differentiate a run exactly, through its events: ranking tables, tornado plot."""
    with told(debug, json=json, pictures=[tornado]) as page:
        assembly = load_netlist(netlist, assignments)
        from modelica_like.analyse.sensitivity.derivatives import sensitivities
        from modelica_like.show.plot import save_plot
        from modelica_like.show.report.analysis import sensitivity_report

        result = sensitivities(assembly, of, to or (), until=until, start=start)
        page.print(sensitivity_report(result))
        if tornado:
            save_plot(result.tornado(of[0]), tornado)


def optimize(
    netlist: Netlist, assignments: Assignments = None, *,
    minimize: Annotated[
        list[str] | None, Option(metavar="OUTPUT", help="What is to be small, e.g. 'peak(shaft.tau)'; of two, a front.")
    ] = None,
    maximize: Annotated[list[str] | None, Option(metavar="OUTPUT", help="What is to be large.")] = None,
    free: Annotated[
        list[str] | None, Option(metavar="NAME=LOW:HIGH", help="What may change, e.g. 'clutch.capacity=20:120'.")
    ] = None,
    subject_to: Annotated[
        list[str] | None, Option(metavar="LIMIT", help="Limit of an output, e.g. 'clutch.lock_time <= 0.4 s'.")
    ] = None,
    until: Until = None, start: Start = None,
    starts: Annotated[int | None, Option(metavar="N", help="Starts of the search.")] = None,
    points: Annotated[int | None, Option(metavar="N", help="Designs of a front; default: 20.")] = None,
    processes: Annotated[
        int | None, Option(metavar="N", help="Searches at the same time; default: one per core.")
    ] = None,
    output: Annotated[
        Path | None, Option("--output", "-o", metavar="FILE", help="Write the netlist with the best values.")
    ] = None,
    plot: Annotated[Path | None, Option(metavar="FILE", help="Draw the front, or the way to the optimum.")] = None,
    report: Annotated[Path | None, Option(metavar="FILE", help="Write a page about the best design.")] = None,
    json: Json = False, debug: Debug = False,
) -> None:  # fmt: skip
    """Find the best design: what [optimize] of the netlist asks for, or these options."""
    with told(debug, json=json, pictures=[plot], files=[output, report]) as page:
        assembly = load_netlist(netlist, assignments)
        from modelica_like.analyse.optimize.optimize import optimize as find
        from modelica_like.analyse.sweeps.ranges import by_name, read_bounds
        from modelica_like.analyse.sweeps.workers import cores
        from modelica_like.show.plot import save_plot
        from modelica_like.show.report.analysis import optimum_report

        bounds = by_name(map(read_bounds, free), "--free") if free else None
        from modelica_like.show.report.progress import Bar

        with Bar(title="designs") as bar:
            result = find(
                assembly, minimize=minimize or (), maximize=maximize or (), free=bounds, subject_to=subject_to or (),
                until=until, start=start, starts=starts, points=points, progress=bar,
                processes=cores() if processes is None else processes,
            )  # fmt: skip
        page.print(optimum_report(result))
        if plot:
            save_plot(result.plot(), plot)
        _write_design(result, output, report)


def _write_design(result: Optimum | Front, output: Path | None, report: Path | None) -> None:
    """Write the netlist and the page of a best design, and leave with a failure where it exceeds a limit."""
    from modelica_like.analyse.optimize.result import Front
    from modelica_like.errors import ValueOutOfRange

    if isinstance(result, Front):
        if output or report:
            raise ValueOutOfRange(
                "A front is no single design to write.", advice="Limit one of the objectives by --subject-to."
            )
        return
    if output:
        result.save(output)
    if report:
        from modelica_like.show.report.page import save_report

        save_report(result.best_drive(), result.simulate(), report, optimum=result)
    if not result.feasible:
        raise SystemExit(SOLVE_FAILED)  # as `size` does where a limit is exceeded


def calibrate(
    netlist: Netlist, assignments: Assignments = None, *,
    data: Annotated[
        list[Path] | None, Option(metavar="FILE.csv", help="Measured curves: `time` and columns such as 'J.w [rpm]'.")
    ] = None,
    free: Annotated[
        list[str] | None, Option(metavar="NAME=LOW:HIGH", help="What is to be found, e.g. 'clutch.mu=0.1:0.5'.")
    ] = None,
    uncertainty: Annotated[
        list[str] | None, Option(metavar="NAME=VALUE", help="Of a column; default: a hundredth of its largest value.")
    ] = None,
    starts: Annotated[int, Option(metavar="N", help="Starts of the search.")] = 1,
    output: Annotated[
        Path | None, Option("--output", "-o", metavar="FILE", help="Write the netlist with the values found.")
    ] = None,
    plot: Annotated[Path | None, Option(metavar="FILE", help="Draw confidence ellipses.")] = None,
    json: Json = False, debug: Debug = False,
) -> None:  # fmt: skip
    """Find parameters that fit measured curves best, with intervals and what the data do not determine."""
    with told(debug, json=json, pictures=[plot], files=[output]) as page:
        assembly = load_netlist(netlist, assignments)
        from modelica_like.analyse.calibration.calibrate import calibrate as find
        from modelica_like.analyse.calibration.measurements import Trajectories
        from modelica_like.analyse.sweeps.ranges import by_name, read_assignment, read_bounds
        from modelica_like.show.plot import save_plot
        from modelica_like.show.report.analysis import calibration_report

        known = by_name(map(read_assignment, uncertainty or ()), "--uncertainty")
        bounds = {name: (low, high) for name, (low, high) in by_name(map(read_bounds, free or ()), "--free").items()}
        from modelica_like.show.report.progress import Bar

        with Bar(title="designs") as bar:
            measured = [Trajectories(file, known) for file in data or ()]
            result = find(assembly, measured, bounds, starts=starts, progress=bar)
        page.print(calibration_report(result))
        if plot:
            save_plot(result.plot(), plot)
        if output:
            result.save(output)


def tolerance(
    netlist: Netlist, assignments: Assignments = None, *,
    of: Annotated[list[str] | None, Option(metavar="OUTPUT", help="Output, e.g. 'max(shaft.tau)'.")] = None,
    scatter: Annotated[
        list[str] | None, Option(metavar="NAME=TEXT", help="E.g. 'clutch.mu=±10 %' or 'm=normal(20 kg, 1 kg)'.")
    ] = None,
    subject_to: Annotated[
        list[str] | None, Option(metavar="LIMIT", help="How probably is it broken? E.g. 'clutch.lock_time <= 0.4 s'.")
    ] = None,
    until: Until = None, start: Start = None,
    shares: Annotated[bool, Option("--shares", help="Shares of the variance by Sobol's indices, too.")] = False,
    plot: Annotated[Path | None, Option(metavar="FILE", help="Draw histograms.")] = None,
    json: Json = False, debug: Debug = False,
) -> None:  # fmt: skip
    """Tell what tolerances do: [tolerances] of the netlist, or these options."""
    with told(debug, json=json, pictures=[plot]) as page:
        assembly = load_netlist(netlist, assignments)
        from modelica_like.analyse.sweeps.ranges import by_name, read_assignment
        from modelica_like.analyse.tolerance.tolerance import tolerance as find
        from modelica_like.show.plot import save_plot
        from modelica_like.show.report.analysis import tolerance_report

        given = by_name(map(read_assignment, scatter), "--scatter") if scatter else None
        result = find(
            assembly, of or (), given, subject_to=subject_to or (), until=until, start=start, shares=shares,
        )  # fmt: skip
        page.print(tolerance_report(result))
        if plot:
            save_plot(result.plot(), plot)
