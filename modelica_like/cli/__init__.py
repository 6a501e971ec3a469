"""The command line: `modelica-like check drive.toml` and the other commands."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from importlib import import_module

# Tasks with their commands and the modules of these, in the order in which the help lists them.
TASKS = {
    "Write a drive": {
        "new": "starters", "edit": "pictures", "check": "models", "draw": "pictures", "library": "types",
        "describe": "types", "schema": "types", "lsp": "starters", "mcp": "starters", "docs": "types",
        "trust": "starters",
    },
    "Run it": {
        "simulate": "models", "report": "pictures", "explore": "pictures", "compare": "validation",
        "demo": "validation",
    },
    "Analyse and size it": {
        "modes": "analysis", "steady": "analysis", "sweep": "analysis", "sensitivity": "analysis",
        "optimize": "analysis", "calibrate": "analysis", "tolerance": "analysis", "size": "validation",
    },
    "Give it to other tools": {
        "export": "export", "runtimes": "export", "validate": "validation", "split": "cosimulation",
        "cosim": "cosimulation", "from-modelica": "export", "to-modelica": "export",
    },
}  # fmt: skip
HOMES = {name: home for commands in TASKS.values() for name, home in commands.items()}
COMPLETE = "_MODELICA_LIKE_COMPLETE"
"""Set where a shell asks how words can go on."""


def command(name: str) -> Callable[..., None]:
    """Return the function of a command."""
    return getattr(import_module(f"modelica_like.cli.{HOMES[name]}"), name.replace("-", "_"))


def main() -> None:
    """Run the command line. All commands know `--trust` and `--library`, which are taken from their words here."""
    from modelica_like.cli.trusted import decide
    from modelica_like.trust import trusting

    words = [word for word in sys.argv[1:] if word != "--trust"]
    everything = len(words) < len(sys.argv) - 1
    words, libraries = _libraries(words)
    try:
        if COMPLETE in os.environ:
            from modelica_like.cli.overview import complete

            complete(words)
            return
        try:
            with trusting(None if everything else decide()), _known(libraries):
                run(words)
        finally:
            sys.stdout.flush()
    except BrokenPipeError:  # the reader of the results has closed the pipe
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise SystemExit(1) from None
    except KeyboardInterrupt:  # while modules are loaded
        raise SystemExit(130) from None


def _libraries(words: list[str]) -> tuple[list[str], list[str]]:
    """Return the words without `--library PATH`, and these paths."""
    rest, places, pending = list[str](), list[str](), iter(words)
    for word in pending:
        name, equals, place = word.partition("=")
        if name != "--library":
            rest.append(word)
        else:  # without a path, or with an empty one, there is no such library
            places.append(place if equals else next(pending, ""))
    return rest, places


def _known(libraries: list[str]) -> AbstractContextManager[None]:
    """Return what makes libraries of Modelica text known."""
    if not libraries:
        return nullcontext()
    from modelica_like.cli.shared import told
    from modelica_like.netlist.modelica.classes import with_libraries

    with told(False):
        return with_libraries(libraries)


def run(words: Sequence[str]) -> None:
    """Run a command.

    Args:
        words: its name, and what follows.

    Raises:
        SystemExit: it failed, or help is shown.
    """
    if not words or words[0] not in HOMES:
        from modelica_like.cli.overview import overview

        overview(words)
    else:
        from modelica_like.cli.reader import reader

        function = command(words[0])
        function(**reader(words[0], function).read(words[1:]))
