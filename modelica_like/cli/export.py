"""Commands that write models for other tools: export, and what it needs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from modelica_like.cli.reader import Argument, Option
from modelica_like.cli.shared import Assignments, Debug, Json, Netlist, load_netlist, say, slips, told, warn
from modelica_like.writing import write_text

Fmi = Annotated[Literal["2.0", "3.0"], Option(help="Version of FMI.")]
Takes = Literal["flow", "potential"]
"""Quantity that open ends take from outside."""
Modes = Literal["output", "local", "integer"]
"""Variables of modes in an FMU."""
Platforms = Annotated[
    list[str] | None,
    Option("--platform", metavar="NAME", help="E.g. x86_64-windows, all, or none; by default native: this one."),
]
Tables = Annotated[
    list[str] | None, Option("--table", metavar="PATTERN", help="Tables with tunable numbers, e.g. '*.mu_pos'.")
]
FixedStep = Annotated[
    str | None, Option(metavar="TIME", help="Co-Simulation with fixed steps and bounded work, e.g. 1ms.")
]


def export(
    netlist: Netlist, assignments: Assignments = None, *,
    output: Annotated[Path | None, Option("--output", "-o", metavar="FILE", help="By default DRIVE.fmu.")] = None,
    html: Annotated[
        Path | None, Option(metavar="FILE", help="Write a page that simulates in a browser; with -o also an FMU.")
    ] = None,
    fmi: Fmi = "2.0",
    kind: Annotated[Literal["both", "me", "cs"], Option(help="Model Exchange, Co-Simulation, or both.")] = "both",
    platforms: Platforms = None,
    outputs: Annotated[
        list[str] | None, Option("--show", metavar="PATTERN", help="Additional outputs, e.g. '*.w'; in a page: curves.")
    ] = None,
    ends: Annotated[
        list[str] | None, Option("--open", metavar="PATH", help="A free connector to open, e.g. J.flange_b.")
    ] = None,
    takes: Annotated[Takes, Option(help="What open ends take: flow (torque) or potential (angle).")] = "flow",
    embed: Annotated[
        bool, Option("--embed", help="Compile the model into the binary, for importers that do not locate resources.")
    ] = False,
    compiled: Annotated[
        bool, Option("--compiled", help="Compile the equations into the binary, too: the same results, faster.")
    ] = False,
    modes: Annotated[Modes, Option(help="Modes as outputs, local variables, or integer outputs.")] = "output",
    fixed_step: FixedStep = None,
    tables: Tables = None,
    check: Annotated[bool, Option(help="Compare the FMU with IDAS.")] = True,
    strict: Annotated[bool, Option("--strict", help="Do not write an FMU that differs from IDAS.")] = False,
    debug: Debug = False,
) -> None:  # fmt: skip
    """Export a netlist as an FMU: compiled C that needs no Python, and check it; or as a page for a browser."""
    with told(debug):
        assembly = load_netlist(netlist, assignments)
        from rich.console import Console

        from modelica_like.fmi.export import export_fmu

        with Console(stderr=True).status("loading") as status:
            if html is not None:
                from modelica_like.show.browser.page import export_html

                say(str(export_html(assembly, html, show=outputs or (), report=status.update)))
                if output is None:
                    return
            done = export_fmu(
                assembly, output or Path(f"{netlist.stem}.fmu"), fmi, ("me", "cs") if kind == "both" else (kind,),
                () if platforms == ["none"] else platforms or ("native",),
                outputs=outputs or (), ends=ends or (), takes=takes, embed=embed, compiled=compiled, modes=modes,
                fixed_step=fixed_step, tables=tables or (), check=check, strict=strict, report=status.update,
            )  # fmt: skip
        say(str(done))


def runtimes(
    *, platforms: Annotated[
        list[str] | None, Option("--platform", metavar="NAME", help="Compile for a platform, native, or all.")
    ] = None,
    json: Json = False, debug: Debug = False,
) -> None:  # fmt: skip
    """List the platforms for which the run-time of FMUs is available; compile it for others."""
    with told(debug, json=json) as page:
        from rich.console import Console

        from modelica_like.fmi.build import RUNTIMES, chosen_platforms
        from modelica_like.fmi.runtime import found_runtime, runtime_library
        from modelica_like.show.report.tables import table

        with Console(stderr=True).status("loading") as status:
            for name in chosen_platforms(platforms or (), RUNTIMES):
                runtime_library(name, status.update)
        libraries = ((name, str(found_runtime(name) or "not compiled")) for name in RUNTIMES)
        page.print(table("run-times", "platform", "library", rows=libraries))


def from_modelica(
    text: Annotated[Path, Argument(metavar="FILE", help="Modelica text (.mo).")],
    output: Annotated[
        Path | None, Option("--output", "-o", metavar="FILE", help="Netlist; by default FILE.toml.")
    ] = None,
    *,
    name: Annotated[
        str, Option("--class", metavar="NAME", help="Model to read; by default the last one of the file.")
    ] = "",
    flat: Annotated[
        bool, Option("--flat", help="Show its flattened equations as Modelica text, or write them to --output.")
    ] = False,
    debug: Debug = False,
) -> None:  # fmt: skip
    """Write a model of Modelica text as a netlist."""
    target = output or text.parent / f"{text.stem or 'model'}.toml"
    with told(debug, files=[] if flat and output is None else [target]):
        from modelica_like.netlist.modelica.netlist_form import netlist_text
        from modelica_like.netlist.modelica.read import read_modelica

        model, notes = read_modelica(text, name)
        if flat:
            from modelica_like.netlist.modelica.flat_text import flat_text

            equations = flat_text(model)
            if output is None:
                say(equations.rstrip("\n"))
            else:
                write_text(output, equations)
            return
        write_text(target, netlist_text(model, target.parent, notes))
        if notes:
            warn(slips(*notes))
        say(f"{target}: {len(model.parts)} parts; next, modelica-like simulate {target}")


def to_modelica(
    netlist: Netlist, assignments: Assignments = None, *,
    output: Annotated[
        Path | None, Option("--output", "-o", metavar="FILE", help="Modelica text; by default NETLIST.mo.")
    ] = None,
    debug: Debug = False,
) -> None:  # fmt: skip
    """Write a netlist as Modelica text on classes of the Modelica Standard Library."""
    target = output or netlist.parent / f"{netlist.stem or 'model'}.mo"
    with told(debug, files=[target]):
        from modelica_like.netlist.modelica.write import modelica_text

        write_text(target, modelica_text(load_netlist(netlist, assignments)))
        say(str(target))
