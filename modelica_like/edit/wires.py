"""Operations on connections and names: parts are inserted, joined, separated, removed and renamed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

from modelica_like.arguments import checked
from modelica_like.edit import asked
from modelica_like.edit import references as ref
from modelica_like.edit.parts import (
    assembly,
    check_connections,
    check_series,
    ends_of,
    is_output,
    part_end,
    require_new,
    require_part,
    side,
)
from modelica_like.edit.sheet import Sheet
from modelica_like.edit.tree import joined
from modelica_like.edit.values import add
from modelica_like.errors import DuplicateName, NetlistError, WrongConnection
from modelica_like.flatten.wiring import Wiring, side_of
from modelica_like.language import Connector, Input, Output
from modelica_like.language import connect as join
from modelica_like.language.assembly import end_at
from modelica_like.netlist.further import head


@checked
def insert(
    sheet: Sheet, name: str, kind: str, *, between: Sequence[str] | None = None, after: str | None = None,
    before: str | None = None, values: Mapping[str, Any] | None = None, **more: Any,
) -> None:  # fmt: skip
    """Put a new part between two that are connected, or into a series behind or before another.

    Args:
        sheet: the netlist.
        name: of the part.
        kind: its type, as `is` has it.
        between: two parts, or their ends, that are connected.
        after: a part; the new one follows it. One in no series begins a new series.
        before: a part; the new one comes before it.
        values: of the new part, by name.
        more: likewise.

    Raises:
        NetlistError: the place is not told, or the two are not connected.
        WrongConnection: the ends of the part do not fit there.
        ModelicaLikeError: the part is wrong.
    """
    given = [place for place in (between, after, before) if place is not None]
    if len(given) != 1 or (between is not None and len(between) != 2):
        advice = 'Write between=("a", "b"), after="a" or before="b"; `add` makes a part that is free.'
        raise NetlistError(f"It is not clear where {name} is to be inserted.", advice=advice)
    for path in between or (str(after or before),):
        require_part(sheet, head(path))
    add(sheet, name, kind, values=values, **more)
    if between is None:
        _beside(sheet, name, after, before)
    elif places := _neighbours(sheet, *between):
        _put(sheet, *places[0], name)
    elif not _in_connection(sheet, name, *between):
        raise NetlistError(
            f"{between[0]} and {between[1]} are not connected, so nothing can be put between them.",
            where=[sheet.source(("parts", head(path))) for path in between],
            advice="Use `connect` after `add`, or name two parts that are connected.",
        )
    sheet.commit()


def _beside(sheet: Sheet, name: str, after: str | None, before: str | None) -> None:
    near = str(after or before)
    for line in ref.lines(sheet, "series"):
        if near in line.names:
            _put(sheet, line, line.names.index(near) + (after is not None), name)
            return
    pair = [near, name] if after is not None else [name, near]
    check_series(sheet, *pair)
    sheet.write(("series", ref.unused(sheet, "series", near)), pair)


def _put(sheet: Sheet, line: ref.Line, place: int, name: str) -> None:
    if place:
        check_series(sheet, line.names[place - 1], name)
    if place < len(line.names):
        check_series(sheet, name, line.names[place])
    sheet.insert_item(line.array, place, name)


def _neighbours(sheet: Sheet, first: str, second: str) -> list[tuple[ref.Line, int]]:
    """Return the series in which two parts, or their ends, follow each other, with the place of the latter."""
    places: list[tuple[ref.Line, int]] = []
    for line in ref.lines(sheet, "series"):
        for place, (left, right) in enumerate(pairwise(line.names), 1):
            if any(_is_end(sheet, f, left, True) and _is_end(sheet, s, right, False)
                   for f, s in ((first, second), (second, first))):  # fmt: skip
                places.append((line, place))
    return places


def _is_end(sheet: Sheet, path: str, name: str, outlet: bool) -> bool:
    if path == name or not path.startswith(f"{name}."):
        return path == name
    return side(sheet, name, outlet).path == path


def _in_connection(sheet: Sheet, name: str, first: str, second: str) -> bool:
    for line in ref.lines(sheet, "connect"):
        ends = [
            next((end for end in line.names if path in (end, end.rpartition(".")[0])), "") for path in (first, second)
        ]
        if not all(ends) or ends[0] == ends[1]:
            continue
        ends.sort(key=lambda end: _upstream(sheet, end), reverse=True)
        inlet, outlet = _two_sides(sheet, name, ends[0])
        wire = [inlet if end == ends[1] else end for end in line.names]
        check_connections(sheet, [wire, [outlet, ends[1]]])
        sheet.rewrite((line.array.items or [])[line.names.index(ends[1])], inlet)
        sheet.write(("connect", ref.unused(sheet, "connect", name)), [outlet, ends[1]])
        return True
    return False


def _upstream(sheet: Sheet, end: str) -> int:
    """Return 1 for the outlet of a part or an output, -1 for an inlet or an input, 0 for what is both or none."""
    owner, name = assembly(sheet, [end]).find(end.rpartition(".")[0]), end.rpartition(".")[2]
    if name in owner.fields:
        return 1 if isinstance(owner.fields[name], Output) else -1
    return side_of(owner.connectors[name])


def _two_sides(sheet: Sheet, name: str, beside: str) -> tuple[str, str]:
    """Return the ends of a new part between signals, or between connectors."""
    if isinstance(end_at(assembly(sheet, [beside]), beside), Connector):
        return side(sheet, name, False).path, side(sheet, name, True).path
    fields = assembly(sheet, [name]).find(name).fields.items()
    inputs = [key for key, field in fields if isinstance(field, Input)]
    outputs = [key for key, field in fields if isinstance(field, Output)]
    if len(inputs) != 1 or len(outputs) != 1:
        what = f"{name} has {len(inputs)} inputs and {len(outputs)} outputs, so it cannot be put into a signal."
        raise WrongConnection(what, advice="Use `add` and `connect`.")
    return f"{name}.{inputs[0]}", f"{name}.{outputs[0]}"


@checked
def connect(sheet: Sheet, first: str, second: str, *, name: str | None = None) -> None:
    """Connect two ends: connectors of one kind, or an output with an input.

    Args:
        sheet: the netlist.
        first: path of an end, such as `ramp.y`.
        second: another one.
        name: of a new line in [connect]; by default those of the two parts.

    Raises:
        NetlistError: they are connected already, or the name is in use.
        WrongConnection: they are of different kinds, or an input would have two sources.
        UnknownName: there is no such end.
    """
    at = {end: [line for line in ref.lines(sheet, "connect") if end in line.names] for end in (first, second)}
    same = [line.path for line in at[first] if line in at[second]]
    same += [line.path for line, _ in _neighbours(sheet, first, second)]
    if same or first == second:
        raise NetlistError(f"{first} and {second} are connected already.", where=[sheet.source(path) for path in same])
    if name is not None and name in sheet.table("connect"):
        where = sheet.source(("connect", name))
        raise NetlistError(f"[connect] has a line '{name}' already.", where=where, advice="Choose another name.")
    known, others = [*at[first], *at[second]], [first, second]
    if bool(at[first]) != bool(at[second]) and name is None:
        line, end = (at[first][0], second) if at[first] else (at[second][0], first)
        check_connections(sheet, [[*line.names, end], *(other.names for other in known[1:])])
        sheet.insert_item(line.array, len(line.names), end)
    else:
        check_connections(sheet, [*(line.names for line in known), others])
        chosen = name or ref.unused(sheet, "connect", "_".join(dict.fromkeys(map(head, others))))
        sheet.write(("connect", chosen), others)
    ref.drop_ends(sheet, lambda end: end in others, "free")
    sheet.commit()


def misfits(sheet: Sheet, end: str) -> dict[str, str]:
    """Return whether each end that is not joined to one can be: "", or a sentence that says why not.

    Args:
        sheet: the netlist, whose parts must all be right.
        end: path of an end.

    Raises:
        UnknownName: there is no such end.
        ModelicaLikeError: a part is wrong.
    """
    drive = assembly(sheet, sheet.table("parts"))
    lines = [line.names for line in ref.lines(sheet, "connect")]
    mine = [line for line in lines if end in line]
    part_end(drive, end)
    pairs = (pair for line in ref.lines(sheet, "series") for pair in pairwise(line.names))
    near = [pair for pair in pairs if head(end) in map(head, pair)]
    joints = [{side(sheet, left, True).path, side(sheet, right, False).path} for left, right in near]
    beside = {path for joint in joints if end in joint for path in joint}
    answer: dict[str, str] = {}
    for path in (f"{name}.{inner}" for name, part in drive.parts.items() for inner in ends_of(part)):
        if path == end or path in beside or any(path in line for line in mine):
            continue
        wiring = Wiring()
        for line in [*mine, *(line for line in lines if path in line), [end, path]]:
            first, *others = (part_end(drive, name) for name in line)
            wiring.add(drive, join(first, *others))
        wiring.check_signal_units()
        answer[path] = wiring.errors[0].what if wiring.errors else ""
    return answer


@checked
def disconnect(sheet: Sheet, first: str, second: str | None = None) -> None:
    """Separate what is connected.

    Args:
        sheet: the netlist.
        first: path of an end; alone, it leaves all its lines in [connect].
        second: another end, which leaves the line of the first; or both are parts, or ends, that follow each other in
            a series, which is cut there.

    Raises:
        NetlistError: they are not connected.
    """
    both = [line for line in ref.lines(sheet, "connect") if first in line.names and second in line.names]
    series = _neighbours(sheet, first, second) if second is not None and not both else []
    if second is None and ref.drop_ends(sheet, lambda end: end == first, "connect"):
        pass
    elif both and len(both[0].names) > 2:
        leaves = first if is_output(sheet, str(second)) else second
        sheet.delete_items(both[0].array, [both[0].names.index(str(leaves))])
    elif both:
        sheet.delete([both[0].path])
    elif series:
        line, place = series[0]
        ref.cut(sheet, line, [range(place), range(place, len(line.names))])
    else:
        what = f"{first} is in no line of [connect]" if second is None else f"{first} and {second} are not connected"
        raise NetlistError(f"{what}, so nothing can be separated.", advice="Name ends, or neighbours in a series.")
    sheet.commit()


@checked
def remove(sheet: Sheet, name: str) -> None:
    """Remove a part with its connections and start values; its neighbours in a series are joined.

    What else uses it is told in the notes.

    Args:
        sheet: the netlist.
        name: of the part.

    Raises:
        UnknownName: there is no such part.
    """
    require_part(sheet, name)
    ref.take_out(sheet, lambda path: head(path) == name)
    ref.drop_ends(sheet, lambda path: head(path) == name, "connect", "free")
    gone = {
        ("parts", name),
        *(key.path for key in ref.keys(sheet, *ref.KEYED) if head(key.name) == name and ref.is_path(key)),
    }
    for entry, end in ref.exposed(sheet):
        if head(end) == name:
            gone.add(entry.path)
            sheet.notes.append(f"The outer connector '{entry.path[1]}' goes: it was {end}.")
    for entry, text, _ in ref.formulas(sheet, name):
        if not any(entry.path[: len(path)] == path for path in gone):
            sheet.notes.append(f"{joined(entry.path[1:])} = '{text}' still uses {name}.")
    sheet.notes += [*asked.users(sheet, name), *ref.in_other_files(sheet, name)]
    sheet.delete(gone)
    sheet.commit()


@checked
def rename(sheet: Sheet, old: str, new: str) -> None:
    """Give a part or a parameter another name; every place of the file that means it follows.

    Args:
        sheet: the netlist.
        old: its name.
        new: its new name.

    Raises:
        UnknownName: there is no such part or parameter.
        NetlistError, DuplicateName: the new name cannot be one, or formulas use it already.
    """
    is_part = old not in sheet.table("parameters")
    if is_part:
        require_part(sheet, old)
    require_new(sheet, new, "part" if is_part else "parameter")
    for entry, text, _ in ref.formulas(sheet, new):
        where, advice = sheet.source(entry.path), "Choose another name."
        raise DuplicateName(f"The formula '{text}' uses the name '{new}' already.", where=where, advice=advice)
    for key in ref.keys(sheet, *(("parts", *ref.KEYED) if is_part else ("parameters",))):
        if head(key.name) == old and ref.is_path(key) if key.path[0] in ref.KEYED else key.name == old:
            sheet.rename(key.span, new + key.name[len(old) :])
    if is_part:
        _rename_ends(sheet, old, new)
        sheet.notes += ref.in_other_files(sheet, old)
    for entry, text, places in ref.formulas(sheet, old):
        sheet.rewrite(entry.value, ref.renamed(text, places, lambda path: new + path[len(old) :]))
    asked.rename(sheet, lambda path: new + path[len(old) :] if head(path) == old else path)
    sheet.commit()


def _rename_ends(sheet: Sheet, old: str, new: str) -> None:
    items = [(line.array.items or [], line.names) for line in ref.lines(sheet, "series", "connect", "free")]
    pairs = [pair for values, names in items for pair in zip(values, names, strict=True)]
    for value, end in [*pairs, *((entry.value, end) for entry, end in ref.exposed(sheet))]:
        if head(end) == old:
            sheet.rewrite(value, new + end[len(old) :])
