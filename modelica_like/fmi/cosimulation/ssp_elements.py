"""The elements of a SystemStructure.ssd: systems, components, connectors, and their values."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from math import isfinite
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import unquote, urlsplit

import lxml.etree as etree

from modelica_like.errors import DuplicateName, NetlistError, Source, unknown_name
from modelica_like.fmi.cosimulation.described import BASE_UNITS, UnitDefinition
from modelica_like.fmi.cosimulation.ssp_document import FMU_TYPE, NAMES
from modelica_like.fmi.unpack import refuse_document_type

ElementPath = tuple[str, ...]
Target = tuple[ElementPath, str]
"""A connector or a variable: the path of its element, and its name."""
Units = Mapping[str, UnitDefinition]

_VALUES = "application/x-ssp-parameter-set"
_BOOLEANS = {"true": 1.0, "1": 1.0, "false": 0.0, "0": 0.0}
_NO_NUMBERS = ("String", "Enumeration", "Binary", "Dimension")


class Connector(NamedTuple):
    """A connector of an element: `kind` is the direction, `unit` is a name or empty."""

    kind: str
    unit: str


class Bound(NamedTuple):
    """A value that a binding gives, in a unit if one is named."""

    value: float
    unit: UnitDefinition | None
    place: Source


@dataclass
class Element:
    """A component with its FMU, or a system with elements inside; `path` has no name for the outermost system."""

    path: ElementPath
    xml: Any
    file: Path | None
    connectors: dict[str, Connector] = field(default_factory=dict[str, Connector])
    children: dict[str, Element] = field(default_factory=dict[str, "Element"])

    @property
    def label(self) -> str:
        """Name for messages."""
        return ".".join(self.path) or self.xml.get("name") or "The system"

    def walk(self) -> Iterator[Element]:
        """Yield it and all elements inside."""
        yield self
        for child in self.children.values():
            yield from child.walk()

    def check_connector(self, name: str, place: Source) -> None:
        """Refuse a connector that it does not have."""
        if name not in self.connectors:
            raise unknown_name(f"{self.label} has no connector '{name}'", name, self.connectors, where=place)


class Files:
    """The XML files of an unpacked SSP."""

    def __init__(self, name: str, folder: Path) -> None:
        self.name, self.folder = name, folder

    def root(self, file: Path) -> Any:
        """Read an XML file that declares no document type."""
        refuse_document_type(self.name, file)
        parser = etree.XMLParser(resolve_entities=False, no_network=True, remove_comments=True, remove_pis=True)
        try:
            return etree.fromstring(file.read_bytes(), parser, base_url=str(file))
        except etree.XMLSyntaxError as error:
            raise NetlistError(
                f"{file.name} in {self.name} is not XML: {error.msg}.", where=Source(file.name, error.lineno or 0)
            ) from None

    def find(self, uri: str, place: Source) -> Path:
        """Return the file of the archive behind a URI."""
        parts = urlsplit(uri)
        inside = (self.folder / unquote(parts.path)).resolve()
        if parts.scheme or parts.netloc or parts.fragment or not inside.is_relative_to(self.folder.resolve()):
            raise NetlistError(
                f"'{uri}' does not lie in {self.name}.", where=place,
                advice="Only files of the archive itself can be used, such as resources/motor.fmu.",
            )  # fmt: skip
        if not inside.is_file():
            raise NetlistError(f"{self.name} has no file '{uri}'.", where=place)
        return inside


def place(xml: Any) -> Source:
    """Return the place of an element of the XML."""
    text = " ".join([local(xml), *(f'{name}="{value}"' for name, value in xml.attrib.items())])
    return Source(Path(xml.getroottree().docinfo.URL or "SystemStructure.ssd").name, xml.sourceline or 0, f"<{text}>")


def local(xml: Any) -> str:
    """Return the name of an XML element without its namespace."""
    return etree.QName(xml).localname


def needed(xml: Any, attribute: str) -> str:
    """Return a required attribute."""
    value = xml.get(attribute)
    if not value:
        raise NetlistError(f"An element {local(xml)} lacks its {attribute}.", where=place(xml))
    return value


def number(xml: Any, attribute: str, default: float | None = None) -> float:
    """Return a finite number."""
    text = xml.get(attribute)
    if text is None and default is not None:
        return default
    try:
        value = float(needed(xml, attribute))
    except ValueError:
        raise NetlistError(f"{local(xml)}: {attribute} = '{text}' is not a number.", where=place(xml)) from None
    if not isfinite(value):
        raise NetlistError(f"{local(xml)}: {attribute} = '{text}' is not finite.", where=place(xml))
    return value


def unit_definitions(top: Any) -> dict[str, UnitDefinition]:
    """Return the units that an SSD or a parameter set defines."""
    units: dict[str, UnitDefinition] = {}
    for unit in top.iterfind("{*}Units/ssc:Unit", NAMES):
        base = unit.find("ssc:BaseUnit", NAMES)
        if base is not None:
            exponents = tuple((name, int(number(base, name))) for name in BASE_UNITS if base.get(name))
            name = needed(unit, "name")
            units[name] = UnitDefinition(name, exponents, number(base, "factor", 1.0), number(base, "offset", 0.0))
    return units


def read_element(xml: Any, path: ElementPath, files: Files) -> Element:
    """Read a system or a component with its contents; refuse unsupported elements and duplicate names."""
    kind = local(xml)
    if kind == "SignalDictionaryReference":
        raise NetlistError(
            f"{'.'.join(path)} refers to a signal dictionary, which is not supported.", where=place(xml),
            advice="Connect the components directly.",
        )  # fmt: skip
    element = Element(path, xml, None if kind == "System" else _fmu(xml, files))
    for name, connector in _named(element, "connector", "ssd:Connectors/ssd:Connector"):
        units = [child.get("unit", "") for child in connector if local(child) in ("Real", "Float64", "Float32")]
        element.connectors[name] = Connector(needed(connector, "kind"), units[0] if units else "")
    for name, child in _named(element, "element", "ssd:Elements/*"):
        element.children[name] = read_element(child, (*path, name), files)
    return element


def _named(element: Element, what: str, where: str) -> Iterator[tuple[str, Any]]:
    names: set[str] = set()
    for child in element.xml.iterfind(where, NAMES):
        name = needed(child, "name")
        if name in names:
            raise DuplicateName(f"{element.label} has two {what}s '{name}'.", where=place(child))
        names.add(name)
        yield name, child


def _fmu(xml: Any, files: Files) -> Path:
    name, kind = needed(xml, "name"), xml.get("type", FMU_TYPE)
    if kind != FMU_TYPE:
        raise NetlistError(
            f"{name} is not an FMU but has the type {kind}, which is not supported.", where=place(xml),
            advice="Put the FMUs of the inner SSP into the system itself.",
        )  # fmt: skip
    how = xml.get("implementation", "any")
    if how not in ("any", "CoSimulation"):
        raise NetlistError(f"{name} asks for {how}, but systems run as co-simulation.", where=place(xml))
    return files.find(needed(xml, "source"), place(xml))


# -- values ------------------------------------------------------------------------------------------------------------


def bound_values(root: Element, files: Files, units: Units) -> dict[Target, Bound]:
    """Return the values from the bindings of a system and its contents, inline or in .ssv files.

    Within one element the later binding wins; between two elements the outer one wins.
    """
    values: dict[Target, Bound] = {}
    for element in sorted(root.walk(), key=lambda source: -len(source.path)):
        for binding in element.xml.iterfind("ssd:ParameterBindings/ssd:ParameterBinding", NAMES):
            prefix = binding.get("prefix", "")
            for name, bound in _parameters(binding, files, units):
                values.update(dict.fromkeys(_targets(element, prefix + name), bound))
    return values


def _targets(element: Element, name: str) -> Iterator[Target]:
    """Yield the targets of a hierarchical name: names of elements may contain dots, so there can be several."""
    if element.file is not None or name in element.connectors:
        yield element.path, name
    for inner, child in element.children.items():
        if name.startswith(f"{inner}."):
            yield from _targets(child, name[len(inner) + 1 :])


def _parameters(binding: Any, files: Files, units: Units) -> Iterator[tuple[str, Bound]]:
    if binding.find("ssd:ParameterMapping", NAMES) is not None:
        raise NetlistError(
            "Mappings of parameters (ssm) are not supported.", where=place(binding),
            advice="Give the values under the names that they have in the system.",
        )  # fmt: skip
    kind, source = binding.get("type", _VALUES), binding.get("source")
    if kind != _VALUES:
        raise NetlistError(f"Parameters of type {kind} are not supported.", where=place(binding))
    if source and binding.get("sourceBase", "SSD") != "SSD":
        raise NetlistError("Parameters inside a component's file are not supported.", where=place(binding))
    inside = binding.iterfind("ssd:ParameterValues/ssv:ParameterSet", NAMES)
    for group in [files.root(files.find(source, place(binding)))] if source else inside:
        all_units = {**units, **unit_definitions(group)}
        for element in group.iterfind("ssv:Parameters/ssv:Parameter", NAMES):
            yield needed(element, "name"), _value(element, all_units)


def _value(parameter: Any, units: Units) -> Bound:
    typed = next((child for child in parameter if local(child) != "Annotations"), None)
    if typed is None or local(typed) in _NO_NUMBERS:
        what = "has no value" if typed is None else f"is of type {local(typed)}"
        name = needed(parameter, "name")
        raise NetlistError(f"Parameter '{name}' {what}; only numbers can be set.", where=place(parameter))
    if local(typed) == "Boolean" and typed.get("value") in _BOOLEANS:
        return Bound(_BOOLEANS[typed.get("value")], None, place(parameter))
    return Bound(number(typed, "value"), units.get(typed.get("unit", "")), place(parameter))
