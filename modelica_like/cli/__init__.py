"""The command line: `modelica-like check drive.toml` and the other commands."""

from __future__ import annotations

import sys
from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import typer

    app: typer.Typer

# Tasks with their commands and the modules of these, in the order in which the help lists them.
TASKS = {
    "Write a drive": {
        "new": "starters", "check": "models", "draw": "pictures", "library": "types", "describe": "types",
        "schema": "types", "docs": "types", "trust": "starters",
    },
    "Run it": {
        "simulate": "models", "report": "pictures", "explore": "pictures", "compare": "validation",
        "demo": "validation",
    },
    "Analyse and size it": {
        "modes": "analysis", "steady": "analysis", "sweep": "analysis", "sensitivity": "analysis", "size": "validation",
    },
    "Give it to other tools": {
        "export": "export", "runtimes": "export", "validate": "validation", "split": "cosimulation",
        "cosim": "cosimulation", "from-modelica": "modelica", "to-modelica": "modelica",
    },
}  # fmt: skip
_HOME = {name: home for commands in TASKS.values() for name, home in commands.items()}


def command(name: str) -> Callable[..., None]:
    """Return the function of a command."""
    return getattr(import_module(f"modelica_like.cli.{_HOME[name]}"), name.replace("-", "_"))


def __getattr__(name: str) -> Any:
    if name != "app":
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    from modelica_like.cli.complete import application

    globals()["app"] = application({task: {one: command(one) for one in names} for task, names in TASKS.items()})
    return globals()["app"]


def main() -> None:
    """Run the command line. All commands know `--trust`, which is taken from their words here."""
    from modelica_like.cli.trusted import decide
    from modelica_like.trust import trusting

    words = [word for word in sys.argv[1:] if word != "--trust"]
    everything = len(words) < len(sys.argv) - 1
    sys.argv[1:] = words
    try:
        with trusting(None if everything else decide()):
            if not _ran(words):
                __getattr__("app")()
    except KeyboardInterrupt:  # while modules are loaded
        raise SystemExit(130) from None


def _ran(words: list[str]) -> bool:
    """Run an ordinary call of a command; leave anything else to the complete application, which starts slower."""
    from modelica_like.cli.declare import WrongUse
    from modelica_like.cli.quick import read

    if not words or words[0] not in _HOME:
        return False
    function = command(words[0])
    values = read(function, words[1:])
    if values is None:
        return False
    try:
        function(**values)
    except WrongUse:
        return False
    return True
