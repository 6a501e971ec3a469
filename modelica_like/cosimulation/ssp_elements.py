"""The elements of a SystemStructure.ssd: systems, components and their connectors, as they stand there."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from math import isfinite
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

import lxml.etree as etree

from modelica_like.cosimulation.described import BASE_UNITS, UnitDefinition
from modelica_like.cosimulation.ssp_document import FMU_TYPE, NAMES
from modelica_like.errors import DuplicateName, NetlistError, Source, UnknownName, did_you_mean
from modelica_like.fmi.unpack import refuse_document_type

ElementPath = tuple[str, ...]


@dataclass(frozen=True)
class Connector:
    """A connector of an element: `kind` says in which direction, `unit` is a name or empty."""

    kind: str
    unit: str


@dataclass
class Element:
    """A component, or a system with elements inside.

    Attributes:
        path: names from the outermost system, which is left out, to this element.
        xml: where it stands.
        file: the FMU of a component; None for a system.
    """

    path: ElementPath
    xml: Any
    file: Path | None
    connectors: dict[str, Connector] = field(default_factory=dict)
    children: dict[str, Element] = field(default_factory=dict)

    @property
    def label(self) -> str:
        """What messages call it."""
        return ".".join(self.path) or self.xml.get("name") or "The system"

    def walk(self) -> Iterator[Element]:
        """Yield it and all elements inside."""
        yield self
        for child in self.children.values():
            yield from child.walk()

    def connector(self, name: str, place: Source) -> Connector:
        """Return a connector.

        Raises:
            UnknownName: it has no such connector.
        """
        if name not in self.connectors:
            hint = did_you_mean(name, self.connectors) or "."
            raise UnknownName(f"{self.label} has no connector '{name}'{hint}", where=place)
        return self.connectors[name]


class Files:
    """The XML files of an unpacked SSP."""

    def __init__(self, name: str, folder: Path) -> None:
        self.name, self.folder = name, folder

    def root(self, file: Path) -> Any:
        """Read an XML file.

        Raises:
            NetlistError: it is no XML.
            FmuRefused: it declares a document type.
        """
        refuse_document_type(self.name, file)
        parser = etree.XMLParser(resolve_entities=False, no_network=True, remove_comments=True, remove_pis=True)
        try:
            return etree.parse(file, parser).getroot()
        except etree.XMLSyntaxError as error:
            raise NetlistError(
                f"{file.name} in {self.name} is no XML: {error.msg}.", where=Source(file.name, error.lineno or 0)
            ) from None

    def find(self, uri: str, place: Source) -> Path:
        """Return the file that a URI means.

        Raises:
            NetlistError: it is not in the archive.
        """
        parts = urlsplit(uri)
        inside = (self.folder / unquote(parts.path)).resolve()
        if parts.scheme or parts.netloc or parts.fragment or not inside.is_relative_to(self.folder.resolve()):
            raise NetlistError(
                f"'{uri}' does not lie in {self.name}.", where=place,
                advice="Only files of the archive itself are taken, such as resources/motor.fmu.",
            )  # fmt: skip
        if not inside.is_file():
            raise NetlistError(f"{self.name} has no file '{uri}'.", where=place)
        return inside


def place(xml: Any) -> Source:
    """Return where an element of the XML stands."""
    text = " ".join([local(xml), *(f'{name}="{value}"' for name, value in xml.attrib.items())])
    return Source(Path(xml.getroottree().docinfo.URL or "SystemStructure.ssd").name, xml.sourceline or 0, f"<{text}>")


def local(xml: Any) -> str:
    """Return the name of an XML element without its namespace."""
    return etree.QName(xml).localname


def needed(xml: Any, attribute: str) -> str:
    """Return an attribute.

    Raises:
        NetlistError: it is not there.
    """
    value = xml.get(attribute)
    if not value:
        raise NetlistError(f"An element {local(xml)} lacks its {attribute}.", where=place(xml))
    return value


def number(xml: Any, attribute: str, default: float | None = None) -> float:
    """Return a number.

    Raises:
        NetlistError: it is not there, or is no finite number.
    """
    text = xml.get(attribute)
    if text is None and default is not None:
        return default
    try:
        value = float(needed(xml, attribute))
    except ValueError:
        raise NetlistError(f"{local(xml)}: {attribute} = '{text}' is no number.", where=place(xml)) from None
    if not isfinite(value):
        raise NetlistError(f"{local(xml)}: {attribute} = '{text}' is not finite.", where=place(xml))
    return value


def unit_definitions(top: Any) -> dict[str, UnitDefinition]:
    """Return the units that an SSD or a parameter set defines."""
    found: dict[str, UnitDefinition] = {}
    for unit in top.iterfind("{*}Units/ssc:Unit", NAMES):
        base = unit.find("ssc:BaseUnit", NAMES)
        if base is not None:
            exponents = tuple((name, int(number(base, name))) for name in BASE_UNITS if base.get(name))
            name = needed(unit, "name")
            found[name] = UnitDefinition(name, exponents, number(base, "factor", 1.0), number(base, "offset", 0.0))
    return found


def read_element(xml: Any, path: ElementPath, files: Files) -> Element:
    """Read a system or a component with all that is inside.

    Raises:
        NetlistError: it is something that cannot be run.
        DuplicateName: two elements, or two connectors of one element, have one name.
    """
    kind = local(xml)
    if kind == "SignalDictionaryReference":
        raise NetlistError(
            f"{'.'.join(path)} is a reference to a signal dictionary, which is not supported.", where=place(xml),
            advice="Connect the components directly.",
        )  # fmt: skip
    element = Element(path, xml, None if kind == "System" else _fmu(xml, files))
    for one in xml.iterfind("ssd:Connectors/ssd:Connector", NAMES):
        name = needed(one, "name")
        if name in element.connectors:
            raise DuplicateName(f"{element.label} has two connectors '{name}'.", where=place(one))
        units = [child.get("unit", "") for child in one if local(child) in ("Real", "Float64", "Float32")]
        element.connectors[name] = Connector(needed(one, "kind"), units[0] if units else "")
    for one in xml.iterfind("ssd:Elements/*", NAMES):
        name = needed(one, "name")
        if name in element.children:
            raise DuplicateName(f"{element.label} has two elements '{name}'.", where=place(one))
        element.children[name] = read_element(one, (*path, name), files)
    return element


def _fmu(xml: Any, files: Files) -> Path:
    name, kind = needed(xml, "name"), xml.get("type", FMU_TYPE)
    if kind != FMU_TYPE:
        raise NetlistError(
            f"{name} is no FMU but of type {kind}, which is not supported.", where=place(xml),
            advice="Put the FMUs of an SSP inside into the system itself.",
        )  # fmt: skip
    if xml.get("implementation") not in (None, "any", "CoSimulation"):
        raise NetlistError(
            f"{name} is to be run as {xml.get('implementation')}; systems are run by co-simulation.", where=place(xml)
        )
    return files.find(needed(xml, "source"), place(xml))
