"""The command new: a netlist to begin with."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from modelica_like.cli.declare import Argument, Option
from modelica_like.cli.shared import Debug, say, told
from modelica_like.cli.validation import DEMO
from modelica_like.errors import NetlistError

Drive = Literal["winch", "launch", "servo", "blank"]
_FILES = {"servo": "servo_axis"}


def new(
    drive: Annotated[Drive, Argument(help="Worked drive, or blank: a motor and a load.", show_default=False)],
    output: Annotated[
        Path | None, Option("--output", "-o", metavar="FILE", help="The netlist; by default DRIVE.toml.")
    ] = None,
    *, debug: Debug = False,
) -> None:  # fmt: skip
    """Write a commented netlist to begin with, never over a file."""
    with told(debug):
        file = output or Path(f"{drive}.toml")
        source = DEMO.parent / f"{_FILES.get(drive, drive)}.toml"
        if not source.is_file():
            raise NetlistError(f"The folder of examples is missing: there is no {source}.", advice="Install again.")
        text = source.read_text(encoding="utf-8")
        try:
            with file.open("x", encoding="utf-8") as made:
                made.write(text)
        except FileExistsError:
            raise NetlistError(f"{file} exists, and is left as it is.", advice="Choose another name with -o.") from None
        say(f"{file}: next, modelica-like simulate {file}")
