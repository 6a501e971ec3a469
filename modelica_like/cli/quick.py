"""Reads the words of an ordinary call by a command's declarations."""

from __future__ import annotations

import inspect
import os
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, get_args, get_origin, get_type_hints

from modelica_like.cli.declare import Option

_INTEGER = re.compile(r"-?[0-9]{1,15}")
_NUMBER = re.compile(r"[0-9]{1,30}(\.[0-9]{0,30})?([eE][+-]?[0-9]{1,3})?")


class _Unusual(Exception):
    """Words that only the complete reader can read."""


class _Parameter:
    def __init__(self, name: str, hint: Any, default: Any) -> None:
        kind, self.declared = get_args(hint)
        # A default of None is no value: `X | None` takes an X.
        kinds = [one for one in get_args(kind) if one is not type(None)] if type(None) in get_args(kind) else [kind]
        self.many = get_origin(kinds[0]) is list
        self.kind: type = get_args(kinds[0])[0] if self.many else kinds[0]
        self.name = name
        self.default = default

    def words(self) -> Mapping[str, bool | None]:
        """Return the words for an option, with the value of a flag, or None for one that takes a value."""
        usual = self.name.replace("_", "-")
        names = self.declared.names or (f"--{usual}",)
        if self.kind is not bool:
            return dict.fromkeys(names)
        return dict.fromkeys(names, True) | ({} if self.declared.names else {f"--no-{usual}": False})

    def read(self, text: str) -> Any:
        if self.kind is str:
            return text
        if self.kind is Path and text:
            return Path(text)
        if self.kind is int and _INTEGER.fullmatch(text):
            return int(text)
        if self.kind is float and _NUMBER.fullmatch(text):
            return float(text)
        if get_origin(self.kind) is Literal and text in get_args(self.kind):
            return text
        raise _Unusual


def read(command: Callable[..., None], words: Sequence[str]) -> dict[str, Any] | None:
    """Return the arguments for a command.

    Args:
        command: with `Annotated` parameters.
        words: of the command line, behind the command's name.

    Returns:
        None if the words ask for help, are wrong, or have an unusual form.
    """
    defaults = {name: one.default for name, one in inspect.signature(command).parameters.items()}
    hints = get_type_hints(command, include_extras=True)
    parameters = [_Parameter(name, hints[name], default) for name, default in defaults.items()]
    try:
        return _values(parameters, words)
    except _Unusual:
        return None


def _values(parameters: list[_Parameter], words: Sequence[str]) -> dict[str, Any]:
    if os.name == "nt" and any(set(word) & set("*?[~$%") for word in words):
        raise _Unusual  # patterns and variables that the shell does not expand
    options = [one for one in parameters if isinstance(one.declared, Option)]
    known = {word: (one, flag) for one in options for word, flag in one.words().items()}
    found: dict[str, list[Any]] = {}
    places: list[str] = []
    rest = iter(words)
    for word in rest:
        if not word.startswith("-"):
            places.append(word)
            continue
        name, equals, value = word.partition("=") if word.startswith("--") else (word, "", "")
        if name not in known:
            raise _Unusual
        one, flag = known[name]
        if flag is None:
            value = value if equals else next(rest, "-")
            if value.startswith("-"):
                raise _Unusual
            found.setdefault(one.name, []).append(one.read(value))
        elif equals:
            raise _Unusual
        else:
            found[one.name] = [flag]
    for one in parameters:
        if not isinstance(one.declared, Option) and places:
            taken = len(places) if one.many else 1
            found[one.name], places = [one.read(word) for word in places[:taken]], places[taken:]
    if places:
        raise _Unusual
    return {one.name: _value(one, found.get(one.name)) for one in parameters}


def _value(parameter: _Parameter, found: list[Any] | None) -> Any:
    if found is None:
        if parameter.default is inspect.Parameter.empty:
            raise _Unusual
        return parameter.default
    return found if parameter.many else found[-1]
