"""How commands declare their arguments and options, as metadata of `Annotated`.

Typer shows help and errors, but it loads a validation framework; an ordinary call is read without it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable


class Argument:
    """A value by its position.

    Args:
        names: of an option, with their dashes; by default that of the parameter.
        metavar: name of the value in the help.
        help: description.
        show_default: whether the help shows its default.
        choices: returns the values that a shell completes.
    """

    def __init__(
        self, *names: str, metavar: str | None = None, help: str | None = None, show_default: bool = True,
        choices: Callable[[], Iterable[str]] | None = None,
    ) -> None:  # fmt: skip
        self.names = names
        self.metavar = metavar
        self.help = help
        self.show_default = show_default
        self.choices = choices


class Option(Argument):
    """A value by its name."""


class WrongUse(Exception):
    """An option has an invalid value; shown with the command's usage."""

    def __init__(self, text: str, option: str) -> None:
        super().__init__(text)
        self.option = option
