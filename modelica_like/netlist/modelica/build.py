"""From an instance of a Modelica class to a component with its parts."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from modelica_like.errors import (
    ModelicaLikeError,
    ModelicaTextError,
    Source,
    UnknownName,
    did_you_mean,
    raise_together_or_one,
)
from modelica_like.language import (
    Assembly,
    Component,
    Connector,
    signal_out,
)
from modelica_like.language.assembly import declare, end_at
from modelica_like.language.fields import Input, Parameter
from modelica_like.language.inside import inside
from modelica_like.netlist.modelica.at_start import bind_at_start
from modelica_like.netlist.modelica.attributes import check_attributes, check_declared
from modelica_like.netlist.modelica.before import begin_parts
from modelica_like.netlist.modelica.carried import Carried
from modelica_like.netlist.modelica.causal import is_causal, variables
from modelica_like.netlist.modelica.connectors import bundle, connector_of, lend
from modelica_like.netlist.modelica.declare import Fields
from modelica_like.netlist.modelica.elements import elements_of
from modelica_like.netlist.modelica.icons import icon_of
from modelica_like.netlist.modelica.instance import Given, Instance, Member, refused
from modelica_like.netlist.modelica.known import library_part
from modelica_like.netlist.modelica.library import Known, connector_type
from modelica_like.netlist.modelica.members import element, exists, part_of, sizes
from modelica_like.netlist.modelica.types import Basic, basic_type
from modelica_like.netlist.modelica.values import Notes, unit_of
from modelica_like.netlist.modelica.wiring import Wire, bundled, paths, rank
from modelica_like.netlist.modelica.written import (
    Written,
    WrittenConnector,
    check_determined,
    written_class,
)


def build_component(instance: Instance, notes: Notes) -> Written:
    """Return the component of an instance, with its parts.

    Args:
        instance: of a class with its modifications.
        notes: collects remarks.

    Raises:
        ModelicaTextError: something is not supported; several errors come as `WiringErrors`.
    """
    component = _Builder(instance, notes).run()
    check_determined(component)
    return component


class _Builder(Fields):
    def __init__(self, instance: Instance, notes: Notes, *, moved: bool = False) -> None:
        super().__init__(instance, notes, moved=moved)
        self.errors: list[ModelicaLikeError] = []
        self.absent: set[str] = set()
        self.driven: dict[str, set[str]] = {}

    def run(self) -> Written:
        bind_at_start(self.instance)
        self._attempt(Source(""), self.statements.read)
        if self.errors:
            raise raise_together_or_one(self.errors)
        text = self.instance.text
        kind: Any = written_class(text.name)
        self.component = component = kind(text.name, description=text.description)
        self.wires = self.statements.wires
        for name, bound in self.statements.bound.items():
            declare(component, name, signal_out(unit_of(bound.basic, self.notes), f"value of {bound.end}"))
            self.wires.append(Wire([name, bound.end], bound.source))
        for part, _, name in (end.rpartition(".") for wire in self.wires for end in wire.ends):
            self.driven.setdefault(part, set()).add(name)
        for name, member in self.instance.members.items():
            place = member.text.place(member.declaration.line)
            Assembly.place(component, f"parts.{name}", place)
            Assembly.place(component, f"parameters.{name}", place)
            self._attempt(place, self._member, name, member)
        if self.errors:
            raise raise_together_or_one(self.errors)
        self._drive()
        self.carried = Carried(component, self.instance)
        for wire in self.wires:
            self.carried.along(wire)
        record, statements = inside(component), self.statements
        equations = (*statements.equations, *self.instance.adopted, *self.carried.equations)
        record.text, record.statements, record.icon = text.path, equations, icon_of(self.instance)
        record.elsewhere, record.lent = frozenset(self.instance.lent), self.instance.balance
        record.initial, record.happenings = tuple(statements.initial), tuple(statements.happenings)
        begin_parts(component, self.instance.late)
        record.instants = frozenset(name for name, (_, instant) in statements.outputs.items() if instant)
        record.instants |= self.carried.instants
        self._connect()
        if self.errors:
            raise raise_together_or_one(self.errors)
        record.frozen = self.instance.frozen_in()
        return component

    def _drive(self) -> None:
        """Connect inputs of parts with a signal each, which an equation determines that own variables do not need."""
        component, joined = self.component, {end for wire in self.wires for end in wire.ends}
        ends = component.connectors.items()
        flows = (f"{name}.{key}" for name, c in ends for key, quantity in c.quantities.items() if quantity.is_flow)
        own = [name for name, field in component.fields.items() if not isinstance(field, Input | Parameter)]
        own = [name for name in (*own, *flows) if name.partition(".")[0] not in joined]
        rows = [([*paths(left), *paths(right)], source) for left, right, source in self.statements.equations]
        for names, source in list(rows):
            end = next((end for end in names if self._is_open(end) and end not in joined), "")
            rest = [row for row in rows if row[0] is not names] if end else rows
            if end and rank(rest, own) == rank(rows, own):
                rows = rest
                joined.add(end)
                signal = end.replace(".", "_")
                while signal in self.instance.members or signal in component.fields:
                    signal += "_"
                declare(component, signal, signal_out("1", f"value of {end}"))
                self.wires.append(Wire([signal, end], source))

    def _is_open(self, end: str) -> bool:
        """Tell whether a path is that of an input of a part without a value."""
        path, _, name = end.rpartition(".")
        part = self.component.parts.get(path)
        return part is not None and isinstance(part.fields.get(name), Input) and part.value(name) is None

    def _attempt(self, place: Source, action: Any, *arguments: Any) -> None:
        """Collect an error, with the place of its declaration."""
        try:
            action(*arguments)
        except ModelicaLikeError as error:
            if not any(p.file.endswith(".mo") for p in error.where):
                error.where = (place,) if place.file else error.where
            self.errors.append(error)
            if self.instance.classes.spent:
                raise

    # -- members -----------------------------------------------------------------------------------------------------

    def _member(self, name: str, member: Member) -> None:
        if member.declaration.is_outer or not exists(self.instance, member):
            self.absent.add(name)
            return
        basic = basic_type(self.instance, member)
        if basic is not None:
            self._basic(name, member, basic)
            return
        shape = sizes(self.instance, member)
        parts = {
            path: self._part(path, member, part_of(self.instance, member, place), element(member.given, place, shape))
            for path, place in elements_of(name, shape)
        }
        if len(shape) == 1 and not any(isinstance(part, Connector) for part in parts.values()):
            setattr(self.component, name, [*parts.values()])
            return
        for path, part in parts.items():
            setattr(self.component, path, part)

    def _part(self, name: str, member: Member, part: Instance | Known | str, given: Given) -> Component | Connector:
        self.instance.classes.spend(50, member.text, member.declaration.line)
        if isinstance(part, Known):
            driven = self.driven.get(name, set())
            return library_part(self.instance, name, member, part, given, driven, self.notes, self.statements.initial)
        if isinstance(part, str):
            kind = connector_type(part)
            if kind is None:
                raise refused(f"{part} as a component", member.text, member.declaration.line)
            connector = kind(member.declaration.description, free=True)
            for field_name, entry in given.inner.items():
                if field_name not in connector.fields:
                    what = f"{name} has no '{field_name}'{did_you_mean(field_name, connector.fields) or '.'}"
                    raise UnknownName(what, where=(entry.text or member.text).place(entry.line))
                check_attributes(f"{name}.{field_name}", Basic("Real", entry, frozenset()), member.text)
            return connector
        if part.text.kind == "connector":
            if part.text.expandable:
                return _Builder(part, self.notes).run()
            if is_causal(part):
                part.lent |= {variable.name for variable in variables(part) if not variable.continuous}
                part.balance += sum(variable.continuous for variable in variables(part))
                return _Builder(part, self.notes).run()
            return bundle(name, part, self.instance, self.wires) if bundled(part) else connector_of(part)
        component = _Builder(part, self.notes, moved=part.owner is not self.instance).run()
        if part.text.kind == "record":
            lend(component, self.instance)
        return component

    def _basic(self, name: str, member: Member, basic: Basic) -> None:
        declared = member.declaration
        check_declared(self.instance, member, basic)
        if "constant" in declared.prefixes or basic.kind in ("String", "StateSelect", "object"):
            return
        if "parameter" in declared.prefixes:
            if basic.kind == "Real" and not declared.dimensions:
                self.parameter(name, member, basic)
            return
        shape = sizes(self.instance, member)
        for path, place in elements_of(name, shape):
            self.variable(path, name, member, replace(basic, given=element(basic.given, place, shape)))

    # -- equations and connections -----------------------------------------------------------------------------------

    def _connect(self) -> None:
        component = self.component
        joined: set[str] = set()
        wires: dict[str, tuple[str, ...]] = {}
        for wire in self.wires:
            ends = tuple(end for end in wire.ends if end.partition(".")[0].partition("[")[0] not in self.absent)
            if len(ends) < 2:
                continue
            key = f"wire_{len(wires) + 1}"
            wires[key] = ends
            joined.update(ends)
            Assembly.place(component, f"connect.{key}", wire.source)
            before = len(self.errors)
            self._attempt(wire.source, self._check_ends, ends)
            if len(self.errors) > before:
                self._lack(ends)
        inside(component).wires = wires
        inside(component).free = tuple(
            f"{name}.{end}"
            for name, part in component.parts.items()
            for end, connector in part.connectors.items()
            if not connector.may_be_free and f"{name}.{end}" not in joined
        )

    def _lack(self, ends: tuple[str, ...]) -> None:
        """Remember the parts of a connection that are components: one of them lacks an end."""
        for head in {end.partition(".")[0].partition("[")[0] for end in ends if "." in end}:
            member = self.instance.members.get(head)
            first = tuple(1 for _ in sizes(self.instance, member)) if member else ()
            part = part_of(self.instance, member, first) if member else None
            if isinstance(part, Known):
                self.instance.classes.lack(f"{self.instance.path}.{head}", part.path)

    def _check_ends(self, ends: tuple[str, ...]) -> None:
        connectors = [end_at(self.component, end) for end in ends]
        kinds = {tuple(c.fields) for c in connectors if isinstance(c, WrittenConnector)}
        if len(kinds) > 1:
            raise ModelicaTextError(f"The connectors {', '.join(ends)} differ.")
        for end, connector in zip(ends, connectors, strict=True):
            if isinstance(connector, Connector) or not isinstance(connector.owner, Written):
                continue
            if connector.name in inside(connector.owner).instants and not self.carried.reached >= {*ends}:
                raise ModelicaTextError(
                    f"{end} is true for instants only, which a connection does not carry here.",
                    advice="Write the 'when' in the class of the sample, or name the variable: when block.y then.",
                )
