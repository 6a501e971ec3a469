"""Operations that a hand means: a part put on a line or an end, parts copied as netlist text and pasted."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, cast

from modelica_like.edit import references as ref
from modelica_like.edit.document import apply
from modelica_like.edit.parts import head, side
from modelica_like.edit.parts import part as part_of
from modelica_like.edit.sheet import Sheet
from modelica_like.edit.values import part_texts
from modelica_like.edit.wires import misfits
from modelica_like.errors import ModelicaLikeError, NetlistError, WrongConnection
from modelica_like.netlist import spell

Request = dict[str, Any]
_JOINED = ("series", "connect")
_STARTS = ("start", "guess", "display")


def placed(sheet: Sheet, part: Request, at: Mapping[str, Any]) -> list[Request]:
    """Return the operations that put a new part somewhere.

    Args:
        sheet: the netlist.
        part: `name`, `kind` and `values` of the part.
        at: `line`, two ends between which it is inserted; or `end`, to which it is joined; or nothing.

    Raises:
        WrongConnection: it does not fit there.
        ModelicaLikeError: the part is wrong.
    """
    if "line" in at:
        return [{"op": "insert", **part, "between": list(at["line"])}]
    if "end" not in at:
        return [{"op": "add", **part}]
    end = str(at["end"])
    for outlet, word in ((True, "after"), (False, "before")):
        request = {"op": "insert", **part, word: head(end)}
        if _is_side(sheet, end, outlet) and _works(sheet, request):
            return [request]
    added = apply(sheet.text, {"op": "add", **part}, file=sheet.file, files=sheet.files)
    drawn = Sheet(added.text, sheet.file, sheet.files)
    new = part_of(drawn, part["name"])
    usual = {f"{part['name']}.{name}" for name, connector in new.connectors.items() if not connector.optional}
    fits = sorted(misfits(drawn, end).items(), key=lambda pair: pair[0] not in usual)
    mine = {path: why for path, why in fits if head(path) == part["name"]}
    if (own := next((path for path, why in mine.items() if not why), None)) is None:
        why = next(iter(mine.values()), f"{part['name']} has no ends.")
        raise WrongConnection(why, advice="Put it on another end, or on the sheet.")
    return [{"op": "add", **part}, {"op": "connect", "first": end, "second": own}]


def _is_side(sheet: Sheet, end: str, outlet: bool) -> bool:
    """Tell whether an end is joined to nothing, and the one by which its part is joined in a series."""
    lines = [(line.names, line.path[0]) for line in ref.lines(sheet, "connect", "series")]
    goes_on = any(head(end) in (names[:-1] if outlet else names[1:]) for names, table in lines if table == "series")
    if goes_on or any(end in names for names, table in lines if table == "connect"):
        return False
    try:
        return side(sheet, head(end), outlet).path == end
    except ModelicaLikeError:
        return False  # it has none


def _works(sheet: Sheet, request: Request) -> bool:
    try:
        apply(sheet.text, request, file=sheet.file, files=sheet.files)
    except WrongConnection:
        return False
    return True


def copied(sheet: Sheet, names: Collection[str]) -> str:
    """Return parts as netlist text, with what joins them and their start values.

    Args:
        sheet: the netlist.
        names: of the parts.
    """
    inline, tables = "", ""
    for name in sheet.table("parts"):
        if name in names:
            first, second = part_texts(sheet, name, name)
            inline, tables = inline + first, tables + ("\n" if second else "") + second
    sections = {"parts": inline}
    for section in _JOINED:
        runs = (
            (key, run) for key, line in sheet.table(section).items() if isinstance(line, list)
            for run in _kept(line, names, section)
        )  # fmt: skip
        sections[section] = "".join(f"{spell.key(key)} = {spell.value(run)}\n" for key, run in runs)
    for section in _STARTS:
        entries = sheet.table(section).items()
        kept = ((key, value) for key, value in entries if head(key) in names)
        sections[section] = "".join(f"{spell.key(key)} = {spell.value(value)}\n" for key, value in kept)
    parts = [f"[{name}]\n{lines}" for name, lines in sections.items() if lines]
    return "\n".join([*parts[:1], *([tables.lstrip("\n")] if tables else []), *parts[1:]])


def _kept(line: Sequence[Any], names: Collection[str], section: str) -> Iterator[list[str]]:
    """Yield what stays of a line: of a connection all ends, of a series each piece without a gap."""
    if section == "connect":
        runs = [[str(end) for end in line if head(str(end)) in names]]
    else:
        runs = list[list[str]]([[]])
        for name in map(str, line):
            if head(name) in names:
                runs[-1].append(name)
            elif runs[-1]:
                runs.append([])
    yield from (run for run in runs if len(run) > 1)


def pasted(sheet: Sheet, text: str) -> list[Request]:
    """Return the operations that add what netlist text has; parts whose names are in use get others.

    Args:
        sheet: the netlist.
        text: with sections as `copied` gives them.

    Raises:
        NetlistError: it is no such text.
    """
    given = Sheet(text, str(Path(sheet.file).with_name("what is pasted")))
    parts = given.table("parts")
    if not parts or not all(isinstance(table, dict) and "is" in table for table in parts.values()):
        raise NetlistError(
            "What is pasted has no parts.", advice='Copy parts, or lines such as `a = { is = "Inertia" }` in [parts].'
        )
    taken, new = {*sheet.table("parts"), *sheet.table("parameters"), *sheet.table("expose")}, dict[str, str]()
    for name in parts:
        new[name] = unused(name, taken)
        taken.add(new[name])

    def renamed(path: str) -> str:
        return new.get(head(path), head(path)) + path[len(head(path)) :]

    requests: list[Request] = []
    for name, table in cast("dict[str, dict[str, Any]]", parts).items():
        values = {key: value for key, value in table.items() if key != "is"}
        requests.append({"op": "add", "name": new[name], "kind": table["is"], "values": values})
    for section in _JOINED:
        used = {*sheet.table(section)}
        for key, line in given.table(section).items():
            name = unused(key, used)
            used.add(name)
            value = [renamed(str(end)) for end in line]
            requests.append({"op": "set", "section": section, "path": name, "value": value})
    for section in _STARTS:
        entries = given.table(section).items()
        requests += (
            {"op": "set", "section": section, "path": renamed(key), "value": v}
            for key, v in entries
            if head(key) in new
        )
    return requests


def unused(name: str, taken: Collection[str]) -> str:
    """Return a name that is not in use: J2 after J1, shaft_2 after shaft."""
    stem, mark, digits = re.fullmatch(r"(.*?)(_?)(\d*)", name, re.S).groups()  # type: ignore[union-attr]
    number, mark = (int(digits), mark) if stem and digits else (1, "_")
    stem = stem or name
    while name in taken:
        number += 1
        name = f"{stem}{mark}{str(number).zfill(len(digits))}"
    return name
