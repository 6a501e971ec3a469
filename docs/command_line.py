"""Write command_line.md from the declarations of the commands: python docs/command_line.py."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from modelica_like.cli import TASKS, command
from modelica_like.cli.reader import Parameter, paragraphs, parameters
from modelica_like.writing import write_text

PAGE = Path(__file__).parent / "command_line.md"
MORE = {
    "new": ("tutorial.md", "tutorial"), "check": ("how_to/does_not_start.md", "a drive that does not start"),
    "draw": ("schematics.md", "schematics"), "describe": ("components/README.md", "components"),
    "schema": ("how_to/editor.md", "an editor that knows netlists"), "trust": ("security.md", "security"),
    "lsp": ("how_to/editor.md", "an editor that knows netlists"),
    "mcp": ("how_to/programs.md", "netlists for programs"),
    "simulate": ("plots.md", "pictures"),
    "report": ("reports.md", "reports"), "explore": ("explore.md", "explore"),
    "edit": ("how_to/edit_in_a_page.md", "a drive in a page"), "modes": ("analysis.md", "analysis"),
    "steady": ("analysis.md", "analysis"), "sweep": ("how_to/sweep.md", "sweeps"),
    "sensitivity": ("sensitivities.md", "sensitivities"),
    "optimize": ("how_to/optimise.md", "optimisation"), "tolerance": ("how_to/tolerances.md", "tolerances"),
    "size": ("sizing.md", "design checks"),
    "export": ("fmu.md", "FMUs"), "runtimes": ("fmu.md", "FMUs"), "validate": ("importers.md", "importers"),
    "split": ("cosimulation.md", "co-simulation"), "cosim": ("cosimulation.md", "co-simulation"),
}  # fmt: skip
"""Pages about commands, with their names."""


def page() -> str:
    """Return the whole page."""
    return "\n\n".join(
        [_HEAD, *_index(), *(text for names in TASKS.values() for name in names for text in _about(name))]
    )


_HEAD = """# The command line

<!-- Written by docs/command_line.py from the commands; do not edit. -->

`modelica-like COMMAND …`, or `python -m modelica_like COMMAND …`. `--help` shows the same as this page, `--version` the
version. `modelica-like --install-completion` makes the shell of `$SHELL` (bash, zsh,
fish) complete commands, options, values and component types.

Options can stand anywhere behind the command. Those marked with … can be given as often as needed. Times are numbers in
seconds or quantities: `2s`, `0.1ms`. `--json` prints tables and problems as data. `--trust`, with any command, runs
Python modules beside the netlists: [security](security.md). `--library PATH`, as often as needed, names a library of
[Modelica text](modelica_text.md). Errors are sentences on standard error; `--debug`
shows where in the code they were raised. Exit codes and files: [scripts](how_to/scripts.md)."""


def _index() -> Iterator[str]:
    for task, names in TASKS.items():
        rows = (f"| [`{name}`](#{name}) | {paragraphs(command(name))[0].removesuffix('.')} |" for name in names)
        yield "\n".join([f"**{task}**", "", "| command | does |", "|---|---|", *rows])


def _about(name: str) -> Iterator[str]:
    """Yield the section of a command."""
    function = command(name)
    known = parameters(function)
    yield f"## {name}"
    yield f"`{' '.join(['modelica-like', name, *(one.place() for one in known if not one.option)])}`"
    yield from paragraphs(function)
    rows = (f"| {_written(one)} | {_meaning(one)} |" for one in known if one.name not in ("debug", "json"))
    yield "\n".join(["| argument or option | meaning |", "|---|---|", *rows])
    if any(one.name == "json" for one in known):
        yield "With `--json`: tables and problems as JSON."
    if name in MORE:
        yield f"More: [{MORE[name][1]}]({MORE[name][0]})."


def _written(one: Parameter) -> str:
    """Return an argument or an option as it is written."""
    if not one.option:
        return f"`{one.place()}`".replace("|", "\\|")
    words, value = list(one.words()), one.value.removesuffix(" …")
    if one.kind is not bool:
        words[0] += f" {value}".replace("|", "\\|")
    return ", ".join(f"`{word}`" for word in words) + (" …" if one.many else "")


def _meaning(one: Parameter) -> str:
    default = one.shown if one.default is True else f"`{one.shown}`"
    text = one.declared.help + (" Required." if one.option and one.required else "")
    return f"{text}{f' Default: {default}.' if one.shown else ''}".replace("|", "\\|")


if __name__ == "__main__":
    write_text(PAGE, page() + "\n")
