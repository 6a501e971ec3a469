"""Fields of a component: parameters, variables and signals of a text, with their values and start values."""

from __future__ import annotations

from typing import Any

from modelica_like.language import boolean, discrete, guess, integer, param, signal_in, signal_out, var
from modelica_like.language.assembly import declare
from modelica_like.language.fields import Discrete, Field, Input
from modelica_like.netlist.modelica.before import uses_time
from modelica_like.netlist.modelica.fold import numbered
from modelica_like.netlist.modelica.instance import Given, Instance, Member, refused
from modelica_like.netlist.modelica.members import demand_determined, undetermined
from modelica_like.netlist.modelica.resolve import Resolver
from modelica_like.netlist.modelica.statements import Statements
from modelica_like.netlist.modelica.tree import Expr
from modelica_like.netlist.modelica.types import Basic, is_signal
from modelica_like.netlist.modelica.values import Notes, known, nominal_of, number_of, shown_unit, unit_of, value_of
from modelica_like.netlist.modelica.written import MEMORY, Written, as_formula

_MEMORIES: dict[str, Any] = {
    "Boolean": boolean, "Real": lambda description: discrete("1", description, start=0.0)
}  # fmt: skip
_STATE_SELECT = {"always": "always", "prefer": "prefer", "avoid": "avoid", "never": "avoid"}


class Fields:
    """Declares the fields of one component.

    Args:
        instance: of a class with its modifications.
        notes: collects remarks.
        moved: whether it is a record that is given as a whole: it keeps the names of where it comes from.

    Attributes:
        statements: what the text says.
        component: that gets the fields.
    """

    component: Written

    def __init__(self, instance: Instance, notes: Notes, *, moved: bool) -> None:
        self.instance, self.notes, self.moved = instance, notes, moved
        self.statements = Statements(instance)

    def parameter(self, name: str, member: Member, basic: Basic) -> None:
        """Declare a parameter, with its value."""
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
        )
        if follows and formula is not None:
            place = member.text.place(member.declaration.line)
            self.statements.initial.append((Expr("name", ((name, ()),)), formula, place))
        elif given.value is not None and not outside:
            parameter.default = self._value(given, self.instance, "")
        parameter.nominal = nominal_of(basic)
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

    def variable(self, path: str, name: str, member: Member, basic: Basic) -> None:
        """Declare a variable or a signal, or an element of an array of them, with its start value."""
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
