"""What a component type says, as mathematics: equations, events and energy terms, with variants."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import groupby
from typing import Any

import casadi as ca

from modelica_like.errors import LanguageError
from modelica_like.language import Component
from modelica_like.language.declared import Connector
from modelica_like.language.equation import Connection, Equation, as_statement
from modelica_like.language.expr import Symbol, symbols_in
from modelica_like.language.places import located
from modelica_like.language.transition import Transition, as_event
from modelica_like.report.component_pages import latex_names as names
from modelica_like.report.component_pages.mathematics import CONDITIONS, Writer
from modelica_like.report.component_pages.named_calls import (
    Call,
    Calls,
    Definition,
    Formal,
    any_table,
    looked_up,
    with_named_calls,
)

_ENERGY = ("stored_energy", "loss_power", "source_power")


@dataclass(frozen=True)
class Term:
    """An equation or a definition: both sides as LaTeX, the sign between them, and what it is."""

    left: str
    right: str
    description: str = ""
    sign: str = "="


@dataclass(frozen=True)
class Event:
    """A transition, or the choice of the mode at the start (`source` is then empty).

    Attributes:
        mode: which mode.
        source: names of the modes it leaves.
        target: name of the mode it enters.
        when: condition or time as LaTeX.
        resets: new values as LaTeX.
        notice: what the report of a run says.
    """

    mode: str
    source: str
    target: str
    when: str
    resets: tuple[str, ...]
    notice: str


@dataclass(frozen=True)
class Part:
    """A part, or equal elements of an array of parts.

    Attributes:
        name: with the numbers of the elements.
        kind: its type.
        values: what it is given, as the class says it.
    """

    name: str
    kind: type[Component]
    values: str


@dataclass(frozen=True)
class Statements:
    """What a component type says.

    Attributes:
        equations: both sides.
        definitions: what the names in the equations stand for.
        events: transitions.
        energy: stored energy, loss power and source power, by name, where they are not zero.
        connections: ends that are joined.
        parts: what it is made of.
        asked: optional parameters on which the equations depend.
        parameters: parameters that occur.
    """

    equations: tuple[Term, ...]
    definitions: tuple[Term, ...]
    events: tuple[Event, ...]
    energy: Mapping[str, Term]
    connections: tuple[tuple[str, ...], ...]
    parts: tuple[Part, ...]
    asked: tuple[str, ...]
    parameters: frozenset[str] = frozenset()


def statements(
    kind: type[Component], structure: Mapping[str, Any], *, given: frozenset[str] = frozenset(),
    used: frozenset[str] = frozenset(),
) -> Statements:  # fmt: skip
    """Write out a component type.

    Args:
        kind: the type.
        structure: values of structural fields; tables of numbers need none.
        given: optional parameters that have a value.
        used: optional connectors that are connected.

    Raises:
        LanguageError: the structure does not fit.
    """
    calls = Calls(given)
    component = with_named_calls(kind, calls)(**{**any_table(kind), **structure})
    for name in used:
        component.connectors[name]._used = True
    return _Page(component, calls).statements()


class _Page:
    """Writes the statements of one component."""

    def __init__(self, component: Component, calls: Calls) -> None:
        self.component = component
        self.calls = calls
        self.referenced: dict[tuple[str, int], None] = {}
        self.parameters: set[str] = set()
        self.abscissae = {
            row[0]: names.text(f"{end} of {name}")
            for name, rows in any_table(type(component)).items()
            for end, row in zip(("first", "last"), rows, strict=True)
        }
        self.writer = Writer(self._symbol, _mode_names, self._special)

    def statements(self) -> Statements:
        component, kind = self.component, type(self.component).__name__
        said = [as_statement(item, source, kind) for item, source in located(component.equations())]
        events = [as_event(item, source, kind) for item, source in located(component.events())]
        energy = {name: ca.SX(getattr(component, name)()) for name in _ENERGY}
        return Statements(
            equations=tuple(self._equation(one) for one in said if isinstance(one, Equation)),
            events=tuple(self._event(one) for one in events),
            energy={
                name: Term(names.text(name), self._opened(value))
                for name, value in energy.items()
                if not _is_zero(value)
            },
            definitions=self._definitions(),
            connections=tuple(self._ends(one) for one in said if isinstance(one, Connection)),
            parts=tuple(_parts(component)),
            asked=tuple(self.calls.asked),
            parameters=frozenset(self.parameters),
        )

    def _symbol(self, symbol: Symbol) -> str:
        owner = symbol.owner
        if owner is None:
            return "t"
        if isinstance(owner, Call):
            self.referenced[owner.name, owner.number] = None
            called = self._call(owner)
            return called if not symbol.order else rf"\frac{{d}}{{dt}} {called}"
        if isinstance(owner, Formal):
            return names.name(symbol.name)
        if owner is self.component:
            self.parameters.add(symbol.name)
        return names.name(_path(owner, self.component, symbol.name), symbol.order)

    def _call(self, call: Call) -> str:
        return names.function(call.name, [self.writer.latex(argument) for argument in call.arguments], call.number)

    def _special(self, e: Any, writer: Writer) -> str:
        if e.is_constant():
            return self.abscissae.get(float(e), "")
        found = looked_up(e)
        if found is None:
            return ""
        row, argument = found
        if row.number:
            raise LanguageError(f"{type(self.component).__name__} does not look up `{row.table}` along straight lines.")
        # A table with several columns of values is a function for each of them.
        return names.function(row.table, [writer.latex(argument)], row.column + 1 if row.column else 0)

    def _equation(self, equation: Equation) -> Term:
        left, right = ca.SX(equation.left), ca.SX(equation.right)
        if _is_zero(right) and left.op() in (ca.OP_ADD, ca.OP_IF_ELSE_ZERO):
            left, right = right, left
        return Term(self.writer.latex(left), self.writer.latex(right))

    def _event(self, event: Any) -> Event:
        mode, latex = event.mode.mode.name, self.writer.latex
        if not isinstance(event, Transition):
            return Event(mode, "", event.target, latex(event.when), (), "")
        when = latex(event.when) if event.at is None else f"t = {latex(event.at)}"
        resets = tuple(f"{latex(what)} := {latex(value)}" for what, value in event.reset.items())
        others = set(_mode_names(event.mode.symbol)) - {event.target}
        all_others = len(others) > 1 and set(event.sources) == others
        source = "all others" if all_others else ", ".join(event.sources)
        return Event(mode, source, event.target, when, resets, event.notice)

    def _opened(self, value: Any) -> str:
        """Write an energy term; if it is one call, what it returns."""
        if value.is_symbolic():
            owner = symbols_in(value)[0].owner
            if isinstance(owner, Call) and not owner.arguments:
                return self.writer.latex(self.calls.definitions[owner.name, owner.number].value)
        return self.writer.latex(value)

    def _definitions(self) -> tuple[Term, ...]:
        """Write what the names stand for that were used so far; definitions use further names."""
        written: dict[tuple[str, int], Term] = {}
        while missing := [name for name in self.calls.definitions if name in self.referenced.keys() - written.keys()]:
            written.update({name: self._definition(self.calls.definitions[name]) for name in missing})
        return tuple(written[name] for name in self.calls.definitions if name in written)

    def _definition(self, definition: Definition) -> Term:
        sign = r"\Leftrightarrow" if definition.value.op() in CONDITIONS else "="
        return Term(self._call(definition.call), self.writer.latex(definition.value), definition.description, sign)

    def _ends(self, connection: Connection) -> tuple[str, ...]:
        return tuple(
            _path(end._owner, self.component, end._name)
            if isinstance(end, Connector)
            else _path(end.owner, self.component, end.name)
            for end in connection.ends
        )


def _is_zero(value: Any) -> bool:
    return bool(value.is_constant()) and float(value) == 0


def _mode_names(symbol: Symbol) -> tuple[str, ...]:
    modes = getattr(type(symbol.owner), "_class_modes", {})
    return modes[symbol.name].names if symbol.name in modes else ()


def _path(owner: Any, root: Component, name: str) -> str:
    path = [name]
    while owner is not root:
        path.append(owner._name)
        owner = owner._owner
    return ".".join(reversed(path))


def _parts(component: Component) -> list[Part]:
    """Return the parts; equal elements of an array that follow each other are one."""
    found: list[Part] = []
    for name, part in component._parts.items():
        if not isinstance(part, list):
            found.append(Part(name, type(part), _values(part)))
            continue
        for (kind, values), group in groupby(enumerate(part, 1), lambda one: (type(one[1]), _values(one[1]))):
            numbers = [number for number, _ in group]
            last = f" … [{numbers[-1]}]" if len(numbers) > 1 else ""
            found.append(Part(f"{name}[{numbers[0]}]{last}", kind, values))
    return found


def _values(part: Component) -> str:
    return ", ".join(f"{name} = {value.given}" for name, value in part._values.items())
