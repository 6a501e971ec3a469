"""modelDescription.xml for FMI 2.0 and 3.0."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from modelica_like.compile.compiled import CompiledDae
from modelica_like.fmi.dependencies import Dependencies
from modelica_like.fmi.interface import FmuVariable, Interface
from modelica_like.fmi.xml import Element, document, element, number, unit_name
from modelica_like.units import Unit, parse_unit

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


def identifier(name: str) -> str:
    """Return a C identifier for a model name."""
    plain = re.sub(r"\W", "_", name, flags=re.ASCII).strip("_")
    return plain if plain and not plain[0].isdigit() else f"model_{plain}".rstrip("_")


def model_description(model: CompiledDae, variables: Interface, about: About) -> str:
    """Write modelDescription.xml.

    Args:
        model: the compiled model.
        variables: its FMI variables.
        about: what else the description says.
    """
    return document((_Fmi2 if about.version == "2.0" else _Fmi3)(model, variables, about).write())


def build_description(name: str, sources: Sequence[str]) -> str:
    """Write buildDescription.xml: which C files make the binary."""
    top = Element("fmiBuildDescription", {"fmiVersion": "3.0"})
    configuration = element(top, "BuildConfiguration", modelIdentifier=identifier(name))
    files = element(configuration, "SourceFileSet", language="C99", compilerOptions="-O2 -ffp-contract=off")
    for source in sources:
        element(files, "SourceFile", name=source)
    return document(top)


class _Writer(ABC):
    """What both versions have in common."""

    def __init__(self, model: CompiledDae, variables: Interface, about: About) -> None:
        self.model = model
        self.about = about
        self.interface = variables
        self.variables = variables.variables
        self.dependencies = Dependencies(model, variables)
        self.types = {names: f"Mode_{k}_{'_'.join(names)}"[:120] for k, names in enumerate(self._mode_names(), 1)}

    def write(self) -> Element:
        """Write all parts in the order of the schema."""
        about = self.about
        top = Element("fmiModelDescription", {
            "fmiVersion": about.version, "modelName": self.model.name, **self._attributes(),
            "description": about.description or None, "generationTool": about.tool,
            "variableNamingConvention": "structured",
        })  # fmt: skip
        self._kinds(top)
        self.units(top)
        if self.types:
            definitions = element(top, "TypeDefinitions")
            for names, title in self.types.items():
                kind = self._type(definitions, title)
                for value, name in enumerate(names):
                    element(kind, "Item", name=name, value=value)
        self.log_categories(top)
        self.default_experiment(top)
        listed = element(top, "ModelVariables")
        for one in self.listed():
            self._variable(listed, one)
        self._structure(element(top, "ModelStructure"))
        return top

    def listed(self) -> Iterable[FmuVariable]:
        """Variables in the order of the description."""
        return self.variables

    @abstractmethod
    def _attributes(self) -> dict[str, Any]: ...

    @abstractmethod
    def _kinds(self, top: Element) -> None: ...

    @abstractmethod
    def _type(self, definitions: Element, title: str) -> Element: ...

    @abstractmethod
    def _variable(self, listed: Element, one: FmuVariable) -> None: ...

    @abstractmethod
    def _structure(self, structure: Element) -> None: ...

    def _mode_names(self) -> list[tuple[str, ...]]:
        return list(dict.fromkeys(one.modes for one in self.variables if one.modes))

    def units(self, top: Element) -> None:
        """Define every unit, with its base units, and how people read it."""
        used = {name: one.unit for one in self.variables if (name := unit_name(one.unit)) is not None}
        if not used:
            return
        definitions = element(top, "UnitDefinitions")
        for name, unit in sorted(used.items()):
            defined = element(definitions, "Unit", name=name)
            exponents = {base: power for base, power in unit.exponents.items() if power}
            if all(isinstance(power, int) for power in exponents.values()):
                element(defined, "BaseUnit", **exponents, **_scale(unit))
            for shown in DISPLAY_UNITS.get(name, ()):
                other = parse_unit(shown)
                offset = -other.offset / other.factor
                element(defined, "DisplayUnit", name=shown, factor=1.0 / other.factor, offset=offset or None)

    def log_categories(self, top: Element) -> None:
        """List the log categories."""
        categories = element(top, "LogCategories")
        for name, text in self.about.log_categories.items():
            element(categories, "Category", name=name, description=text)

    def default_experiment(self, top: Element) -> None:
        """Suggest how to run."""
        about = self.about
        element(
            top, "DefaultExperiment", startTime=0.0, stopTime=about.stop_time, tolerance=about.tolerance,
            stepSize=about.step_size,
        )  # fmt: skip

    def initial_unknowns(self) -> list[FmuVariable]:
        """Outputs, calculated parameters, states and derivatives that initialization determines, by reference."""
        own = {*self.interface.states, *self.interface.derivatives, *self.interface.outputs}
        return [
            one
            for one in self.variables
            if (one.reference in own and one.initial != "exact") or one.causality == "calculatedParameter"
        ]

    def known(self, one: FmuVariable, initial: bool = False) -> list[int] | None:
        """Value references on which an unknown depends; None for all, where a list would be longer than useful."""
        if one.slot[0] == "discrete" and not initial:
            return None  # in event mode a mode depends on more than states and inputs
        found = self.dependencies.initial(one) if initial else self.dependencies.continuous(one)
        return found if len(found) <= _MOST_DEPENDENCIES else None

    def attributes(self, one: FmuVariable) -> dict[str, Any]:
        """Attributes that mean the same in both versions."""
        name = unit_name(one.unit)
        whole = one.type != "Float64"
        return {
            "unit": name,
            "displayUnit": DISPLAY_UNITS[name][0] if name in _SUGGESTED else None,
            "min": number(one.min, whole=whole),
            "max": number(one.max, whole=whole),
            "nominal": one.nominal,
            "start": number(one.start, whole=whole),
        }

    def ordered(self, references: Sequence[int]) -> Iterator[FmuVariable]:
        """Variables of value references, in the same order."""
        return (self.variables[k] for k in references)


def _scale(unit: Unit) -> dict[str, float]:
    return {} if unit.factor == 1.0 else {"factor": unit.factor}


class _Fmi2(_Writer):
    """FMI 2.0: variables by their index, from one."""

    def _attributes(self) -> dict[str, Any]:
        return {"guid": self.about.token, "numberOfEventIndicators": len(self.interface.indicators)}

    def _kinds(self, top: Element) -> None:
        common = {
            "modelIdentifier": identifier(self.model.name), "canGetAndSetFMUstate": True, "canSerializeFMUstate": True,
            "providesDirectionalDerivative": True,
        }  # fmt: skip
        own = {
            "canHandleVariableCommunicationStepSize": not self.about.fixed_step, "canInterpolateInputs": True,
            "maxOutputDerivativeOrder": 3,
        }  # fmt: skip
        for kind, tag, more in (("me", "ModelExchange", {}), ("cs", "CoSimulation", own)):
            if kind in self.about.kinds:
                files = element(element(top, tag, **common, **more), "SourceFiles")
                for name in self.about.sources:
                    element(files, "File", name=name)

    def _type(self, definitions: Element, title: str) -> Element:
        return element(element(definitions, "SimpleType", name=title), "Enumeration")

    def _variable(self, listed: Element, one: FmuVariable) -> None:
        scalar = element(
            listed, "ScalarVariable", name=one.name, valueReference=one.reference,
            description=one.description or None, causality=one.causality, variability=one.variability,
            initial=one.initial,
        )  # fmt: skip
        attributes = self.attributes(one)
        if one.type != "Float64":
            kept = {key: attributes[key] for key in ("min", "max", "start")}
            element(scalar, "Enumeration" if one.modes else "Integer", declaredType=self.types.get(one.modes), **kept)
        else:
            derivative = None if one.derivative_of is None else one.derivative_of + 1
            element(scalar, "Real", **attributes, derivative=derivative)

    def _structure(self, structure: Element) -> None:
        interface = self.interface
        lists = (
            ("Outputs", self.ordered(interface.outputs), False),
            ("Derivatives", self.ordered(interface.derivatives), False),
            ("InitialUnknowns", self.initial_unknowns(), True),
        )
        for tag, unknowns, initial in lists:
            found = list(unknowns)
            if not found:
                continue
            group = element(structure, tag)
            for one in found:
                known = self.known(one, initial)
                element(
                    group, "Unknown", index=one.reference + 1,
                    dependencies=None if known is None else [k + 1 for k in known],
                    dependenciesKind=None if known is None else ["dependent"] * len(known),
                )  # fmt: skip


class _Fmi3(_Writer):
    """FMI 3.0: variables by their value references."""

    def _attributes(self) -> dict[str, Any]:
        return {"instantiationToken": self.about.token}

    def _kinds(self, top: Element) -> None:
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

    def _type(self, definitions: Element, title: str) -> Element:
        return element(definitions, "EnumerationType", name=title)

    def listed(self) -> Iterable[FmuVariable]:
        inside = {k for array in self.interface.arrays for k in array.elements}
        return (one for one in (*self.variables, *self.interface.arrays) if one.reference not in inside)

    def known(self, one: FmuVariable, initial: bool = False) -> list[int] | None:
        arrays = {k: array.reference for array in self.interface.arrays for k in array.elements}
        found = super().known(one, initial)
        return found if found is None or not arrays else list(dict.fromkeys(arrays.get(k, k) for k in found))

    def _variable(self, listed: Element, one: FmuVariable) -> None:
        attributes = self.attributes(one)
        if one.type != "Float64":
            del attributes["unit"], attributes["displayUnit"], attributes["nominal"]
        if one.elements:
            attributes["start"] = [self.variables[k].start for k in one.elements]
        written = element(
            listed, one.type, name=one.name, valueReference=one.reference, description=one.description or None,
            causality=one.causality, variability=one.variability, initial=one.initial,
            declaredType=self.types.get(one.modes), **attributes, derivative=one.derivative_of,
        )  # fmt: skip
        for size in one.dimensions:
            element(written, "Dimension", start=size)

    def _structure(self, structure: Element) -> None:
        interface = self.interface
        lists = (
            ("Output", self.ordered(interface.outputs), False),
            ("ContinuousStateDerivative", self.ordered(interface.derivatives), False),
            ("InitialUnknown", self.initial_unknowns(), True),
            ("EventIndicator", self.ordered(interface.indicators), False),
        )
        for tag, unknowns, initial in lists:
            for one in unknowns:
                known = self.known(one, initial)
                kinds = None if known is None else " ".join(["dependent"] * len(known))
                element(structure, tag, valueReference=one.reference, dependencies=known, dependenciesKind=kinds)
