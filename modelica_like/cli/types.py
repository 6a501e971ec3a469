"""Commands on component types: describe, schema and library."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

from modelica_like.cli.declare import Argument, Option
from modelica_like.cli.shared import Debug, out, say, told


def describe(
    kind: Annotated[str, Argument(metavar="TYPE", help="component type, as in a netlist", show_default=False)],
    *, debug: Debug = False,
) -> None:  # fmt: skip
    """Describe a component type: parameters, units, connectors, equations."""
    with told(debug):
        from modelica_like.netlist import find_type
        from modelica_like.report.types import describe as page

        out().print(page(find_type(kind)))


def schema(*, debug: Debug = False) -> None:
    """Print the JSON schema of netlists with all component types, for editors."""
    with told(debug):
        import json

        from modelica_like.netlist import schema as generate

        sys.stdout.write(json.dumps(generate(), indent=2, ensure_ascii=False) + "\n")


def library(*, debug: Debug = False) -> None:
    """List all component types of the installed libraries."""
    with told(debug):
        from modelica_like.netlist import library_types
        from modelica_like.report.types import library_table

        out().print(library_table(library_types()))


def docs(
    output: Annotated[Path, Option("--output", "-o", metavar="FOLDER", help="folder for the pages")],
    types: Annotated[
        list[str] | None, Argument(metavar="TYPE", help="component types, as in a netlist", show_default=False)
    ] = None,
    *,
    examples: Annotated[
        Path | None, Option(metavar="FOLDER", help="folder of netlists to link", show_default=False)
    ] = None,
    debug: Debug = False,
) -> None:
    """Write pages about component types in Markdown: all types and an index, or the named ones."""
    with told(debug, files=[output / "README.md"]):
        from modelica_like.report.component_pages.library import write_component_pages

        pages = write_component_pages(output, examples, types)
        say(f"{len(pages)} page{'s' if len(pages) > 1 else ''} in {output}")
