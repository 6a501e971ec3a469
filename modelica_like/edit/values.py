"""Operations on parts and values: what a netlist has, without what joins it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any, cast

from modelica_like.arguments import checked
from modelica_like.edit.parts import assembly, check_connections, require_new, require_part
from modelica_like.edit.references import KEYED, cut_misfits, drop_ends, exposed, formulas, is_path, keys, lines
from modelica_like.edit.sheet import Sheet
from modelica_like.edit.tree import joined
from modelica_like.errors import ModelicaLikeError, NetlistError, UnknownName, did_you_mean
from modelica_like.language import Assembly, Discrete, Variable
from modelica_like.language.assembly import end_at
from modelica_like.netlist import spell
from modelica_like.netlist.further import head
from modelica_like.netlist.outline import Path, Section, decoded
from modelica_like.netlist.sections import READERS, read_sections
from modelica_like.netlist.write import plain


@checked
def add(sheet: Sheet, name: str, kind: str, *, values: Mapping[str, Any] | None = None, **more: Any) -> None:
    """Write a new part, which is not connected.

    Args:
        sheet: the netlist.
        name: of the part.
        kind: its type, as `is` has it.
        values: of the part, by name; those of inner parts by path.
        more: likewise.

    Raises:
        NetlistError, DuplicateName: the name cannot be that of a new part.
        ModelicaLikeError: there is no such type, or a value is wrong.
    """
    require_new(sheet, name)
    pairs = {"is": kind, **_plain({**(values or {}), **more})}
    table = ", ".join(f"{spell.key(*key.split('.'))} = {spell.value(value)}" for key, value in pairs.items())
    sheet.put(("parts", name), f"{{ {table} }}")
    sheet.commit()
    assembly(sheet, [name])


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(inner) for key, inner in cast("Mapping[Any, Any]", value).items()}
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in cast("list[Any]", value)]
    return plain(value)


@checked
def set(sheet: Sheet, path: str, value: Any, *, section: str | None = None) -> None:
    """Give a value: of a parameter, inside a part, at the start, or in another section.

    A start value or mode stays where it stands; a new one goes to [start]. A new name becomes a parameter.

    Args:
        sheet: the netlist.
        path: such as `damper.d`, `mass`, `rotor.w`; the key, if a section is given.
        value: a number, a text with a unit, a formula, a list.
        section: such as `simulate` or `display`; "" for `name`, `description`, `sizing` and `free`.

    Raises:
        UnknownName: there is no such part, value or section.
        ModelicaLikeError: the value is wrong.
    """
    data = _plain(value)
    key = find_key(sheet, path, section) or _new_key(sheet, path, section)
    with _no_new_error(sheet, path, section, key):
        sheet.write(key, data)


@checked
def unset(sheet: Sheet, path: str, *, section: str | None = None) -> None:
    """Remove a value; what still uses a parameter is told in the notes.

    Args:
        sheet: the netlist.
        path: see `set`.
        section: see `set`.

    Raises:
        UnknownName: there is no such value in the netlist.
        NetlistError: a part cannot be without it.
    """
    key = find_key(sheet, path, section)
    if key is None:
        known = sheet.table(section or "parameters")
        where = f"[{section}]" if section else "The netlist"
        raise UnknownName(f"{where} has no value for '{path}'{did_you_mean(path, known) or '.'}")
    if key[0] == "parameters":
        users = [joined(entry.path[1:]) for entry, _, _ in formulas(sheet, path) if entry.path != key]
        sheet.notes += [f"{', '.join(users)} still use{'s' * (len(users) == 1)} {path}."] if users else []
    with _no_new_error(sheet, path, section):
        sheet.delete([key])


def find_key(sheet: Sheet, path: str, section: str | None) -> Path | None:
    """Return the key that gives a value, None if none does; see `set`."""
    tables = [section] if section is not None else ["parts", "start", "guess"] if "." in path else ["parameters"]
    return next((key for table in tables if (key := sheet.given.get((table, path)))), None)


def _new_key(sheet: Sheet, path: str, section: str | None) -> Path:
    if section is not None:
        if section not in ("", *READERS):
            sections = ", ".join(READERS)
            raise UnknownName(
                f"A netlist has no section '{section}'{did_you_mean(section, READERS) or '.'} It has {sections}."
            )
        return (section, path) if section else (path,)
    if "." not in path:
        if path in sheet.table("parts"):
            raise NetlistError(f"'{path}' is a part, and no value.", advice=f"Name one of its values: {path}.….")
        require_new(sheet, path, "parameter")
        return ("parameters", path)
    name = head(path)
    require_part(sheet, name)
    owner_path, _, last = path.rpartition(".")
    try:
        owner = assembly(sheet, [name]).find(owner_path)
    except ModelicaLikeError:
        owner = None  # what is wrong with the part may be what is set right here
    if owner is not None and (last in owner.modes or isinstance(owner.fields.get(last), Variable | Discrete)):
        return ("start", path)
    return (*table_of(sheet, path.partition(".")[0]), *path.split(".")[1:])


def table_of(sheet: Sheet, name: str) -> Path:
    """Return the path of the table of a part, or of an element of an array of different parts.

    Raises:
        UnknownName: there is no such part.
        NetlistError: an array is meant as a whole, or an element of equal ones.
    """
    require_part(sheet, head(name))
    table, place = sheet.table("parts")[head(name)], name.partition("[")[2].rstrip("]")
    where = sheet.source(("parts", head(name)))
    if isinstance(table, list):
        if not place.isdecimal() or not 0 < int(place) <= len(table):
            advice = f"Name one: {head(name)}[1]."
            raise NetlistError(f"{name} is an array of {len(table)} different parts.", where=where, advice=advice)
        return ("parts", head(name), int(place) - 1)
    if place:
        advice = f"Write {head(name)} to change all of them."
        raise NetlistError(f"{name} is one of equal parts, which share their values.", where=where, advice=advice)
    return ("parts", name)


def _errors(sheet: Sheet, path: str, section: str | None, key: Path = ()) -> list[ModelicaLikeError]:
    """Return what is wrong with a part, or with a section."""
    errors: list[ModelicaLikeError] = []
    is_in_part = section is None and "." in path
    name = path if section == "" else section or "parameters"
    if name in sheet.data and not is_in_part:
        read_sections({name: sheet.data[name]}, "A netlist", READERS, sheet.lines, errors)
    try:
        if is_in_part:
            start = sheet.table("start") if key[:1] == ("start",) else {}
            assembly(sheet, [path], {given: value for given, value in start.items() if given == path})
        elif name == "parameters" and path in sheet.table(name) and not errors:
            Assembly("netlist").add_parameter(path, sheet.table(name)[path])
    except ModelicaLikeError as error:
        error.where = error.where if is_in_part else (sheet.source((name, path)),)
        errors += getattr(error, "errors", [error])
    return errors


@contextmanager
def _no_new_error(sheet: Sheet, path: str, section: str | None, key: Path = ()) -> Iterator[None]:
    """Refuse a change by which something else is wrong than before."""
    before = len(_errors(sheet, path, section))
    yield
    sheet.commit()
    if len(after := _errors(sheet, path, section, key)) > before:
        raise after[-1]


def part_texts(sheet: Sheet, name: str, new: str) -> tuple[str, str]:
    """Return the lines of a part in [parts], and its own tables, as written, with another name."""
    copies: list[str] = []
    tables: list[str] = []
    for key in keys(sheet, "parts"):
        if key.name != name:
            continue
        if key.entry is None:
            section = next(section for section in sheet.tree.sections if section.names[1:2] == [key.span])
            start, end = section.start, section.entries[-1].value.end if section.entries else section.end - 1
        elif isinstance(key.entry.owner, Section) and key.span == key.entry.names[0]:
            start, end = sheet.tree.line_start(key.entry.start), key.entry.value.end
        else:
            continue
        text = sheet.text[start : key.span[0]] + spell.key(new) + sheet.text[key.span[1] : sheet.tree.line_end(end)]
        (copies if key.entry else tables).append(text.replace("\r\n", "\n").rstrip("\n") + "\n")
    return "".join(copies), "\n".join(tables)


@checked
def duplicate(sheet: Sheet, name: str, new: str) -> None:
    """Copy a part with its values, start values and units of display; the copy is not connected.

    Args:
        sheet: the netlist.
        name: of the part.
        new: name of the copy.

    Raises:
        UnknownName: there is no such part.
        NetlistError, DuplicateName: the name cannot be that of a new part.
    """
    require_part(sheet, name)
    require_new(sheet, new)
    copies, tables = part_texts(sheet, name, new)
    if copies or tables:
        sheet.put_behind(("parts", name), copies + ("\n" if copies and tables else "") + tables)
    else:
        sheet.write(("parts", new), sheet.table("parts")[name])
    for key in keys(sheet, *KEYED):
        if key.entry is not None and head(key.name) == name and is_path(key):
            copy = (key.path[0], new + str(key.path[1])[len(name) :], *key.path[2:])
            sheet.put(copy, sheet.text[key.entry.value.start : key.entry.value.end])
    sheet.commit()


@checked
def replace(sheet: Sheet, name: str, kind: str, *, values: Mapping[str, Any] | None = None, **more: Any) -> None:
    """Give a part another type; values, connections and start values that the new type has stay, others go.

    What goes is told in the notes.

    Args:
        sheet: the netlist.
        name: of the part, or of an element of an array of different parts.
        kind: the new type, as `is` has it.
        values: of the part, by name, which replace those that it has.
        more: likewise.

    Raises:
        UnknownName: there is no such part or type.
        ModelicaLikeError: a new value is wrong.
    """
    base = table_of(sheet, name)
    new = {"is": kind, **_plain({**(values or {}), **more})}
    _keep_values(sheet, name, base, new)
    for key, value in new.items():
        sheet.write((*base, *key.split(".")), value)
    sheet.commit()
    assembly(sheet, [name])
    _keep_ends(sheet, name)
    _keep_keys(sheet, name)
    sheet.commit()


def _keep_values(sheet: Sheet, name: str, base: Path, new: Mapping[str, Any]) -> None:
    """Remove the values that the new type does not take, one by one, because one may depend on another."""
    part = head(name)
    table: Any = sheet.table("parts")[part]
    table = table[base[2]] if len(base) > 2 and isinstance(base[2], int) else table
    kept = dict(new)
    assembly(sheet, [part], tables={part: kept})
    for key, value in table.items():
        if key in kept or key == "count":
            continue
        try:
            assembly(sheet, [part], tables={part: {**kept, key: value}})
            kept[key] = value
        except ModelicaLikeError as error:
            sheet.notes.append(f"{name}.{key} goes: {error.what}")
            sheet.delete([(*base, key)])


def _keep_ends(sheet: Sheet, name: str) -> None:
    """Take the ends that the part does not have, or that do not fit, out of their lines."""
    for line in lines(sheet, "series"):
        if name in line.names:
            cut_misfits(sheet, line, name)
    drive, wrong = assembly(sheet, [name]), list[str]()
    for line in lines(sheet, "connect", "free"):
        for end in (end for end in line.names if head(end) == head(name)):
            try:
                end_at(drive, end)
                if line.path[0] == "connect":
                    check_connections(sheet, [line.names])
            except ModelicaLikeError as error:
                sheet.notes.append(f"{end} leaves [{line.path[0]}]: {error.what}")
                wrong.append(end)
    drop_ends(sheet, lambda end: end in wrong, "connect", "free")


def _keep_keys(sheet: Sheet, name: str) -> None:
    """Remove the start values, units and outer connectors of what the part does not have."""
    drive, gone = assembly(sheet, [name]), list[Path]()
    for key in keys(sheet, *KEYED):
        path = joined(key.path[1:])
        if key.entry is None or head(path) != head(name) or not is_path(key) or "*" in path:
            continue
        owner, _, last = path.rpartition(".")
        value = sheet.text[key.entry.value.start : key.entry.value.end]
        try:
            if key.path[0] != "display":
                assembly(sheet, [name], start={path: decoded(value)})
            elif last not in drive.find(owner).fields:
                raise UnknownName(f"{name} has no variable '{last}' now.")
        except ModelicaLikeError as error:
            sheet.notes.append(f"{path} leaves [{key.path[0]}]: {error.what}")
            gone.append(key.path)
    for entry, end in exposed(sheet):
        if head(end) == head(name):
            try:
                end_at(drive, end)
            except ModelicaLikeError as error:
                sheet.notes.append(f"The outer connector '{entry.path[1]}' goes: {error.what}")
                gone.append(entry.path)
    sheet.delete(gone)
