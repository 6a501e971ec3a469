"""The command line: `modelica-like check drive.toml` and the other commands."""

from __future__ import annotations

import sys
from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import typer

    app: typer.Typer

# Modules and their commands, in the order in which the help lists them.
_GROUPS = {
    "starters": ("new",),
    "models": ("check", "simulate"),
    "pictures": ("draw", "report", "explore"),
    "analysis": ("modes", "steady", "sweep", "sensitivity"),
    "export": ("export", "runtimes"),
    "modelica": ("from-modelica", "to-modelica"),
    "cosimulation": ("split", "cosim"),
    "types": ("describe", "schema", "library", "docs"),
    "validation": ("validate", "compare", "size", "demo"),
}
_HOME = {name: group for group, names in _GROUPS.items() for name in names}


def command(name: str) -> Callable[..., None]:
    """Return the function of a command."""
    return getattr(import_module(f"modelica_like.cli.{_HOME[name]}"), name.replace("-", "_"))


def __getattr__(name: str) -> Any:
    if name != "app":
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    from modelica_like.cli.complete import application

    globals()["app"] = application({one: command(one) for one in _HOME})
    return globals()["app"]


def main() -> None:
    """Run the command line."""
    try:
        if not _ran(sys.argv[1:]):
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
