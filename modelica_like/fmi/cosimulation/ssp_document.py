"""Systems as SystemStructure.ssd: the XML of the SSP standard, 1.0 and 2.0.

Both versions have the same namespaces; 2.0 has the types of FMI 3.0.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Literal

from modelica_like.errors import NetlistError
from modelica_like.fmi.cosimulation.described import DescribedFmu, FmuVariable, UnitDefinition
from modelica_like.fmi.cosimulation.system import Port, System, Unit
from modelica_like.fmi.xml import Element, document, element

Version = Literal["1.0", "2.0"]

_HOME = "http://ssp-standard.org/SSP1/SystemStructure"
NAMES = {
    "ssd": f"{_HOME}Description",
    "ssc": f"{_HOME}Common",
    "ssv": f"{_HOME}ParameterValues",
    "ml": "urn:modelica_like",
}
COSIMULATION = "modelica_like.cosimulation"
"""Type of the annotation for settings outside the standard."""
PARAMETER_SET = "initialValues"
"""Name of all parameter sets: some importers apply values by this name."""
FMU_TYPE = "application/x-fmu-sharedlibrary"
_REAL = ("Real", "Float64", "Float32")


def ssd(system: System, fmus: Mapping[str, DescribedFmu], sources: Mapping[str, str], version: Version) -> bytes:
    """Write a system.

    Args:
        system: the system.
        fmus: descriptions by the name of the unit.
        sources: paths inside the archive, by the name of the unit.
        version: of the SSP standard.
    """
    spaces = {f"xmlns:{prefix}": home for prefix, home in NAMES.items()}
    top = Element("ssd:SystemStructureDescription", {**spaces, "version": version, "name": system.name})
    inside = element(top, "ssd:System", name=system.name)
    parts = element(inside, "ssd:Elements")
    ports = list(dict.fromkeys(port for link in system.links for port in (link.source, *link.targets)))
    for unit in system.units:
        _component(parts, unit, fmus[unit.name], sources[unit.name], ports, version)
    if system.links:
        group = element(inside, "ssd:Connections")
        for joint in system.links:
            for target in joint.targets:
                element(
                    group, "ssd:Connection", description=joint.name, startElement=joint.source.unit,
                    startConnector=joint.source.variable, endElement=target.unit, endConnector=target.variable,
                )  # fmt: skip
    ports = [*ports, *(Port(unit.name, name) for unit in system.units for name in unit.parameters)]
    _units(top, [(fmus[port.unit], port.variable) for port in ports])
    if system.settings.until is not None:
        element(top, "ssd:DefaultExperiment", startTime=0.0, stopTime=system.settings.until)
    settings = system.settings
    note = element(element(top, "ssd:Annotations"), "ssc:Annotation", type=COSIMULATION)
    inner = element(
        note, "ml:Cosimulation", master=settings.master, inputs=settings.inputs, step=settings.step,
        tolerance=settings.tolerance, ownNames=system.own_names,
    )  # fmt: skip
    for bond in system.bonds:
        element(inner, "ml:Bond", name=bond.name, flow=bond.flow, rate=bond.rate)
    return document(top).encode()


def _component(
    parts: Element, unit: Unit, fmu: DescribedFmu, source: str, ports: list[Port], version: Version
) -> None:  # fmt: skip
    component = element(
        parts, "ssd:Component", name=unit.name, type=FMU_TYPE, source=source, implementation="CoSimulation"
    )
    described = {name: v if v.unit in fmu.units else replace(v, unit="") for name, v in fmu.variables.items()}
    variables = [described[port.variable] for port in ports if port.unit == unit.name]
    if variables:
        connectors = element(component, "ssd:Connectors")
        for variable in variables:
            connector = element(connectors, "ssd:Connector", name=variable.name, kind=variable.causality)
            _type(connector, "ssc", variable, version)
    if unit.parameters:
        binding = element(element(component, "ssd:ParameterBindings"), "ssd:ParameterBinding")
        values = element(binding, "ssd:ParameterValues")
        group = element(values, "ssv:ParameterSet", version=version, name=PARAMETER_SET)
        given = element(group, "ssv:Parameters")
        for name, value in unit.parameters.items():
            parameter = element(given, "ssv:Parameter", name=name)
            _type(parameter, "ssv", described[name], version, value)


def _type(parent: Element, prefix: str, variable: FmuVariable, version: Version, value: float | None = None) -> None:
    """Append the type of a variable, with a value if there is one."""
    kind = _kind(variable.kind, version)
    if kind is None and value is None:
        return
    if kind in (None, "Integer", "Boolean") or "Int" in (kind or ""):
        whole = None if value is None else bool(value) if kind == "Boolean" else round(value)
        element(parent, f"{prefix}:{kind or 'Integer'}", value=whole)
    else:
        element(parent, f"{prefix}:{kind}", value=value, unit=variable.unit or None)


def _kind(kind: str, version: Version) -> str | None:
    """Return the SSP type of an FMI type; None for enumerations, whose connectors may go without."""
    if kind == "Enumeration":
        return None
    if kind == "Boolean" or version == "2.0":
        return kind
    return "Real" if kind in _REAL else "Integer"


def _units(top: Element, used: list[tuple[DescribedFmu, str]]) -> None:
    """Write the units of all variables that are mentioned."""
    units: dict[str, UnitDefinition] = {}
    for fmu, name in used:
        unit = fmu.variables[name].unit
        if unit not in fmu.units:
            continue
        definition = fmu.units[unit]
        if units.setdefault(unit, definition) != definition:
            raise NetlistError(f"Two FMUs define the unit '{unit}' differently, which an SSP cannot express.")
    if units:
        group = element(top, "ssd:Units")
        for name in sorted(units):
            about = units[name]
            base: dict[str, object] = dict(about.exponents)
            base |= {} if about.factor == 1.0 else {"factor": about.factor}
            base |= {} if about.offset == 0.0 else {"offset": about.offset}
            element(element(group, "ssc:Unit", name=name), "ssc:BaseUnit", **base)
