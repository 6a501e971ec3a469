"""Write command_line.md from the declarations of the commands: python docs/command_line.py."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Literal, get_args, get_origin, get_type_hints

from modelica_like.cli import TASKS, command
from modelica_like.cli.declare import Option
from modelica_like.cli.quick import _Parameter
from modelica_like.writing import write_text

PAGE = Path(__file__).parent / "command_line.md"
MORE = {
    "new": ("tutorial.md", "tutorial"), "check": ("how_to/does_not_start.md", "a drive that does not start"),
    "draw": ("schematics.md", "schematics"), "describe": ("components/README.md", "components"),
    "schema": ("how_to/editor.md", "an editor that knows netlists"), "trust": ("security.md", "security"),
    "simulate": ("plots.md", "pictures"),
    "report": ("reports.md", "reports"), "explore": ("explore.md", "explore"), "modes": ("analysis.md", "analysis"),
    "steady": ("analysis.md", "analysis"), "sweep": ("how_to/sweep.md", "sweeps"),
    "sensitivity": ("sensitivities.md", "sensitivities"), "size": ("sizing.md", "design checks"),
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
version. `modelica-like --install-completion` makes the shell complete commands, options, values and component types.

Options can stand anywhere behind the command. Those marked with … can be given as often as needed. Times are numbers in
seconds or quantities: `2s`, `0.1ms`. `--json` prints tables as data. `--trust`, with any command, runs Python modules
beside the netlists: [security](security.md). Errors are sentences on standard error; `--debug`
shows where in the code they were raised. Exit codes and files: [scripts](how_to/scripts.md)."""


def _index() -> Iterator[str]:
    for task, names in TASKS.items():
        rows = (f"| [`{name}`](#{name}) | {_paragraphs(command(name))[0].removesuffix('.')} |" for name in names)
        yield "\n".join([f"**{task}**", "", "| command | does |", "|---|---|", *rows])


def _about(name: str) -> Iterator[str]:
    """Yield the section of a command."""
    function = command(name)
    defaults = {key: one.default for key, one in inspect.signature(function).parameters.items()}
    hints = get_type_hints(function, include_extras=True)
    known = [_Parameter(key, hints[key], default) for key, default in defaults.items()]
    places = " ".join(_place(one) for one in known if not isinstance(one.declared, Option))
    yield f"## {name}"
    yield f"`modelica-like {name}{' ' if places else ''}{places}`"
    yield from _paragraphs(function)
    rows = (f"| {_written(one)} | {_meaning(one)} |" for one in known if one.name not in ("debug", "json"))
    yield "\n".join(["| argument or option | meaning |", "|---|---|", *rows])
    if "json" in defaults:
        yield "With `--json`: the tables as JSON."
    if name in MORE:
        yield f"More: [{MORE[name][1]}]({MORE[name][0]})."


def _paragraphs(function: Callable[..., None]) -> list[str]:
    return [" ".join(text.split()) for text in inspect.cleandoc(function.__doc__ or "").split("\n\n")]


def _place(one: Any) -> str:
    name = one.declared.metavar or _values(one)
    name += " …" if one.many else ""
    return name if one.default is inspect.Parameter.empty else f"[{name}]"


def _values(one: Any) -> str:
    return "|".join(get_args(one.kind)) if get_origin(one.kind) is Literal else one.name.upper()


def _written(one: Any) -> str:
    """Return an option as it is written."""
    if not isinstance(one.declared, Option):
        return f"`{_place(one)}`".replace("|", "\\|")
    words = [f"`{word}`" for word in one.words()]
    if one.kind is not bool:
        value = one.declared.metavar or _values(one)
        words[0] = f"`{next(iter(one.words()))} {value}`".replace("|", "\\|")
    return ", ".join(words) + (" …" if one.many else "")


def _meaning(one: Any) -> str:
    text = one.declared.help or ""
    if isinstance(one.declared, Option) and one.default is inspect.Parameter.empty:
        text += " Required."
    shown = one.default not in (None, False, inspect.Parameter.empty, "", Path())
    if shown and one.declared.show_default:
        default = "yes" if one.default is True else f"`{one.default}`"
        text += f" Default: {default}."
    return text.replace("|", "\\|")


if __name__ == "__main__":
    write_text(PAGE, page() + "\n")
