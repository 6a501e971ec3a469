"""A drive that was read from a file is written with the comments, the order and the layout of that file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path as File
from typing import Any

from modelica_like.edit.sheet import Sheet
from modelica_like.edit.tree import joined
from modelica_like.errors import ModelicaLikeError
from modelica_like.garbage import without_garbage_search
from modelica_like.language import Assembly
from modelica_like.language.inside import inside
from modelica_like.netlist.outline import Path
from modelica_like.netlist.read import loads
from modelica_like.netlist.write import sections

_GONE = object()


@without_garbage_search()
def rewritten(drive: Assembly, path: str | File) -> str | None:
    """Return the text from which a drive was read, with what has changed since.

    Args:
        drive: read from a netlist.
        path: of the file to be written.

    Returns:
        None if what has changed cannot be written so; then all of the drive is to be written anew.

    Raises:
        NetlistError: a netlist cannot contain the drive.
    """
    origin = File(inside(drive).origin)
    wanted, moved = sections(drive, origin.parent), sections(drive, File(path).parent)
    sheet = Sheet(inside(drive).text, str(origin))
    try:
        _change(sheet, sections(loads(sheet.text, str(origin)), origin.parent), wanted)
        changed = sheet.text != inside(drive).text
        if changed and sections(loads(sheet.text, str(origin)), origin.parent) != wanted:
            return None
        wanted[""]["name"] = sheet.data.get("name", File(path).stem)
        _change(sheet, wanted, moved)
    except ModelicaLikeError:
        return None
    return sheet.text


def _change(sheet: Sheet, before: Mapping[str, Any], wanted: Mapping[str, Any]) -> None:
    for key, value in _differences(before, wanted):
        place = _place(sheet, key)
        if value is _GONE:
            sheet.delete([place])
        else:
            sheet.write(place, value)
    sheet.commit()


def _place(sheet: Sheet, key: Path) -> Path:
    """Return the key of the file that stands for one of the plain form; a start value may stand in its part."""
    tables = ("start", "parts") if key[0] == "start" else (str(key[0]),)
    path = joined(key[1:])
    return next((at for table in tables if (at := sheet.given.get((table, path)))), key)


def _differences(before: Mapping[str, Any], wanted: Mapping[str, Any], path: Path = ()) -> Iterator[tuple[Path, Any]]:
    """Yield the keys that differ with their new values; a part of another type differs as a whole."""
    for name in dict.fromkeys([*before, *wanted]):
        old, new, here = before.get(name, _GONE), wanted.get(name, _GONE), (*path, name) if name else path
        tables = isinstance(old, dict) and isinstance(new, dict)
        if tables and (len(here) < 2 or old.get("is") == new.get("is")):
            yield from _differences(old, new, here)
        elif old != new or type(old) is not type(new):
            yield here, new
