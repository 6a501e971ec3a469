"""The plain data of one netlist file, read from TOML and checked for its form before components are created."""

from __future__ import annotations

import re
import tomllib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from modelica_like.errors import (
    DuplicateName,
    ModelicaLikeError,
    NetlistError,
    Source,
    did_you_mean,
    raise_together_or_one,
)
from modelica_like.netlist.locate import Lines, locate
from modelica_like.netlist.sections import READERS, read_sections
from modelica_like.trust import require_confined

_ENDLESS = re.compile(r"[0-9]{4301}")
MAX_BYTES = 2_000_000


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
