"""What the names of a netlist that is being written mean; modules of folders without trust are not imported."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from modelica_like.errors import ModelicaLikeError
from modelica_like.language import Assembly, Component, Input, Output, Parameter
from modelica_like.language.declared import Connector
from modelica_like.language.fields import Field
from modelica_like.language.inside import declarations, inside
from modelica_like.language.units import ANY, ONE, Unit, parse_unit, same_dimension
from modelica_like.language.units.atoms import ATOMS
from modelica_like.language.units.quantity import counts_turns
from modelica_like.lsp.text import Text
from modelica_like.netlist.further import head
from modelica_like.netlist.json_schema import properties_of
from modelica_like.netlist.read import is_modelica, load
from modelica_like.netlist.registry import find_type, library_types

_USUAL = (
    "kg.cm2", "g.cm2", "mN.m", "N.mm", "N.cm", "kN.m", "mm/s", "m/min", "km/h", "N/mm", "kN/mm", "N/um", "N.m/deg",
)  # fmt: skip
"""Units that no type declares, and that are usual in drawings and catalogues."""


@dataclass(frozen=True)
class Owner:
    """A component type, or an assembly of a file, whose names are asked for.

    Attributes:
        kind: its class.
        about: name and description.
        fields: by name, as the connectors and parts.
        values: schemas of what a part can be given, by name.
        part: an assembly of a file itself.
    """

    kind: type[Component]
    about: str
    fields: Mapping[str, Field]
    connectors: Mapping[str, Connector]
    parts: Mapping[str, Component | list[Component]]
    values: Mapping[str, Mapping[str, Any]]
    part: Component | None = None

    def ends(self) -> dict[str, str]:
        """Return descriptions of connectors and signals by name."""
        signals = {name: field for name, field in self.fields.items() if isinstance(field, Input | Output)}
        ends = {**self.connectors, **signals}
        return {name: f"{type(end).__name__}: {end.description}" for name, end in ends.items()}

    def inner(self, name: str) -> Owner | None:
        """Return what is known of a part."""
        part = self.parts.get(name) or self.parts.get(head(name))
        part = part[0] if isinstance(part, list) and part else part
        return owner_of(part) if isinstance(part, Component) else None


def owner_of(part: type[Component] | Component) -> Owner:
    """Return the names of a type, of a part, or of an assembly."""
    kind = part if isinstance(part, type) else type(part)
    if isinstance(part, Assembly):
        about = f"{inside(part).name}\n\n{inside(part).description}"
        values = {name: {"description": field.description, "default": _written(field)} for name, field in
                  part.fields.items()}  # fmt: skip
        return Owner(kind, about.strip(), part.fields, part.connectors, part.parts, values, part)
    known = declarations(kind)
    return Owner(kind, about_type(kind), known.fields, known.connectors, known.parts, properties_of(kind))


def _written(field: Field) -> Any:
    """Return what a netlist gives a parameter, which is its default where the netlist is used as a part."""
    return (
        field.default if isinstance(field, Parameter) and isinstance(field.default, bool | float | int | str) else None
    )


def about_type(kind: type[Component]) -> str:
    """Return the name of a type, and its text."""
    return f"{kind.__name__}\n\n{inspect.cleandoc(kind.__doc__ or '')}".strip()


def described(schema: Mapping[str, Any]) -> str:
    """Return description, unit, default and limits of a value."""
    limits = schema.get("anyOf", [schema])[0]
    known = {"default:": schema.get("default"), "at least": limits.get("minimum"), "at most": limits.get("maximum")}
    words = [f"{name} {value:.6g}" if isinstance(value, float) else f"{name} {value}" for name, value in known.items()
             if value is not None]  # fmt: skip
    return "; ".join(filter(None, [schema.get("description", ""), *words, ", ".join(schema.get("enum", ()))]))


class Names:
    """Names of a netlist that is being written."""

    def __init__(self, text: Text) -> None:
        self.text = text
        self._types: dict[str, Owner | None] = {}

    def parts(self) -> dict[str, str]:
        """Return the types of the parts, as written, by the names of the parts."""
        names = dict.fromkeys(path[1] for path in self.text.outline.by_path if path[0] == "parts" and len(path) > 1)
        return {name: self._type(("parts", name)) or self._type(("parts", name, "0")) for name in names}

    def _type(self, path: tuple[str, ...]) -> str:
        entry = self.text.outline.by_path.get((*path, "is"))
        return self.text.outline.read(entry.value) if entry else ""

    def type(self, name: str) -> Owner | None:
        """Return the type of an `is`; None if there is none, it cannot be read, or is in a folder without trust."""
        if name not in self._types:
            self._types[name] = None  # the diagnostics tell why
            with suppress(ModelicaLikeError, OSError):
                is_file, file = is_modelica(name) or name.endswith(".toml"), self.text.path.parent / name
                self._types[name] = (
                    owner_of(load(file) if is_file else find_type(name, self.text.path.parent)) if name else None
                )
        return self._types[name]

    def owner(self, path: str) -> Owner | None:
        """Return what is known of a part, by its path."""
        first, *rest = path.split(".")
        if written := self._type(("parts", first, *rest)):  # also of a part that is replaced
            return self.type(written)
        owner = self.type(self.parts().get(head(first), ""))
        for name in rest:
            owner = owner.inner(name) if owner else None
        return owner

    def value(self, path: str) -> tuple[Mapping[str, Any], Unit | None]:
        """Return the schema of a value and its unit, by its path, as far as they are known."""
        owner_path, _, name = path.rpartition(".")
        owner = self.owner(owner_path) if owner_path else None
        field = owner.fields.get(name) if owner else None
        return owner.values.get(name, {}) if owner else {}, field.unit if field else None

    def parameters(self) -> dict[str, str]:
        """Return the entries of [parameters]."""
        entries = self.text.outline.by_path.items()
        read = self.text.outline.read
        return {path[1]: read(entry.value) for path, entry in entries if path[0] == "parameters" and len(path) > 1}


@lru_cache(maxsize=256)
def units_like(unit: Unit) -> list[str]:
    """Return usual units of a dimension: the unit itself, those of declarations, and those with a name."""
    fields = (field for kind in library_types().values() for field in declarations(kind).fields.values())
    known: dict[str, Any] = dict.fromkeys([str(unit), *(field.unit_text for field in fields), *ATOMS, *_USUAL])
    if unit in (ANY, ONE):
        return []
    units = ((text, parse_unit(text)) for text in known if text != "*")
    return [text for text, other in units if same_dimension(other, unit) and not counts_turns(other, unit)]
