"""The operation that makes an assembly with a file of its own of several parts."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import groupby
from pathlib import Path as File
from typing import Any

from modelica_like.arguments import checked
from modelica_like.edit import asked
from modelica_like.edit import references as ref
from modelica_like.edit.parts import assembly, is_output, require_new, require_part, side
from modelica_like.edit.sheet import Sheet
from modelica_like.edit.values import part_texts
from modelica_like.errors import DuplicateName, NetlistError
from modelica_like.language import Connector
from modelica_like.language.assembly import end_at
from modelica_like.netlist import spell
from modelica_like.netlist.further import head
from modelica_like.netlist.outline import Entry, Path, Span


@checked
def group(sheet: Sheet, names: Sequence[str], name: str, *, file: str | None = None) -> None:
    """Put parts into a netlist of their own, which is used as one part; the results stay the same.

    Ends that are joined to other parts become outer connectors, parameters that the parts use become its parameters.
    Start values and units of display stay in this netlist.

    Args:
        sheet: the netlist.
        names: of the parts.
        name: of the new part.
        file: name of its file, beside the netlist; by default the name of the part with `.toml`.

    Raises:
        UnknownName: there is no such part.
        NetlistError, DuplicateName: the name or file cannot be a new one.
        ModelicaLikeError: a part is wrong.
    """
    if not names:
        raise NetlistError("No part is to be grouped.", advice="Name at least one.")
    for part in names:
        require_part(sheet, part)
    require_new(sheet, name)
    file = file or f"{name}.toml"
    path = File(sheet.file).resolve().parent / file
    if File(file).name != file or not file.endswith(".toml") or not file.isprintable():
        raise NetlistError(f"{file!r} is no name for a netlist beside this one.", advice=f"Write {name}.toml.")
    try:
        exists = path in sheet.files or path.exists()
    except OSError as error:
        raise NetlistError(f"'{file}' cannot be the name of a file: {error.strerror}.") from None
    if exists:
        raise DuplicateName(f"'{file}' exists already.", advice="Name another file.")
    sheet.files[path] = _Group(sheet, [part for part in sheet.table("parts") if part in names], name, path).split()


class _Group:
    """Moves parts from one netlist to another."""

    def __init__(self, outer: Sheet, names: list[str], name: str, file: File) -> None:
        self.outer, self.names, self.name, self.file = outer, names, name, file
        self.drive = assembly(outer, names)
        self.ports: dict[str, str] = {}
        self.inner: dict[str, dict[str, Any]] = {"parameters": {}, "series": {}, "connect": {}, "expose": {}}
        self.overridden: list[Path] = []
        self.given = {"is": spell.quoted(f"./{file.name}")}

    def split(self) -> str:
        """Change the outer netlist, and return the text of the inner one."""
        outer = self.outer
        for entry, text, places in ref.formulas(outer):
            self._split_formula(entry, text, places)
        self._split_wires()
        free = ref.drop_ends(outer, self._has, "free")
        for entry, end in ref.exposed(outer):
            if self._has(end):
                outer.rewrite(entry.value, f"{self.name}.{self._port(end)}")
        for key in ref.keys(outer, *ref.KEYED):
            if self._has(key.name) and ref.is_path(key):
                outer.rename(key.span, f"{self.name}.{key.name}")
        asked.rename(outer, lambda path: f"{self.name}.{path}" if self._has(path) else path)
        parts = [(name, *part_texts(outer, name, name)) for name in self.names]
        table = f"{{ {', '.join(f'{key} = {text}' for key, text in self.given.items())} }}"
        if ("parts", self.names[0]) in outer.tree.entries and parts[0][1]:
            outer.put_behind(("parts", self.names[0]), f"{spell.key(self.name)} = {table}\n")
        else:
            outer.put(("parts", self.name), table)
        text = self._written(parts, free)
        outer.delete([("parts", name) for name in self.names])
        outer.commit()
        return text

    def _written(self, parts: Iterable[tuple[str, str, str]], free: list[str]) -> str:
        """Return the inner netlist; its parts are as they were written."""
        data, tables = self.outer.table("parts"), [table for _, _, table in parts if table]
        inline = [
            text or f"{spell.key(name)} = {spell.value(data[name])}\n" for name, text, table in parts if not table
        ]
        top = f"name = {spell.quoted(self.name)}\n" + (f"free = {spell.value(free)}\n" if free else "")
        pieces = [top, *(["[parts]\n" + "".join(inline)] if inline else []), *tables]
        sheet = Sheet("\n".join(pieces), str(self.file))
        sheet.delete(self.overridden)
        self.inner["expose"] = {port: end for end, port in self.ports.items()}
        for section, entries in self.inner.items():
            for key, value in entries.items():
                sheet.write((section, key), value)
        sheet.commit()
        return sheet.text

    def _has(self, path: str) -> bool:
        return head(path) in self.names

    def _port(self, end: str, name: str = "") -> str:
        """Return the outer connector that stands for an end, which may be new."""
        if end not in self.ports:
            taken = {*self.names, *self.ports.values(), *self.outer.table("parameters")}
            wanted = name or end.replace(".", "_").replace("[", "_").replace("]", "")
            numbered = (f"{wanted}_{k}" if k > 1 else wanted for k in range(1, len(taken) + 2))
            self.ports[end] = next(candidate for candidate in numbered if candidate not in taken)
        return self.ports[end]

    # -- connections -------------------------------------------------------------------------------------------------

    def _split_wires(self) -> None:
        mixed = [line for line in ref.lines(self.outer, "series") if any(map(self._has, line.names))]
        # The series in which the new part stands has the ends that every series asks for.
        mixed.sort(key=lambda line: [inside for inside, _ in groupby(line.names, self._has)].count(True) > 1)
        for line in mixed:
            self._split_series(line, claim=line is mixed[0])
        for line in ref.lines(self.outer, "connect"):
            self._split_connection(line)

    def _split_series(self, line: ref.Line, claim: bool) -> None:
        runs = [
            (inside, list(run)) for inside, run in groupby(range(len(line.names)), lambda k: self._has(line.names[k]))
        ]
        claim = claim and len(runs) > 1 and [inside for inside, _ in runs].count(True) == 1
        pieces: list[list[int]] = [[]]
        for inside, run in runs:
            if not inside:
                pieces[-1] += run
                continue
            if len(run) > 1:
                key = str(line.path[1])
                key = key if key not in self.inner["series"] else f"{key}_{len(self.inner['series']) + 1}"
                self.inner["series"][key] = [line.names[k] for k in run]
            if self._join_run(line, run, claim):
                self.outer.rewrite((line.array.items or [])[run[0]], self.name)
                pieces[-1].append(run[0])
            else:
                pieces.append([])
        ref.cut(self.outer, line, pieces)

    def _join_run(self, line: ref.Line, run: list[int], claim: bool) -> bool:
        """Give the ends of parts that follow each other outer connectors; return whether a series finds them."""
        ports: list[tuple[str, str, bool]] = []
        for outlet, place, beside in ((False, run[0], run[0] - 1), (True, run[-1], run[-1] + 1)):
            if 0 <= beside < len(line.names):
                end, usual = side(self.outer, line.names[place], outlet).path, "flange_b" if outlet else "flange_a"
                ports.append((self._port(end, usual if claim else ""), line.names[beside], outlet))
        if claim and all(port == ("flange_b" if outlet else "flange_a") for port, _, outlet in ports):
            return True
        for port, neighbour, outlet in ports:
            ends = [side(self.outer, neighbour, not outlet).path, f"{self.name}.{port}"]
            self.outer.write(
                ("connect", ref.unused(self.outer, "connect", f"{self.name}_{port}_{head(neighbour)}")), ends
            )
        return False

    def _split_connection(self, line: ref.Line) -> None:
        ends = [end for end in line.names if self._has(end)]
        inputs = self._are_inputs(ends)
        if len(ends) > 1 and (not inputs or len(ends) == len(line.names)):
            self.inner["connect"][str(line.path[1])] = ends
        if len(ends) == len(line.names):
            self.outer.delete([line.path])
        elif ends:
            outside = ends if inputs else [next((end for end in ends if is_output(self.outer, end)), ends[0])]
            gone = [k for k, end in enumerate(line.names) if end in ends and end not in outside]
            for item, end in zip(line.array.items or [], line.names, strict=True):
                if end in outside:
                    self.outer.rewrite(item, f"{self.name}.{self._port(end)}")
            self.outer.delete_items(line.array, gone)

    def _are_inputs(self, ends: list[str]) -> bool:
        """Return whether ends are signals that come from outside."""
        connectors = any(isinstance(end_at(self.drive, end), Connector) for end in ends)
        return not connectors and not any(is_output(self.outer, end) for end in ends)

    # -- values ------------------------------------------------------------------------------------------------------

    def _split_formula(self, entry: Entry, text: str, places: list[Span]) -> None:
        """Rename the parts in a formula; one that uses what stays outside is given from there."""
        new = ref.renamed(text, places, lambda path: f"{self.name}.{path}" if self._has(path) else path)
        if entry.path[0] != "parts" or entry.path[1] not in self.names:
            if new != text:
                self.outer.rewrite(entry.value, new)
            return
        used, names = dict[str, Any](), [head(text[slice(*place)]) for place in places]
        parameters = self.outer.table("parameters")
        if all(self._has(name) or self._within(name, used) for name in names):
            self.inner["parameters"] = {
                key: parameters[key] for key in parameters if key in used | self.inner["parameters"]
            }
            self.given |= {spell.key(name): spell.quoted(name) for name in names if name in used}
            return
        self.overridden.append(entry.path)
        for key in self._keys(entry.path):
            self.given[key] = spell.quoted(new)

    def _within(self, name: str, used: dict[str, Any]) -> bool:
        """Return whether a name is a parameter that follows from parameters only, or none of the outer netlist."""
        if name in self.outer.table("parts"):
            return False
        value = self.outer.table("parameters").get(name)
        if value is None or name in used:
            return True
        used[name] = value
        names = [head(value[slice(*place)]) for place in ref.places_in(value)] if isinstance(value, str) else []
        return all(self._within(inner, used) for inner in names)

    def _keys(self, path: Path) -> list[str]:
        """Return the keys by which the outer netlist gives a value: one for each element of an array of equal parts."""
        name, rest = str(path[1]), path[2:]
        table = self.outer.table("parts")[name]
        elements = [name]
        if isinstance(rest[0], int):
            elements, rest = [f"{name}[{rest[0] + 1}]"], rest[1:]
        elif isinstance(table, dict) and "count" in table:
            elements = [f"{name}[{k}]" for k in range(1, table["count"] + 1)]
        return [spell.key(element, *map(str, rest)) for element in elements]
