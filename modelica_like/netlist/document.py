"""The plain data of one netlist file, read from TOML and checked for its form before components are created."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, get_args

from modelica_like.errors import (
    DuplicateName,
    ModelicaLikeError,
    NetlistError,
    Source,
    UnitError,
    did_you_mean,
    raise_together_or_one,
    unknown_name,
)
from modelica_like.language.units import parse_unit, to_si
from modelica_like.netlist.locate import Lines, locate
from modelica_like.netlist.optimization import OPTIMIZE, tolerances
from modelica_like.trust import require_confined

_ENDLESS = re.compile(r"[0-9]{4301}")
MAX_BYTES = 2_000_000
StartKind = Literal["given", "rest", "steady"]
"""Replacement of missing start values."""
OnChattering = Literal["stop", "slide", "rest"]
"""What happens where events follow each other without end."""
Check = Callable[[str, Any], Any]
"""Returns an entry with the key `section.name`, if it has the right form."""
Reader = Callable[[str, Any, Lines, list[ModelicaLikeError]], Any]
"""Returns a section; errors of its entries are appended."""


@dataclass
class Document:
    """One netlist file.

    Attributes:
        lines: of its keys.
        text: as written.
        parts: tables with `is`, or lists of such tables, by name.
        start: fixed start values by path.
        guess: guessed start values by path.
        expose: inner connectors by the name of the outer one.
        simulate: options of a run, as written.
        display: units in which results are shown, by path, pattern or quantity.
        sizing: path of a sizing file, whose checks stand in reports.
        optimize: what is optimised, as written.
        tolerances: how parameters scatter, by path.
        modelica: libraries of Modelica text.
        errors: of entries that have another form, and are left out.
    """

    lines: Lines
    name: str
    text: str = ""
    description: str = ""
    parameters: dict[str, Any] = field(default_factory=dict)
    parts: dict[str, Any] = field(default_factory=dict)
    series: dict[str, list[str]] = field(default_factory=dict)
    connect: dict[str, list[str]] = field(default_factory=dict)
    start: dict[str, Any] = field(default_factory=dict)
    guess: dict[str, Any] = field(default_factory=dict)
    free: list[str] = field(default_factory=list)
    expose: dict[str, str] = field(default_factory=dict)
    simulate: dict[str, Any] = field(default_factory=dict)
    display: dict[str, str] = field(default_factory=dict)
    sizing: str = ""
    optimize: dict[str, Any] = field(default_factory=dict)
    tolerances: dict[str, Any] = field(default_factory=dict)
    modelica: dict[str, list[str]] = field(default_factory=dict)
    errors: list[ModelicaLikeError] = field(default_factory=list)


def read_text(path: Path, *, as_written: bool = False) -> str:
    """Return the text of a netlist file.

    Args:
        path: of the file.
        as_written: whether line breaks of Windows, and a mark of the byte order, are left in it.

    Raises:
        NetlistError: the file is missing, not text, too large, or outside of a folder; see `confined`.
    """
    require_confined(path)
    try:
        if not path.is_file():
            what = "is a folder" if path.is_dir() else "does not exist"
            raise NetlistError(f"The netlist '{path}' {what}.{_neighbours(path)}")
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise NetlistError(f"The netlist '{path}' cannot be read: {error.strerror}.") from None
    if len(data) > MAX_BYTES:
        raise NetlistError(
            f"'{path.name}' is larger than {MAX_BYTES // 10**6} MB, the limit for netlists.", where=Source(str(path))
        )
    if data.startswith(b"PK\3\4"):
        raise NetlistError(
            f"'{path.name}' is an archive, such as an FMU, and no netlist.",
            advice="An FMU is run by run_fmu(…) in Python, and by `compare` and `report` on the command line.",
        )
    try:
        return data.decode() if as_written else plain(data.decode())
    except UnicodeDecodeError as error:
        place = Source(str(path), data.count(b"\n", 0, error.start) + 1)
        raise NetlistError(f"'{path.name}' is not a text file (UTF-8).", where=place) from None


def plain(text: str) -> str:
    """Return a text without the line breaks of Windows and a mark of the byte order."""
    return text.removeprefix("\ufeff").replace("\r\n", "\n")


def _neighbours(path: Path) -> str:
    try:
        names = [file.name for file in path.parent.glob("*.toml")] if path.parent.is_dir() else []
    except OSError:
        names = []
    return did_you_mean(path.name, names).removeprefix(";").replace("did", "Did")


def parse(text: str, file: str) -> Document:
    """Read the text of a netlist and check its form.

    Args:
        text: TOML; see `plain`.
        file: path of the file, for messages.

    Raises:
        NetlistError: the text is not TOML, or does not have the form of a netlist.
        DuplicateName: a name is used twice.
        WiringErrors: several errors.
    """
    document = survey(text, file)
    if document.errors:
        raise raise_together_or_one(document.errors)
    return document


def survey(text: str, file: str) -> Document:
    """Read what has the form of a netlist in a text, and collect the errors of the rest; see `parse`.

    Raises:
        NetlistError, DuplicateName: the text is not TOML.
    """
    written, text = text, plain(text)
    lines = locate(text, file)
    if not text.strip():
        raise NetlistError(
            f"'{Path(file).name}' is empty.", where=Source(file), advice="A netlist has at least one part in [parts]."
        )
    data = parse_toml(text, lines)
    errors: list[ModelicaLikeError] = []
    sections = read_sections(data, "A netlist", READERS, lines, errors)
    document = Document(lines, text=written, **{"name": Path(lines.file).stem, **sections}, errors=errors)
    for name in document.parts.keys() & document.parameters.keys():
        places = (lines.source("parameters", name), lines.source("parts", name))
        errors.append(DuplicateName(f"'{name}' is both a parameter and a part.", where=places))
        del document.parts[name]
    if not document.parts and not errors:
        errors.append(
            NetlistError(f"{document.name} has no parts.", where=Source(lines.file), advice="Declare them in [parts].")
        )
    return document


def parse_toml(text: str, lines: Lines) -> dict[str, Any]:
    """Parse TOML.

    Args:
        text: TOML.
        lines: of the same text, for messages.

    Raises:
        NetlistError: the text is not TOML.
        DuplicateName: a name is used twice.
    """
    try:
        return tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise _not_toml(str(error), lines) from None
    except ValueError:
        number = next((k for k, line in enumerate(lines.text, 1) if _ENDLESS.search(line.replace("_", ""))), 0)
        raise NetlistError("A number has more than 4300 digits.", where=lines.line(number)) from None


def _not_toml(message: str, lines: Lines) -> ModelicaLikeError:
    if lines.repeated:
        path, first, second = lines.repeated[0]
        section, *rest = path
        what = f"'{'.'.join(rest)}' in [{section}]" if rest else f"'{section}'"
        return DuplicateName(f"{what} is declared twice.", where=dict.fromkeys([lines.line(first), lines.line(second)]))
    match = re.search(r"^(.*) \(at (?:line (\d+), column \d+|end of document)\)$", message)
    number = int(match.group(2)) if match and match.group(2) else len(lines.text)
    reason = match.group(1) if match else "nested too deeply"
    place = lines.line(number)
    if match and (key := re.search(r"^Duplicate inline table key '(.*)'$", match.group(1))):
        return DuplicateName(f"{key.group(1)} is given twice.", where=place)
    return NetlistError(f"'{Path(lines.file).name}' is not TOML: {reason[:1].lower()}{reason[1:]}.", where=place)


# --- the form -------------------------------------------------------------------------------------------------------


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
