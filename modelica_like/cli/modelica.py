"""Commands between netlists and Modelica text."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from modelica_like.cli.declare import Argument, Option
from modelica_like.cli.shared import Assignments, Debug, Netlist, load_netlist, note, say, told
from modelica_like.writing import write_text


def from_modelica(
    text: Annotated[Path, Argument(metavar="FILE", help="Modelica text (.mo).")],
    output: Annotated[
        Path | None, Option("--output", "-o", metavar="FILE", help="Netlist; by default FILE.toml.")
    ] = None,
    *,
    name: Annotated[
        str, Option("--class", metavar="NAME", help="Model to read; by default the last one of the file.")
    ] = "",
    debug: Debug = False,
) -> None:  # fmt: skip
    """Write a model of Modelica text as a netlist."""
    target = output or text.parent / f"{text.stem or 'model'}.toml"
    with told(debug, files=[target]):
        from modelica_like.netlist.modelica.netlist_form import netlist_text
        from modelica_like.netlist.modelica.read import read_modelica

        model, notes = read_modelica(text, name)
        write_text(target, netlist_text(model, target.parent, notes))
        note(*notes)
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
