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
    boolean,
    discrete,
    guess,
    integer,
    param,
    signal_in,
    signal_out,
    var,
)
from modelica_like.language.assembly import declare, end_at
from modelica_like.language.fields import Discrete, Field, Input, Parameter
from modelica_like.language.inside import inside
from modelica_like.netlist.modelica.at_start import bind_at_start
from modelica_like.netlist.modelica.attributes import check_attributes, check_declared
from modelica_like.netlist.modelica.before import begin_parts, uses_time
from modelica_like.netlist.modelica.carried import Carried
from modelica_like.netlist.modelica.causal import is_causal, variables
from modelica_like.netlist.modelica.connectors import bundle, connector_of, lend
from modelica_like.netlist.modelica.fold import numbered
from modelica_like.netlist.modelica.icons import icon_of
from modelica_like.netlist.modelica.instance import Given, Instance, Member, refused
from modelica_like.netlist.modelica.known import library_part
from modelica_like.netlist.modelica.library import Known, connector_type
from modelica_like.netlist.modelica.members import (
    demand_determined,
    element,
    elements_of,
    exists,
    part_of,
    sizes,
    undetermined,
)
from modelica_like.netlist.modelica.resolve import Resolver
from modelica_like.netlist.modelica.statements import Statements
from modelica_like.netlist.modelica.tree import Expr
from modelica_like.netlist.modelica.types import Basic, basic_type, is_signal
from modelica_like.netlist.modelica.values import Notes, known, nominal_of, number_of, shown_unit, unit_of, value_of
from modelica_like.netlist.modelica.wiring import Wire, bundled, paths, rank
from modelica_like.netlist.modelica.written import (
    MEMORY,
    Written,
    WrittenConnector,
    as_formula,
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


_MEMORIES: dict[str, Any] = {
    "Boolean": boolean, "Real": lambda description: discrete("1", description, start=0.0)
}  # fmt: skip
_STATE_SELECT = {"always": "always", "prefer": "prefer", "avoid": "avoid", "never": "avoid"}


class _Builder:
    def __init__(self, instance: Instance, notes: Notes, *, moved: bool = False) -> None:
        self.instance, self.notes = instance, notes
        self.moved = moved  # a record that is given as a whole keeps the names of where it comes from
        self.statements = Statements(instance)
        self.errors: list[ModelicaLikeError] = []
        self.absent: set[str] = set()

    def run(self) -> Written:
        bind_at_start(self.instance)
        self._attempt(Source(""), self.statements.read)
        if self.errors:
            raise raise_together_or_one(self.errors)
        text = self.instance.text
        kind: Any = written_class(text.name)
        component: Written = kind(text.name, description=text.description)
        self.component = component
        self.wires = self.statements.wires
        for name, bound in self.statements.bound.items():
            declare(component, name, signal_out(unit_of(bound.basic, self.notes), f"value of {bound.end}"))
            self.wires.append(Wire([name, bound.end], bound.source))
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
            rest = [row for row in rows if row[0] is not names]
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
        if len(shape) > 1:
            raise refused(f"{name}, an array with several dimensions,", member.text, member.declaration.line)
        if not shape:
            part = part_of(self.instance, member)
            setattr(self.component, name, self._part(name, member, part, member.given))
            return
        parts = [
            self._part(f"{name}[{k}]", member, part_of(self.instance, member, k), element(member.given, k, shape[0]))
            for k in range(1, shape[0] + 1)
        ]
        if parts and isinstance(parts[0], Connector):
            for k, element_part in enumerate(parts, 1):
                setattr(self.component, f"{name}[{k}]", element_part)
        else:
            setattr(self.component, name, parts)

    def _part(self, name: str, member: Member, part: Instance | Known | str, given: Given) -> Component | Connector:
        self.instance.classes.spend(50, member.text, member.declaration.line)
        if isinstance(part, Known):
            driven = {
                end.rpartition(".")[2] for wire in self.wires for end in wire.ends if end.rpartition(".")[0] == name
            }
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
                self._parameter(name, member, basic)
            return
        shape = sizes(self.instance, member)
        for path, index in elements_of(name, shape):
            given = element(basic.given, index, shape[0]) if index else basic.given
            self._variable(path, name, member, replace(basic, given=given))

    def _parameter(self, name: str, member: Member, basic: Basic) -> None:
        given = member.given
        begins = given.value is None and "start" in given.inner and given.inner["start"].value is not None
        given = given.inner["start"] if begins else given
        low, high = (number_of(basic.given.inner.get(limit)) for limit in ("min", "max"))
        fixed = known(basic.given.inner.get("fixed")) is not False
        initial = [
            right for left, right, _ in self.statements.initial if left == Expr("name", ((name, ()),), left.line)
        ]
        if not fixed and any(map(uses_time, initial)):  # it begins with the run, and ticks may count from it
            declare(self.component, name, discrete(unit_of(basic, self.notes), member.declaration.description))
            return
        if begins and fixed:
            self.notes.tell(f"{f'{self.instance.path}.{name}'.lstrip('.')} has no value; its start value is taken.")
        outside = given.scope is not None and given.scope[0] is not self.instance
        formula = None if given.value is None or given.scope is None else Resolver(*given.scope)(given.value)
        # What depends on a parameter of the initial equations is another one, by an equation of its own.
        follows = fixed and not outside and formula is not None and bool(undetermined(self.instance, formula))
        parameter = param(
            unit_of(basic, self.notes),
            member.declaration.description,
            min=low,
            max=high,
            fixed=fixed and not follows,
            tunable=name not in self.instance.frozen,
        )
        if follows and formula is not None:
            place = member.text.place(member.declaration.line)
            self.statements.initial.append((Expr("name", ((name, ()),)), formula, place))
        elif given.value is not None and not outside:
            parameter.default = self._value(given, self.instance, "")
        parameter.nominal = nominal_of(basic)
        if isinstance(parameter, Parameter):
            self.instance.parameters[name] = parameter
        declare(self.component, name, parameter)
        if given.value is not None and outside:
            demand_determined(f"{self.instance.path}.{name}".lstrip("."), given)
            value = self._value(given, self.instance.owner, "")
            self.component.give(name, value if fixed or not begins else guess(value))

    def _value(self, given: Given, reader: Instance | None, prefix: str) -> Any:
        """Return a value as a number or a formula, read among the names of `reader`."""
        assert given.value is not None
        assert given.scope is not None
        node = Resolver(*given.scope)(given.value)
        near = given.scope[0] is reader and not (self.moved and reader is not self.instance)
        formula = as_formula(node, prefix) if near else None
        if formula is None:
            numbers = Resolver(*given.scope, numeric=True)(given.value)
            if numbers.kind != "number":
                raise refused("this value", given.scope[1], given.value.line)
            if node.kind != "number":
                self.notes.tell(
                    f"Line {given.value.line}: the formula is a number now, because a formula cannot have all of it."
                )
            return numbers.args[0]
        return formula

    def _variable(self, path: str, name: str, member: Member, basic: Basic) -> None:
        description = member.declaration.description
        declared: Field
        signal = is_signal(self.instance, member, basic)
        if basic.kind == "Boolean" and not signal:
            declared = boolean(description)
        elif basic.kind in ("Integer", "enumeration") and not signal:
            declared = integer(description)
        elif (path in self.statements.assigned and not signal) or "discrete" in basic.prefixes:
            declared = discrete(unit_of(basic, self.notes), description, start=0.0)
        elif "input" in basic.prefixes and signal:
            declared = signal_in(unit_of(basic, self.notes), description)
        elif "output" in basic.prefixes and signal:
            declared = signal_out(unit_of(basic, self.notes), description)
        else:
            select: Any = _STATE_SELECT.get(known(basic.given.inner.get("stateSelect")), "default")
            declared = var(unit_of(basic, self.notes), description, state=select)
        declared.nominal = nominal_of(basic)
        if path in self.statements.outputs:
            memory = _MEMORIES.get(basic.kind, integer)(description)
            declare(self.component, f"{path}{MEMORY}", memory)
            self._start(path, basic, memory)
        declare(self.component, path, declared)
        shown = shown_unit(basic, self.notes)
        if shown:
            self.notes.display[f"{self.instance.path}.{path}".lstrip(".")] = shown
        self._start(path, basic, declared)

    def _start(self, path: str, basic: Basic, declared: Field) -> None:
        """Give the start value; it is fixed, or a first guess."""
        prefix = f"{self.instance.name}." if self.instance.owner is not None else ""
        given = basic.given.inner.get("start")
        fixed = known(basic.given.inner.get("fixed")) is True
        if isinstance(declared, Discrete):
            before = self.statements.memory.get(path)
            value = value_of(given) if before is None else before
            start = None if value is None else numbered(value).args[0]
            first = 1.0 if basic.kind == "enumeration" else 0.0
            declared.default = float(start) if isinstance(start, bool | int | float) else first
            return
        if isinstance(declared, Input):
            self._start_input(path, given, declared)
            return
        if basic.kind == "Boolean" or (given is None and not fixed):
            return
        outside = given is not None and given.scope is not None and given.scope[0] is not self.instance
        if given is not None:
            demand_determined(f"{path}.start", given)
        value = (
            0.0
            if given is None or given.value is None
            else self._value(given, self.instance.owner if outside else self.instance, "" if outside else prefix)
        )
        if fixed:
            self.component.give(path, value)
        elif not outside and path in self.statements.states:
            declared.default = (
                self._value(given, self.instance, "") if given is not None and given.value is not None else value
            )
        elif value != 0.0:
            self.component.give(path, guess(value))

    def _start_input(self, path: str, given: Given | None, declared: Input) -> None:
        """Give an input of the whole model its value for where it has no other."""
        if self.instance.owner is not None or given is None or given.value is None or given.scope is None:
            return
        demand_determined(f"{path}.start", given)
        value = Resolver(*given.scope, numeric=True)(given.value)
        if value.kind not in ("number", "boolean"):
            raise refused(f"a start value of {path} that only a run knows", given.scope[1], given.value.line)
        declared.default = float(value.args[0])
        if Resolver(*given.scope)(given.value) != value:
            self.notes.tell(f"{path}.start is a number now: parameters that it depends on do not change it.")

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
            part = part_of(self.instance, member, 1 if sizes(self.instance, member) else 0) if member else None
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
