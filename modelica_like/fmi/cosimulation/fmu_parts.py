"""Netlists with FMUs as parts: all other parts become another FMU, and all FMUs run together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from modelica_like.errors import (
    ModelicaLikeError,
    NetlistError,
    UnknownName,
    did_you_mean,
    raise_together_or_one,
    unknown_name,
)
from modelica_like.fmi.cosimulation.described import DescribedFmu, check_units, described
from modelica_like.fmi.cosimulation.system import Link, Port, Settings, System, Unit, check_system, find_bonds
from modelica_like.fmi.export import export_fmu
from modelica_like.language import Assembly, Connector
from modelica_like.language.fields import Input
from modelica_like.language.units import ONE, parse_unit, to_si
from modelica_like.netlist.document import Document, parse, read_text
from modelica_like.netlist.read import FMU_PART, assemble
from modelica_like.netlist.sections import flattened
from modelica_like.simulation import seconds

_OWN = ("is", "file")
_ONLY_SIGNALS = "An FMU has only signals: connect its inputs and outputs in [connect]."


def system_of_netlist(path: Path, work: Path) -> System:
    """Make a system from a netlist with FMUs as parts; all errors are reported together.

    Each FMU is a unit, with its file name relative to the netlist; all other parts are exported into a folder as one
    FMU with the netlist's name.
    """
    document = parse(read_text(path), str(path))
    fmus = {
        name: entry
        for name, entry in document.parts.items()
        if any(table["is"] == FMU_PART for table in (entry if isinstance(entry, list) else [entry]))
    }
    if not fmus:
        raise NetlistError(
            f"{document.name} has no FMU among its parts, so there is nothing to co-simulate.",
            advice="Simulate it, or cut it into FMUs with `modelica-like split`.",
        )
    return _Joiner(document, fmus, path).system(work)


@dataclass(frozen=True)
class _End:
    """An end of a connection: of an FMU, or of the other parts."""

    port: Port
    takes: bool
    foreign: bool

    def __str__(self) -> str:
        return str(self.port) if self.foreign else self.port.variable


class _Joiner:
    """Separates the FMUs of a netlist from its other parts, and collects errors."""

    def __init__(self, document: Document, fmus: Mapping[str, Any], path: Path) -> None:
        self.document, self.fmus, self.path = document, fmus, path
        self.title = document.name if document.name.isidentifier() and document.name not in fmus else "parts_around"
        self.about: dict[str, DescribedFmu] = {}
        self.errors: list[ModelicaLikeError] = []
        self.given: dict[str, str] = {}

    def system(self, work: Path) -> System:
        if "from" in self.document.simulate:
            what = "A netlist with FMUs is a co-simulation, which begins at 0 s: it cannot have `from`."
            raise NetlistError(what, where=self.document.lines.source("simulate", "from"))
        units = [unit for name, entry in self.fmus.items() if (unit := self._tried("parts", name, self._unit, entry))]
        self._refuse_other_mentions()
        self._stop()
        rest, crossing = self._rest()
        kept: dict[str, list[str]] = {}
        crossings = (self._tried("connect", name, self._link, rest, ends, kept) for name, ends in crossing.items())
        links = [link for link in crossings if link is not None]
        self._stop()
        if rest is not None:
            outputs = [link.source.variable for link in links if link.source.unit == self.title]
            file = work / f"{self.title}.fmu"
            export_fmu(self._assembled({**self._plain(), **kept}), file, "2.0", "cs", outputs=outputs, check=False)
            units.append(Unit(self.title, file))
        until = self.document.simulate.get("until")
        settings = Settings(until if until is None else seconds(until))
        system = System(self.document.name, tuple(units), tuple(links), find_bonds(links), settings)
        check_system(system)
        check_units(
            system,
            lambda name: self.document.lines.source("connect", name),
            lambda port: port.variable if port.unit == self.title else str(port),
        )
        return system

    def _tried(self, section: str, name: str, action: Any, *arguments: Any) -> Any:
        try:
            return action(name, *arguments)
        except ModelicaLikeError as error:
            error.where = error.where or (self.document.lines.source(section, name),)
            self.errors.append(error)
            return None

    def _stop(self) -> None:
        if self.errors:
            raise raise_together_or_one(self.errors)

    # --- the FMUs -----------------------------------------------------------------------------------------------------

    def _unit(self, name: str, entry: Any) -> Unit:
        if isinstance(entry, list) or "count" in entry:
            raise NetlistError(f"{name}: an array cannot contain FMUs.", advice="Declare each FMU as a part.")
        if not isinstance(entry.get("file"), str):
            raise NetlistError(f"{name} names no file.", advice=f'Write {{ is = "FMU", file = "{name}.fmu" }}.')
        file = self.path.parent / entry["file"]
        if not file.is_file():
            near = [path.name for path in file.parent.glob("*.fmu")] if file.parent.is_dir() else []
            hint = did_you_mean(file.name, near) or "."
            raise NetlistError(
                f"{name}: there is no file '{entry['file']}'{hint}", why="Paths are relative to the netlist."
            )
        self.about[name] = described(file)
        if not self.about[name].cosimulation:
            raise NetlistError(
                f"{name}: {file.name} has no Co-Simulation part, only Model Exchange.",
                why="Its equations need a solver, which this FMU does not contain.",
                advice="Export it again for Co-Simulation.",
            )
        values = flattened({key: value for key, value in entry.items() if key not in _OWN})
        return Unit(name, file, {key: self._value(name, key, value) for key, value in values.items()})

    def _value(self, fmu: str, key: str, value: Any) -> float:
        variable = self._variable(fmu, key)
        if not isinstance(value, str | int | float):
            raise NetlistError(f'{fmu}.{key} must be a number or a text with a unit, such as "10 N.m".')
        if not isinstance(value, str):
            return to_si(value + 0, ONE, f"{fmu}.{key}")  # true is 1
        unit = parse_unit(variable.unit or "1")
        return (to_si(value, unit, f"{fmu}.{key}") - unit.offset) / unit.factor

    def _variable(self, fmu: str, name: str) -> Any:
        variables = self.about[fmu].variables
        if name not in variables:
            raise unknown_name(f"{fmu} has no variable '{name}'", name, variables)
        return variables[name]

    def _refuse_other_mentions(self) -> None:
        """Refuse FMUs in sections that join flanges, or that give start values."""
        places: list[tuple[str, str, list[str]]] = [("series", k, v) for k, v in self.document.series.items()]
        places += [("expose", k, [v]) for k, v in self.document.expose.items()]
        places += [("free", end, [end]) for end in self.document.free]
        for section, name, ends in places:
            for fmu in [_part(end) for end in ends if _part(end) in self.fmus]:
                where = self.document.lines.source(section, *([name] if section != "free" else []))
                self.errors.append(NetlistError(f"{fmu} cannot be in [{section}].", where=where, why=_ONLY_SIGNALS))
        for section in ("start", "guess"):
            for name in getattr(self.document, section):
                if _part(name) in self.fmus:
                    where = self.document.lines.source(section, name)
                    advice = f"Give the value where {_part(name)} is declared."
                    self.errors.append(NetlistError(f"{name} belongs to an FMU.", where=where, advice=advice))

    # --- the other parts ----------------------------------------------------------------------------------------------

    def _plain(self) -> dict[str, list[str]]:
        """Return the connections without FMUs."""
        wires = self.document.connect.items()
        return {name: ends for name, ends in wires if not any(_part(end) in self.fmus for end in ends)}

    def _rest(self) -> tuple[Assembly | None, dict[str, list[str]]]:
        """Return the other parts with the connections among them, and the connections to FMUs."""
        plain = self._plain()
        crossing = {name: ends for name, ends in self.document.connect.items() if name not in plain}
        self.given = {end: name for name, ends in plain.items() for end in ends}
        return (self._assembled(plain) if len(self.document.parts) > len(self.fmus) else None), crossing

    def _assembled(self, connect: dict[str, list[str]]) -> Assembly:
        parts = {name: entry for name, entry in self.document.parts.items() if name not in self.fmus}
        return assemble(replace(self.document, parts=parts, connect=connect), self.path)

    def _link(self, name: str, rest: Assembly | None, ends: list[str], kept: dict[str, list[str]]) -> Link | None:
        ports = [self._end(end, rest) for end in ends]
        sources, targets = [e for e in ports if not e.takes], [e for e in ports if e.takes]
        if len(sources) != 1:
            names = ", ".join(map(str, sources or targets))
            what = "no output drives it" if not sources else "multiple outputs drive it"
            raise NetlistError(f"{name}: {what}: {names}.", advice="Join one output with the inputs that take it.")
        (source,) = sources
        for target in targets:
            self._give(str(target), name)
        if not source.foreign:
            inner = [e.port.variable for e in targets if not e.foreign]
            kept |= {name: [source.port.variable, *inner]} if inner else {}
            targets = [e for e in targets if e.foreign]
        return Link(name, source.port, tuple(e.port for e in targets))

    def _give(self, end: str, name: str) -> None:
        if (other := self.given.setdefault(end, name)) != name:
            where = [self.document.lines.source("connect", wire) for wire in (other, name)]
            raise NetlistError(f"{end} is given twice, by {other} and {name}.", where=where, advice="Remove one.")

    def _end(self, end: str, rest: Assembly | None) -> _End:
        part, _, variable = end.partition(".")
        if part in self.fmus:
            causality = self._variable(part, variable).causality
            if "arameter" in causality or causality == "independent":
                raise NetlistError(f"{end} is a parameter of an FMU, not a signal.")
            return _End(Port(part, variable), causality == "input", foreign=True)
        return _End(Port(self.title, end), self._takes(end, rest), foreign=False)

    def _takes(self, end: str, rest: Assembly | None) -> bool:
        owner_path, _, name = end.rpartition(".")
        if rest is None:
            raise UnknownName(f"{self.document.name} has no part '{_part(end)}'{did_you_mean(end, self.fmus) or '.'}")
        owner = rest.find(owner_path)
        if name in owner.fields:
            return isinstance(owner.fields[name], Input)
        if isinstance(inner := getattr(owner, name, None), Connector):
            raise NetlistError(
                f"{end} is a {type(inner).__name__}, and an FMU has only signals.",
                why="A shaft, slide or wire carries torque and motion in both directions; an FMU computes one from the "
                "other.",
                advice="Put an adaptor on it, such as TorqueToAngleAdaptor, and connect its signals.",
            )  # fmt: skip
        raise unknown_name(f"{owner.label} has no signal '{name}'", name, owner.fields)


def _part(path: str) -> str:
    return path.partition(".")[0]
