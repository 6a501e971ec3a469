"""Parameters of the flat model: independent ones, and those that follow from others."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, cast

import casadi as ca

from modelica_like.errors import CyclicAssembly, MissingValue, UnitError, UnitMismatch, UnknownName, ValueOutOfRange
from modelica_like.flatten.checks import unit_of_field
from modelica_like.flatten.dimensions import expect_unit
from modelica_like.flatten.model import FlatParameter
from modelica_like.flatten.names import column
from modelica_like.language.assembly import Assembly
from modelica_like.language.component import Component
from modelica_like.language.declared import unknown
from modelica_like.language.fields import Input, Parameter, Value, Variable
from modelica_like.language.inside import inside
from modelica_like.language.scopes import scope_for, scopes_of
from modelica_like.language.units import ANY, Unit, coherent, read_quantity


class Parameters:
    """Collects parameters while the tree is flattened.

    Every declared parameter has a position in the vector q; independent ones also have one in p.
    """

    def __init__(self, root: Component) -> None:
        self.root = root
        self.flat: list[FlatParameter] = []
        self.derived: list[FlatParameter] = []
        self._formulas: list[Any] = []
        self._owners: list[tuple[Component, str]] = []
        self._symbols: list[Any] = []
        self._q: list[Any] = []
        self._position: dict[tuple[int, str], int] = {}
        self._open: list[str] = []
        self._units: dict[int, Unit] = {}

    def declare(self, component: Component, name: str, path: str) -> int | None:
        """Give a parameter its place in q; None if it has no value.

        Args:
            component: the component that declares it.
            name: of the parameter or input.
            path: its dotted name.
        """
        key = id(component), name
        if key in self._position:
            return self._position[key]
        value = component.value(name)
        if value is None:
            return None
        if value.formula is None:
            field = component.fields[name]
            expression = ca.SX.sym(path)
            unit = coherent(unit_of_field(component, name))
            read = read_quantity(value.given) if field.unit_text == "*" and isinstance(value.given, str) else None
            tunable, above = (field.tunable, field.above) if isinstance(field, Parameter) else (True, 0)
            tunable = tunable and name not in inside(component).frozen
            number, bounds, written = cast(float, value.number), field.bounds, read[1] if read else None
            self.flat.append(FlatParameter(path, unit, field.description, number, *bounds, tunable, above, written))
            self._symbols.append(expression)
        else:
            with component.at_its_place(name):
                expression, unit = self._dependent(component, name, path, value)
        self._position[key] = position = self.add(expression)
        self._units[position] = unit
        return position

    def add(self, expression: Any) -> int:
        """Append an expression to q; return its position."""
        self._q.append(expression)
        return len(self._q) - 1

    def _dependent(self, component: Component, name: str, path: str, value: Value) -> tuple[Any, Unit]:
        if path in self._open:
            circle = " → ".join([*self._open[self._open.index(path) :], path])
            raise CyclicAssembly(
                f"Parameters depend on each other in a circle: {circle}.", advice="Give one of them a number."
            )
        self._open.append(path)
        scopes = scopes_of(component, value, given=name in inside(component).values)
        expression, written = self._read(value, scopes, path)
        self._open.pop()
        field = component.fields[name]
        unit = coherent(written if value.unit == ANY else value.unit)
        self.derived.append(FlatParameter(path, unit, field.description, math.nan, *field.bounds, False))
        self._owners.append((component, name))
        self._formulas.append(expression)
        return expression, unit

    def evaluate(self, value: Value, scopes: Sequence[Component], label: str) -> Any:
        """Return the number or the expression of a value.

        Args:
            value: what was given.
            scopes: the components whose names a formula uses; the first that knows a name counts.
            label: name for messages.

        Raises:
            UnknownName: the formula uses a parameter that does not exist.
            UnitMismatch: the formula has the wrong dimension.
            CyclicAssembly: the formula depends on itself.
            ValueOutOfRange: the result is not finite.
        """
        return self._read(value, scopes, label)[0]

    def _read(self, value: Value, scopes: Sequence[Component], label: str) -> tuple[Any, Unit]:
        """Return the number or the expression of a value, and its unit; `ANY` is that of a plain number."""
        if value.formula is None:
            return value.number, value.unit
        units: dict[str, Unit] = {}

        def look_up(path: str) -> Any:
            position = self._sought(scopes, path, label)
            units[path] = self._units[position]
            return self._q[position]

        result = ca.SX(value.formula.evaluate(look_up, _number))
        if result.is_constant() and not math.isfinite(float(result)):
            raise ValueOutOfRange(f"{label} must be a finite number, not {float(result):g}.")
        if not scopes[0].units_checked:
            return result, ANY
        told = f"{label} = {value.formula}"
        try:
            unit = value.formula.unit(units.__getitem__, plain=True)
        except UnitError as error:
            raise UnitMismatch(f"{told}: {error.what}") from None
        expect_unit(unit, value.unit, told)
        return result, unit

    def _sought(self, scopes: Sequence[Component], path: str, label: str) -> int:
        """Return the position of a name in a formula."""
        owner_path, _, name = path.rpartition(".")
        owner = scope_for(scopes, path).find(owner_path)
        field = owner.fields.get(name)
        if isinstance(field, Variable) and not isinstance(field, Input):
            raise UnknownName(
                f"{label}: {path} is no parameter: it changes over time, and a value does not.",
                advice=f'If {label} is an input, connect them: name = ["{path}", "{label}"] in [connect].',
            )
        if not isinstance(field, Parameter | Input):
            names = [key for key, f in owner.fields.items() if isinstance(f, Parameter)]
            raise unknown("parameter", f"{label}: {owner.label}", path, names, {path: owner.renamed.get(name, "")})
        return self.position(owner, name)

    def position(self, component: Component, name: str) -> int:
        """Return the position of a parameter in q.

        Args:
            component: the component that declares it.
            name: of the parameter or input.

        Raises:
            MissingValue: it has no value.
        """
        label = f"{component.path}.{name}" if component.path else name
        position = self.declare(component, name, label)
        if position is None:
            kind = type(component).__name__
            raise MissingValue(
                f"{label} ({kind}) has no value.", where=component.place_of(), advice=f"Give it one: {name} = …",
                operation=give_operation(component, name),
            )  # fmt: skip
        return position

    def q(self, position: int) -> Any:
        """Return one entry of q."""
        return self._q[position]

    def check_derived(self) -> None:
        """Compute the parameters that follow from others.

        Raises:
            ValueOutOfRange: one is not finite, or outside its min and max.
        """
        numbers = ca.Function("derived", [self.symbols()], [self.formulas()])(
            [parameter.value for parameter in self.flat]
        )
        values = numbers.full().ravel().tolist()
        for k, (component, name) in enumerate(self._owners):
            with component.at_its_place(name):
                value = self.derived[k].checked(values[k], f"{values[k]:g}")
            self.derived[k] = replace(self.derived[k], value=value)

    def formulas(self) -> Any:
        """Return the expressions of the parameters that follow from others."""
        return column(self._formulas)

    def symbols(self) -> Any:
        """Return the vector p."""
        return column(self._symbols)

    def expressions(self) -> Any:
        """Return the vector q."""
        return column(self._q)


def give_operation(component: Component, name: str) -> dict[str, str] | None:
    """Return the change of a netlist that gives a part a value, None if the part is in no netlist."""
    part, unit = inside(component), component.fields[name].unit_text
    return (
        {"operation": "set", "path": f"{part.name}.{name}", "unit": unit} if isinstance(part.owner, Assembly) else None
    )


def _number(text: str) -> Any:
    """Return the number of a quantity in a formula, in SI units."""
    number, unit = cast("tuple[float, Unit]", read_quantity(text))
    return ca.SX(number * unit.factor + unit.offset)
