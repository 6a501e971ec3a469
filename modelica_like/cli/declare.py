"""How commands declare their arguments and options, as metadata of `Annotated`; `reader.py` reads them."""

from __future__ import annotations

from collections.abc import Callable, Iterable


class Argument:
    """A value by its position.

    Args:
        names: of an option, with their dashes; by default that of the parameter.
        metavar: name of the value in the help.
        help: description.
        choices: returns the values that a shell completes.
    """

    def __init__(
        self, *names: str, metavar: str | None = None, help: str, choices: Callable[[], Iterable[str]] | None = None
    ) -> None:
        self.names = names
        self.metavar = metavar
        self.help = help
        self.choices = choices


class Option(Argument):
    """A value by its name."""
