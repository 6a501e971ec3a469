"""Assemblies of components without a class, as read from netlists."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import replace
from functools import partial
from typing import Any, ClassVar

from modelica_like.arguments import checked
from modelica_like.errors import (
    DuplicateName,
    LanguageError,
    ModelicaLikeError,
    Source,
    WrongConnection,
    raise_together_or_one,
)
from modelica_like.language.component import Component
from modelica_like.language.declared import Connector, unknown
from modelica_like.language.equation import Equations, connect, free, series
from modelica_like.language.expr import Expr, Symbol, symbol_of
from modelica_like.language.fields import Field, Input, Output, Parameter, Variable, param
from modelica_like.language.formula import CONSTANTS
from modelica_like.language.inside import Inside, InsideAssembly, inside
from modelica_like.language.places import NOWHERE, caller


class Assembly(Component):
    """Parts and their connections, named at run time.

    Connections are stored as text (`"clutch.flange_a"`), as in a netlist, and resolved when the model is used.

    Args:
        name: of the model.
        parts: components, or lists of them, by name.
        connect: paths of the ends of each connection, by its name.
        series: names of the parts of each chain, by its name.
        free: paths of connectors that stay unconnected on purpose.
        parameters: values by name.
        description: one phrase.
    """

    _kept: ClassVar[type[Inside]] = InsideAssembly
    _inside: InsideAssembly  # pyright: ignore[reportIncompatibleVariableOverride]

    @checked
    def __init__(
        self, name: str = "", *, parts: Mapping[str, Component | list[Component]] | None = None,
        connect: Mapping[str, Sequence[str]] | None = None, series: Mapping[str, Sequence[str]] | None = None,
        free: Sequence[str] = (), parameters: Mapping[str, Any] | None = None, description: str = "",
    ) -> None:  # fmt: skip
        super().__init__()
        record = self._inside
        record.name, record.description, record.made = name, description, caller()
        for key, value in (parameters or {}).items():
            self.add_parameter(key, value)
        for key, part in (parts or {}).items():
            setattr(self, key, part)
        record.wires = {key: tuple(ends) for key, ends in (connect or {}).items()}
        record.chains = {key: tuple(ends) for key, ends in (series or {}).items()}
        record.free = tuple(free)

    def add_parameter(self, name: str, value: Any) -> None:
        """Declare a parameter of the assembly; its unit is that of its value.

        Raises:
            LanguageError: no formula could name it.
            DuplicateName: the name is in use, also as that of a constant in formulas.
        """
        refused = f"{self.label}: a parameter cannot be called '{name}'."
        if name.startswith("_") or not name.isidentifier():
            raise LanguageError(refused, advice="A name is a letter, then letters, digits and _.")
        if name in CONSTANTS:
            raise DuplicateName(
                refused,
                why=f"In a formula, {name} is always {CONSTANTS[name]:.7g}….", advice="Choose another name.",
            )  # fmt: skip
        field: Parameter = param("*", default=value)
        declare(self, name, field)
        field.read(value)

    def expose(self, name: str, end: str) -> None:
        """Make an inner connector or signal an outer one of the assembly."""
        inner = end_at(self, end)
        if isinstance(inner, Connector):
            setattr(self, name, type(inner)(inner.description, free=inner.may_be_free))
        elif isinstance(field := inner.owner.fields[inner.name], Input | Output):
            declare(self, name, copy(field))
        else:
            raise unknown("connector", self.label, end, [])
        self._inside.exposed = (*self._inside.exposed, (name, end))

    def place(self, key: str, source: Source) -> None:
        """Store the place of a connection, series or part in the netlist."""
        self._inside.places[key] = source

    def source_of(self, key: str) -> Source:
        """Return the place of a connection, series or part in the netlist, or of a part in Python."""
        if not self._inside.places and key.startswith("parts."):
            return replace(self._inside.made, text=key)
        return self._inside.places.get(key, NOWHERE)

    @property
    def wires(self) -> dict[str, tuple[str, ...]]:
        """Connections by name."""
        return self._inside.wires

    @property
    def chains(self) -> dict[str, tuple[str, ...]]:
        """Series by name."""
        return self._inside.chains

    @property
    def free_ends(self) -> tuple[str, ...]:
        """Connectors that stay unconnected on purpose."""
        return self._inside.free

    @property
    def exposed(self) -> tuple[tuple[str, str], ...]:
        """Outer connectors and signals, and the inner ones they stand for."""
        return self._inside.exposed

    def __getattr__(self, name: str) -> Expr:
        if name in self._inside.own_fields:
            return symbol_of(self, name)
        if name in ("description", "simulate", "display", "origin", "sizing"):  # unless a part has this name
            return getattr(self._inside, name)
        raise AttributeError(f"{type(self).__name__} '{self._inside.name}' has no '{name}'")

    def __setattr__(self, name: str, value: Any) -> None:
        if name in self._inside.own_fields and not isinstance(value, Component | list):
            self.give(name, value)
        else:
            super().__setattr__(name, value)

    def equations(self) -> Equations:
        """Yield the connections; all their errors are reported together."""
        errors: list[ModelicaLikeError] = []
        for key, make in self._wiring():
            source = self.source_of(key)
            try:
                statements = make()
            except ModelicaLikeError as error:
                error.where = error.where or (self._told(key),)
                errors.append(error)
            else:
                yield from (replace(statement, source=source) for statement in statements)
        if errors:
            raise raise_together_or_one(errors)

    def _told(self, key: str) -> Source:
        """Return the place of an entry: its line in a netlist, or the call that created the assembly."""
        if self._inside.places:
            return self.source_of(key)
        kind, _, name = key.partition(".")
        given = {"connect": self._inside.wires, "series": self._inside.chains}.get(kind, {}).get(name)
        return replace(self._inside.made, text=key if given is None else f"{key} = {list(given)}")

    def _wiring(self) -> Iterator[tuple[str, Callable[[], list[Any]]]]:
        """Yield every entry of the netlist with the function that makes its statements."""
        for key, ends in self._inside.wires.items():
            yield f"connect.{key}", lambda ends=ends: [connect(*(end_at(self, end) for end in ends))]
        for key, names in self._inside.chains.items():
            yield f"series.{key}", partial(self._series, names)
        for end in self._inside.free:
            yield f"free.{end}", lambda end=end: [free(self._connector(end))]
        for name, end in self._inside.exposed:
            yield f"expose.{name}", lambda name=name, end=end: [connect(end_at(self, name), end_at(self, end))]

    def _series(self, names: Sequence[str]) -> list[Any]:
        components: list[Component] = []
        for name in names:
            part = self._inside.parts.get(name)
            components += part if isinstance(part, list) else [self._link(name)]
        return list(series(*components))

    def _link(self, path: str) -> Component:
        """Find a part of a series."""
        owner, _, name = path.rpartition(".")
        if owner and name in self.find(owner).connectors:
            raise WrongConnection(
                f"{path} is a connector, but a series joins parts.",
                advice=f"Write {owner} in the series, or join {path} in a connection of its own.",
            )
        if owner and name not in self.find(owner).parts:
            end_at(self, path)
        return self.find(path)

    def _connector(self, path: str) -> Connector:
        end = end_at(self, path)
        if isinstance(end, Connector):
            return end
        raise unknown("connector", self.label, path, [])


# Functions, because parts and parameters of an assembly may have names of methods.


def declare(of: Assembly, name: str, field: Field) -> None:
    """Declare a field that one assembly alone has.

    Raises:
        DuplicateName: the name is in use.
        ValueOutOfRange: the nominal value of the field is not positive and finite.
    """
    record = inside(of)
    if name in of.fields or name in record.parts or name in record.connectors:
        raise DuplicateName(f"{of.label}: '{name}' is already in use.")
    field.owner, field.name = of.label, name
    field.check()
    record.own_fields = {**record.own_fields, name: field}


def refused_wiring(of: Assembly, broken: Collection[str]) -> tuple[list[ModelicaLikeError], bool]:
    """Take the connections away that have errors, or name broken parts.

    Returns:
        The errors, but those about broken parts; and whether something was taken away.
    """
    record, errors, bad = inside(of), list[ModelicaLikeError](), set[str]()
    for key, make in [*Assembly._wiring(of)]:  # pyright: ignore[reportPrivateUsage]
        section, _, name = key.partition(".")
        known = {"connect": record.wires, "series": record.chains, "free": {name: (name,)}}
        known["expose"] = {outer: (end,) for outer, end in record.exposed}
        ends = [*known[section][name]]
        others = [end for end in ends if re.split(r"[.\[]", end)[0] not in broken]
        find = Assembly._link if section == "series" else end_at  # pyright: ignore[reportPrivateUsage]
        bad |= {key} if others != ends else set()
        for attempt in [make] if others == ends else [partial(find, of, end) for end in others]:
            try:
                attempt()
            except ModelicaLikeError as error:
                error.where = error.where or (Assembly._told(of, key),)  # pyright: ignore[reportPrivateUsage]
                errors.append(error)
                bad.add(key)
    record.wires = {name: ends for name, ends in record.wires.items() if f"connect.{name}" not in bad}
    record.chains = {name: ends for name, ends in record.chains.items() if f"series.{name}" not in bad}
    record.free = tuple(end for end in record.free if f"free.{end}" not in bad)
    record.exposed = tuple(pair for pair in record.exposed if f"expose.{pair[0]}" not in bad)
    return errors, bool(bad)


def end_at(of: Assembly, path: str) -> Connector | Symbol:
    """Find the connector or signal at a path."""
    owner_path, _, name = path.rpartition(".")
    owner = of.find(owner_path)
    if name in owner.connectors:
        return owner.connectors[name]
    if name in owner.fields and isinstance(owner.fields[name], Variable):
        return symbol_of(owner, name)
    signals = [key for key, field in owner.fields.items() if type(field).__name__ in ("Input", "Output")]
    label = f"{owner.label} ({type(owner).__name__})" if owner_path else owner.label
    if name in owner.parts:
        raise unknown("connector", label, name, [f"{name}.{c}" for c in owner.parts[name].connectors])
    raise unknown("connector", label, name, [*owner.connectors, *signals], owner.renamed)
