"""Parameter bindings of a SystemStructure.ssd: inline, or in .ssv files."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from modelica_like.cosimulation.described import UnitDefinition
from modelica_like.cosimulation.ssp_document import NAMES
from modelica_like.cosimulation.ssp_elements import (
    Element,
    ElementPath,
    Files,
    local,
    needed,
    number,
    place,
    unit_definitions,
)
from modelica_like.errors import NetlistError, Source

_VALUES = "application/x-ssp-parameter-set"
_BOOLEANS = {"true": 1.0, "1": 1.0, "false": 0.0, "0": 0.0}
_NO_NUMBERS = ("String", "Enumeration", "Binary")

Target = tuple[ElementPath, str]


@dataclass(frozen=True)
class Bound:
    """A value that a binding gives, in a unit if one is named."""

    value: float
    unit: UnitDefinition | None
    place: Source


def bound_values(root: Element, files: Files, units: dict[str, UnitDefinition]) -> dict[Target, Bound]:
    """Return what the bindings of a system and of all inside give to variables.

    Of two bindings of an element, the later one counts; of two elements, the outer one.

    Raises:
        NetlistError: a binding cannot be understood.
    """
    found: dict[Target, Bound] = {}
    for element in sorted(root.walk(), key=lambda one: -len(one.path)):
        for binding in element.xml.iterfind("ssd:ParameterBindings/ssd:ParameterBinding", NAMES):
            prefix = binding.get("prefix", "")
            for name, bound in _parameters(binding, files, units):
                found.update(dict.fromkeys(_targets(element, prefix + name), bound))
    return found


def _targets(element: Element, name: str) -> Iterator[Target]:
    """Yield what a hierarchical name means: names of elements may contain dots, so there can be several."""
    if element.file is not None or name in element.connectors:
        yield element.path, name
    for inner, child in element.children.items():
        if name.startswith(f"{inner}."):
            yield from _targets(child, name[len(inner) + 1 :])


def _parameters(binding: Any, files: Files, units: dict[str, UnitDefinition]) -> Iterator[tuple[str, Bound]]:
    if binding.find("ssd:ParameterMapping", NAMES) is not None:
        raise NetlistError(
            "Mappings of parameters (ssm) are not supported.", where=place(binding),
            advice="Give the values under the names that they have in the system.",
        )  # fmt: skip
    kind = binding.get("type", _VALUES)
    if kind != _VALUES:
        raise NetlistError(f"Parameters of type {kind} are not supported.", where=place(binding))
    for group in _sets(binding, files):
        known = units | unit_definitions(group)
        for one in group.iterfind("ssv:Parameters/ssv:Parameter", NAMES):
            yield needed(one, "name"), _value(one, known)


def _sets(binding: Any, files: Files) -> list[Any]:
    source = binding.get("source")
    if not source:
        return binding.findall("ssd:ParameterValues/ssv:ParameterSet", NAMES)
    if binding.get("sourceBase", "SSD") != "SSD":
        raise NetlistError("Parameters inside of a component's file are not supported.", where=place(binding))
    return [files.root(files.find(source, place(binding)))]


def _value(parameter: Any, units: dict[str, UnitDefinition]) -> Bound:
    typed = next((one for one in parameter if local(one) != "Annotations"), None)
    name = needed(parameter, "name")
    if typed is None or local(typed) in _NO_NUMBERS or local(typed) == "Dimension":
        what = "has no value" if typed is None else f"is of type {local(typed)}"
        raise NetlistError(f"Parameter '{name}' {what}; only numbers can be set.", where=place(parameter))
    if local(typed) == "Boolean" and typed.get("value") in _BOOLEANS:
        return Bound(_BOOLEANS[typed.get("value")], None, place(parameter))
    return Bound(number(typed, "value"), units.get(typed.get("unit", "")), place(parameter))
