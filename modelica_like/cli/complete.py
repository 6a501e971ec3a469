"""The complete command line: Typer shows help and errors from the declarations of the commands."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import Annotated, Any, get_args, get_type_hints

import typer
from rich.markup import escape

from modelica_like.cli.declare import Argument, Option, WrongUse


def application(commands: dict[str, Callable[..., None]]) -> typer.Typer:
    """Return the application with these commands, in this order."""
    app = typer.Typer(
        help="Acausal drive-train models: check, simulate, analyse and export netlists.",
        no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False,
    )  # fmt: skip
    for name, command in commands.items():
        app.command(name)(_for_typer(command))
    return app


def _for_typer(command: Callable[..., None]) -> Callable[..., None]:
    hints = get_type_hints(command, include_extras=True)
    told = {name: _annotation(hint) if name != "return" else hint for name, hint in hints.items()}

    @functools.wraps(command)
    def run(*arguments: Any, **options: Any) -> None:
        try:
            command(*arguments, **options)
        except WrongUse as error:
            raise typer.BadParameter(str(error), param_hint=error.option) from None

    run.__annotations__, run.__doc__ = told, escape(command.__doc__ or "")
    signature = inspect.signature(command)
    parameters = [one.replace(annotation=told[one.name]) for one in signature.parameters.values()]
    run.__signature__ = signature.replace(parameters=parameters)  # type: ignore[attr-defined]
    return run


def _annotation(hint: Any) -> Any:
    kind, declared = get_args(hint)
    told = {"metavar": declared.metavar, "help": escape(declared.help or ""), "show_default": declared.show_default}
    if isinstance(declared, Option):
        return Annotated[kind, typer.Option(*declared.names, **told)]
    assert isinstance(declared, Argument)
    return Annotated[kind, typer.Argument(**told)]
