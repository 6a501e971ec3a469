"""Makes an argparse reader of a command's declarations: values by name, help, and mistakes with the usage."""

from __future__ import annotations

import argparse
import inspect
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, Literal, NoReturn, get_args, get_origin, get_type_hints

from modelica_like.errors import did_you_mean


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


_NONE = inspect.Parameter.empty
_NUMBERS = {int: "a whole number", float: "a number"}
_SAID = {
    "argument ": "Invalid value for ",
    "the following arguments are required: ": "Missing: ",
    "unrecognized arguments: ": "Unexpected: ",
}
"""Beginnings of argparse's messages, with ours."""


class Parameter:
    """A declared parameter of a command.

    Args:
        name: in the command's signature.
        hint: its `Annotated` type.
        default: of the signature.
    """

    def __init__(self, name: str, hint: Any, default: Any) -> None:
        kind, self.declared = get_args(hint)
        # A default of None is no value: `X | None` takes an X.
        kinds = [word for word in get_args(kind) if word is not type(None)] if type(None) in get_args(kind) else [kind]
        self.many = get_origin(kinds[0]) is list
        self.kind: Any = get_args(kinds[0])[0] if self.many else kinds[0]
        self.choices: tuple[str, ...] = get_args(self.kind) if get_origin(self.kind) is Literal else ()
        self.name, self.default, self.required = name, default, default is _NONE
        self.option = isinstance(self.declared, Option)
        value = self.declared.metavar or "|".join(self.choices) or name.upper()
        self.value = value + " …" * self.many
        """How its value is named."""
        self.shown = "" if default in (_NONE, None, False, Path()) else "yes" if default is True else str(default)
        """Its default, if there is one to tell."""

    def words(self) -> tuple[str, ...]:
        """Return the words for an option."""
        usual = self.name.replace("_", "-")
        return self.declared.names or (f"--{usual}", *([f"--no-{usual}"] if self.kind is bool else ()))

    def place(self) -> str:
        """Return how the usage names a value by position."""
        return self.value if self.required else f"[{self.value}]"

    def read(self, text: str) -> Any:
        """Read one value."""
        if self.choices and text not in self.choices:
            choices = ", ".join(f"'{choice}'" for choice in self.choices)
            raise argparse.ArgumentTypeError(f"'{text}' is not one of {choices}.")
        try:
            return text if self.choices else self.kind(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"'{text}' is not {_NUMBERS[self.kind]}.") from None

    def add(self, group: Any) -> None:
        """Declare it to argparse."""
        keywords: dict[str, Any] = {"default": None if self.required else self.default}
        if self.kind is bool:
            kind = "store_true" if self.declared.names else argparse.BooleanOptionalAction  # with --no-…
            action = group.add_argument(self.words()[0], dest=self.name, action=kind, **keywords)
        elif self.option:
            keywords |= {"required": self.required, "action": "append" if self.many else None}
            action = group.add_argument(*self.words(), dest=self.name, metavar=self.value, type=self.read, **keywords)
        else:
            nargs = "*" if self.many else None if self.required else "?"
            action = group.add_argument(self.name, metavar=self.value, nargs=nargs, type=self.read, **keywords)
        required = " Required." if self.option and self.required else ""
        default = f" Default: {self.shown}." if self.shown else ""
        action.help = f"{self.declared.help}{required}{default}".replace("%", "%%")


def parameters(command: Callable[..., None]) -> list[Parameter]:
    """Return the parameters of a command."""
    hints = get_type_hints(command, include_extras=True)
    arguments = inspect.signature(command).parameters.values()
    return [Parameter(argument.name, hints[argument.name], argument.default) for argument in arguments]


def paragraphs(command: Callable[..., None]) -> list[str]:
    """Return the description of a command, each paragraph on one line."""
    return [" ".join(text.split()) for text in inspect.cleandoc(command.__doc__ or "").split("\n\n")]


def reader(name: str, command: Callable[..., None]) -> Reader:
    """Return the reader of a command."""
    declared = parameters(command)
    places, options = [d for d in declared if not d.option], [d for d in declared if d.option]
    result = Reader(name, " ".join(["[OPTIONS]", *(place.place() for place in places)]), paragraphs(command))
    for title, those in ("Arguments", places), ("Options", options):
        group = result.add_argument_group(title)
        for parameter in those:
            parameter.add(group)
    group.add_argument("--help", action="help", help="Show this page.")
    return result


class Reader(argparse.ArgumentParser):
    """Reads words and shows help.

    Args:
        name: of a command, behind that of the program.
        usage: what follows.
        about: paragraphs.
    """

    def __init__(self, name: str, usage: str, about: Sequence[str]) -> None:
        program = "python -m modelica_like" if Path(sys.argv[0]).stem == "__main__" else "modelica-like"
        super().__init__(
            f"{program} {name}".strip(), f"%(prog)s {usage}", "\n\n".join(about).replace("%", "%%"),
            formatter_class=_Page, add_help=False, allow_abbrev=False,
        )  # fmt: skip
        self.color = False  # of newer Pythons
        self._json = False

    def read(self, words: Sequence[str]) -> dict[str, Any]:
        """Return the values by name.

        Raises:
            SystemExit: help is shown (0), or the words are wrong (2).
        """
        self._json = "--json" in words
        given = [*self._ordered(words)]
        return vars(self.parse_args(["--help"] if "--help" in given else given))

    def _ordered(self, words: Sequence[str]) -> Iterator[str]:
        """Yield options as single words, because values may begin with a dash, and then the places."""
        actions, places, rest = self._option_string_actions, [], iter(words)
        for word in rest:
            name, equals, value = word.partition("=") if word.startswith("--") else (word[:2], word[2:], word[2:])
            if word == "--":
                places += rest
            elif word in ("", "-") or word[0] != "-":
                places.append(word)
            elif name not in actions:
                self.error(f"No such option '{name}'{did_you_mean(name, actions) or '.'}")
            elif actions[name].nargs == 0 and equals:
                self.error(f"Option '{name}' does not take a value.")
            elif actions[name].nargs == 0:
                yield word
            elif (value := value if equals else next(rest, None)) is None:
                self.error(f"Option '{name}' requires a value.")
            else:
                yield f"{actions[name].option_strings[0]}={value}"
        yield from [*(["--"] if any(place.startswith("-") for place in places) else ()), *places]

    def error(self, message: str) -> NoReturn:
        """Tell what is wrong with the words, and how they should be."""
        from modelica_like.cli.shared import BAD_INPUT, Page, warn
        from modelica_like.errors import ModelicaLikeError

        for begin, ours in _SAID.items():
            message = ours + message.removeprefix(begin) if message.startswith(begin) else message
        what = message if message[-1] in ".?" else f"{message}."
        warn(f"{what}\n{self.format_usage()}More about it: {self.prog} --help", "red")
        page = Page(json=self._json)
        page.problems.append({**ModelicaLikeError(what).as_json(), "kind": "Usage"})
        page.close()
        raise SystemExit(BAD_INPUT)


class _Page(argparse.HelpFormatter):
    def __init__(self, prog: str, **options: Any) -> None:
        super().__init__(prog, max_help_position=30, **options)

    def add_usage(self, usage: str | None, actions: Any, groups: Any, prefix: str | None = None) -> None:
        super().add_usage(usage, actions, groups, "Usage: ")

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        return "\n\n".join(super(_Page, self)._fill_text(word, width, indent) for word in text.split("\n\n"))

    def _format_action_invocation(self, action: argparse.Action) -> str:
        value = "" if action.nargs == 0 else str(action.metavar or action.dest)
        return f"{', '.join(action.option_strings)} {value}".strip()
