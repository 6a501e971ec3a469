"""A SystemStructure.ssd as a flat system of FMUs."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import chain, count
from math import isfinite
from pathlib import Path
from typing import Any

from modelica_like.errors import DuplicateName, NetlistError, Source
from modelica_like.fmi.cosimulation import ssp_elements as ssp
from modelica_like.fmi.cosimulation.described import UnitDefinition, described, refuse_other_unit
from modelica_like.fmi.cosimulation.ssp_document import COSIMULATION, NAMES
from modelica_like.fmi.cosimulation.ssp_elements import Element, ElementPath, Files, Target, needed, number, place
from modelica_like.fmi.cosimulation.system import Bond, Link, Port, Settings, System, Unit, check_system, find_bonds
from modelica_like.fmi.unpack import SSP

_GIVES = {
    True: ("output", "calculatedParameter", "constant", "local"),
    False: ("input", "parameter", "structuralParameter"),
}
"""Kinds of connectors that provide a value: of an element inside, of the system itself."""
_NAMED = ("input", "output", "parameter", "structuralParameter", "calculatedParameter", "constant", "local")


@dataclass(frozen=True)
class _Drive:
    """What drives a connector: another connector, by a connection."""

    source: Target
    description: str
    converts: bool
    place: Source


def read_structure(name: str, folder: Path) -> System:
    """Read the system of the SSP of this name that is unpacked in a folder; see `load_ssp`."""
    files = Files(name, folder)
    top = files.root(folder / SSP.description)
    if top.tag != f"{{{NAMES['ssd']}}}SystemStructureDescription":
        raise NetlistError(f"{SSP.description} in {name} describes no system structure.", where=place(top))
    if top.get("version", "").partition(".")[0] not in ("1", "2"):
        raise NetlistError(
            f"{name} has the SSP version {top.get('version')}; 1.0 and 2.0 are supported.", where=place(top)
        )
    inside = top.find("ssd:System", NAMES)
    if inside is None:
        raise NetlistError(f"{name} has no system.", where=place(top))
    return _Reader(top, ssp.read_element(inside, (), files), files).system()


class _Reader:
    """Flattens a tree of elements; `drives` maps each connector to its source."""

    def __init__(self, top: Any, root: Element, files: Files) -> None:
        self.top, self.root, self.files = top, root, files
        self.elements = {node.path: node for node in root.walk()}
        self.files_of = {node.path: node.file for node in root.walk() if node.file is not None}
        # Names of components have no dots, blanks and special characters.
        components = [self.elements[path] for path in self.files_of]
        names: dict[ElementPath, str] = {}
        for component in components:
            name = _word("_".join(component.path))
            if name in names.values():
                raise DuplicateName(
                    f"Two FMUs would have the name {name}.", where=place(component.xml), advice="Rename one of them."
                )
            names[component.path] = name
        self.names = names
        self.fmus = {path: described(file) for path, file in self.files_of.items()}
        self.units = ssp.unit_definitions(top)
        self.drives: dict[Target, _Drive] = {}
        for element in root.walk():
            for connection in element.xml.iterfind("ssd:Connections/ssd:Connection", NAMES):
                self._connect(element, connection)

    def system(self) -> System:
        """Return the flat system."""
        targets = {target: self._origin(target) for target in self.drives if target[0] in self.fmus}
        note = self.top.find(f"ssd:Annotations/ssc:Annotation[@type='{COSIMULATION}']/ml:Cosimulation", NAMES)
        between = {target: way for target, way in targets.items() if way[-1].source[0] in self.fmus}
        links = self._links(between, described=note is not None)
        outer = {target: way[-1].source for target, way in targets.items() if target not in between}
        parameters = self._parameters(outer)
        units = tuple(Unit(self.names[path], file, parameters[path]) for path, file in self.files_of.items())
        bonds = find_bonds(links) if note is None else tuple(map(_bond, note.iterfind("ml:Bond", NAMES)))
        own_names = note is not None and note.get("ownNames") == "true"
        title = self.top.get("name") or self.root.xml.get("name") or Path(self.files.name).stem
        system = System(title, units, links, bonds, self._settings(note), own_names)
        check_system(system)
        return system

    # -- connections -------------------------------------------------------------------------------------------------

    def _connect(self, system: Element, xml: Any) -> None:
        for child in xml:
            if ssp.local(child).endswith("Transformation") and not _is_identity(child):
                raise NetlistError(
                    f"A connection with a {ssp.local(child)} is not supported.", where=place(xml),
                    advice="Do the conversion in one of the FMUs.",
                )  # fmt: skip
        ends = [self._end(system, xml, which) for which in ("start", "end")]
        gives = [self._gives(system, end) for end in ends]
        if gives == [False, True]:  # the start of a connection does not define its direction
            ends.reverse()
        elif gives[0] == gives[1] and None not in gives:
            what = "two connectors that provide a value" if gives[0] else "two connectors that receive a value"
            raise NetlistError(f"A connection joins {what}: {' and '.join(map(_text, ends))}.", where=place(xml))
        source, target = ends
        if target in self.drives:
            places = (self.drives[target].place, place(xml))
            raise NetlistError(f"{_text(target)} is driven twice, by {_text(self.drives[target].source)} and "
                               f"{_text(source)}.", where=places)  # fmt: skip
        converts = xml.get("suppressUnitConversion", "false") not in ("true", "1")
        self.drives[target] = _Drive(source, xml.get("description", ""), converts, place(xml))

    def _end(self, system: Element, xml: Any, which: str) -> Target:
        name, connector = xml.get(f"{which}Element"), needed(xml, f"{which}Connector")
        if xml.get(f"{which}Indices"):
            raise NetlistError("Connections to single elements of arrays are not supported.", where=place(xml))
        if name and name not in system.children:
            raise NetlistError(f"{system.label} has no element '{name}'.", where=place(xml))
        element = system.children[name] if name else system
        element.check_connector(connector, place(xml))
        return element.path, connector

    def _gives(self, system: Element, end: Target) -> bool | None:
        """Return whether an end provides a value inside a system, or None if it may do both."""
        kind = self.elements[end[0]].connectors[end[1]].kind
        return kind in _GIVES[end[0] != system.path] if kind in _NAMED else None

    def _origin(self, target: Target) -> list[_Drive]:
        """Return the connections from a component's input back to the source of its value."""
        way = [self.drives[target]]
        while way[-1].source in self.drives:
            if way[-1].source in [drive.source for drive in way[:-1]]:
                raise NetlistError(f"{_text(target)} is driven by a loop of connections.", where=way[0].place)
            way.append(self.drives[way[-1].source])
        return way

    def _links(self, targets: Mapping[Target, list[_Drive]], *, described: bool) -> tuple[Link, ...]:
        """Return the connections between components; `described` in our own files, which is their name."""
        grouped: dict[tuple[Target, str], list[Target]] = {}
        for target, way in targets.items():
            self._check_units(target, way)
            grouped.setdefault((way[-1].source, way[0].description if described else ""), []).append(target)
        links: list[Link] = []
        for (source, _), taken in grouped.items():
            said = targets[taken[0]][0].description
            is_name = said != "" if described else said.isidentifier()
            chosen = said if is_name else _word(_text(source))
            used = [link.name for link in links]
            name = next(c for c in chain([chosen], (f"{chosen}_{k}" for k in count(2))) if c not in used)
            links.append(Link(name, self._port(source), tuple(map(self._port, taken))))
        return tuple(links)

    def _port(self, target: Target) -> Port:
        return Port(self.names[target[0]], target[1])

    def _check_units(self, target: Target, way: list[_Drive]) -> None:
        """Refuse connections that would need a unit conversion, unless that is suppressed."""
        ends = [target, *(drive.source for drive in way)]
        if all(drive.converts for drive in way):
            units = [unit for end in ends for unit in self._units_of(end)]
            refuse_other_unit(_text(target), _text(way[-1].source), units, way[0].place)

    def _units_of(self, end: Target) -> list[UnitDefinition]:
        path, name = end
        own_unit = self.fmus[path].unit_of(name) if path in self.fmus else None
        return [unit for unit in (own_unit, self._unit_of(end)) if unit is not None]

    # -- values ------------------------------------------------------------------------------------------------------

    def _parameters(self, outer: Mapping[Target, Target]) -> dict[ElementPath, dict[str, float]]:
        """Return the values of each component: those bound to it, and those bound to its sources outside."""
        bound = ssp.bound_values(self.root, self.files, self.units)
        values: dict[ElementPath, dict[str, float]] = {path: {} for path in self.fmus}
        for target in {**bound, **outer}:
            source = outer[target] if outer.get(target) in bound else target
            (path, name), fmu = target, self.fmus.get(target[0])
            if source not in bound or fmu is None or name not in fmu.variables:
                continue  # the standard ignores values without a receiver
            given, own_unit = bound[source], fmu.unit_of(name)
            # A value that was given for a connector of a system is in the connector's unit if it has none.
            unit = given.unit if source == target else given.unit or self._unit_of(source)
            if unit and own_unit and not unit.same_dimension(own_unit):
                raise NetlistError(
                    f"{_text(target)} is in {own_unit.name}; {given.value:g} {unit.name} is another quantity.",
                    where=given.place, advice=f"Give it in {own_unit.name}, or in a unit of the same dimension.",
                )  # fmt: skip
            value = unit.convert(given.value, own_unit) if unit and own_unit else given.value
            if not isfinite(value):
                raise NetlistError(f"{_text(target)} = {value:g} is not finite.", where=given.place)
            values[path][name] = value
        return values

    def _unit_of(self, end: Target) -> UnitDefinition | None:
        """Return the unit that a connector says it has."""
        return self.units.get(self.elements[end[0]].connectors[end[1]].unit)

    def _settings(self, note: Any) -> Settings:
        experiment = self.top.find("ssd:DefaultExperiment", NAMES)
        until = None if experiment is None or not experiment.get("stopTime") else number(experiment, "stopTime")
        if experiment is not None and number(experiment, "startTime", 0.0) != 0.0:
            raise NetlistError(
                f"{self.files.name} starts at t = {experiment.get('startTime')} s; co-simulations start at 0 s.",
                where=place(experiment),
            )
        if note is None:
            return Settings(until=until)
        step, tolerance = (number(note, name) if note.get(name) else None for name in ("step", "tolerance"))
        return Settings(until, step, note.get("master", "jacobi"), note.get("inputs", "linear"), tolerance)


def _is_identity(transformation: Any) -> bool:
    linear = ssp.local(transformation) == "LinearTransformation"
    return linear and number(transformation, "factor", 1.0) == 1.0 and number(transformation, "offset", 0.0) == 0.0


def _bond(xml: Any) -> Bond:
    return Bond(needed(xml, "name"), needed(xml, "flow"), needed(xml, "rate"))


def _word(text: str) -> str:
    word = re.sub(r"\W+", "_", text)
    return word if word.isidentifier() else f"_{word}"


def _text(target: Target) -> str:
    return ".".join((*target[0], target[1]))
