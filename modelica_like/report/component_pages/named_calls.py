"""Component types whose methods are known by name: their equations then read as the class was written.

A friction torque is `sliding_friction(w)` in the equations of a clutch, and one definition says what that is; written
out at every place, nobody could read them. Tables are functions of their argument in the same way.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from inspect import cleandoc, signature
from types import FunctionType
from typing import Any, get_type_hints

import casadi as ca

from modelica_like.language import Component
from modelica_like.language.expr import Symbol, symbols_in

ROWS = (0.6180339887498949, 1.4142135623730951)
"""Abscissae of the two rows that stand for a type's first table, plus one for each further table: nobody uses them."""


_PAIR = 2
"""Columns of a table with one column of values."""


class _Owner:
    """Owns symbols as a component does, without fields."""

    fields: Mapping[str, Any] = {}
    constant = False

    def is_constant(self, name: str) -> bool:
        """Tell whether its symbols have no derivative."""
        return self.constant


@dataclass(eq=False)
class Call(_Owner):
    """What a symbol stands for that is a call of a method.

    Attributes:
        name: of the method.
        arguments: numbers or expressions.
        number: which of several values it returns, counted from one; 0 if it returns one.
    """

    name: str
    arguments: tuple[Any, ...]
    number: int = 0
    is_call = True


class Formal(_Owner):
    """Owner of the formal arguments of methods."""


@dataclass(eq=False)
class Row(_Owner):
    """What a symbol stands for that is a value of a table.

    Attributes:
        table: name of the structural field.
        column: number of the column, counted from one; 0 if the table has only one column of values.
        number: number of the row.
        begin: abscissa of the first row.
    """

    table: str
    column: int
    number: int
    begin: float
    constant = True


@dataclass(frozen=True, eq=False)
class Definition:
    """What a method returns.

    Attributes:
        call: the method with its formal arguments.
        value: expression of them.
        description: first sentence of its docstring.
    """

    call: Call
    value: Any
    description: str


@dataclass
class Calls:
    """Calls that were made while the equations were written.

    Attributes:
        extra: names of optional parameters that count as given.
        asked: names of the parameters the class asked `given` about.
        definitions: what was called, by name.
        symbols: what stands for the calls, by name and arguments.
    """

    extra: frozenset[str] = frozenset()
    asked: dict[str, None] = field(default_factory=dict[str, None])
    definitions: dict[tuple[str, int], Definition] = field(default_factory=dict[tuple[str, int], Definition])
    symbols: dict[Any, Symbol] = field(default_factory=dict[Any, Symbol])

    def named(self, component: Component, method: Callable[..., Any], name: str, arguments: tuple[Any, ...]) -> Any:
        """Return the symbol of a call; what is simple enough stands for itself."""
        value = method(component, *arguments)
        if not all(isinstance(argument, ca.SX | int | float) for argument in arguments):
            return value
        if not isinstance(value, tuple):
            return self._symbol(component, method, Call(name, arguments), value)
        return tuple(
            self._symbol(component, method, Call(name, arguments, number), one) for number, one in enumerate(value, 1)
        )

    def _symbol(self, component: Component, method: Callable[..., Any], call: Call, value: Any) -> Any:
        if not _worth_a_name(value):
            return value
        known = call.name, call.number, *(_identity(argument) for argument in call.arguments)
        if known not in self.symbols:
            self.symbols[known] = Symbol(call, call.name)
            self._define(component, method, call, value)
        return self.symbols[known]

    def _define(self, component: Component, method: Callable[..., Any], call: Call, value: Any) -> None:
        key = call.name, call.number
        if key not in self.definitions:
            formal = tuple(Symbol(Formal(), argument) for argument in list(signature(method).parameters)[1:])
            # What it calls itself is defined after it.
            self.definitions[key] = Definition(
                Call(call.name, formal, call.number), value, _sentence(component, call.name)
            )
            general = method(component, *formal)
            self.definitions[key] = replace(
                self.definitions[key], value=general[call.number - 1] if call.number else general
            )


def _sentence(component: Component, name: str) -> str:
    """Return the first sentence of a method's docstring, or of the one it replaces."""
    texts = (vars(base)[name].__doc__ or "" for base in type(component).__mro__[1:] if name in vars(base))
    sentence = cleandoc(next(filter(None, texts), "")).partition("\n")[0].removeprefix("Return ").removesuffix(".")
    return sentence[:1].lower() + sentence[1:]


def _worth_a_name(value: Any) -> bool:
    if not isinstance(value, ca.SX) or not value.is_scalar():
        return False
    inner: Any = value.dep(0) if value.op() == ca.OP_NEG else value
    return not (inner.is_symbolic() or inner.is_constant())


def _identity(argument: Any) -> Any:
    if not isinstance(argument, ca.SX):
        return float(argument)
    leaves = symbols_in(argument)  # type: ignore[arg-type]
    return str(argument), *(id(leaf) for leaf in leaves)


def with_named_calls(kind: type[Component], calls: Calls) -> type[Component]:
    """Return a type with the equations of another, in which methods and properties are named calls."""
    members: dict[str, Any] = {"__module__": kind.__module__, "__doc__": kind.__doc__}
    for base in kind.__mro__:
        if base in Component.__mro__ or not issubclass(base, Component):
            continue
        for name, member in vars(base).items():
            if name.startswith("_") or hasattr(Component, name) or name in members:
                continue
            if isinstance(member, property):
                members[name] = property(_called(calls, member.fget, name))
            elif isinstance(member, FunctionType):
                members[name] = _called(calls, member, name)
    members["given"] = _given(calls)
    return type(kind.__name__, (kind,), members)


def _called(calls: Calls, method: Any, name: str) -> Callable[..., Any]:
    def call(component: Component, *arguments: Any, **options: Any) -> Any:
        if options:
            return method(component, *arguments, **options)
        return calls.named(component, method, name, arguments)

    return call


def _given(calls: Calls) -> Callable[[Component, str], bool]:
    def given(component: Component, name: str) -> bool:
        if component.fields[name].default is None:
            calls.asked[name] = None
        return name in calls.extra or Component.given(component, name)

    return given


def any_table(kind: type[Component]) -> dict[str, Any]:
    """Return two rows for each structural field that is a table of numbers: its values are symbols."""
    hints = get_type_hints(kind)
    widths = {name: _columns(hints[name]) for name in kind._structural}
    return {
        name: tuple((x + shift, *_cells(name, width, number, ROWS[0] + shift)) for number, x in enumerate(ROWS))
        for shift, (name, width) in enumerate((name, width) for name, width in widths.items() if width)
    }


def _cells(table: str, width: int, number: int, begin: float) -> list[Symbol]:
    """Return symbols for the values in a row."""
    columns = range(1, width) if width > _PAIR else (0,)
    return [Symbol(Row(table, column, number, begin), table) for column in columns]


def _columns(hint: Any) -> int:
    """Return the number of columns of `tuple[tuple[float, …], ...]`, or 0."""
    row = next(iter(getattr(hint, "__args__", ())), None)
    cells = getattr(row, "__args__", ())
    return len(cells) if cells and all(cell is float for cell in cells) else 0


def looked_up(e: Any) -> tuple[Row, Any] | None:
    """Recognise the value of a table: the table's column, and the argument it is looked up for."""
    if e.is_symbolic():
        row = symbols_in(e)[0].owner
        return (row, ca.SX(row.begin)) if isinstance(row, Row) else None
    if e.op() != ca.OP_ADD or not e.dep(0).is_symbolic() or e.dep(1).op() != ca.OP_MUL:
        return None
    row, distance = symbols_in(e.dep(0))[0].owner, e.dep(1).dep(0)
    return (row, _shifted(distance, row.begin)) if isinstance(row, Row) else None


def _shifted(distance: Any, begin: float) -> Any:
    """Return the argument of a table from its distance to the first row."""
    if distance.is_constant():
        return ca.SX(round(float(distance) + begin, 12))
    if distance.op() == ca.OP_SUB and distance.dep(1).is_constant():
        x = distance.dep(0)
        # Beyond the rows it may be held at the ends; that is what the field `extrapolate` tells.
        return x.dep(0).dep(0) if x.op() == ca.OP_FMIN and x.dep(0).op() == ca.OP_FMAX else x
    if distance.op() == ca.OP_NEG and distance.dep(0).op() == ca.OP_ADD:
        inner = distance.dep(0)
        return -(inner.dep(1) if inner.dep(0).is_constant() else inner.dep(0))
    return distance + begin
