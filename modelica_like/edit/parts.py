"""The parts that a netlist names, as components: what they take, where they are joined, and whether that fits."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path as File
from typing import Any

from modelica_like.edit.sheet import Sheet
from modelica_like.edit.tree import joined
from modelica_like.errors import (
    DuplicateName,
    ModelicaLikeError,
    NetlistError,
    UnknownName,
    WrongConnection,
    did_you_mean,
    raise_together_or_one,
)
from modelica_like.flatten.wiring import Wiring
from modelica_like.language import Assembly, Component, Connector, Input, Output, connect
from modelica_like.language.assembly import end_at
from modelica_like.language.fields import require_identifier
from modelica_like.language.formula import CONSTANTS
from modelica_like.netlist.document import Document
from modelica_like.netlist.further import head
from modelica_like.netlist.outline import Path
from modelica_like.netlist.read import assemble
from modelica_like.netlist.sections import check_part


def assembly(
    sheet: Sheet, paths: Iterable[str], start: Mapping[str, Any] | None = None, tables: Mapping[str, Any] | None = None
) -> Assembly:
    """Return a drive that has only the parts with which paths begin, and outer connectors that are paths.

    Args:
        sheet: the netlist.
        paths: of parts or ends.
        start: start values of these parts, by path.
        tables: of parts, by name, instead of those of the netlist.

    Raises:
        ModelicaLikeError: a part does not exist, or is wrong.
    """
    exposed, parts = sheet.table("expose"), {**sheet.table("parts"), **(tables or {})}
    outer = {path: exposed[path] for path in paths if isinstance(exposed.get(path), str)}
    names = dict.fromkeys(head(outer.get(path, path)) for path in paths)
    for name in names:
        require_part(sheet, name)
        try:
            check_part(f"parts.{name}", parts[name])
        except NetlistError as error:
            error.where = (sheet.source(("parts", name)),)
            raise
    document = Document(sheet.lines, str(sheet.data.get("name", "netlist")), parts={n: parts[n] for n in names})
    document.expose, document.start = outer, dict(start or {})
    return assemble(document, File(sheet.file), sheet.files)


def require_part(sheet: Sheet, name: str) -> None:
    """Refuse a name that no part has."""
    parts = sheet.table("parts")
    if name not in parts:
        has = f"It has {', '.join(parts)}." if parts else "It has none."
        where = sheet.source(("parts",))
        raise UnknownName(f"The netlist has no part '{name}'{did_you_mean(name, parts) or '.'} {has}", where=where)


def require_new(sheet: Sheet, name: str, what: str = "part") -> None:
    """Refuse the name of a new part or parameter that cannot be one."""
    try:
        require_identifier(name, "")
    except ModelicaLikeError as error:
        raise NetlistError(f"'{name}' is no name for a {what}.", advice=error.advice) from None
    for section in ("parts", "parameters", "expose"):
        if name in sheet.table(section):
            kind = {"parts": "a part", "parameters": "a parameter", "expose": "an outer connector"}[section]
            raise DuplicateName(f"The netlist has {kind} '{name}' already.", where=sheet.source((section, name)))
    if name in CONSTANTS:
        raise DuplicateName(f"'{name}' is no name for a {what}: it is a constant of formulas.")
    if hasattr(Component, name):
        raise DuplicateName(f"'{name}' is no name for a {what}: every component has something of this name.")


def part(sheet: Sheet, name: str) -> Component:
    """Return a part; of an array, its first element."""
    drive = assembly(sheet, [name])
    return drive.find(name if name in drive.parts else f"{name}[1]")


def owner_of(sheet: Sheet, path: Path) -> Component | None:
    """Return the component to which a key in [parts] or [start] belongs; None if it cannot be created."""
    names = joined(path[1:])
    name, owner = head(names), names.rpartition(".")[0]
    table = sheet.table("parts").get(name)
    for tables in ({}, {name: {"is": table.get("is")}} if isinstance(table, dict) else {}):
        with suppress(ModelicaLikeError):
            drive = assembly(sheet, [name], tables=tables)
            return drive.find(f"{owner}[1]" if owner == name and owner not in drive.parts else owner)
    return None


def side(sheet: Sheet, name: str, outlet: bool) -> Connector:
    """Return the connector by which a part, or an array of parts, is joined in a series."""
    drive = assembly(sheet, [name])
    elements = [path for path in drive.parts if head(path) == name and path != name]
    component = drive.find((elements[-1] if outlet else elements[0]) if elements else name)
    return component.outlet_connector() if outlet else component.inlet_connector()


def fit(sheet: Sheet, left: str, right: str) -> bool:
    """Return whether two parts can follow each other in a series; parts that cannot be created can."""
    return _holds((UnknownName, WrongConnection), check_series, sheet, left, right)


def joins(sheet: Sheet, ends: Sequence[str]) -> bool:
    """Return whether ends make a connection; ends of parts that cannot be created do."""
    return _holds((WrongConnection,), check_connections, sheet, [ends])


def _holds(refusals: tuple[type[ModelicaLikeError], ...], check: Callable[..., None], *args: Any) -> bool:
    with suppress(ModelicaLikeError):
        try:
            check(*args)
        except refusals:
            return False
    return True


def check_series(sheet: Sheet, left: str, right: str) -> None:
    """Refuse parts that cannot follow each other."""
    check_connections(sheet, [[side(sheet, left, True).path, side(sheet, right, False).path]])


def check_connections(sheet: Sheet, lines: Sequence[Sequence[str]]) -> None:
    """Refuse connections of what does not fit."""
    drive, wiring = assembly(sheet, dict.fromkeys(end for line in lines for end in line)), Wiring()
    for line in lines:
        first, *others = (part_end(drive, path) for path in line)
        wiring.add(drive, connect(first, *others))
    wiring.check_signal_units()
    if wiring.errors:
        raise raise_together_or_one(wiring.errors)


def is_output(sheet: Sheet, end: str) -> bool:
    """Return whether an end is the output of a part."""
    at = end_at(assembly(sheet, [end]), end)
    return not isinstance(at, Connector) and isinstance(at.owner.fields[at.name], Output)


def part_end(drive: Assembly, path: str) -> Any:
    """Return the end at a path.

    Raises:
        WrongConnection: it is a part.
        UnknownName: there is none.
    """
    if path in drive.parts:
        ends = [name for name, connector in drive.find(path).connectors.items() if not connector.optional]
        example = f': "{path}.{ends[0]}".' if ends else "."
        raise WrongConnection(f"'{path}' is a part, and ends of parts are connected.", advice=f"Name one{example}")
    return end_at(drive, path)


def ends_of(part: Component) -> list[str]:
    """Return the names of the connectors and signals of a part."""
    return [*part.connectors, *(name for name, field in part.fields.items() if isinstance(field, Input | Output))]
