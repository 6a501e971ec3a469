"""Commands to begin with, new and trust, and servers for editors and programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from modelica_like.cli.reader import Argument, Option
from modelica_like.cli.shared import Debug, say, told
from modelica_like.cli.validation import DEMO
from modelica_like.errors import NetlistError

Drive = Literal["winch", "launch", "servo", "blank"]
_FILES = {"servo": "servo_axis"}


def new(
    drive: Annotated[Drive, Argument(help="Worked drive, or blank: a motor and a load.")],
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
            with file.open("x", encoding="utf-8") as stream:
                stream.write(text)
        except FileExistsError:
            raise NetlistError(f"{file} exists, and is left as it is.", advice="Choose another name with -o.") from None
        say(f"{file}: next, modelica-like simulate {file}")


def trust(
    folder: Annotated[Path | None, Argument(metavar="FOLDER", help="Without one: list them.")] = None,
    *, remove: Annotated[bool, Option("--remove", help="Trust it no longer.")] = False,
    debug: Debug = False,
) -> None:  # fmt: skip
    """Trust a folder: Python modules beside its netlists, and beside those in folders below, may run.

    A module can do all that you can. A netlist that names a module in any other folder is refused; `--trust` with
    another command makes an exception for that call.
    """
    with told(debug):
        import modelica_like.trust as trusted

        if folder is None:
            say("\n".join(map(str, trusted.trusted_folders())) or "No folder is trusted.")
        elif remove:
            say(f"{trusted.distrust(folder)} is not trusted any more.")
        else:
            say(f"{trusted.trust(folder)} is trusted.")


def lsp(*, debug: Debug = False) -> None:
    """Answer an editor about netlists and sizing files, on standard input and output (extra `lsp`).

    The editor starts it, and speaks the language server protocol. Modules of folders that are not trusted do not run.
    """
    with told(debug):
        from modelica_like import __version__
        from modelica_like.errors import extra_module

        extra_module("pygls", "lsp")
        extra_module("modelica_like.lsp.server", "lsp").serve(__version__)


def mcp(
    folder: Annotated[Path, Argument(metavar="FOLDER", help="With the netlists.")] = Path(),
    *, debug: Debug = False,
) -> None:  # fmt: skip
    """Answer a program about the netlists of a folder, on standard input and output (extra `mcp`).

    The program starts it, and speaks the Model Context Protocol: operations, check, simulate and analyses are tools.
    No file outside of the folder is read or written. Modules of folders that are not trusted do not run.
    """
    with told(debug):
        from modelica_like import __version__
        from modelica_like.errors import extra_module

        extra_module("mcp", "mcp")
        extra_module("modelica_like.mcp.server", "mcp").serve(__version__, folder)
