"""The sections of a netlist and of other files: the form that each must have."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Literal, get_args

from modelica_like.errors import (
    ModelicaLikeError,
    NetlistError,
    Source,
    UnitError,
    unknown_name,
)
from modelica_like.language.units import parse_unit, to_si
from modelica_like.netlist.locate import Lines
from modelica_like.netlist.optimization import OPTIMIZE, tolerances

StartKind = Literal["given", "rest", "steady"]
"""Replacement of missing start values."""
OnChattering = Literal["stop", "slide", "rest"]
"""What happens where events follow each other without end."""
Check = Callable[[str, Any], Any]
"""Returns an entry with the key `section.name`, if it has the right form."""
Reader = Callable[[str, Any, Lines, list[ModelicaLikeError]], Any]
"""Returns a section; errors of its entries are appended."""


def read_sections(
    data: Mapping[str, Any], what: str, readers: Mapping[str, Reader], lines: Lines, errors: list[ModelicaLikeError]
) -> dict[str, Any]:
    """Read the sections of a file, each by its reader.

    Args:
        data: the file's content.
        what: name for messages, such as `A netlist`.
        readers: by the name of the section.
        lines: of its keys.
        errors: list for errors, with their places.
    """
    read: dict[str, Any] = {}
    for key, value in data.items():
        try:
            if key not in readers:
                sections = ", ".join(readers)
                raise unknown_name(f"{what} has no entry '{key}'", key, readers, f" It has {sections}.")
            read[key] = readers[key](key, value, lines, errors)
        except ModelicaLikeError as error:
            errors.append(_placed(error, lines.source(key)))
    return read


def _placed(error: ModelicaLikeError, source: Source) -> ModelicaLikeError:
    error.where = error.where or (source,)
    return error


def whole(check: Check) -> Reader:
    """Return the reader of a section that is one entry."""
    return lambda key, value, lines, errors: check(key, value)


def _table(key: str, value: Any) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise NetlistError(f"{key} must be a table: [{key}].")
    return value


def each(check: Check, flat: bool = False) -> Reader:
    """Return the reader of a table whose entries have one form; `flat` joins dotted keys to paths."""

    def read(key: str, value: Any, lines: Lines, errors: list[ModelicaLikeError]) -> dict[str, Any]:
        result: dict[str, Any] = {}
        entries = flattened(_table(key, value)) if flat else _table(key, value)
        for name, entry in entries.items():
            try:
                result[name] = check(f"{key}.{name}", entry)
            except ModelicaLikeError as error:
                errors.append(_placed(error, lines.source(key, name)))
        return result

    return read


def flattened(table: Mapping[str, Any], before: str = "") -> dict[str, Any]:
    """Join dotted keys, which TOML reads as tables in tables."""
    flat: dict[str, Any] = {}
    for name, value in table.items():
        flat.update(flattened(value, f"{before}{name}.") if isinstance(value, dict) else {f"{before}{name}": value})
    return flat


def _value(key: str, value: Any) -> Any:
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise NetlistError(f'{key} must be a number or a text with a unit, such as "10 N.m".')
    return value


def as_text(key: str, value: Any) -> str:
    """Return an entry that is a text.

    Raises:
        NetlistError: it is not.
    """
    if not isinstance(value, str):
        raise NetlistError(f"{key} must be a text.")
    return value


def _names(key: str, value: Any) -> list[str]:
    if not isinstance(value, list) or not all(isinstance(name, str) for name in value):
        raise NetlistError(f"{key} must be a list of names.")
    return value


def _ends(key: str, value: Any) -> list[str]:
    if isinstance(value, list) and any(isinstance(entry, list) for entry in value):
        raise NetlistError(
            f"{key} must be a list of names.",
            advice="Write a separate entry for every list.",
        )
    if len(_names(key, value)) < 2:
        raise NetlistError(f"{key} must name at least two ends.")
    return value


def check_part(key: str, value: Any) -> Any:
    """Return the table of a part, or of several, if it has the form of one.

    Raises:
        NetlistError: it has another form.
    """
    tables = value if isinstance(value, list) and value else [value]
    for table in tables:
        if not isinstance(table, dict):
            raise NetlistError(f'{key} must be a table: {{ is = "Inertia", J = "1 kg.m2" }}.')
        if not isinstance(table.get("is"), str):
            raise NetlistError(f"{key} has no type.", advice='Give its type, such as is = "Inertia".')
        _whole(100_000)(f"{key}: count", table.get("count", 1))
    return value


def options(checks: Mapping[str, Check]) -> Reader:
    """Return the reader of a section whose entries differ in form, such as [simulate]."""

    def check(key: str, value: Any) -> Any:
        section, _, name = key.partition(".")
        if name not in checks:
            raise unknown_name(f"[{section}] has no '{name}'", name, checks, f" It has {', '.join(checks)}.")
        return checks[name](key, value)

    return each(check)


def duration(key: str, value: Any) -> Any:
    """Return a time as written; a UnitError, ValueOutOfRange or NetlistError if it is none, or not positive."""
    seconds = to_si(value, parse_unit("s"), key)
    if seconds <= 0:
        raise NetlistError(f"{key} = {value} must be positive.")
    return value


def _moment(key: str, value: Any) -> Any:
    to_si(value, parse_unit("s"), key)
    return value


def _one_of(kind: Any) -> Check:
    """Return the check of a word."""

    def check(key: str, value: Any) -> str:
        if value not in get_args(kind):
            raise NetlistError(f"{key} = {value!r} must be {' or '.join(get_args(kind))}.")
        return value

    return check


def _rtol(key: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not 1e-14 <= value <= 0.1:
        raise NetlistError(f"{key} = {value} must be a number from 1e-14 to 0.1.")
    return float(value)


def _whole(most: int) -> Check:
    """Return the check of a count."""

    def check(key: str, value: Any) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= most:
            raise NetlistError(f"{key} = {value} must be a whole number from 1 to {most}.")
        return value

    return check


def _unit_text(key: str, value: Any) -> str:
    try:
        return str(parse_unit(as_text(key, value)))
    except UnitError as error:
        what = f"{key}: {error.what}"
        raise UnitError(what, advice=error.advice, word=error.word, instead=error.instead) from None


_OPTIONS: Mapping[str, Check] = {
    "from": _moment, "until": duration, "start": _one_of(StartKind), "rtol": _rtol, "points": _whole(1_000_000),
    "on_chattering": _one_of(OnChattering),
}  # fmt: skip
READERS: Mapping[str, Reader] = {
    "name": whole(as_text),
    "description": whole(as_text),
    "parameters": each(_value),
    "parts": each(check_part),
    "series": each(_ends),
    "connect": each(_ends),
    "start": each(_value, flat=True),
    "guess": each(_value, flat=True),
    "free": whole(_names),
    "expose": each(as_text),
    "simulate": options(_OPTIONS),
    "display": each(_unit_text, flat=True),
    "sizing": whole(as_text),
    "optimize": options(OPTIMIZE),
    "tolerances": whole(tolerances),
    "modelica": options({"libraries": _names}),
}
"""Of the sections of a netlist."""
