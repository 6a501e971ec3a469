"""Components that stand for classes of the standard library, with the values of a declaration."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from typing import Any

from modelica_like.errors import ModelicaLikeError, Source, UnknownName, did_you_mean
from modelica_like.language import Component, Parameter, Variable, guess
from modelica_like.language.fields import Input, Output, in_range
from modelica_like.language.inside import declarations, inside
from modelica_like.language.scopes import give_by_path
from modelica_like.netlist.modelica import fold
from modelica_like.netlist.modelica.attributes import check_attributes
from modelica_like.netlist.modelica.instance import GIVE, Given, Instance, Member, of_version_4, refused
from modelica_like.netlist.modelica.library import Known, table
from modelica_like.netlist.modelica.members import demand_determined, record_of
from modelica_like.netlist.modelica.parse import parse_expression
from modelica_like.netlist.modelica.resolve import Resolver
from modelica_like.netlist.modelica.tree import Expr, names_in, substituted
from modelica_like.netlist.modelica.types import Basic
from modelica_like.netlist.modelica.values import Notes
from modelica_like.netlist.modelica.written import as_formula
from modelica_like.netlist.read import new_component
from modelica_like.netlist.registry import find_type


def library_part(
    owner: Instance,
    name: str,
    member: Member,
    entry: Known,
    given: Given,
    driven: set[str],
    notes: Notes,
    initial: list[tuple[Expr, Expr, Source]],
) -> Component:
    """Return the component of a declaration.

    Args:
        owner: instance that declares it.
        name: of the part, with its index.
        member: the declaration.
        entry: its class.
        given: its modification.
        driven: its connected signals.
        notes: collects remarks.
        initial: collects initial equations, of accelerations.

    Raises:
        ModelicaTextError, UnknownName: a parameter does not exist here, or has a value that is not supported.
    """
    try:
        part = _Part(owner, name, member, entry, given, notes)
        component = part.make(driven)
    except ModelicaLikeError:
        owner.classes.lack(f"{owner.path}.{name}", entry.path)
        raise
    initial += part.initial
    inside(component).frozen = owner.frozen_in(name)
    return component


class _Part:
    def __init__(self, owner: Instance, name: str, member: Member, entry: Known, given: Given, notes: Notes) -> None:
        self.owner, self.name, self.member, self.known, self.given, self.notes = (
            owner,
            name,
            member,
            entry,
            given,
            notes,
        )
        self.given = of_version_4(given, [entry])
        self.entries = dict(self._entries())
        self.kind = self._kind()
        self.fields, self.structural = declarations(self.kind).fields, declarations(self.kind).structural
        self.values: dict[str, Expr] = {}
        self.used: set[str] = set()
        self.initial: list[tuple[Expr, Expr, Source]] = []

    def make(self, driven: set[str]) -> Component:
        self.used = used = {n.path for text in self.known.set.values() for n in names_in(parse_expression(str(text)))}
        starts: list[tuple[str, Given]] = []
        for name, start in self.entries.items():
            here = self.known.here(name)
            if here in self.fields:
                check_attributes(f"{self.name}.{name}", Basic("", start, frozenset()), self.member.text)
            if name in self.known.only:
                if start.value is not None and start.scope is not None:
                    self._equal(name, Resolver(*start.scope, numeric=True)(start.value), start.value.line)
                    self.values.pop(name, None)
            elif name in self.known.ignore and name not in used:
                continue
            elif here in self.structural or name in used or isinstance(self.fields.get(here), Parameter | Input):
                self._read(name, start)
            elif isinstance(self.fields.get(here), Variable) or "." in here:
                starts.append((here, start))
            elif here not in self._of_others():
                self._unknown(name, start)
        self._defaults()
        settings = {self.known.here(name): value for name, value in self.values.items() if name not in used}
        for here, text in self.known.set.items():
            if here not in driven:
                settings[here] = self._owners()(substituted(parse_expression(str(text)), self.values))
        for here, value in settings.items():
            self._demand_range(here, value)
        structural = {here: self._plain(here, value) for here, value in settings.items() if here in self.structural}
        part = new_component(self.kind, {**structural, **self.known.fix})
        for here, value in settings.items():
            if here not in structural:
                part.give(here, self._value(value))
        for here in self.known.fixed:
            starts += [(here, Given())] if here not in dict(starts) else []
        for here, start in starts:
            self._start(part, here, start)
        self._begin(part, dict(starts))
        return part

    def _demand_range(self, here: str, value: Expr) -> None:
        """Refuse a number that the component does not take; the class may."""
        field = self.fields.get(here)
        if isinstance(field, Parameter):
            # What no constants determine is checked with the values of a run, and so is what changes.
            with suppress(ModelicaLikeError), self.owner.classes.saying():
                value = self._owners().known()(value)
        if isinstance(field, Parameter) and value.kind == "number":
            label = f"{self.name}.{self.known.there(here)}"
            in_range(value.args[0], f"{value.args[0]:g}", label, str(field.unit), field.bounds)

    def _of_others(self) -> set[str]:
        """Return the names of parameters that other types have which the same class may be."""
        types = [find_type(name) for choice, name in self.known.by.items() if choice not in ("parameter", "default")]
        return {name for kind in types for name in declarations(kind).fields}

    def _begin(self, part: Component, starts: dict[str, Given]) -> None:
        """Collect the initial equations of a class, unless a parameter switches them off or a start value is fixed."""
        for here, source in self.known.begin.items():
            if here in inside(part).starts and inside(part).starts[here].fixed:
                continue
            if not any(getattr(part, flag, False) for flag in self.known.exact.split()):
                line = self.member.declaration.line
                left, right = (Expr("name", ((f"{self.name}.{name}", ()),), line) for name in (here, source))
                self.initial.append((left, right, self.member.text.place(line)))

    def _entries(self) -> Iterator[tuple[str, Given]]:
        """Yield names and modifications; those of a record are taken apart, as `losses.P`."""
        records = {name.partition(".")[0] for name in self.known.names.values() if "." in name}
        for name, entry in self.given.inner.items():
            if name not in records:
                yield name, entry
                continue
            yield from ((f"{name}.{key}", inner) for key, inner in entry.inner.items())
            if entry.value is not None and entry.value.kind == "name" and entry.scope is not None:
                record = record_of(entry.scope[0], entry.value)
                if record is None:
                    raise refused(f"this value for {self.name}.{name}", entry.scope[1], entry.value.line)
                known = set(self.known.names.values())
                for key in (key for key in record.members if f"{name}.{key}" in known):
                    path = Expr("name", (*entry.value.args, (key, ())), entry.value.line)
                    yield f"{name}.{key}", Given(path, entry.scope, line=entry.line)

    def _kind(self) -> type[Component]:
        """Return the component type; a parameter may choose it."""
        if not self.known.by:
            return self.known.type
        parameter, choices = self.known.by["parameter"], self.known.by
        entry = self.entries.pop(parameter, None)
        value = (
            Resolver(*entry.scope, numeric=True)(entry.value).args[0]
            if entry and entry.scope and entry.value
            else "default"
        )
        name = str(value).rpartition(".")[2]
        if name not in choices:
            what = f"{self.known.path.rpartition('.')[2]} with {parameter} = {name}"
            raise refused(what, self.member.text, entry.line if entry else 0, GIVE)
        return find_type(choices[name])

    def _owners(self) -> Resolver:
        return Resolver(self.owner, self.member.text)

    def _read(self, name: str, given: Given) -> None:
        """Resolve a value; a formula that other names than the owner's use becomes a number."""
        unit = given.inner.get("displayUnit")
        here = self.known.here(name)
        if unit is not None and unit.value is not None and isinstance(self.fields.get(here), Input):
            self._show(here, Resolver(*unit.scope)(unit.value) if unit.scope else unit.value)
        if given.value is None or given.scope is None:
            return
        demand_determined(f"{self.name}.{name}", given)
        node = Resolver(*given.scope)(given.value)
        if given.scope[0] is not self.owner or (as_formula(node) is None and node.kind not in (*fold.KNOWN, "array")):
            number = Resolver(*given.scope, numeric=True)(given.value)
            if number != node:
                words = given.scope[1].place(given.value.line).text
                self.notes.tell(f"{self.name}.{name} is a number now: a formula cannot have '{words}'.")
            node = number
        if node.kind == "name" and name in self.known.omit:
            node = Resolver(*given.scope, numeric=True)(given.value)
        if node.kind != "number" or self.known.omit.get(name) != node.args[0]:
            self.values[name] = node

    def _show(self, here: str, unit: Expr) -> None:
        if unit.kind != "string":
            raise refused(f"a displayUnit of {self.name}.{here} that is no text", self.member.text, unit.line)
        self.notes.display[f"{self.owner.path}.{self.name}.{here}".lstrip(".")] = unit.args[0]

    def _defaults(self) -> None:
        for name, value in self.known.default.items():
            here = self.known.here(name)
            has = here in self.fields or here in self.structural or name in (*self.known.only, *self.used)
            demanded = name in self.known.only and name in self.entries and self.entries[name].value is not None
            if name not in self.values and has and not demanded:
                text = str(value).lower() if isinstance(value, bool) else str(value)
                node = substituted(parse_expression(text), self.values)
                self.values[name] = self._owners()(node)
        for name in self.known.default:
            if name in self.known.only and name in self.values:
                self._equal(name, self.values.pop(name), self.member.declaration.line)

    def _equal(self, name: str, value: Expr, line: int) -> None:
        only = self.known.only[name]
        wanted = only if isinstance(only, list) else [only]
        actual = value.args[0].rpartition(".")[2] if isinstance(value.args[0], str) else value.args[0]
        if actual not in wanted:
            raise refused(
                f"{self.known.path.rpartition('.')[2]}.{name} = {actual}", self.member.text, line,
                f"The component {self.known.component} has {name} = {' or '.join(map(str, wanted))} only. {GIVE}",
            )  # fmt: skip

    def _plain(self, here: str, value: Expr) -> Any:
        """Return the value of a field that decides the structure."""
        if value.kind == "name" or (value.kind == "array" and any(True for _ in names_in(value))):
            value = self._owners().known()(value)
        if value.kind == "literal":
            kind, _, name = value.args[0].rpartition(".")
            choices = table()["enumerations"].get(kind, {})
            if name not in choices:
                raise refused(f"{value.args[0]} for {self.name}", self.member.text, self.member.declaration.line)
            return choices[name]
        if value.kind == "array":
            items = tuple(self._plain(here, argument) for argument in value.args)
            return _without_jumps(items, self.name, self.notes) if here == "table" else items
        if value.kind == "number" and isinstance(self.structural[here], int):
            return int(value.args[0])
        return value.args[0]

    def _value(self, value: Expr) -> Any:
        if value.kind == "array" and len(value.args) == 1:  # a class for several, of which the component is one
            value = value.args[0]
        formula = as_formula(value)
        if formula is None:
            formula = as_formula(self._owners().known()(value))
        if formula is None:
            raise refused(f"this value for {self.name}", self.member.text, self.member.declaration.line)
        return formula

    def _start(self, part: Component, here: str, given: Given) -> None:
        if given.value is not None:
            raise refused(f"{self.name}.{here} with an equation", self.member.text, given.line)
        attributes = {
            key: Resolver(*inner.scope)(inner.value)
            for key, inner in given.inner.items()
            if inner.value is not None and inner.scope is not None
        }
        if "displayUnit" in attributes:
            self._show(here, attributes["displayUnit"])
        path, _, last = here.rpartition(".")
        fixed = attributes["fixed"].args == (True,) if "fixed" in attributes else here in self.known.fixed
        if isinstance(part.find(path).fields[last], Output) and not fixed:
            return
        start = given.inner.get("start")
        value: Any = self.known.starts.get(here, 0.0)
        if start is not None and start.value is not None and start.scope is not None:
            outside = start.scope[0] is not self.owner
            demand_determined(f"{self.name}.{here}.start", start)
            node = Resolver(*start.scope, numeric=outside)(start.value)
            value = self._value(node)
        if fixed:
            give_by_path(part, here, value, above=1)
        elif value != 0.0:
            give_by_path(part, here, guess(value), above=1)

    def _unknown(self, name: str, given: Given) -> None:
        fixed, start = given.inner.get("fixed"), given.inner.get("start")
        rate = next((below for below in table()["rates"].get(name, "").split() if below in self.fields), "")
        if rate and fixed is not None and fixed.value is not None and fixed.value.args == (True,):
            value: Expr = fold.number(0)
            if start is not None and start.value is not None and start.scope is not None:
                value = Resolver(*start.scope)(start.value)
            speed = Expr("name", ((f"{self.name}.{rate}", ()),), given.line)
            self.initial.append(
                (Expr("call", ("der", (speed,), ()), given.line), value, self.member.text.place(given.line))
            )
            return
        if name in table()["ignored"]["variables"].split():
            return
        if given.value is None and given.inner and (fixed is None or fixed.value is None or not fixed.value.args[0]):
            return  # attributes of a variable that the component does not have
        ours = {back: front for front, back in self.known.names.items()}
        names = [self.known.names.get(key, key) for key in (*self.fields, *self.structural)]
        near = did_you_mean(name, [*names, *ours])
        raise UnknownName(
            f"{self.known.path} has no '{name}' here{near or '.'}",
            where=self.member.text.place(given.line or self.member.declaration.line),
            advice="" if near else GIVE,
        )


def _without_jumps(rows: tuple[Any, ...], name: str, notes: Notes) -> tuple[Any, ...]:
    """Return a table over time in which two rows at one time are a microsecond apart."""
    changed: list[Any] = []
    for row in rows:
        if changed and isinstance(row, tuple) and row[0] <= changed[-1][0]:
            row = (changed[-1][0] + 1e-6, *row[1:])
            notes.tell(f"{name}: where the table jumps, it does so in a microsecond.")
        changed.append(row)
    return tuple(changed)
