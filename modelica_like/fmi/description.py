"""modelDescription.xml for FMI 2.0 and 3.0."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

from modelica_like.compile.compiled import CompiledDae
from modelica_like.fmi.dependencies import Dependencies
from modelica_like.fmi.interface import FmuVariable, Interface
from modelica_like.fmi.xml import Element, document, element, unit_name
from modelica_like.language.units import parse_unit

Version = Literal["2.0", "3.0"]
Kind = Literal["me", "cs"]

DISPLAY_UNITS = {
    "rad": ("deg", "rev"), "rad/s": ("rpm", "deg/s"), "rad/s2": ("deg/s2",), "m": ("mm",), "m/s": ("mm/s", "m/min"),
    "K": ("degC",), "Pa": ("bar", "MPa"), "kg.m2": ("kg.cm2",), "N": ("kN",), "W": ("kW",), "J": ("kJ",), "A": ("mA",),
}  # fmt: skip
"""Units in which people read values; the first is suggested."""
_SUGGESTED = ("rad", "rad/s", "m", "K", "Pa")
_MOST_DEPENDENCIES = 1000


@dataclass(frozen=True)
class About:
    """What a description says besides variables.

    Attributes:
        version: FMI version.
        kinds: `me`, `cs` or both.
        token: GUID or instantiation token.
        description: one phrase about the drive.
        stop_time: end of the default experiment in s.
        tolerance: relative tolerance of the default experiment.
        step_size: communication step of the default experiment in s.
        sources: names of the C files.
        log_categories: with a description.
        tool: name and version of the exporting tool.
        fixed_step: step size inside of Co-Simulation in s, 0 for one that accuracy asks for.
    """

    version: Version
    kinds: frozenset[Kind]
    token: str
    description: str
    stop_time: float | None
    tolerance: float
    step_size: float | None
    sources: tuple[str, ...]
    log_categories: dict[str, str]
    tool: str
    fixed_step: float = 0.0


_LONGEST = 63
"""Letters of an identifier that every C compiler tells apart (C99, 5.2.4.1)."""


def identifier(name: str) -> str:
    """Return a C identifier for a model name, which names files, too: no longer than any system allows."""
    plain = re.sub(r"\W", "_", name, flags=re.ASCII).strip("_")[:_LONGEST].rstrip("_")
    return plain if plain and not plain[0].isdigit() else f"model_{plain}".rstrip("_")


def model_description(model: CompiledDae, variables: Interface, about: About) -> str:
    """Write modelDescription.xml.

    Args:
        model: the compiled model.
        variables: its FMI variables.
        about: what else the description says.
    """
    return document(_Writer(model, variables, about).write())


def build_description(name: str, sources: Sequence[str]) -> str:
    """Write buildDescription.xml: which C files make the binary."""
    top = Element("fmiBuildDescription", {"fmiVersion": "3.0"})
    configuration = element(top, "BuildConfiguration", modelIdentifier=identifier(name))
    files = element(configuration, "SourceFileSet", language="C99", compilerOptions="-O2 -ffp-contract=off")
    for source in sources:
        element(files, "SourceFile", name=source)
    return document(top)


class _Writer:
    """The description's parts, in the words of its version: FMI 2.0 counts variables from one, 3.0 has references."""

    def __init__(self, model: CompiledDae, face: Interface, about: About) -> None:
        self.model, self.face, self.about = model, face, about
        self.second = about.version == "2.0"
        self.dependencies = Dependencies(model, face)
        # FMI 3.0 has arrays in place of their numbers.
        self.arrays = {} if self.second else {k: array for array in face.arrays for k in array.elements}
        names = dict.fromkeys(variable.modes for variable in face.variables if variable.modes)
        self.types = {name: f"Mode_{k}_{'_'.join(name)}"[:120] for k, name in enumerate(names, 1)}

    def write(self) -> Element:
        """Write all parts in the order of the schema."""
        about, face = self.about, self.face
        token = {"guid": about.token, "numberOfEventIndicators": len(face.indicators)}
        top = Element("fmiModelDescription", {
            "fmiVersion": about.version, "modelName": self.model.name,
            **(token if self.second else {"instantiationToken": about.token}), "description": about.description or None,
            "generationTool": about.tool, "variableNamingConvention": "structured",
        })  # fmt: skip
        (self._kinds2 if self.second else self._kinds3)(top)
        self._units(top)
        self._types(top)
        categories = element(top, "LogCategories")
        for name, text in about.log_categories.items():
            element(categories, "Category", name=name, description=text)
        element(
            top, "DefaultExperiment", startTime=self.model.begin, stopTime=about.stop_time, tolerance=about.tolerance,
            stepSize=about.step_size,
        )  # fmt: skip
        listed, write = element(top, "ModelVariables"), self._variable2 if self.second else self._variable3
        for variable in (*face.variables, *dict.fromkeys(self.arrays.values())):
            if variable.reference not in self.arrays:
                write(listed, variable)
        self._structure(element(top, "ModelStructure"))
        return top

    def _kinds2(self, top: Element) -> None:
        common = {
            "modelIdentifier": identifier(self.model.name), "canGetAndSetFMUstate": True, "canSerializeFMUstate": True,
            "providesDirectionalDerivative": True,
        }  # fmt: skip
        attributes = {
            "canHandleVariableCommunicationStepSize": not self.about.fixed_step, "canInterpolateInputs": True,
            "maxOutputDerivativeOrder": 3,
        }  # fmt: skip
        for kind, tag, more in (("me", "ModelExchange", {}), ("cs", "CoSimulation", attributes)):
            if kind in self.about.kinds:
                files = element(element(top, tag, **common, **more), "SourceFiles")
                for name in self.about.sources:
                    element(files, "File", name=name)

    def _kinds3(self, top: Element) -> None:
        common = {
            "modelIdentifier": identifier(self.model.name), "canGetAndSetFMUState": True, "canSerializeFMUState": True,
            "providesDirectionalDerivatives": True, "providesAdjointDerivatives": True,
        }  # fmt: skip
        if "me" in self.about.kinds:
            element(top, "ModelExchange", **common, needsCompletedIntegratorStep=True)
        fixed = self.about.fixed_step
        if "cs" in self.about.kinds:
            element(
                top, "CoSimulation", **common, canHandleVariableCommunicationStepSize=not fixed,
                maxOutputDerivativeOrder=3, providesIntermediateUpdate=True, mightReturnEarlyFromDoStep=not fixed,
                canReturnEarlyAfterIntermediateUpdate=True, hasEventMode=not fixed,
                fixedInternalStepSize=fixed or None,
            )  # fmt: skip

    def _units(self, top: Element) -> None:
        """Define every unit, with its base units, and how people read it."""
        used = {name: v.unit for v in self.face.variables if (name := unit_name(v.unit)) is not None}
        definitions = element(top, "UnitDefinitions") if used else top
        for name, unit in sorted(used.items()):
            defined = element(definitions, "Unit", name=name)
            exponents = {base: power for base, power in unit.exponents.items() if power}
            if all(isinstance(power, int) for power in exponents.values()):
                element(defined, "BaseUnit", **exponents, factor=None if unit.factor == 1.0 else unit.factor)
            for shown in DISPLAY_UNITS.get(name, ()):
                other = parse_unit(shown)
                offset = -other.offset / other.factor
                element(defined, "DisplayUnit", name=shown, factor=1.0 / other.factor, offset=offset or None)

    def _types(self, top: Element) -> None:
        definitions = element(top, "TypeDefinitions") if self.types else top
        for names, title in self.types.items():
            if self.second:
                kind = element(element(definitions, "SimpleType", name=title), "Enumeration")
            else:
                kind = element(definitions, "EnumerationType", name=title)
            for value, name in enumerate(names):
                element(kind, "Item", name=name, value=value)

    def _attributes(self, variable: FmuVariable) -> dict[str, Any]:
        """Attributes that mean the same in both versions; whole numbers have no unit."""
        limits = {"min": variable.min, "max": variable.max}
        if variable.type != "Float64":
            return {
                key: None if value is None else int(value)
                for key, value in (*limits.items(), ("start", variable.start))
            }
        name = unit_name(variable.unit)
        start = [self.face.variables[k].start for k in variable.elements] if variable.elements else variable.start
        shown = DISPLAY_UNITS[name][0] if name in _SUGGESTED else None
        return {"unit": name, "displayUnit": shown, **limits, "nominal": variable.nominal, "start": start}

    def _variable2(self, listed: Element, variable: FmuVariable) -> None:
        scalar = element(
            listed, "ScalarVariable", name=variable.name, valueReference=variable.reference,
            description=variable.description or None, causality=variable.causality, variability=variable.variability,
            initial=variable.initial,
        )  # fmt: skip
        derivative = None if variable.derivative_of is None else variable.derivative_of + 1
        kind = "Real" if variable.type == "Float64" else "Enumeration" if variable.modes else "Integer"
        first = {"declaredType": self.types.get(variable.modes)}
        element(scalar, kind, **first, **self._attributes(variable), derivative=derivative)

    def _variable3(self, listed: Element, variable: FmuVariable) -> None:
        written = element(
            listed, variable.type, name=variable.name, valueReference=variable.reference,
            description=variable.description or None, causality=variable.causality, variability=variable.variability,
            initial=variable.initial, declaredType=self.types.get(variable.modes), **self._attributes(variable),
            derivative=variable.derivative_of,
        )  # fmt: skip
        for size in variable.dimensions:
            element(written, "Dimension", start=size)

    def _structure(self, structure: Element) -> None:
        face = self.face
        listed = {*face.states, *face.derivatives, *face.outputs}
        initial = (
            v.reference
            for v in face.variables
            if (v.reference in listed and v.initial != "exact") or v.causality == "calculatedParameter"
        )
        groups = (
            ("Output", "Outputs", face.outputs), ("ContinuousStateDerivative", "Derivatives", face.derivatives),
            ("InitialUnknown", "InitialUnknowns", tuple(initial)), ("EventIndicator", "", face.indicators),
        )  # fmt: skip
        for tag, group, references in groups:
            if self.second and not (group and references):
                continue
            parent = element(structure, group) if self.second else structure
            for variable in (face.variables[k] for k in references):
                dependencies = self._known(variable, tag == "InitialUnknown")
                place = {"index": variable.reference + 1} if self.second else {"valueReference": variable.reference}
                kinds = None if dependencies is None else ["dependent"] * len(dependencies)
                element(
                    parent,
                    "Unknown" if self.second else tag,
                    **place,
                    dependencies=dependencies,
                    dependenciesKind=kinds,
                )

    def _known(self, variable: FmuVariable, initial: bool) -> list[int] | None:
        """On what an unknown depends; None for all, where a list would be longer than useful."""
        if variable.slot[0] == "discrete" and not initial:
            return None  # in event mode a mode depends on more than states and inputs
        references = self.dependencies.initial(variable) if initial else self.dependencies.continuous(variable)
        if len(references) > _MOST_DEPENDENCIES:
            return None
        if self.second:
            return [k + 1 for k in references]
        return list(dict.fromkeys(self.arrays[k].reference if k in self.arrays else k for k in references))
