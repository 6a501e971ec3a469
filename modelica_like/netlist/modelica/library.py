"""The table of the standard library's classes, and the built-in Modelica text."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

from modelica_like.language import Component, Connector
from modelica_like.language.inside import declarations
from modelica_like.netlist.modelica.parse import parse_modelica
from modelica_like.netlist.modelica.tree import ClassText
from modelica_like.netlist.registry import find_type

_HERE = Path(__file__).parent
_READ = ("is", "names", "ports", "ignore", "absent")


@dataclass(frozen=True)
class Known:
    """A class of the standard library that a component stands for; see `standard_library.toml`.

    Attributes:
        path: full name of the class.
        component: name of the component type.
        names: the class's names by the component's.
        set: expressions of the class's parameters by the component's field.
        put: expressions of the component's fields by the class's parameter.
        default: of the class's parameters.
        fix: values of the component's fields.
        starts: start values of variables where none is given.
        fixed: variables whose start values are fixed where nothing else is said.
        begin: inputs that are the start values of variables, unless a Boolean of the component in `exact` is true.
        only: the one value that is supported, by the class's parameter.
        omit: values that stand for none, by the class's parameter.
        by: the component types by the value of a `parameter`, and the `default` one.
        ignore: names of the class's parameters without a meaning here.
        absent: fields of the component that the class does not have.
        instead: the class's parameters that stand for such a field, as expressions of it.
    """

    path: str
    component: str
    names: Mapping[str, str]
    set: Mapping[str, str] = field(default_factory=dict[str, str])
    put: Mapping[str, str] = field(default_factory=dict[str, str])
    default: Mapping[str, Any] = field(default_factory=dict[str, Any])
    fix: Mapping[str, Any] = field(default_factory=dict[str, Any])
    starts: Mapping[str, float] = field(default_factory=dict[str, float])
    fixed: frozenset[str] = frozenset()
    begin: Mapping[str, str] = field(default_factory=dict[str, str])
    exact: str = ""
    only: Mapping[str, Any] = field(default_factory=dict[str, Any])
    omit: Mapping[str, float] = field(default_factory=dict[str, float])
    by: Mapping[str, str] = field(default_factory=dict[str, str])
    ignore: frozenset[str] = frozenset()
    absent: frozenset[str] = frozenset()
    instead: Mapping[str, Mapping[str, str]] = field(default_factory=dict[str, Mapping[str, str]])

    @property
    def type(self) -> type[Component]:
        """The component type."""
        return find_type(self.component)

    def here(self, name: str) -> str:
        """Return the component's name for one of the class's: of a parameter, variable or connector."""
        here_of = {given: ours for ours, given in self.names.items()}
        if name in here_of:
            return here_of[name]
        head, bracket, index = name.partition("[")
        pattern = here_of.get(f"{head}[#]") if bracket else None
        return pattern.replace("#", index.rstrip("]")) if pattern else name

    def has(self, name: str) -> bool:
        """Tell whether the component has a variable, a parameter, a rate or an end of this name of its own."""
        declared, head = declarations(self.type), re.split(r"[.\[]", name)[0]
        if name in table()["ignored"]["variables"].split():
            return False
        rates = table()["rates"].get(name, "").split()
        own = {*declared.fields, *declared.structural, *declared.connectors}
        return name in own or head in declared.connectors or any(rate in own for rate in rates)

    def there(self, name: str) -> str:
        """Return the class's name for one of the component's."""
        if name in self.names:
            return self.names[name]
        index = re.search(r"\[(\d+)\]", name)
        pattern = self.names.get(name.replace(index[0], "[#]", 1)) if index else None
        return pattern.replace("#", index[1]) if pattern and index else name


@lru_cache(maxsize=1)
def table() -> dict[str, Any]:
    """Return the table of the standard library."""
    return tomllib.loads((_HERE / "standard_library.toml").read_text(encoding="utf-8"))


@lru_cache(maxsize=1)
def known_classes() -> dict[str, Known]:
    """Return the classes that components stand for, by their full names."""
    data = table()
    common = data["ignored"]["parameters"].split()
    by_name: dict[str, Known] = {}
    for package, classes in data["classes"].items():
        for name, entry in classes.items():
            rest = {key: value for key, value in entry.items() if key not in _READ}
            rest["fixed"] = frozenset(entry.get("fixed", "").split())
            names = {**data["names"], **entry.get("names", {}), **entry.get("ports", {})}
            ignored = frozenset([*common, *entry.get("ignore", "").split()])
            path = f"{package}.{name}"
            absent = frozenset([*data["absent"]["fields"].split(), *entry.get("absent", "").split()])
            by_name[path] = Known(path, entry.get("is", name), names, ignore=ignored, absent=absent, **rest)
    return by_name


@lru_cache(maxsize=1)
def by_component() -> dict[str, Known]:
    """Return the class that a component is written as, by the component's name: the first of the table."""
    classes: dict[str, Known] = {}
    for entry in known_classes().values():
        if not entry.by:
            classes.setdefault(entry.component, entry)
    return classes


@lru_cache(maxsize=1)
def built_in() -> dict[str, ClassText]:
    """Return the outermost classes of the built-in text, with blocks in `Modelica`."""
    classes: dict[str, ClassText] = {}
    for file in (_HERE / "builtin.mo", _HERE / "blocks.mo"):
        for stored in parse_modelica(file.read_text(encoding="utf-8"), file.name):
            around = classes.get(stored.within)
            (classes if around is None else around.classes)[stored.name] = stored
            stored.owner = around
    return classes


def connector_type(path: str) -> type[Connector] | None:
    """Return the connector that stands for one of the standard library, None if there is none."""
    entry = table()["connectors"].get(path)
    if entry is None:
        return None
    component, _, name = entry.partition(".")
    return type(declarations(find_type(component)).connectors[name])
