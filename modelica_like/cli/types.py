"""Commands on component types: describe, library, schema and docs."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Literal

from modelica_like.cli.reader import Argument, Option
from modelica_like.cli.shared import Debug, Json, say, told


def _types() -> Iterable[str]:
    from modelica_like.netlist import library_types

    return library_types()


def describe(
    kind: Annotated[str, Argument(metavar="TYPE", help="Component type, or a netlist.", choices=_types)],
    *, json: Json = False, debug: Debug = False,
) -> None:  # fmt: skip
    """Describe a component type: parameters, units, connectors, modes, parts, equations and events.

    Of a netlist: its parameters, its parts and those of its assemblies, and its connections.
    """
    with told(debug, json=json) as page:
        from modelica_like.netlist import find_type, load
        from modelica_like.netlist.read import is_modelica
        from modelica_like.show.report.types import describe as described
        from modelica_like.show.report.types import describe_netlist

        is_netlist = kind.endswith(".toml") or is_modelica(kind)
        page.print(describe_netlist(load(kind)) if is_netlist else described(find_type(kind)))


def library(
    words: Annotated[list[str] | None, Argument(metavar="WORD", help="Words that the type or its text has.")] = None,
    *, group: Annotated[str | None, Option(metavar="GROUP", help="Only this group, e.g. gears.")] = None,
    json: Json = False, debug: Debug = False,
) -> None:  # fmt: skip
    """List the component types of the installed libraries: all, those of a group, or those with some words."""
    with told(debug, json=json) as page:
        from modelica_like.netlist import library_types
        from modelica_like.show.report.types import library_table

        page.print(library_table(library_types(), words or (), group))


def schema(
    of: Annotated[Literal["netlist", "sizing"], Argument(help="Files that it describes.")] = "netlist",
    *, output: Annotated[
        Path | None, Option("--output", "-o", metavar="FILE", help="Write a file, not to the screen.")
    ] = None,
    debug: Debug = False,
) -> None:  # fmt: skip
    """Write the JSON schema of netlists or of sizing files: an editor then completes, explains and marks mistakes."""
    with told(debug, files=[output]):
        import json
        import sys
        from importlib import import_module

        from modelica_like.writing import write_text

        package = {"netlist": "netlist", "sizing": "analyse.sizing"}[of]
        generate = import_module(f"modelica_like.{package}.json_schema").schema
        text = json.dumps(generate(), indent=1, ensure_ascii=False) + "\n"
        if output is None:
            sys.stdout.write(text)
        else:
            write_text(output, text)
            say(f'{output}: the first line of a file names it, "#:schema ./{output.name}"')


def docs(
    output: Annotated[Path, Option("--output", "-o", metavar="FOLDER", help="Folder for the pages.")],
    types: Annotated[list[str] | None, Argument(metavar="TYPE", help="Component types, as in a netlist.")] = None,
    *, examples: Annotated[Path | None, Option(metavar="FOLDER", help="Folder of netlists to link.")] = None,
    debug: Debug = False,
) -> None:  # fmt: skip
    """Write pages about component types in Markdown: all types and an index, or the named ones."""
    with told(debug, files=[output / "README.md"]):
        from modelica_like.show.report.component_pages.library import write_component_pages

        pages = write_component_pages(output, examples, types)
        say(f"{len(pages)} page{'s' if len(pages) > 1 else ''} in {output}")
