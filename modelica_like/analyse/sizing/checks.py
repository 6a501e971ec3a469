"""The design checks of the installed libraries."""

from __future__ import annotations

import dataclasses
import importlib.util
import inspect
from collections.abc import Callable, Iterator, Mapping
from functools import lru_cache
from importlib.metadata import EntryPoint, entry_points
from types import MappingProxyType, ModuleType
from typing import Any, get_args

from modelica_like.errors import NetlistError, unknown_name
from modelica_like.language.results import Result, hints, quantity, quantity_of
from modelica_like.language.units import Unit, parse_unit
from modelica_like.netlist.registry import GROUP, imported, library_module

Check = Callable[..., Any]


@lru_cache(maxsize=1)
def design_checks() -> Mapping[str, Check]:
    """Return the design checks of all installed libraries by name, sorted.

    A library `gears` has its checks in the package `gears.sizing`: the functions of `__all__` that return a `Result`.

    Raises:
        NetlistError: a library cannot be imported, or two libraries have a check with the same name.
    """
    checks: dict[str, Check] = {}
    for entry in sorted(entry_points(group=GROUP), key=lambda entry: entry.name):
        for name, function in _checks_of(entry):
            if checks.setdefault(name, function) is not function:
                raise NetlistError(f"Two libraries have a design check '{name}': {checks[name].__module__} and "
                                   f"{function.__module__}.")  # fmt: skip
    return MappingProxyType(dict(sorted(checks.items())))


def _checks_of(entry: EntryPoint) -> Iterator[tuple[str, Check]]:
    package, name = library_module(entry), f"{entry.value}.sizing"
    if not hasattr(package, "__path__") or importlib.util.find_spec(name) is None:
        return
    module: ModuleType = imported(name, f"The design checks of the library '{entry.name}'")
    for member in getattr(module, "__all__", ()):
        function = getattr(module, member)
        if inspect.isfunction(function) and is_result(hints(function).get("return")):
            yield member, function


def find_check(name: str) -> Check:
    """Return the design check of an `is` in a sizing file."""
    checks = design_checks()
    if name not in checks:
        advice = "`modelica-like size` lists all checks."
        raise unknown_name(f"There is no design check '{name}'", name, checks, advice=advice)
    return checks[name]


@dataclasses.dataclass(frozen=True)
class Argument:
    """An argument of a design check; its annotation is a number with a unit, a text, a dataclass, or a sequence."""

    name: str
    kind: Any
    required: bool
    default: Any = None


def arguments_of(check: Any) -> dict[str, Argument]:
    """Return the arguments of a check or the fields of a dataclass that is an argument, by name."""
    kinds = hints(check)
    if dataclasses.is_dataclass(check):
        return {
            field.name: Argument(
                field.name,
                kinds[field.name],
                field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING,
            )
            for field in dataclasses.fields(check)
        }
    return {
        name: Argument(name, kinds[name], parameter.default is parameter.empty, parameter.default)
        for name, parameter in inspect.signature(check).parameters.items()
    }


def is_result(kind: Any) -> bool:
    """Return whether an annotation is a type of results."""
    return isinstance(kind, type) and issubclass(kind, Result)


def unit_of_kind(kind: Any) -> Unit | None:
    """Return the unit of a number's annotation, or None for other annotations."""
    declared = quantity(kind)
    return None if declared is None else parse_unit(declared.unit)


def unit_of_line(result: Any, name: str) -> Unit:
    """Return the unit of a line of a result, or that of a plain number."""
    return parse_unit(quantity_of(type(result), name).unit)


def without_none(kind: Any) -> Any:
    """Return an annotation without `| None`."""
    kinds = [option for option in get_args(kind) if option is not type(None)]
    return kinds[0] if type(None) in get_args(kind) else kind


def meanings(text: str) -> Iterator[tuple[str, str]]:
    """Yield the arguments that a docstring describes, with their descriptions."""
    inside = False
    for line in text.splitlines():
        if line.startswith("    ") and inside:
            name, colon, meaning = line.strip().partition(": ")
            if colon and name.isidentifier():
                yield name, meaning
        elif line:
            inside = line == "Args:"
