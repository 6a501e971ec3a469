"""The complete command line: Typer shows help and errors from the declarations of the commands."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Mapping
from typing import Annotated, Any, get_args, get_type_hints

import typer
from rich.markup import escape

from modelica_like import __version__
from modelica_like.cli.declare import Argument, Option, WrongUse

_ABOUT = (
    "Acausal drive-train models: check, simulate, analyse and export netlists.\n\n"
    "Exit codes: 0 done; 1 the model cannot be solved, or a check failed; 2 the input is wrong, or a file cannot be "
    "read or written; 130 stopped by Ctrl-C.\n\n"
    "`--trust`, with any command, runs Python modules beside the netlists."
)


def application(tasks: Mapping[str, Mapping[str, Callable[..., None]]]) -> typer.Typer:
    """Return the application with these commands by task, in this order."""
    app = typer.Typer(no_args_is_help=True, pretty_exceptions_enable=False)
    app.callback(help=_ABOUT)(_version)
    for task, commands in tasks.items():
        for name, command in commands.items():
            app.command(name, rich_help_panel=task)(_for_typer(command))
    return app


def _told(wanted: bool) -> None:
    if wanted:
        typer.echo(f"modelica-like {__version__}")
        raise typer.Exit


def _version(
    *, version: Annotated[
        bool, typer.Option("--version", is_eager=True, callback=_told, help="Print the version.")
    ] = False,
) -> None:  # fmt: skip
    """Nothing is left to do: the option has its own function."""


def _for_typer(command: Callable[..., None]) -> Callable[..., None]:
    hints = get_type_hints(command, include_extras=True)
    told = {name: _annotation(hint) if name != "return" else hint for name, hint in hints.items()}

    @functools.wraps(command)
    def run(*arguments: Any, **options: Any) -> None:
        try:
            command(*arguments, **options)
        except WrongUse as error:
            raise typer.BadParameter(str(error), param_hint=error.option) from None

    paragraphs = inspect.cleandoc(command.__doc__ or "").split("\n\n")
    run.__annotations__, run.__doc__ = told, escape("\n\n".join(" ".join(one.split()) for one in paragraphs))
    signature = inspect.signature(command)
    parameters = [one.replace(annotation=told[one.name]) for one in signature.parameters.values()]
    run.__signature__ = signature.replace(parameters=parameters)  # type: ignore[attr-defined]
    return run


def _annotation(hint: Any) -> Any:
    kind, declared = get_args(hint)
    told: dict[str, Any] = {"metavar": declared.metavar, "help": escape(declared.help or "")}
    told |= {"show_default": declared.show_default}
    if (choices := declared.choices) is not None:
        told["autocompletion"] = lambda incomplete: [one for one in choices() if one.startswith(incomplete)]
    if isinstance(declared, Option):
        return Annotated[kind, typer.Option(*declared.names, **told)]
    assert isinstance(declared, Argument)
    return Annotated[kind, typer.Argument(**told)]
